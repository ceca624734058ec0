"""The specular stage: target frames, model and lobe of each object, and what of its median was no diffuse light."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from ..brdf.lambertian import LAMBERTIAN
from ..brdf.material import ObjectMaterial, from_json
from ..light.over_surface import sun_irradiance
from ..light.sun import Sun
from ..memory import give_back
from ..parallel import ordered_map
from ..passes.glossy_light.glossy_light import Excess, glossy_light
from ..passes.see_through.see_through import look_behind
from ..passes.specular.describe import as_given, described, flat_mirror, lamp_material
from ..passes.specular.given import given_note, same_material
from ..passes.specular.params import FIT
from ..passes.specular.separate import specular_in_median, spread_over_object
from ..passes.specular_removal.removal import SpecularPart, without_specular
from ..passes.sun.sun_strength import strength_without_gloss
from ..passes.unlit_lamps.unlit import unlit
from ..progress import Rounds
from ..results.overrides import NOTHING, Given, Overrides
from ..results.values import kinds_of, packed, unpacked
from ..scene.element_groups import ElementGroups
from ..scene.lit_diffuse import LitDiffuse
from ..scene.model import Frame, Instance, Pixels, class_names
from ..scene.visibility import SATURATED
from ..significance import LEVELS
from .choose_models import Chosen, Looked, Room, choose_models, look_at
from .frames import STAGE as FRAMES
from .published.targets import fit_targets
from .shading import STAGE as SHADING
from .stage import Stage
from .surface import STAGE as SURFACE

STAGE = Stage(
    "specular",
    Path(__file__),
    (SURFACE, FRAMES, SHADING),
    ("specular", "specular_rays", "refine", "median", "seed"),
    divided_by="objects",
)


@dataclass(frozen=True)
class Specular:
    """What the specular stage finds.

    Attributes
    ----------
    materials : tuple of ObjectMaterial
        One for each instance, by object_id.
    specular : (n, 3) float32
        Part of each element's L_d that is specular, or came through it from behind.
    rest : LitDiffuse
        L_d without it, and what that rests on. Clipped where in every view the specular part is more than what remains.
    excess : (n, 3) float32
        What is to be added to E, as glossy things reflect more onto each element than their L_d says, and under `sun`.
    sun : Sun, optional
        The shading stage's with another irradiance (`sun-strength`).
    """

    materials: tuple[ObjectMaterial, ...]
    specular: np.ndarray
    rest: LitDiffuse
    excess: np.ndarray
    sun: Sun | None = None

    def to_store(self, overrides: Overrides) -> tuple[dict[str, np.ndarray], dict[str, Any]]:
        """What is stored of it: arrays, and what JSON holds."""
        arrays = {
            "specular": self.specular, "excess": self.excess,
            "rest_spread": self.rest.interquartile_range, "rest_count": self.rest.count, "rest_tier": self.rest.tier,
        }  # fmt: skip
        materials, sun = [m.as_dict() for m in self.materials], packed(self.sun, arrays)
        return arrays, {"materials": materials, "overrides": overrides.as_dict(), "sun": sun}

    @staticmethod
    def from_store(arrays: dict[str, np.ndarray], meta: dict[str, Any], lit_diffuse: LitDiffuse) -> Specular:
        """From the stage's arrays, the descriptions as JSON has them, and L_d with its specular part."""
        materials = tuple(from_json(entry) for entry in meta["materials"])
        sun = unpacked(meta["sun"], arrays, kinds_of(Sun))
        specular = arrays["specular"]
        rest = replace(
            lit_diffuse, radiance=lit_diffuse.radiance - specular, interquartile_range=arrays["rest_spread"],
            count=arrays["rest_count"], tier=arrays["rest_tier"],
        )  # fmt: skip
        return Specular(materials, specular, rest, arrays["excess"], sun)


@dataclass(frozen=True)
class Held:
    """What a fit of a few objects leaves as it is: all that was found, but of these objects."""

    found: Specular
    only: Collection[int]


@dataclass(frozen=True)
class Pictures:
    """The frames, as lobes are taken out of them.

    Attributes
    ----------
    frames : sequence of Frame
        All of the capture's, in the poses that they were found to have.
    read : callable
        Gives a frame's pixels.
    folder : Path
        Where the exact median keeps observations meanwhile.
    groups : ElementGroups, optional
        As `accumulate` takes them.
    """

    frames: Sequence[Frame]
    read: Callable[[Frame], Pixels]
    folder: Path
    groups: ElementGroups | None = None


