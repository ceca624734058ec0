"""Albedo = pi L_d / E, and what stands in where nothing was seen."""

from collections.abc import Collection
from dataclasses import dataclass

import numpy as np

from ...groups import by_label
from ...kinds import Code
from ...parallel import ordered_map
from ...scene.atlas import Atlas
from ...scene.lit_diffuse import LitDiffuse
from ...scene.model import Instance, class_names
from ...significance import SIGMA_OF_MAD
from .bias_field import without_bias
from .neighbourhood import References, relative_error, shrink, well_measured
from .params import ALBEDO, MAX_ALBEDO

MEASURED: Code[int] = 2
FILLED: Code[int] = 1
NONE: Code[int] = 0
"""How an element's albedo came about: measured; filled in from its object; no reflectance (an emitter, an object
nobody saw, or one that shows what is behind it)."""
TEXTURED: Code[int] = 3
"""In `coverage.exr` alone: filled in, with texture of what was measured (`passes.texture_fill`)."""
CLOSED: Code[int] = 4
"""Added in `coverage.exr` where the element is of a face that the capture lacks, by which a hole was closed."""


@dataclass(frozen=True)
class Albedo:
    """Diffuse albedo of n elements.

    Attributes
    ----------
    rho : (n, 3) float32
        Linear Rec.709, 0...1.
    origin : (n,) int8
        MEASURED, FILLED or NONE.
    error : (n,) float32
        Relative standard error of `rho`, as far as it came of each element's own measurement and of its neighbourhood;
        what all of an object has in common, such as missing light, is added in `evidence.texel`. 0 on lamps.
    """

    rho: np.ndarray
    origin: np.ndarray
    error: np.ndarray


