"""The specular stage: target frames, model and lobe of each object, and what of its median was no diffuse light."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ..brdf.lambertian import LAMBERTIAN
from ..brdf.material import ObjectMaterial, from_json
from ..fit.problem import Problem
from ..light.field import LightField
from ..light.lamps import Lamp
from ..light.lobes import GRID
from ..paper.target_frame import frame_scores, target_frame
from ..parallel import ordered_map
from ..passes.glossy_light.glossy_light import Excess, glossy_light
from ..passes.see_through.see_through import is_sure, judge, look_behind
from ..passes.specular.by_looks import coated_by_looks, metal_by_looks
from ..passes.specular.describe import as_given, described, flat_mirror, lamp_material
from ..passes.specular.given import fit_given, given_note, same_material
from ..passes.specular.intervals import gloss_interval
from ..passes.specular.models import MIN_ELEMENTS, Choice, adopt_from_class, choose_model, set_apart
from ..passes.specular.one_colour import compare, compare_coat
from ..passes.specular.problems import Problems
from ..passes.specular.separate import specular_in_median, spread_over_object
from ..progress import Progress
from ..results.overrides import NOTHING, Given, Overrides
from ..scene.lit_diffuse import LitDiffuse
from ..scene.model import Instance
from ..scene.samples import Samples
from .frames import STAGE as FRAMES
from .published.targets import fit_targets
from .shading import STAGE as SHADING
from .stage import Stage
from .surface import STAGE as SURFACE

STAGE = Stage("specular", Path(__file__), (SURFACE, FRAMES, SHADING), ("specular", "specular_rays", "refine", "seed"))
FIT_ELEMENTS = 350
FIT_VIEWS = 12
"""Elements of an object that the fit looks at, and views of each."""
SCREEN_ELEMENTS = 200
SCREEN_RAYS = 4
"""The first look is at fewer elements and with so many times fewer rays; it drops what a lobe makes much worse."""
HOPELESS = 1.15
"""A lobe that raises the cost by this factor in the first look needs no second."""
LOOKS_VIEWS = 4
"""Views of each element for the question whether an object looks like a metal or coated all over (`by_looks`)."""
LOOKS_LIKE_NONE = 1.5
"""A metal whose spread is so many times the other's in the first look needs no second."""
SEPARATE_ELEMENTS = 2500
SEPARATE_VIEWS = 9
SEPARATE_RAYS = 8
"""Taking the lobe out of a median averages over views, and its width is known; so many times fewer rays do."""


@dataclass(frozen=True)
class Specular:
    """What the specular stage finds.

    Attributes
    ----------
    materials : tuple of ObjectMaterial
        One for each instance, by object_id.
    specular : (n, 3) float32
        Part of each element's L_d that is specular, or came through it from behind.
    excess : (n, 3) float32
        What is to be added to E, as glossy things throw more on each element than their L_d says.
    """

    materials: tuple[ObjectMaterial, ...]
    specular: np.ndarray
    excess: np.ndarray

    def to_store(self, overrides: Overrides) -> tuple[dict[str, np.ndarray], dict[str, Any]]:
        """What is stored of it: arrays, and what JSON holds."""
        meta = {"materials": [m.as_dict() for m in self.materials], "overrides": overrides.as_dict()}
        return {"specular": self.specular, "excess": self.excess}, meta

    @staticmethod
    def from_store(arrays: dict[str, np.ndarray], meta: dict[str, Any]) -> Specular:
        """From the stage's arrays, and the descriptions as JSON has them."""
        return Specular(tuple(from_json(one) for one in meta["materials"]), arrays["specular"], arrays["excess"])


@dataclass(frozen=True)
class Held:
    """What a fit of a few objects leaves as it is: all that was found, but of these objects."""

    found: Specular
    only: Collection[int]