def fit_specular(
    room: Room, pictures: Pictures | None = None, held: Held | None = None, looked: Mapping[int, Looked] | None = None
) -> Specular:
    """Fit every object to many of its views, choose its model, and find the specular part of L_d.

    With the setting `specular` as published, objects of which nothing is given get the lobe of their target frame.

    Parameters
    ----------
    pictures : Pictures, optional
        What lobes are taken out of; without, they stay in L_d.
    held : Held, optional
        Fit a few objects only.
    looked : mapping of int to Looked, optional
        What `look_at_block` found of objects.

    Raises
    ------
    InterruptedRun
        From the room's progress.
    """
    instances, field, given, settings = room.instances, room.field, room.given, room.settings
    without, refine = settings.without, settings.refine
    refine = 0 if "specular-removal" in without else min(refine, 1) if "glossy-light" in without else refine
    wanted = _wanted(room, held)
    target_lobes: dict[int, ObjectMaterial] = {}
    if "specular" in settings.published:
        others = [i for i in instances if i.object_id in wanted and i.object_id not in given]
        target_lobes = fit_targets(others, room)
        wanted = [i for i in wanted if i not in target_lobes]
    looks = look_at(room, wanted, looked)
    chosen = choose_models(room, looks)

    held_materials = (
        {} if held is None else {m.object_id: m for m in held.found.materials if m.object_id not in held.only}
    )
    by_id = {
        instance.object_id: held_materials.get(instance.object_id)
        or target_lobes.get(instance.object_id)
        or _describe(instance, room, chosen.get(instance.object_id))
        for instance in instances
    }
    _copy_same_materials(by_id, given, set(held_materials))
    materials = tuple(by_id.values())
    del chosen, looks  # megabytes of observations for each object
    give_back()

    specular = np.zeros((len(field.atlas), 3), np.float32)
    excess, rest = np.zeros_like(specular), room.lit_diffuse
    if held is not None:
        again = np.isin(field.atlas.object_id, list(held.only))
        specular = np.where(again[:, None], specular, held.found.specular)
        excess = held.found.excess
        rest = rest.where(again, held.found.rest)
    if refine:
        fitted = [m for m in materials if m.object_id not in held_materials]
        _without_backgrounds(specular, fitted, room)
        if pictures is not None:
            rest = _remove(specular, rest, fitted, room, pictures)
    rest = replace(rest, radiance=room.lit_diffuse.radiance - specular)
    give_back()
    if refine > 1 and held is None:
        seen_elements = np.flatnonzero(room.lit_diffuse.seen)
        emitted = Excess(field, materials, specular, settings.seed)
        excess[seen_elements] = glossy_light(
            emitted, seen_elements, room.irradiance[seen_elements], threads=settings.threads, seed=settings.seed,
            progress=room.progress, share=(0.85, 1.0), without=without,
        )  # fmt: skip
    if held is not None:
        return Specular(materials, specular, rest, excess, held.found.sun)
    found = Specular(materials, specular, rest, excess)
    return _under_sun(found, room) if refine and "sun-strength" not in without else found


def _under_sun(found: Specular, room: Room) -> Specular:
    """The same with the irradiance that L_d less its specular part asks of a sun that was solved for."""
    field, lit_diffuse, settings = room.field, room.lit_diffuse, room.settings
    before = field.sun
    if before is None or before.seen:
        return found
    diffuse_objects = [m.object_id for m in found.materials if m.model.has_diffuse and not m.model.gives_light]
    hidden = (found.rest.tier == SATURATED) & (lit_diffuse.tier != SATURATED)
    good = lit_diffuse.seen & ~hidden & np.isin(field.atlas.object_id, diffuse_objects)
    elements = np.arange(len(field.atlas))
    sunlight = sun_irradiance(field, elements, room.irradiance.mean(1), settings.threads, settings.seed)
    sun = strength_without_gloss(
        field, found.rest.radiance, room.irradiance + found.excess - sunlight, good,
        lit_diffuse.clipped > 0.5, settings.seed,
    )  # fmt: skip
    if sun is None:
        return found
    stronger = sun.irradiance / np.maximum(before.irradiance, 1e-12) - 1
    return replace(found, excess=found.excess + sunlight * stronger.astype(np.float32), sun=sun)


def look_at_block(room: Room, block: tuple[int, int]) -> dict[int, Looked]:
    """What `fit_specular` has to find of every N-th object, from the I-th of those on that it fits.

    Parameters
    ----------
    block : tuple of int
        I and N, I from 1.

    Raises
    ------
    InterruptedRun
        From the room's progress.
    """
    return look_at(room, _wanted(room)[block[0] - 1 :: block[1]])


def _wanted(room: Room, held: Held | None = None) -> list[int]:
    """Objects that a model is to be chosen for. What is given goes before what the shading stage found."""
    instances, given = room.instances, room.given
    found_before = {lamp.object_id for lamp in room.lamps} | {mirror.object_id for mirror in room.field.mirrors}
    taken = {i for i, entry in given.items() if entry.same_as is not None}
    excluded = {i for i in found_before if i not in given} | taken
    wanted = [i.object_id for i in instances if i.object_id not in excluded]
    if held is None:
        return wanted
    # Where nothing is given of an object, others of its class count, too.
    classes = {i.class_name for i in instances if i.object_id in held.only and i.object_id not in given}
    class_of = class_names(instances)
    return [i for i in wanted if i in held.only or i not in given and class_of[i] in classes]