def quotient(lit_diffuse: np.ndarray, irradiance: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """pi L_d / E, not clamped, and where it holds.

    Parameters
    ----------
    lit_diffuse, irradiance : (n, 3) float32
        L_d may hold NaN.

    Returns
    -------
    (n, 3) float32, (n,) bool
    """
    known = np.isfinite(lit_diffuse).all(1)
    mean = irradiance.mean(1)
    floor = ALBEDO.floor * float(np.median(mean[known])) if known.any() else 0.0
    valid = known & (mean > max(floor, 1e-20))
    rho = np.full(lit_diffuse.shape, np.nan, np.float32)
    # A single channel may be dark under coloured light: it gets the floor, not a division by nothing.
    rho[valid] = np.pi * lit_diffuse[valid] / np.maximum(irradiance[valid], ALBEDO.floor * mean[valid, None])
    return rho, valid


def without_emitters(atlas: Atlas, mask: np.ndarray, emitters: set[int]) -> np.ndarray:
    """The elements of `mask`, (n,) bool, that are no emitter's."""
    return mask & ~np.isin(atlas.object_id, list(emitters))


def above_one(rho: np.ndarray, reflecting: np.ndarray) -> float:
    """Share of the `reflecting` elements, (n,) bool, whose quotient is above 1: an alarm that light is missing."""
    return float((rho[reflecting].max(1) > MAX_ALBEDO).mean()) if reflecting.any() else 0.0


def albedo_of(
    atlas: Atlas,
    lit_diffuse: LitDiffuse,
    irradiance: np.ndarray,
    irradiance_error: np.ndarray,
    instances: tuple[Instance, ...],
    emitters: set[int],
    without: Collection[str] = (),
) -> Albedo:
    """Albedo = pi L_d / E, clamped, filled in and shrunk (`fill`).

    Parameters
    ----------
    lit_diffuse : LitDiffuse
        L_d without its specular part, and what that rests on.
    irradiance : (n, 3) float32
        E, radiance * steradian.
    irradiance_error : (n,) float32
        Relative error of E.
    emitters : set of int
        Objects that have no albedo.
    """
    rho, valid = quotient(np.maximum(lit_diffuse.radiance, 0), irradiance)
    error = np.hypot(relative_error(lit_diffuse, atlas.object_id, "object-spread" not in without), irradiance_error)
    valid &= lit_diffuse.seen
    if "bias-field" not in without:
        rho = without_bias(atlas, rho, without_emitters(atlas, valid & np.isfinite(error), emitters))
    guesses = {instance.object_id for instance in instances if instance.guess}
    return fill(atlas, rho, valid, class_names(instances), emitters, error, without, guesses, irradiance_error)


def fill(
    atlas: Atlas,
    rho: np.ndarray,
    valid: np.ndarray,
    class_of: dict[int, str],
    emitters: set[int],
    error: np.ndarray | None = None,
    without: Collection[str] = (),
    guesses: Collection[int] = (),
    shared: np.ndarray | None = None,
) -> Albedo:
    """Clamp, fill in what was not measured, and shrink what was measured badly, from the same object.

    An object without any measurement takes the median of its class, else of the room.

    Parameters
    ----------
    error : (n,) float32, optional
        Relative standard error of each quotient (`neighbourhood.relative_error`); without it all count as equally good.
        Where it is inf, the quotient counts as not measured.
    guesses : collection of int
        Objects that were told apart by shape alone.
    shared : (n,) float32, optional
        The part of `error` that is E's.
    """
    if error is not None:
        valid = valid & np.isfinite(error)
    result = np.clip(np.nan_to_num(rho), 0, MAX_ALBEDO)
    origin = np.where(valid, MEASURED, FILLED).astype(np.int8)
    reflecting = without_emitters(atlas, valid, emitters)
    room_median = np.median(result[reflecting], 0) if reflecting.any() else np.full(3, 0.5, np.float32)
    error = np.where(valid, 0.0 if error is None else error, np.inf).astype(np.float32)
    result_error = error.copy()
    class_medians: dict[str, list[np.ndarray]] = {}
    unmeasured: dict[str, list[np.ndarray]] = {}
    measured = []
    for elements in by_label(_parts(atlas, valid)):
        object_id = int(atlas.object_id[elements[0]])
        if object_id in emitters:
            result[elements], origin[elements], result_error[elements] = 0, NONE, 0
        elif not valid[elements].any():
            unmeasured.setdefault(class_of.get(object_id, ""), []).append(elements)
        else:
            measured.append(elements)
    guessed = [elements for elements in measured if int(atlas.object_id[elements[0]]) in guesses]
    guessed_references = _references(atlas, guessed, result, error) if guessed else None

    def shrunk_part(elements: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        references = guessed_references if int(atlas.object_id[elements[0]]) in guesses else None
        part_shared = None if shared is None else shared[elements]
        return shrink(atlas, elements, result[elements], error[elements], without, references, part_shared)

    shrunk_parts = ordered_map(shrunk_part, measured, 0)
    for elements, shrunk in zip(measured, shrunk_parts, strict=True):
        result[elements], result_error[elements] = shrunk
        name = class_of.get(int(atlas.object_id[elements[0]]), "")
        class_medians.setdefault(name, []).append(np.median(result[elements][valid[elements]], 0))
    all_medians = [median for medians in class_medians.values() for median in medians]
    for name, groups in unmeasured.items():
        elements, medians = np.concatenate(groups), class_medians.get(name)
        result[elements] = np.median(medians, 0) if medians else room_median
        origin[elements] = NONE
        result_error[elements] = _spread(medians if medians and len(medians) > 2 else all_medians)
    return Albedo(np.clip(result, 0, MAX_ALBEDO).astype(np.float32), origin, result_error)


def _references(atlas: Atlas, parts: list[np.ndarray], rho: np.ndarray, error: np.ndarray) -> References:
    """The well-measured elements of some parts, (m,) int each."""
    elements = np.concatenate([part[well_measured(error[part])] for part in parts])
    return References(atlas.position[elements], rho[elements], error[elements])


def _parts(atlas: Atlas, valid: np.ndarray) -> np.ndarray:
    """Labels of what is filled in together: objects, a sheet's second side by itself if it was measured, (n,) int."""
    if atlas.back is None:
        return atlas.object_id
    part = atlas.side
    measured = np.bincount(part, valid, 2 * int(atlas.object_id.max()) + 2).reshape(-1, 2) > 0
    return np.where(measured.all(1)[atlas.object_id], part, part - atlas.back)


def _spread(albedos: list[np.ndarray]) -> float:
    """Relative standard deviation of some objects' albedo, (3,) each; `ALBEDO.unknown` where there are few."""
    if len(albedos) < 3:
        return ALBEDO.unknown
    level = np.log(np.maximum(np.array(albedos).mean(1), ALBEDO.floor))
    return max(SIGMA_OF_MAD * float(np.median(np.abs(level - np.median(level)))), ALBEDO.least_spread)
