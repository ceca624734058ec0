"""Which model and which lobe each object gets: by its views, by what is behind it, by its looks, by its class."""

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, partial

import numpy as np

from ..brdf.lambertian import LAMBERTIAN
from ..fit.lobe_fit import LobeFit
from ..fit.problem import Problem
from ..fit.transmission import SeeThrough
from ..light.field import LightField
from ..light.lamps import Lamp
from ..light.lobes import LobeLight
from ..paper.target_frame import frame_scores, target_frame
from ..parallel import ordered_map
from ..passes.albedo.albedo import quotient
from ..passes.albedo.params import ALBEDO
from ..passes.see_through.see_through import is_sure, judge, look_behind
from ..passes.specular.by_looks import coated_by_looks, metal_by_looks
from ..passes.specular.given import fit_given
from ..passes.specular.intervals import GlossInterval, gloss_interval
from ..passes.specular.models import Choice, choose_model, set_apart
from ..passes.specular.of_class import adopt_from_class, share_paint
from ..passes.specular.one_colour import OneColour, compare, compare_coat
from ..passes.specular.params import FIT
from ..passes.specular.problems import Problems
from ..progress import Progress
from ..results.overrides import Given
from ..results.values import kinds_of
from ..scene.lit_diffuse import LitDiffuse
from ..scene.model import Instance, class_names
from ..scene.samples import Samples
from ..scene.shape_parts import WALL
from ..settings import Settings
from ..significance import LEVELS


@dataclass(frozen=True)
class Room:
    """What the models are chosen by and how, for n elements.

    Attributes
    ----------
    irradiance : (n, 3) float32
        E of each element, from L_d.
    lamps : tuple of Lamp
        As the shading stage found them.
    noise : float
        What was taken out of the mesh, in metres.
    given : dict of int to Given
        What the artist gives of objects, by object_id.
    settings : Settings
        The stage's.
    progress : Progress or None
        Ends the work by `InterruptedRun`.
    """

    instances: tuple[Instance, ...]
    field: LightField
    lit_diffuse: LitDiffuse
    irradiance: np.ndarray
    samples: Samples
    frame_names: list[str]
    lamps: tuple[Lamp, ...] = ()
    noise: float = 0.0
    given: Mapping[int, Given] = dataclasses.field(default_factory=dict)
    settings: Settings = Settings()
    progress: Progress | None = None

    @cached_property
    def names(self) -> dict[int, str]:
        """What the objects are called, by their number."""
        return {instance.object_id: instance.name for instance in self.instances}

    @cached_property
    def problems(self) -> Problems:
        """The builder of objects' fitting problems."""
        # Objects are shared between the threads, not the rays of one: so the fits run side by side, too.
        return Problems(self.field, self.samples, threads=1, seed=self.settings.seed, without=self.settings.without)


@dataclass(frozen=True)
class Looked:
    """What an object's own frames say, before it is compared with its class.

    Attributes
    ----------
    problem : Problem or None
        The observations that decided.
    target : int
        The target frame; -1 where there is none.
    """

    choice: Choice
    problem: Problem | None
    target: int


@dataclass(frozen=True)
class Chosen(Looked):
    """The same with what its class says, and how sure its gloss is."""

    interval: GlossInterval


LOOKED = kinds_of(Looked, Choice, Problem, LobeLight, LobeFit, SeeThrough, OneColour)
"""What a stored `Looked` may hold."""


def look_at(room: Room, wanted: Sequence[int], known: Mapping[int, Looked] | None = None) -> dict[int, Looked]:
    """What the frames say of each of the `wanted` objects, by object_id; none depends on which others are wanted.

    Parameters
    ----------
    known : mapping of int to Looked, optional
        What was found of them before.
    """
    guesses = {instance.object_id for instance in room.instances if instance.guess}
    known, given, maker = known or {}, room.given, room.problems

    def look(object_id: int) -> Looked:
        if object_id in known:
            return known[object_id]
        if object_id in given:
            rays = room.settings.specular_rays
            return Looked(*fit_given(given[object_id], maker, object_id, room.irradiance, rays), -1)
        return Looked(*_look(room, object_id, object_id in guesses))

    results: dict[int, Looked] = {}
    size = np.bincount(room.field.atlas.object_id, minlength=max(wanted, default=0) + 1)
    order = sorted(wanted, key=lambda object_id: -size[object_id])  # the longest last would have one thread work alone
    for object_id, looked in zip(order, ordered_map(look, order, room.settings.threads, ahead=len(order)), strict=True):
        results[object_id] = looked
        if room.progress is not None:
            room.progress.update(0.7 * len(results) / len(wanted))
    return {object_id: results[object_id] for object_id in wanted}


