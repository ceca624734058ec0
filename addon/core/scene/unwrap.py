"""Atlases without Blender: by the mesh's own texture coordinates, or by xatlas where it is installed."""

from collections.abc import Callable
from typing import TypeVar

import numpy as np

from ..errors import BadInputError
from .model import Mesh
from .params import SURFACE
from .uv_overlap import overlapping_pairs

Unwrap = Callable[[Mesh, int], np.ndarray]
"""Atlas coordinates, (t, 3, 2) float32 in [0, 1] without overlap, for a mesh and an atlas's edge in texels."""
T = TypeVar("T", bound=Callable)


def of_parts(unwrap: T) -> T:
    """Marks an unwrap that may be called with some of a mesh's triangles alone."""
    vars(unwrap)["of_parts"] = True
    return unwrap


def takes_parts(unwrap: Unwrap) -> bool:
    """Whether it is marked so; not where it is given the faces of the artist's mesh by the number of each triangle."""
    keywords = getattr(unwrap, "keywords", {})
    return getattr(getattr(unwrap, "func", unwrap), "of_parts", False) and keywords.get("polygons") is None


def own_coordinates(mesh: Mesh, size: int) -> np.ndarray:
    """The mesh's own texture coordinates; its second sides (`Mesh.backs`) get a square of their own beside the first.

    Raises
    ------
    BadInputError
        There are none, they leave the unit square, or triangles overlap in it.
    """
    if mesh.uv is None:
        raise BadInputError(f"The mesh has no texture coordinates of its own to lay its atlas out by; {OTHERWISE}.")
    uv = np.asarray(mesh.uv, np.float32)
    if not np.isfinite(uv).all() or uv.min(initial=0) < 0 or uv.max(initial=0) > 1:
        raise BadInputError(f"The mesh's own texture coordinates lie outside of 0 to 1, as tiled ones do; {OTHERWISE}.")
    first = len(uv) - (0 if mesh.backs is None else len(mesh.backs))
    pairs = overlapping_pairs(uv[:first], SURFACE.overlap_texels / size)
    if len(pairs):
        raise BadInputError(
            f"The mesh's own texture coordinates overlap ({len(pairs)} pairs of triangles), so that a texel would "
            f"stand for two places; {OTHERWISE}."
        )
    if first == len(uv):
        return uv
    side_by_side = uv / 2
    side_by_side[first:, :, 0] += 0.5
    return side_by_side


@of_parts
def by_xatlas(mesh: Mesh, size: int) -> np.ndarray:
    """Charts by the library xatlas, each of one object; packed into one square.

    Raises
    ------
    BadInputError
        The library is not installed.
    """
    try:
        import xatlas
    except ImportError as error:
        raise BadInputError(f"The Python package 'xatlas' is missing; {OTHERWISE}.") from error
    # Vertices are split between objects: a chart then never spans two of them.
    label = mesh.object_id[:, None].astype(np.int64) * len(mesh.vertices) + mesh.triangles
    unique_labels, corners = np.unique(label.ravel(), return_inverse=True)
    atlas = xatlas.Atlas()
    atlas.add_mesh(
        mesh.vertices[unique_labels % len(mesh.vertices)].astype(np.float32), corners.reshape(-1, 3).astype(np.uint32)
    )
    packing = xatlas.PackOptions()
    packing.resolution, packing.padding = size, SURFACE.margin
    atlas.generate(xatlas.ChartOptions(), packing)
    _, triangles, uv = atlas[0]
    edge = max(atlas.width, atlas.height, 1)  # its units are the two edges, which may differ
    coordinates = uv[triangles] * np.array([atlas.width / edge, atlas.height / edge], np.float32)
    return np.clip(np.nan_to_num(coordinates), 0, 1).astype(np.float32)


OTHERWISE = "install Blender's bpy or xatlas (pip install 'scan-relight[blender]' or 'scan-relight[unwrap]')"
