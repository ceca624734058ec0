"""Standard errors of every texel's shading and albedo."""

from dataclasses import dataclass

import numpy as np
from scipy import ndimage

from ..groups import by_label
from ..passes.albedo.albedo import MEASURED
from ..scene.atlas import Atlas
from ..scene.visibility import EDGE
from .findings import Findings
from .light import LightEvidence
from .params import CALIBRATION


@dataclass(frozen=True)
class TexelEvidence:
    """Errors of n elements.

    Attributes
    ----------
    shading : (n,) float32
        Relative standard error of E.
    albedo : (n, 3) float32
        Standard error of the albedo; 90 % of the truth lies within 1.645 of it.
    unseen : (n,) float32
        Share of E that comes from what no frame saw.
    clipped : (n,) float32
        Share of the observations that the sensor clipped.
    """

    shading: np.ndarray
    albedo: np.ndarray
    unseen: np.ndarray
    clipped: np.ndarray


def contrast(atlas: Atlas, values: np.ndarray) -> np.ndarray:
    """Standard deviation of log values ((n,), positive) over the texels around each element, (n,) float32."""
    level = np.log(np.maximum(values, 1e-3)).astype(np.float32)
    level -= level.mean()
    sums = []
    for moment in (np.ones_like(level), level, level * level):
        image = np.zeros(atlas.size * atlas.size, np.float32)
        image[atlas.texel] = moment
        image = ndimage.uniform_filter(image.reshape(atlas.size, -1), CALIBRATION.around, mode="constant")
        sums.append(image.ravel()[atlas.texel])
    count, total, squares = sums
    return np.sqrt(np.maximum(squares / count - np.square(total / count), 0))


def without_light(findings: Findings) -> np.ndarray:
    """Relative error of albedo as far as it has nothing to do with light or gloss, (n,) float32.

    What no frame saw has the error of what it was filled in from, the spread of its object, and the more, the less of
    the object was measured.
    """
    albedo = findings.albedo
    measured = albedo.origin == MEASURED
    texture = CALIBRATION.texture * contrast(findings.surface.atlas, albedo.rho.mean(1))
    error = np.square(CALIBRATION.own * albedo.error) + np.square(texture)
    error += np.where(findings.lit_diffuse.tier == EDGE, np.float32(CALIBRATION.poorly**2), 0)
    spread, common, share = by_object(findings, error)
    error += np.where(measured, 0, np.square(CALIBRATION.filled * spread) + CALIBRATION.filled_floor**2 + common)
    error += np.where(measured, 0, np.square(CALIBRATION.barely_seen * (1 - share) ** 2))
    return np.sqrt(error).astype(np.float32)


def texel_evidence(findings: Findings, intrinsic: np.ndarray, light: LightEvidence) -> TexelEvidence:
    """All errors of a texel put together; `intrinsic` ((n,) float32) is `without_light`."""
    albedo = findings.albedo
    light_variance = np.square(light.unsure) + CALIBRATION.light_floor**2
    shading = np.sqrt(np.square(light.noise) + light_variance)
    shrunk = np.sqrt(np.square(CALIBRATION.noise_left * light.noise) + light_variance)
    # What was filled in shares the error of the light on what it was filled in from.
    _, common, _ = by_object(findings, shrunk)
    relative = np.square(intrinsic) + np.square(np.where(albedo.origin == MEASURED, shrunk, common))
    error = np.sqrt(relative[:, None] * np.square(albedo.rho) + np.square(gloss_error(findings))[:, None])
    # Of an albedo between 0 and 1 nothing worse can be said than that nothing is known.
    error = np.minimum(error, CALIBRATION.nothing_known)
    error[np.isin(findings.surface.atlas.object_id, list(findings.emitters))] = 0
    clipped = findings.lit_diffuse.clipped
    return TexelEvidence(shading.astype(np.float32), error.astype(np.float32), light.unseen, clipped)


def by_object(findings: Findings, value: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Of what was measured of each element's object: spread of log albedo, median of a value, share of the area.

    (n,) float32 each; 0 for objects of which nothing was measured.
    """
    atlas, albedo = findings.surface.atlas, findings.albedo
    spread, median, share = np.zeros((3, len(atlas)), np.float32)
    level = np.log(np.maximum(albedo.rho.mean(1), 1e-3))
    for elements in by_label(atlas.object_id):
        known = elements[albedo.origin[elements] == MEASURED]
        if len(known):
            low, high = np.quantile(level[known], (0.16, 0.84))
            spread[elements], median[elements] = (high - low) / 2, np.median(value[known])
            share[elements] = atlas.area[known].sum() / max(atlas.area[elements].sum(), 1e-30)
    return spread, median, share


def gloss_error(findings: Findings) -> np.ndarray:
    """Error of albedo by what a highlight left in the median, or by taking too much out, (n,) float32, absolute."""
    atlas, specular, irradiance = findings.surface.atlas, findings.specular, findings.irradiance
    result = np.full(len(atlas), CALIBRATION.left, np.float32)
    for m in findings.materials:
        if m.model.layered:
            indices = atlas.elements_of(m.object_id)
            taken = np.pi * specular[indices].mean(1) / np.maximum(irradiance[indices].mean(1), 1e-20)
            known = findings.albedo.origin[indices] == MEASURED
            if known.any():
                # Where hardly any light comes the ratio is wild; what was filled in came from what was measured.
                median = np.median(taken[known])
                taken = np.where(known, np.minimum(taken, 3 * median), median)
                result[indices] = CALIBRATION.poorly * taken + CALIBRATION.left
    return result