def choose_models(room: Room, looks: Mapping[int, Looked]) -> dict[int, Chosen]:
    """Choose a model for each object, by what its frames and its class say; of those that are given, by that alone.

    By object_id.

    Parameters
    ----------
    looks : mapping of int to Looked
        What `look_at` found of each of them.
    """
    choices = {i: looked.choice for i, looked in looks.items()}
    problems = {i: looked.problem for i, looked in looks.items() if looked.problem is not None}
    if "class-lobes" not in room.settings.without:
        # That two parts are walls by their shape says nothing of what they are painted with; a common colour does.
        named_ids = {instance.object_id for instance in room.instances if not instance.guess}
        reflecting = {i: choice for i, choice in choices.items() if i in named_ids and not choice.model.gives_light}
        adopted = adopt_from_class(reflecting, problems, class_names(room.instances))
        colours = _wall_colours(room)
        walls = {i: choices[i] for i in colours if i in choices and i not in room.given}
        adopted |= share_paint(walls, problems, colours)
        choices |= {i: choice for i, choice in adopted.items() if i not in room.given}
    order = sorted(looks, key=lambda i: -len(problems[i].radiance) if i in problems else 0)
    intervals = ordered_map(
        lambda i: gloss_interval(choices[i], problems.get(i)), order, room.settings.threads, ahead=len(order)
    )
    return {
        i: Chosen(choices[i], looks[i].problem, looks[i].target, interval)
        for i, interval in zip(order, intervals, strict=True)
    }


def _wall_colours(room: Room) -> dict[int, np.ndarray]:
    """Logarithm of the median albedo, (3,), of each part that is a wall by its shape, where any of it was seen."""
    colours: dict[int, np.ndarray] = {}
    for instance in room.instances:
        if instance.guess and instance.class_name == WALL:
            elements = room.field.atlas.elements_of(instance.object_id)
            elements = elements[room.lit_diffuse.seen[elements]]
            rho, valid = quotient(room.lit_diffuse.radiance[elements], room.irradiance[elements])
            if valid.any():
                colours[instance.object_id] = np.log(np.maximum(np.median(rho[valid], 0), ALBEDO.floor))
    return colours


def _look(room: Room, object_id: int, guess: bool) -> tuple[Choice, Problem | None, int]:
    """What an object's own frames say: its model, the observations behind that, its target frame.

    A `guess` may hold several things: it is called neither metal nor transparent, as that would take the texture of
    all of them, and it is not judged by one colour.
    """
    field, samples = room.field, room.samples
    choice, problem, index = _by_frames(room, object_id, guess)
    element, direction = samples.element[index], samples.direction[index]
    scores = frame_scores(
        field, field.atlas.position[element], field.atlas.normal[element], direction, samples.frame[index],
        len(room.frame_names),
    )  # fmt: skip
    if problem is not None and choice.fit is not None and "see-through" not in room.settings.without and not guess:
        behind = look_behind(field, room.lit_diffuse.seen, element, direction, object_id, room.noise)
        lobe = choice.fit if choice.model.has_lobe else None
        see_through = judge(problem, behind, lobe, choice.fit.scale)
        if see_through is not None:
            choice = set_apart(choice, see_through, is_sure(see_through))
    if choice.model.has_albedo and not guess:
        choice, problem = _by_looks(room, object_id, choice, problem)
    return choice, problem, target_frame(scores)


def _by_frames(room: Room, object_id: int, guess: bool) -> tuple[Choice, Problem | None, np.ndarray]:
    """Choose a model by some of the object's samples, which come last; a `guess` is never called metal.

    A lamp's highlight lies on one in a hundred of the elements of a wall of tiles, so what shows none is looked at once
    more where highlights are expected. Of a guess that decides; its lobe is what all of it tells, if that tells one.
    """
    elements = FIT.part_elements if guess else LEVELS.of_object
    # The rays' noise is known and counts by elements, so as many rays are spread over more of them.
    rays = room.settings.specular_rays * LEVELS.of_object // elements
    pick = partial(room.problems.pick, object_id, elements, FIT.views, seed=1, smooth=True)

    def look(index: np.ndarray) -> tuple[Choice, Problem, np.ndarray]:
        problem = room.problems.problem(index, rays)
        return choose_model(problem, guess), problem, index

    expecting = "highlight-sampling" not in room.settings.without
    index = pick(highlights=guess and expecting)
    if not len(index):
        return Choice(LAMBERTIAN, None, note="Seen too little to look for a highlight."), None, index
    found = look(index)
    # The first look settles that an object has a lobe, and that a guess has none.
    settled = found[0].model.has_lobe != guess
    if settled or not expecting:
        return found
    others = pick(highlights=not guess)
    if np.array_equal(others, index):
        return found
    second = look(others)
    return second if second[0].model.layered else found


def _by_looks(room: Room, object_id: int, choice: Choice, problem: Problem | None) -> tuple[Choice, Problem | None]:
    """Ask whether an object looks like a metal or coated all over; choice and observations stay as they were if not."""
    irradiance, without = room.irradiance, room.settings.without
    if problem is not None and len(np.unique(problem.element)) >= LEVELS.few:
        first = compare(problem, irradiance)
        if first is None:
            return choice, problem
        if first.ratio > FIT.looks_like_none:
            coat = None if choice.model.has_lobe else compare_coat(problem, irradiance)
            if coat is None or coat.ratio > 1:
                return choice, problem
    index = room.problems.pick(object_id, LEVELS.of_object, LEVELS.views, min_views=1, seed=1)
    if not len(index):
        return choice, problem
    full_problem = room.problems.problem(index, room.settings.specular_rays)
    looks = compare(full_problem, irradiance)
    if looks is None:
        return choice, problem
    result = choice if "metal-by-looks" in without else metal_by_looks(choice, looks, full_problem)
    coat = None if result.model.has_lobe or "coat-by-looks" in without else compare_coat(full_problem, irradiance)
    if coat is not None:
        result = coated_by_looks(result, coat)
    return result, full_problem if result.looks is not None else problem
