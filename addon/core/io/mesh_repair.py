"""Mesh repair: removes triangles without area and vertices that are not finite."""

from dataclasses import replace

import numpy as np

from ..errors import BadInputError
from ..kinds import Limit, Unit
from ..parallel import blocks
from ..scene.model import TRIANGLES_AT_ONCE
from .layout import RawMesh

MAX_COORDINATE: Limit[float] = 1e6
"""Metres; beyond, single precision (rays, atlas) can't hold a room."""
MIN_HEIGHT: Unit[float] = 1e-12
"""A triangle whose height is below this share of its longest edge has no area."""
PLAUSIBLE_EXTENT: Limit[tuple[float, float]] = (0.1, 1000.0)
"""Metres; a room outside of this was likely exported in another unit."""


def repair(mesh: RawMesh) -> tuple[RawMesh, list[str]]:
    """Remove the triangles of `mesh` that are degenerate or have vertices that are not finite.

    Returns
    -------
    mesh : RawMesh
        Each triangle has an area; every vertex is finite. Materials and the file's faces are left out.
    warnings : list of str

    Raises
    ------
    BadInputError
        No triangle is left.
    """
    name = mesh.name
    if not len(mesh.triangles):
        raise BadInputError(f"Mesh '{name}' has no triangles; export the room's surface with its faces.")
    warnings = []
    with np.errstate(invalid="ignore"):
        finite = (np.abs(mesh.vertices) <= MAX_COORDINATE).all(1)
    corners_finite = finite[mesh.triangles].all(1)
    good = corners_finite.copy()
    good[corners_finite] = _has_area(mesh.vertices, mesh.triangles[corners_finite])
    broken, flat = int((~corners_finite).sum()), int((corners_finite & ~good).sum())
    if broken:
        warnings.append(
            f"{broken} triangles of '{name}' have vertices that are not finite or over "
            f"{MAX_COORDINATE:g} m away, and are left out."
        )
    if flat:
        warnings.append(f"{flat} triangles of '{name}' have no area and are left out.")
    if not good.any():
        raise BadInputError(f"Mesh '{name}' has no triangle with an area; export the room's surface again.")
    vertices, triangles = mesh.vertices, mesh.triangles[good]
    if not finite.all():
        new_index = np.cumsum(finite) - 1
        vertices, triangles = vertices[finite], new_index[triangles].astype(np.int32)
    ids = None if mesh.object_id is None else mesh.object_id[good]
    uv = None if mesh.uv is None else np.nan_to_num(mesh.uv[good], nan=0.0, posinf=0.0, neginf=0.0)
    used = np.zeros(len(vertices), bool)
    used[triangles] = True
    extent = float(np.ptp(vertices[used], axis=0).max())
    if not PLAUSIBLE_EXTENT[0] <= extent <= PLAUSIBLE_EXTENT[1]:
        warnings.append(f"Mesh '{name}' is {extent:.3g} m across; captures are in metres.")
    lit = None if mesh.lit is None else mesh.lit.part(good)
    far = None if mesh.far is None else mesh.far[good]
    kept = {"vertices": vertices, "triangles": triangles, "object_id": ids, "uv": uv, "lit": lit, "far": far}
    return replace(mesh, **kept, material=None, faces=None), warnings


def _has_area(vertices: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Whether each triangle has three corners apart from one line, (t,) bool."""
    result = np.empty(len(triangles), bool)
    for part in blocks(len(triangles), TRIANGLES_AT_ONCE):
        a, b, c = (vertices[triangles[part, i]] for i in range(3))
        doubled_area = np.linalg.norm(np.cross(b - a, c - a), axis=1)
        longest_squared = np.maximum.reduce([((b - a) ** 2).sum(1), ((c - b) ** 2).sum(1), ((a - c) ** 2).sum(1)])
        result[part] = doubled_area > MIN_HEIGHT * longest_squared
    return result
