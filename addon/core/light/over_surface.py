"""E over the surface: which estimator is evaluated at which elements, and what is interpolated between."""

from collections.abc import Callable
from typing import TypedDict

import numpy as np

from ..kinds import Block
from ..parallel import for_blocks
from ..progress import Progress, Rounds
from ..scene.atlas import Atlas
from .emitters import bright_triangles
from .field import LightField
from .interpolate import interpolated
from .irradiance import direct, gather
from .less_noise import less_noise
from .params import GATHER
from .portals import find_portals
from .sun import Sun, sunlight
from .texel_blocks import TexelBlocks

ELEMENTS_AT_ONCE: Block[int] = 1 << 13


def finest_spacing(atlas: Atlas, share: float = GATHER.finest_share) -> float:
    """Least distance of two gathering points, metres."""
    low, high = atlas.box
    extent = np.sort(high - low)
    return max(atlas.texel_edge, share * float(np.sqrt(extent[1] * extent[2])))


def block_step(atlas: Atlas) -> int:
    """Edge in texels of the blocks that light is interpolated in: a power of two."""
    return 1 << max(int(np.log2(finest_spacing(atlas) / atlas.texel_edge + 1e-6)), 0)


class Gathering(TypedDict):
    """Those of `irradiance`'s keywords that are the same for all elements of a room."""

    finest: float
    smooth: bool
    threads: int
    seed: int


class RayCounts(TypedDict):
    """Those that say how many rays are taken of each kind, at each place."""

    rays: int
    emitter_rays: int
    portal_rays: int


def irradiance(
    field: LightField,
    element: np.ndarray,
    *,
    rays: int,
    emitter_rays: int,
    portal_rays: int,
    interpolate: bool,
    finest: float,
    threads: int,
    seed: int,
    smooth: bool = True,
    progress: Progress | None = None,
) -> tuple[np.ndarray, np.ndarray, int, np.ndarray]:
    """E at chosen elements.

    Parameters
    ----------
    element : (m,) int
        The elements wanted.
    finest : float
        Least distance of two gathering points in metres.
    smooth : bool
        Take out the noise of rays and of interpolation (`less_noise`).

    Returns
    -------
    irradiance : (m, 3) float32
    escaped : (m,) float32
    points : int
        How many places were gathered at.
    relative_error : (m,) float32
        Relative error of E by interpolation, by the rays' noise and at the edges of the sun's light.
    """
    atlas = field.atlas
    bright = bright_triangles(field)
    lamp_rays = emitter_rays if len(bright) else 0
    portals = find_portals(field, seed) if portal_rays else None
    gathering, aiming = Rounds(progress, 0.0, 0.75), Rounds(progress, 0.75, 1.0)
    points = rounds = 0

    def gathered(index: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """E and the escaped share in four channels, and the radius R, at some of the elements."""
        nonlocal rounds
        rounds += 1
        first_seed = seed + 7919 * rounds

        def gather_at(p: np.ndarray, n: np.ndarray, start: int) -> np.ndarray:
            block_seed = first_seed + start
            E, radius, escaped = gather(field, bright, p, n, rays, lamp_rays, block_seed, portals, portal_rays)
            return np.column_stack([E, escaped, radius])

        at_once = max(ELEMENTS_AT_ONCE * 64 // rays, 64)
        value = _by_blocks(atlas, element[index], gather_at, 5, threads, at_once, gathering)
        gathering.next()
        return value[:, :4], value[:, 4]

    blocks = TexelBlocks(atlas, element, threads)
    step = block_step(atlas) if interpolate else 1

    def around(index: np.ndarray) -> np.ndarray:
        """E, the escaped share and the contrast, (k, 5) float32."""
        nonlocal points
        if not interpolate:
            points += len(index)
            return np.concatenate([gathered(index)[0], np.zeros((len(index), 1), np.float32)], 1)
        surface_points = atlas.position[element[index]], atlas.normal[element[index]]
        value, chosen, contrast = interpolated(*surface_points, lambda i: gathered(index[i]), finest, threads)
        points += len(chosen)
        return np.concatenate([value, contrast[:, None]], 1)

    def aim(index: np.ndarray) -> np.ndarray:
        """The lamps' part of E, and its noise, (k, 4) float32."""

        def aim_from(p: np.ndarray, n: np.ndarray, start: int) -> np.ndarray:
            return np.column_stack(direct(field, bright, p, n, rays, lamp_rays, seed + 1 + start))

        result = _by_blocks(atlas, element[index], aim_from, 4, threads, progress=aiming)
        aiming.next()
        return result

    value = blocks.evaluate(around, step, np.inf)
    total, escaped = value[:, :3].copy(), value[:, 3].copy()
    error = value[:, 4] * total.mean(1)
    del value
    if lamp_rays:
        lamps = blocks.evaluate(aim, step, GATHER.smooth, total.mean(1))
        total += lamps[:, :3]
        error = np.hypot(error, lamps[:, 3])
    if smooth:
        total, error = less_noise(atlas.position[element], atlas.normal[element], total, error, threads=threads)
    if field.sun is not None:
        sunlit = _from_sun(field, field.sun, blocks, element, step, total.mean(1), threads, seed)
        total += sunlit[:, :3]
        error = np.hypot(error, sunlit[:, 3])
    return total, escaped, points, error / np.maximum(total.mean(1), 1e-20)


def sun_irradiance(field: LightField, element: np.ndarray, around: np.ndarray, threads: int, seed: int) -> np.ndarray:
    """The sun's part of E at elements ((m,) int) of a field that has one, (m, 3) float32.

    `around`, (m,) float, is E there, which the sun's part is judged beside.
    """
    blocks, step = TexelBlocks(field.atlas, element, threads), block_step(field.atlas)
    sun = field.sun
    assert sun is not None
    return _from_sun(field, sun, blocks, element, step, around, threads, seed)[:, :3]


def _from_sun(
    field: LightField,
    sun: Sun,
    blocks: TexelBlocks,
    element: np.ndarray,
    step: int,
    around: np.ndarray,
    threads: int,
    seed: int,
) -> np.ndarray:
    """The sun's part of E and its error at elements that `blocks` were made of, (m, 4) float32."""

    def shine_on(p: np.ndarray, n: np.ndarray, start: int) -> np.ndarray:
        return sunlight(field.scene, sun, p, n, field.atlas.texel_edge, seed + 2 + start)

    def shine(index: np.ndarray) -> np.ndarray:
        return _by_blocks(field.atlas, element[index], shine_on, 4, threads)

    return blocks.evaluate(shine, step, GATHER.smooth, around)


def _by_blocks(
    atlas: Atlas,
    element: np.ndarray,
    function: Callable[[np.ndarray, np.ndarray, int], np.ndarray],
    channels: int,
    threads: int,
    at_once: int = ELEMENTS_AT_ONCE,
    progress: Rounds | None = None,
) -> np.ndarray:
    """A function of positions, normals and the first one's number, at elements ((m,) int), (m, channels) float32."""
    result = np.empty((len(element), channels), np.float32)

    def run(part: slice) -> None:
        elements = element[part]
        result[part] = function(atlas.position[elements], atlas.normal[elements], part.start)

    for_blocks(run, len(element), at_once, threads, progress)
    return result