def fit_specular(
    instances: tuple[Instance, ...],
    field: LightField,
    lit_diffuse: LitDiffuse,
    irradiance: np.ndarray,
    lamps: tuple[Lamp, ...],
    samples: Samples,
    frame_names: list[str],
    *,
    rays: int = 256,
    refine: int = 2,
    threads: int = 0,
    seed: int = 0,
    noise: float = 0.0,
    given: Mapping[int, Given] | None = None,
    held: Held | None = None,
    without: Collection[str] = (),
    as_published: bool = False,
    progress: Progress | None = None,
) -> Specular:
    """Fit every object to many of its views, choose its model, and find the specular part of L_d.

    Parameters
    ----------
    irradiance : (n, 3) float32
        E of each element, from L_d.
    refine : int
        0 leaves L_d as the median gave it; 1 takes the lobes out of it; 2 also corrects E for what they really throw.
    noise : float
        What was taken out of the mesh, in metres.
    given : dict of int to Given
        What the artist gives of objects, by object_id.
    held : Held, optional
        Fit a few objects only.
    without : collection of str
        Passes left out.
    as_published : bool
        Objects of which nothing is given get the lobe of their target frame instead (`fit_targets`).

    Raises
    ------
    InterruptedRun
        From `progress`.
    """
    given = given or {}
    glowing, mirrors = {lamp.object_id: lamp for lamp in lamps}, {mirror.object_id: mirror for mirror in field.mirrors}
    # Objects are shared between the threads, not the rays of one: so the fits run side by side, too.
    maker = Problems(field, samples, threads=1, seed=seed, without=without)
    refine = 0 if "specular-in-median" in without else min(refine, 1) if "glossy-light" in without else refine
    # What is given goes before what the shading stage found.
    taken = {i for i, one in given.items() if one.same_as is not None}
    settled = {i for i in (*glowing, *mirrors) if i not in given} | taken
    wanted = [i.object_id for i in instances if i.object_id not in settled]
    if held is not None:
        # Where nothing is given of an object, others of its class have their say.
        alike = {i.class_name for i in instances if i.object_id in held.only and i.object_id not in given}
        class_of = {i.object_id: i.class_name for i in instances}
        wanted = [i for i in wanted if i in held.only or i not in given and class_of[i] in alike]

    told: dict[int, ObjectMaterial] = {}
    if as_published:
        others = [i for i in instances if i.object_id in wanted and i.object_id not in given]
        told = fit_targets(
            others, field, lit_diffuse, samples, frame_names, rays=rays, threads=threads, seed=seed, progress=progress
        )
        wanted = [i for i in wanted if i not in told]

    def look(object_id: int) -> tuple[Choice, Problem | None, int]:
        if object_id in given:
            return *fit_given(given[object_id], maker, object_id, irradiance, rays), -1
        choice, problem, index = _by_frames(maker, object_id, rays, "first-look" not in without)
        where = field.atlas.position[samples.element[index]], field.atlas.normal[samples.element[index]]
        scores = frame_scores(field, *where, samples.direction[index], samples.frame[index], len(frame_names))
        if problem is not None and choice.fit is not None and "see-through" not in without:
            element, direction = samples.element[index], samples.direction[index]
            behind = look_behind(field, lit_diffuse.seen, element, direction, object_id, noise)
            lobe = choice.fit if choice.model.has_lobe else None
            scale = max(1.4826 * choice.fit.residual, 1e-4)
            shown = judge(problem, behind, lobe, scale)
            if shown is not None:
                choice = set_apart(choice, shown, is_sure(shown))
        if choice.model.has_albedo:
            choice, problem = _by_looks(maker, object_id, choice, problem, irradiance, rays, without)
        return choice, problem, target_frame(scores)

    problems, choices, targets = {}, {}, {}
    for object_id, found in zip(wanted, ordered_map(look, wanted, threads, ahead=len(wanted)), strict=True):
        choices[object_id], problem, targets[object_id] = found
        if problem is not None:
            problems[object_id] = problem
        if progress is not None:
            progress.update(0.7 * len(choices) / len(wanted))
    if "class-lobes" not in without:
        reflecting = {i: choice for i, choice in choices.items() if not choice.model.gives_light}
        adopted = adopt_from_class(reflecting, problems, {i.object_id: i.class_name for i in instances})
        choices |= {i: choice for i, choice in adopted.items() if i not in given}

    intervals = ordered_map(lambda i: gloss_interval(choices[i], problems.get(i)), wanted, threads)
    sure = dict(zip(wanted, intervals, strict=True))

    names = {i.object_id: i.name for i in instances}

    def describe(i: Instance) -> ObjectMaterial:
        if i.object_id in told:
            return told[i.object_id]
        own, choice = field.atlas.object_id == i.object_id, choices.get(i.object_id)
        if choice is not None and choice.model.gives_light:
            seen = np.median(field.radiance[own], 0) if own.any() else np.zeros(3)
            return lamp_material(i, seen, irradiance[own], given_note(given[i.object_id]))
        if choice is not None:
            target, problem = targets[i.object_id], problems.get(i.object_id)
            name = frame_names[target] if target >= 0 else None
            found = described(i, choice, problem, name, sure[i.object_id])
            return as_given(found, given[i.object_id], choice, sure[i.object_id]) if i.object_id in given else found
        if i.object_id in glowing and i.object_id not in given:
            known = glowing[i.object_id]
            return lamp_material(i, known.radiance, irradiance[own], known.note(names))
        if i.object_id in mirrors and i.object_id not in given:
            seen = int((field.atlas.object_id[samples.element] == i.object_id).sum())
            return flat_mirror(i, mirrors[i.object_id], seen)
        return ObjectMaterial(i.object_id, i.class_name, LAMBERTIAN)  # the same as another, which is described first

    kept = {} if held is None else {m.object_id: m for m in held.found.materials if m.object_id not in held.only}
    by_id = {i.object_id: kept.get(i.object_id) or describe(i) for i in instances}
    for i in by_id:
        if i not in kept and (source := given.get(i, NOTHING).same_as) is not None:
            while (further := given.get(source, NOTHING).same_as) is not None:
                source = further
            by_id[i] = same_material(by_id[source], by_id[i])
    materials = list(by_id.values())

    specular = np.zeros((len(field.atlas), 3), np.float32)
    if held is not None:
        specular = np.where(np.isin(field.atlas.object_id, list(held.only))[:, None], specular, held.found.specular)
    glass = [m for m in materials if m.surfaces is not None]
    glossy = [m for m in materials if m.model.layered] + glass if refine else []
    glossy = [m for m in glossy if m.object_id not in kept]

    def separate(material: ObjectMaterial) -> tuple[np.ndarray, np.ndarray]:
        if material.model.see_through:
            return _without_background(material, field, lit_diffuse.seen, maker, samples)
        return _separate(material, field, maker, samples, max(rays // SEPARATE_RAYS, 16))

    for done, (own, part) in enumerate(ordered_map(separate, glossy, threads)):
        specular[own] = part
        if progress is not None:
            progress.update(0.7 + 0.15 * (done + 1) / len(glossy))

    excess = np.zeros_like(specular) if held is None else held.found.excess
    if refine > 1 and held is None:
        seen = np.flatnonzero(lit_diffuse.seen)
        sent = Excess(field, tuple(materials), specular, seed)
        excess[seen] = glossy_light(
            sent, seen, irradiance[seen], threads=threads, seed=seed, progress=progress, share=(0.85, 1.0),
            without=without,
        )  # fmt: skip
    return Specular(tuple(materials), specular, excess)


def _by_frames(
    maker: Problems, object_id: int, rays: int, first_look: bool
) -> tuple[Choice, Problem | None, np.ndarray]:
    """Choose a model; in two looks, as only some objects deserve the second. Last: which samples were looked at."""
    index = maker.pick(object_id, SCREEN_ELEMENTS, FIT_VIEWS)
    if not len(index):
        return Choice(LAMBERTIAN, None, note="Seen too little to look for a highlight."), None, index
    screen = maker.problem(index, max(rays // SCREEN_RAYS, 16), rough=True)
    first = choose_model(screen)
    fit = first.fit
    hopeless = fit is None or fit.cost > HOPELESS * fit.cost_lambertian
    if hopeless and not first.model.lobe_alone and first_look:
        return first, screen, index
    index = maker.pick(object_id, FIT_ELEMENTS, FIT_VIEWS, seed=1)
    problem = maker.problem(index, rays)
    return choose_model(problem), problem, index


def _by_looks(
    maker: Problems,
    object_id: int,
    choice: Choice,
    problem: Problem | None,
    irradiance: np.ndarray,
    rays: int,
    without: Collection[str],
) -> tuple[Choice, Problem | None]:
    """Ask whether an object looks like a metal or coated all over; choice and observations stay as they were if not."""
    if problem is not None and len(np.unique(problem.element)) >= MIN_ELEMENTS:
        first = compare(problem, irradiance)
        if first is None:
            return choice, problem
        if first.ratio > LOOKS_LIKE_NONE:
            coat = None if choice.model.has_lobe else compare_coat(problem, irradiance)
            if coat is None or coat.ratio > 1:
                return choice, problem
    index = maker.pick(object_id, FIT_ELEMENTS, LOOKS_VIEWS, least=1, seed=1)
    if not len(index):
        return choice, problem
    whole = maker.problem(index, rays)
    looks = compare(whole, irradiance)
    if looks is None:
        return choice, problem
    found = choice if "metal-by-looks" in without else metal_by_looks(choice, looks, whole)
    coat = None if found.model.has_lobe or "coat-by-looks" in without else compare_coat(whole, irradiance)
    if coat is not None:
        found = coated_by_looks(found, coat)
    return found, whole if found.looks is not None else problem


def _separate(
    material: ObjectMaterial, field: LightField, maker: Problems, samples: Samples, rays: int
) -> tuple[np.ndarray, np.ndarray]:
    """A glossy object's elements (n,), and the specular part of their L_d, (n, 3)."""
    own = np.flatnonzero(field.atlas.object_id == material.object_id)
    index = maker.pick(material.object_id, SEPARATE_ELEMENTS, SEPARATE_VIEWS, least=1, seed=2)
    if not len(index):
        return own, np.zeros((len(own), 3), np.float32)
    if material.alpha is None or material.f0 is None or material.model.microfacets is None:
        raise ValueError(f"{material.name} has no lobe")
    light = maker.light(index, rays, max(material.alpha, float(GRID[0])), microfacets=material.model.microfacets)
    element, part = specular_in_median(samples, index, material.f0 * light.A[:, 0] + light.B[:, 0])
    return own, spread_over_object(field.atlas, own, element, part)


def _without_background(
    material: ObjectMaterial, field: LightField, seen: np.ndarray, maker: Problems, samples: Samples
) -> tuple[np.ndarray, np.ndarray]:
    """A glass object's elements (n,), and the part of their L_d that came from behind, (n, 3)."""
    own = np.flatnonzero(field.atlas.object_id == material.object_id)
    index = maker.pick(material.object_id, SEPARATE_ELEMENTS, SEPARATE_VIEWS, least=1, seed=2)
    if not len(index):
        return own, np.zeros((len(own), 3), np.float32)
    behind = look_behind(field, seen, samples.element[index], samples.direction[index], material.object_id)
    index, passed = index[behind.known], np.float32(material.transmission) * behind.radiance[behind.known]
    if not len(index):
        return own, np.zeros((len(own), 3), np.float32)
    element, part = specular_in_median(samples, index, passed)
    return own, spread_over_object(field.atlas, own, element, part)
