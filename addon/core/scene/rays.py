"""Rays against the room's triangles. The only module that imports embreex."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from embreex.mesh_construction import TriangleMesh
from embreex.rtcore_scene import EmbreeScene

from ..kinds import Unit

RELATIVE_OFFSET: Unit[float] = 2e-5
"""Origins are moved off their surface by this share of the scene's diagonal: embreex has no tnear, and without it
92 % of the rays hit the surface that they leave (none from 1e-6 on, measured in a 6 m room)."""


@dataclass(frozen=True)
class Hits:
    """First hits of n rays.

    Attributes
    ----------
    triangle : (n,) int32
        -1 where the ray escapes.
    u, v : (n,) float32
        Barycentric coordinates of the second and third corner.
    distance : (n,) float32
        Along the (unit) direction, metres; inf where the ray escapes.
    """

    triangle: np.ndarray
    u: np.ndarray
    v: np.ndarray
    distance: np.ndarray

    def part(self, index: np.ndarray) -> Hits:
        """The hits of some of the rays."""
        return Hits(self.triangle.take(index), self.u.take(index), self.v.take(index), self.distance.take(index))


class RayScene:
    """The triangles, ready to be hit.

    Parameters
    ----------
    vertices : (v, 3) float
        World, metres.
    triangles : (t, 3) int
    backs : (s,) int, optional
        As in `Mesh`: the last s triangles are the second sides of these. A ray meets the side that it comes from.
    """

    def __init__(self, vertices: np.ndarray, triangles: np.ndarray, backs: np.ndarray | None = None):
        low, high = vertices.min(0), vertices.max(0)
        self.diagonal = float(np.linalg.norm(high - low))
        # Far from the origin float32 itself is coarser than that: 1 mm at 10 km.
        self._coarse = 4 * float(np.spacing(np.float32(np.abs([low, high]).max())))
        self.offset = max(RELATIVE_OFFSET * self.diagonal, self._coarse)
        self._sides: tuple[np.ndarray, np.ndarray] | None = None  # of each triangle: its second side, and its normal
        if backs is not None and len(backs):
            triangles = triangles[: len(triangles) - len(backs)]
            back = np.full(len(triangles), -1, np.int32)
            back[backs] = len(triangles) + np.arange(len(backs))
            a, b, c = (vertices[triangles[:, i]] for i in range(3))
            self._sides = back, np.cross(b - a, c - a).astype(np.float32)
        self._scene = EmbreeScene()
        self._mesh = TriangleMesh(
            self._scene, np.ascontiguousarray(vertices, np.float32), np.ascontiguousarray(triangles, np.int32)
        )
        self._run(np.zeros((1, 3), np.float32), np.array([[0, 0, 1]], np.float32))  # builds the tree now, in one thread

    def fit(self, extent: float) -> None:
        """Let origins lie as near to their surface as a room of so many metres needs it, where the mesh goes beyond."""
        self.offset = max(RELATIVE_OFFSET * min(self.diagonal, 2 * extent), self._coarse)

    def _run(self, origins, directions, **options):
        origins = np.ascontiguousarray(np.broadcast_to(origins, directions.shape), np.float32)
        return self._scene.run(origins, np.ascontiguousarray(directions, np.float32), **options)

    def intersect(self, origins: np.ndarray, directions: np.ndarray) -> Hits:
        """First hit of each ray.

        Parameters
        ----------
        origins : (n, 3) or (3,) float
            Where each starts, or all of them.
        directions : (n, 3) float32
            Of unit length.
        """
        if len(directions) == 0:
            none = np.zeros(0, np.float32)
            return Hits(np.zeros(0, np.int32), none, none, none)
        result = self._run(origins, directions, output=True)
        triangle = result["primID"]
        hits = Hits(triangle, result["u"], result["v"], np.where(triangle < 0, np.float32(np.inf), result["tfar"]))
        return hits if self._sides is None else self._by_side(hits, directions, *self._sides)

    @staticmethod
    def _by_side(hits: Hits, directions: np.ndarray, back: np.ndarray, normal: np.ndarray) -> Hits:
        """The hits credited to the side of a sheet that the rays came from."""
        sheet = np.flatnonzero((hits.triangle >= 0) & (back[hits.triangle] >= 0))
        triangle_hit = hits.triangle[sheet]
        from_behind = sheet[np.einsum("ij,ij->i", directions[sheet], normal[triangle_hit]) > 0]
        triangle, u, v = hits.triangle.copy(), hits.u.copy(), hits.v.copy()
        triangle[from_behind] = back[triangle[from_behind]]
        u[from_behind], v[from_behind] = hits.v[from_behind], hits.u[from_behind]  # the other winding
        return Hits(triangle, u, v, hits.distance)

    def occluded(self, origins: np.ndarray, directions: np.ndarray, distances: np.ndarray) -> np.ndarray:
        """True where something lies between an origin and `distances` ((n,) float32, metres) along its ray."""
        if len(origins) == 0:
            return np.zeros(0, bool)
        return self._run(origins, directions, dists=np.ascontiguousarray(distances, np.float32), query="OCCLUDED") >= 0

    def off_surface(self, positions: np.ndarray, normals: np.ndarray) -> np.ndarray:
        """Origins for rays that leave `positions` on the side of `normals` ((n, 3) float32 each)."""
        return positions + np.float32(self.offset) * normals
