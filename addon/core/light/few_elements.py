"""The elements at which light that no frame looked at is solved for, and E there by many rays each."""

import numpy as np

from ..groups import by_label, by_number
from ..kinds import Block
from ..luminance import LUMINANCE
from ..parallel import for_blocks
from ..significance import LEVELS
from .emitters import bright_triangles
from .environment import Environment
from .field import LightField
from .irradiance import direct, gather
from .params import GATHER, LIGHT_FIT
from .portals import find_portals
from .sun import sunlight

ELEMENTS_AT_ONCE: Block[int] = 1 << 10


def pick(field: LightField, good: np.ndarray, seed: int, samples: int) -> np.ndarray:
    """At most so many good elements, evenly over the objects that have them."""
    rng = np.random.default_rng(seed)
    element = np.flatnonzero(good)
    groups = by_label(field.atlas.object_id[element])
    per_object = max(samples // len(groups), 50)
    chosen = [
        members if len(members) <= per_object else rng.choice(members, per_object, replace=False)
        for members in (element[g] for g in groups)
    ]
    return np.sort(np.concatenate(chosen))


def spread_over(field: LightField, element: np.ndarray, count: int, rng: np.random.Generator) -> np.ndarray:
    """At most so many of some elements ((m,) int), evenly over the surface that they stand for."""
    if len(element) <= count:
        return element
    weight = field.atlas.weight[element].astype(np.float64)
    count = min(count, int((weight > 0).sum()))
    return np.sort(rng.choice(element, count, replace=False, p=weight / weight.sum()))


def steady(field: LightField, good: np.ndarray, flat: np.ndarray) -> np.ndarray:
    """The good elements, (n,) bool: of an object with enough on flat spots, those."""
    object_id = field.atlas.object_id
    count = np.bincount(object_id, good & flat)
    return good & (flat | (count < LEVELS.enough)[object_id])


def barely_seen(field: LightField, good: np.ndarray) -> np.ndarray:
    """Elements of bright objects that have no good one, (n,) bool: a lamp may be smaller than a pixel.

    What nobody saw is dark in `field`, so it is not among them.
    """
    luminance, atlas = field.radiance @ LUMINANCE, field.atlas
    seen = (luminance > 0) & ~np.isin(atlas.object_id, atlas.object_id[good])
    level = GATHER.bright * float((luminance * atlas.weight).sum() / max(atlas.weight.sum(), 1e-30))
    index = np.flatnonzero(seen)
    groups = by_number(atlas.object_id[index])
    bright = [i for i, members in groups.items() if np.median(luminance[index[members]]) > level]
    return seen & np.isin(atlas.object_id, bright)


def filled_radiance(field: LightField) -> np.ndarray:
    """L_d with the likely radiance of elements that nobody saw, (n, 3) float32: they are dark in `field`.

    The field's `unseen`, else the median of its object; nothing where nobody saw anything of the object.
    """
    radiance, object_id = field.radiance.copy(), field.atlas.object_id
    seen = radiance.any(1)
    if field.unseen is not None:
        fill = ~seen & (np.bincount(object_id, seen) > 0)[object_id]
        radiance[fill] = field.unseen[fill]
        return radiance
    for members in by_label(object_id):
        known = seen[members]
        if known.any() and not known.all():
            radiance[members[~known]] = np.median(radiance[members[known]], 0)
    return radiance


def irradiance_at(field: LightField, element: np.ndarray, seed: int, more: int = 1) -> np.ndarray:
    """E of a few elements by both estimators, with `more` times the rays, and from the sun, (m, 3) float64."""
    bright, portals = bright_triangles(field), find_portals(field, seed)
    rays, emitter_rays = more * LIGHT_FIT.rays, more * LIGHT_FIT.emitter_rays
    position, normal = field.atlas.position[element], field.atlas.normal[element]
    E = np.empty((len(element), 3))

    def run(part: slice) -> None:
        p, n, block_seed = position[part], normal[part], seed + part.start
        indirect, _, _ = gather(field, bright, p, n, rays, emitter_rays, block_seed, portals, emitter_rays)
        E[part] = indirect + direct(field, bright, p, n, rays, emitter_rays, block_seed + 1)[0]

    for_blocks(run, len(element), ELEMENTS_AT_ONCE, 0)
    return E + from_sun(field, element)


def from_sun(field: LightField, element: np.ndarray) -> np.ndarray:
    """The sun's part of E, (m, 3) float32."""
    atlas = field.atlas
    if field.sun is None:
        return np.zeros((len(element), 3), np.float32)
    return sunlight(field.scene, field.sun, atlas.position[element], atlas.normal[element], atlas.texel_edge)[:, :3]


def mostly_lit(field: LightField, mask: np.ndarray) -> bool:
    """Whether the sun lights most of some elements, (n,) bool."""
    return 2 * from_sun(field, np.flatnonzero(mask)).any(1).sum() > mask.sum()


def by_sun(
    field: LightField, radiance: np.ndarray, sunlit: np.ndarray, element: np.ndarray, seed: int, more: int = 1
) -> np.ndarray:
    """E at m elements by the sun and by the `radiance` that it makes `sunlit` elements ((n,) bool) send, (m, 1, 3).

    float64; (m, 0, 3) where there are none of these.
    """
    if not sunlit.any():
        return np.zeros((len(element), 0, 3))
    reflected = np.where(sunlit[:, None], radiance, 0).astype(np.float32)
    alone = field.with_openings(None).with_light(reflected, Environment.dark())
    return irradiance_at(alone, element, seed, more)[:, None]


def most_reflected(field: LightField, objects: list[int], seed: int) -> float:
    """Luminance that objects would send out at an albedo of `EMITTER_ALBEDO`, in the median over their elements."""
    elements = pick(field, np.isin(field.atlas.object_id, objects), seed, LEVELS.of_object)
    return LIGHT_FIT.emitter_albedo / np.pi * float(np.median(irradiance_at(field, elements, seed) @ LUMINANCE))
