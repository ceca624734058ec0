"""Uncertainty of the irradiance E: gathered anew at a few thousand elements, and its share that no frame looked at.

The same light is gathered twice with other rays, E_a and E_b. How far they differ from each other is their own noise;
how much further they differ from E is the error of E, be it its rays' or its interpolation's.
"""

from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from ..groups import by_number, cell_of
from ..kinds import Unit
from ..light.environment import Environment
from ..light.field import LightField
from ..light.over_surface import RayCounts, irradiance
from ..luminance import LUMINANCE
from ..scene.atlas import Atlas
from ..scene.visibility import SATURATED
from ..significance import LEVELS
from .findings import Findings
from .params import CALIBRATION

RAYS: RayCounts = {"rays": 128, "emitter_rays": 32, "portal_rays": 32}
"""Of one check. 2 x 4000 spots cost 1 s of CPU in the living room; an object's error is then known to 10 - 20 %."""
SHARE_RAYS: RayCounts = {"rays": 64, "emitter_rays": 16, "portal_rays": 16}
ONE_SIGMA: Unit[float] = 0.683


@dataclass(frozen=True)
class LightEvidence:
    """Errors of E at n elements.

    Attributes
    ----------
    noise : (n,) float32
        Relative standard error of E by rays and interpolation.
    unseen : (n,) float32
        Share of E that comes from what no frame saw: surfaces whose light was estimated, lamps and sky solved for.
    unsure : (n,) float32
        Relative error of E that follows from that.
    spots : int
        Places at which E was checked.
    """

    noise: np.ndarray
    unseen: np.ndarray
    unsure: np.ndarray
    spots: int


def spots(atlas: Atlas, seen: np.ndarray, count: int, seed: int = 0) -> tuple[np.ndarray, np.ndarray]:
    """About `count` elements, evenly over the surface, one of each object at least.

    Parameters
    ----------
    seen : (n,) bool
        Elements that were seen stand for such, unseen ones for unseen ones.

    Returns
    -------
    chosen : (k,) int
    nearest : (n,) int
        For each element, the index into `chosen` of the one that stands for it: of its object, in its cell, and on the
        same side of it.
    """
    edge = float(np.sqrt(atlas.weight.sum(dtype=np.float64) / count))
    # Small things and edges occupy more cells than their area says.
    cell = cell_of(atlas.position, 1.3 * max(edge, 1e-9))
    main = np.abs(atlas.normal).argmax(1)
    side = 2 * main + (np.take_along_axis(atlas.normal, main[:, None], 1)[:, 0] > 0)
    key = 12 * atlas.object_id.astype(np.int64) + 6 * seen + side
    key = key * (cell.max() + 1) + cell
    names, nearest = np.unique(key, return_inverse=True)
    chosen = np.empty(len(names), np.int64)
    order = np.random.default_rng(seed).permutation(len(key))
    chosen[nearest[order]] = order
    return chosen, nearest.ravel()


def unsure_light(findings: Findings, relative_error: np.ndarray) -> LightField:
    """The room with nothing but the light that no frame looked at.

    Channel 0: all of it; 1: that of surfaces, times its relative error; 2: the same of lamps and sky.
    """
    field, shading, lit = findings.field, findings.shading, findings.lit_diffuse
    luminance = field.radiance @ LUMINANCE
    solved = np.isin(field.atlas.object_id, [lamp.object_id for lamp in shading.lamps if not lamp.seen])
    clipped = lit.tier == SATURATED
    surface = (~lit.seen | clipped) & ~solved
    error = np.where(
        clipped, CALIBRATION.poorly, CALIBRATION.surfaces * np.minimum(np.hypot(relative_error, CALIBRATION.roughly), 1)
    )
    kinds = [luminance * (surface | solved), luminance * surface * error, luminance * solved * CALIBRATION.solved]
    sky = (shading.environment.radiance @ LUMINANCE) * (shading.environment.observations == 0)
    sky = np.stack([sky, np.zeros_like(sky), CALIBRATION.roughly * sky], -1).astype(np.float32)
    sun = None
    if shading.sun is not None and not shading.sun.seen:
        level = float(shading.sun.irradiance @ LUMINANCE)
        sun = replace(shading.sun, irradiance=np.array([level, 0, CALIBRATION.solved * level], np.float32))
    unseen_light = field.with_light(np.stack(kinds, 1), Environment(sky, shading.environment.observations))
    openings = field.openings
    if openings is not None:
        radiance = openings.radiance @ LUMINANCE
        radiance = np.stack([radiance, np.zeros_like(radiance), CALIBRATION.roughly * radiance], -1).astype(np.float32)
        openings = replace(openings, radiance=radiance)
    return unseen_light.with_sun(sun).with_openings(openings)