def _describe(instance: Instance, room: Room, chosen: Chosen | None) -> ObjectMaterial:
    """What is known of one object: a lamp, a flat mirror, or what its model was chosen to be."""
    field, given, number = room.field, room.given, instance.object_id
    elements = field.atlas.elements_of(number)

    def lamp(radiance: np.ndarray, note: str) -> ObjectMaterial:
        albedo, reason = None, ""
        if "unlit-lamps" not in room.settings.without:
            reflecting = room.lit_diffuse.seen & ~np.isin(
                field.atlas.object_id, [lamp.object_id for lamp in room.lamps]
            )
            albedo, reason = unlit(instance, field, room.irradiance, reflecting, room.settings.seed)
        return lamp_material(
            instance, radiance, room.irradiance[elements], " ".join(filter(None, (note, reason))), albedo
        )

    if chosen is not None and chosen.choice.model.gives_light:
        median = np.median(field.radiance[elements], 0) if len(elements) else np.zeros(3)
        return lamp(median, given_note(given[number]))
    if chosen is not None:
        name = room.frame_names[chosen.target] if chosen.target >= 0 else None
        material = described(instance, chosen.choice, chosen.problem, name, chosen.interval)
        return as_given(material, given[number], chosen.choice, chosen.interval) if number in given else material
    solved_lamp = None if number in given else next((lamp for lamp in room.lamps if lamp.object_id == number), None)
    if solved_lamp is not None:
        return lamp(solved_lamp.radiance, solved_lamp.note(room.names))
    mirror = next((mirror for mirror in field.mirrors if mirror.object_id == number), None)
    if mirror is not None and number not in given:
        observations = int((field.atlas.object_id[room.samples.element] == number).sum())
        return flat_mirror(instance, mirror, observations)
    return ObjectMaterial(number, instance.class_name, LAMBERTIAN)  # the same as another, which is described first


def _copy_same_materials(by_id: dict[int, ObjectMaterial], given: Mapping[int, Given], skipped: set[int]) -> None:
    """Give objects that are given as the same as another that one's description."""
    for i in by_id:
        if i not in skipped and (source := given.get(i, NOTHING).same_as) is not None:
            while (further := given.get(source, NOTHING).same_as) is not None:
                source = further
            by_id[i] = same_material(by_id[source], by_id[i])


def _remove(
    specular: np.ndarray, rest: LitDiffuse, materials: list[ObjectMaterial], room: Room, pictures: Pictures
) -> LitDiffuse:
    """Put the specular part of glossy things' L_d into `specular`, (n, 3); the `rest` with theirs."""
    glossy = [m for m in materials if m.model.layered]
    field, samples, settings = room.field, room.samples, room.settings
    glossy_mask = np.isin(field.atlas.object_id, [m.object_id for m in glossy])
    frames_showing = np.unique(samples.frame[glossy_mask[samples.element]])
    if not len(frames_showing):
        return rest
    separated = without_specular(
        SpecularPart(field, glossy, settings.seed), field, room.lit_diffuse, glossy_mask,
        [pictures.frames[i] for i in frames_showing], pictures.read, median=settings.median, seed=settings.seed,
        threads=settings.threads, folder=pictures.folder, groups=pictures.groups,
        progress=Rounds(room.progress, 0.7, 1.0),
    )  # fmt: skip
    specular[glossy_mask] = separated.specular[glossy_mask]
    return rest.where(~glossy_mask, separated.rest)


def _without_backgrounds(specular: np.ndarray, materials: list[ObjectMaterial], room: Room) -> None:
    """Put what came from behind glass into `specular`, (n, 3)."""
    glass = [m for m in materials if m.surfaces is not None]
    parts = ordered_map(partial(_from_behind, room), glass, room.settings.threads)
    for material, part in zip(glass, parts, strict=True):
        specular[room.field.atlas.elements_of(material.object_id)] = part


def _from_behind(room: Room, material: ObjectMaterial) -> np.ndarray:
    """The part of the L_d of each of a glass object's elements that came from behind, (n, 3)."""
    atlas, samples, number = room.field.atlas, room.samples, material.object_id
    elements = atlas.elements_of(number)
    index = room.problems.pick(number, LEVELS.sample, FIT.views, min_views=1, seed=2)
    nothing = np.zeros((len(elements), 3), np.float32)
    if not len(index):
        return nothing
    behind = look_behind(room.field, room.lit_diffuse.seen, samples.element[index], samples.direction[index], number)
    index, transmitted = index[behind.known], np.float32(material.transmission) * behind.radiance[behind.known]
    if not len(index):
        return nothing
    return spread_over_object(atlas, elements, *specular_in_median(samples, index, transmitted))
