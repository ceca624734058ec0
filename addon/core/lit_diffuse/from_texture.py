"""L_d from light that the capture stores on its mesh, where there are no frames to take the median of."""

from itertools import pairwise

import numpy as np

from ..errors import BadInputError
from ..io.exr import HALF_MAX
from ..kinds import Block
from ..parallel import blocks
from ..progress import Progress
from ..scene.atlas import Atlas
from ..scene.lit_diffuse import LitDiffuse
from ..scene.model import Mesh
from ..scene.params import VISIBILITY
from ..scene.stored_light import LitTiles
from ..scene.visibility import CLEAN, SATURATED

TEXELS_AT_ONCE: Block[int] = 1 << 22
"""Texels of the tiles that are looked at together; 160 bytes each."""


def face_edge(mesh: Mesh) -> float:
    """Edge in metres of the usual face of the stored light's mesh: how large an element should be."""
    if not isinstance(mesh.lit, LitTiles):
        raise BadInputError("No light is stored on the mesh; give the capture frames.")
    _, area = _tiles(mesh, mesh.lit)
    return float(np.sqrt(np.median(area)))


def lit_from_tiles(mesh: Mesh, atlas: Atlas, progress: Progress | None = None) -> LitDiffuse:
    """The mean over the part of its tile that each element stands for.

    A stored value is itself the median or mean of many frames, so that an element counts as seen often enough; the
    interquartile range of those is not known, and is 0. Texels that are 0 in all channels, or
    not finite, were never seen. An element most of whose texels are as bright as a half float can be is clipped.

    Parameters
    ----------
    mesh : Mesh
        With `lit`, and its triangles wound as they were read.
    atlas : Atlas
        Elements by the same triangles, wound any way.

    Raises
    ------
    BadInputError
        Nothing is stored, or no light; or a texture was changed or taken away since it was read.
    """
    stored, n = mesh.lit, len(atlas)
    if not isinstance(stored, LitTiles):
        raise BadInputError("The capture has no frames, and no light stored on its mesh; give it either.")
    of_triangle, area = _tiles(mesh, stored)
    key = of_triangle[atlas.triangle]
    order = np.argsort(key, kind="stable")
    place = _place(mesh, stored, atlas)
    # How many texels of its tile an element covers along an edge.
    width = np.sqrt(atlas.area / np.maximum(area[key], 1e-30)) * stored.size
    sums = np.zeros((n, 5))
    tiles, first = np.unique(key[order], return_index=True)
    ends = np.append(first[1:], n)
    picture = np.zeros(len(area), np.int32)
    number = np.zeros(len(area), np.int64)
    picture[of_triangle], number[of_triangle] = stored.picture, stored.tile
    for part in _runs(picture[tiles], max(TEXELS_AT_ONCE // stored.size**2, 1)):
        texels = _read(stored, int(picture[tiles[part.start]]), number[tiles[part]])
        elements = order[first[part.start] : ends[part.stop - 1]]
        local = np.searchsorted(tiles[part], key[elements])
        sums[elements] = _window_sums(texels, local, place[elements] * stored.size, width[elements], stored.size)
        if progress is not None:
            progress.update(0.9 * part.stop / len(tiles))
    if not sums[:, 3].any():
        raise BadInputError("The textures on the mesh hold no light at all; copy them again.")
    return of_sums(sums)


def of_sums(sums: np.ndarray) -> LitDiffuse:
    """L_d of sums of R, G, B, number and number of clipped texels over each element, (n, 5)."""
    weight = sums[:, 3]
    seen = weight > 0
    radiance = np.full((len(sums), 3), np.nan, np.float32)
    radiance[seen] = sums[seen, :3] / weight[seen, None]
    share = (sums[:, 4] / np.maximum(weight, 1)).astype(np.float32)
    tier = np.where(seen, np.where(share > 0.5, SATURATED, CLEAN), -1).astype(np.int8)
    none = np.zeros_like(radiance)
    return LitDiffuse(radiance, none, np.where(seen, VISIBILITY.enough, 0).astype(np.int32), tier, share)


def _tiles(mesh: Mesh, stored: LitTiles) -> tuple[np.ndarray, np.ndarray]:
    """A number for each triangle's tile, (t,), and the surface that each tile covers, square metres."""
    _, area = mesh.geometry
    of_triangle = np.unique(stored.picture.astype(np.int64) * (1 << 32) + stored.tile, return_inverse=True)[1].ravel()
    return of_triangle, np.bincount(of_triangle, area)


def _place(mesh: Mesh, stored: LitTiles, atlas: Atlas) -> np.ndarray:
    """Where in its tile each element lies, (n, 2) float64, 0...1."""
    result = np.empty((len(atlas), 2))
    for part in blocks(len(atlas), 1 << 18):
        triangle = atlas.triangle[part]
        result[part] = interpolated(stored.uv[triangle], *barycentric(mesh, triangle, atlas.position[part]))
    return np.clip(np.nan_to_num(result), 0, 1)


def barycentric(mesh: Mesh, triangle: np.ndarray, position: np.ndarray) -> np.ndarray:
    """Shares of the second and the third corner of triangles ((n,) int) at places in them ((n, 3), metres), (2, n)."""
    a, b, c = (mesh.vertices[mesh.triangles[triangle, i]] for i in range(3))
    e, f, p = b - a, c - a, position - a
    ee, ef, ff, pe, pf = (np.einsum("ij,ij->i", x, y) for x, y in ((e, e), (e, f), (f, f), (p, e), (p, f)))
    scale = np.maximum(ee * ff - ef * ef, 1e-300)
    return np.stack([(pe * ff - pf * ef) / scale, (pf * ee - pe * ef) / scale])


def interpolated(corner: np.ndarray, u: np.ndarray, v: np.ndarray) -> np.ndarray:
    """Values at the corners of triangles ((n, 3, 2)), by the shares of the second and the third, (n, 2) float64."""
    corner = corner.astype(np.float64)
    return (1 - u - v)[:, None] * corner[:, 0] + u[:, None] * corner[:, 1] + v[:, None] * corner[:, 2]


def _runs(picture: np.ndarray, maximum: int) -> list[slice]:
    """Slices of at most so many tiles, each within one picture."""
    ends = [*(np.flatnonzero(np.diff(picture)) + 1).tolist(), len(picture)]
    return [
        slice(first + part.start, first + part.stop)
        for first, end in pairwise([0, *ends])
        for part in blocks(end - first, maximum)
    ]


def _read(light: LitTiles, picture: int, number: np.ndarray) -> np.ndarray:
    """Tiles of a picture, (k, size, size, 3) float32."""
    path, side, size = light.paths[picture], light.side[picture], light.size
    try:
        stored = np.memmap(path, "<f2", "r", shape=(side, side, 3))
    except (OSError, ValueError) as error:
        raise BadInputError(f"Texture '{path}' changed during the run; start again.") from error
    across = side // size
    tiles = stored[: across * size, : across * size].reshape(across, size, across, size, 3)
    return tiles[number // across, :, number % across].astype(np.float32)


def _window_sums(texels: np.ndarray, tile: np.ndarray, centre: np.ndarray, width: np.ndarray, size: int) -> np.ndarray:
    """Sums of R, G, B, number and number of clipped texels ((k, size, size, 3)) over squares of some tiles, (n, 5).

    Their `centre` ((n, 2) x and y) and `width` ((n,)) are in texels; they are moved to lie within the tile ((n,) int).
    """
    known = np.isfinite(texels).all(-1) & (texels >= 0).all(-1) & (texels > 0).any(-1)
    infinite = np.isposinf(texels).any(-1)
    known |= infinite
    values = np.empty((*known.shape, 5))
    values[..., :3] = np.where(known[..., None], np.minimum(texels, HALF_MAX), 0)
    values[..., 3] = known
    values[..., 4] = known & (infinite | (texels >= HALF_MAX).any(-1))
    table = np.zeros((len(texels), size + 1, size + 1, 5))
    table[:, 1:, 1:] = values.cumsum(1).cumsum(2)
    edge = np.clip(np.rint(width), 1, size).astype(np.int64)[:, None]
    low = np.clip(np.rint(centre - edge / 2).astype(np.int64), 0, size - edge)
    (x0, y0), (x1, y1) = low.T, (low + edge).T
    return table[tile, y1, x1] - table[tile, y0, x1] - table[tile, y1, x0] + table[tile, y0, x0]