def light_evidence(findings: Findings, relative_error: np.ndarray) -> LightEvidence:
    """Check E at some elements and carry its error over to all; `relative_error` ((n,)) is albedo's, but for light."""
    field, shading, lit, seed = findings.field, findings.shading, findings.lit_diffuse, findings.seed
    atlas = field.atlas
    chosen, nearest = spots(atlas, lit.seen, LEVELS.sample, seed)
    gather = partial(irradiance, interpolate=False, finest=1.0, threads=findings.threads)
    log_E = np.log(np.maximum(shading.irradiance[chosen].mean(1), 1e-20))
    gathered = [gather(field, chosen, **RAYS, seed=seed + 100_003 * (k + 1))[0].mean(1) for k in range(2)]
    a, b = (np.clip(np.log(np.maximum(E, 1e-20)) - log_E, -CALIBRATION.worst, CALIBRATION.worst) for E in gathered)
    noise = _by_group(2 * atlas.object_id[chosen] + lit.seen[chosen], a, b)

    unseen_light = unsure_light(findings, relative_error)
    shares = np.zeros((len(chosen), 3), np.float32)
    if unseen_light.radiance.any() or unseen_light.environment.radiance.any() or unseen_light.sun is not None:
        unseen_E = gather(unseen_light, chosen, **SHARE_RAYS, seed=seed + 7)[0]
        shares = np.clip(unseen_E / np.maximum(shading.irradiance[chosen] @ LUMINANCE, 1e-20)[:, None], 0, 1)
    return LightEvidence(
        noise=noise[nearest].astype(np.float32),
        unseen=shares[nearest, 0].astype(np.float32),
        unsure=np.hypot(shares[:, 1], shares[:, 2])[nearest].astype(np.float32),
        spots=len(chosen),
    )


def _by_group(group: np.ndarray, a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Standard error of log E at each spot, (k,), the same all over a group, by log(E checked / E) of both checks.

    A `group` ((k,) int) is twice the object_id, and one more where the spot was seen: E of the unseen is a rough guess.
    Robust, as a contact shadow that fell between the shading points must not speak for a whole wall: from the share
    of 68 % that lies within one standard deviation, for the checks' deviations and for the checks' own noise.
    """
    result = np.empty(len(group))
    by_kind = {kind: _variance(a[group % 2 == kind], b[group % 2 == kind]) for kind in (0, 1)}
    for number, indices in by_number(group).items():
        count = len(indices)
        prior = by_kind[number % 2]
        result[indices] = np.sqrt(
            (count * _variance(a[indices], b[indices]) + CALIBRATION.prior_spots * prior)
            / (count + CALIBRATION.prior_spots)
        )
    return result


def _variance(a: np.ndarray, b: np.ndarray) -> float:
    """What a and b have in common, less their own noise; at least 0."""
    if not len(a):
        return 0.0
    total = np.quantile(np.abs(np.concatenate([a, b])), ONE_SIGMA) ** 2
    return max(float(total - np.quantile(np.abs(a - b), ONE_SIGMA) ** 2 / 2), 0.0)
