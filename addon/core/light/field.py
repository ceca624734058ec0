"""The light field of the captured room: along a ray, radiance is L_d where it hits, the environment where it leaves."""

from __future__ import annotations

import copy
from collections.abc import Iterable
from functools import cached_property
from typing import Any

import numpy as np

from ..scene.atlas import Atlas
from ..scene.elements import ElementLookup
from ..scene.model import Mesh
from ..scene.rays import Hits, RayScene
from ..scene.shells import bulges
from .environment import Environment
from .mirrors import Mirror
from .openings import Openings
from .sun import Sun

FLAT = np.cos(np.radians(2.0))
"""Triangles turned less than this against a mirror's plane belong to it."""


class LightField:
    """L(x, w) (Haefner et al. 2021, sec. 3.2: "radiance at a hit is L_d there").

    Parameters
    ----------
    radiance : (n, 3) float32
        L_d of each element, no NaN.
    lamps : iterable of int
        Objects that give light. They do so on the side that the normals show, which is the side the frames see: a
        lamp that is a bare rectangle under a ceiling does not light the gap above it. So does each side of a sheet
        that has two (`Mesh.backs`). In a mesh without objects a lamp that `bulges` shines on both: what lacks of a
        bulb, as no frame saw it, shines too, and its inside does in its stead. All else of such a mesh is dark from
        behind: a ray that meets a back came in by a hole where no frame looked, and it is dark inside of things.
    lookup : ElementLookup, optional
        Of this mesh and atlas, if there is one already.
    """

    def __init__(
        self,
        mesh: Mesh,
        atlas: Atlas,
        scene: RayScene,
        radiance: np.ndarray,
        environment: Environment,
        lamps: Iterable[int] = (),
        lookup: ElementLookup | None = None,
    ):
        self.mesh, self.atlas, self.scene, self.environment = mesh, atlas, scene, environment
        self.radiance = np.ascontiguousarray(radiance, np.float32)
        self.normal, _ = mesh.geometry
        self._set_lamps(lamps)
        self.mirrors: tuple[Mirror, ...] = ()
        self.sun: Sun | None = None
        self.openings: Openings | None = None
        self.unseen: np.ndarray | None = None
        self.mirror_of = np.full(len(mesh.triangles), -1, np.int8)
        self.lookup = lookup or ElementLookup(mesh, atlas)
        # By seed, rays that leave the mesh (`portals`): the same for every light, so all fields of the room share them.
        self.leaving: dict[int, tuple[np.ndarray, np.ndarray]] = {}

    @cached_property
    def room_box(self) -> tuple[np.ndarray, np.ndarray]:
        """Lower and upper corner ((3,) each) of the mesh, or of its part that is the room (`Atlas.box`)."""
        low, high = self.mesh.vertices.min(0), self.mesh.vertices.max(0)
        first, last = self.atlas.box
        reach = np.maximum(last - first, 0.01 * float(np.max(last - first)))
        return np.maximum(low, first - 0.02 * reach), np.minimum(high, last + 0.02 * reach)

    @property
    def outer_box(self) -> tuple[np.ndarray, np.ndarray]:
        """Low corner and size, (3,) float32 each, of `room_box` with what rays start off the surface by around it."""
        margin = np.float32(2 * self.scene.offset)
        low, high = (corner.astype(np.float32) for corner in self.room_box)
        return low - margin, high - low + 2 * margin

    def with_light(
        self, radiance: np.ndarray, environment: Environment | None = None, lamps: Iterable[int] | None = None
    ) -> LightField:
        """The same room with another L_d and, if given, another environment and other lamps."""
        field = self._with(
            radiance=np.ascontiguousarray(radiance, np.float32), environment=environment or self.environment
        )
        if lamps is not None:
            field._set_lamps(lamps)
        return field

    def _with(self, **changed: Any) -> LightField:
        field = copy.copy(self)
        vars(field).update(changed)
        return field

    def _set_lamps(self, lamps: Iterable[int]) -> None:
        if self.mesh.whole:
            normal, area = self.mesh.geometry
            triangles = {lamp: self.mesh.object_id == lamp for lamp in lamps}
            bulging = [lamp for lamp, own in triangles.items() if bulges(normal[own], area[own])]
            self.one_sided = ~np.isin(self.mesh.object_id, bulging)
        else:
            self.one_sided = np.isin(self.mesh.object_id, list(lamps))
        self._dark_backs = bool(self.one_sided.any())
        if self.mesh.backs is not None:  # rays meet no side from behind, but are aimed at points on either
            self.one_sided[self.mesh.backs] = True
            self.one_sided[len(self.mesh.triangles) - len(self.mesh.backs) :] = True

    def with_mirrors(self, mirrors: tuple[Mirror, ...]) -> LightField:
        """The same room with flat mirrors that reflect rays."""
        mirror_of = np.full(len(self.mesh.triangles), -1, np.int8)
        for i, mirror in enumerate(mirrors):
            parallel = np.abs(self.normal @ mirror.normal) > FLAT
            mirror_of[parallel & (self.mesh.object_id == mirror.object_id)] = i
        return self._with(mirrors=mirrors, mirror_of=mirror_of)

    def with_sun(self, sun: Sun | None) -> LightField:
        """The same room with a sun, or without one. Rays don't meet it: its part of E is `sun.sunlight`."""
        return self._with(sun=sun)

    def with_unseen(self, radiance: np.ndarray | None) -> LightField:
        """The same room with the likely radiance, (n, 3) float32, of elements that no frame saw, which are dark."""
        return self._with(unseen=radiance)

    def with_openings(self, openings: Openings | None) -> LightField:
        """The same room with light that comes in by its openings.

        For rays from inside they stand in place of the environment, where no frame saw that nor nearly so.
        """
        return self._with(openings=openings)

    def outside(self, origins: np.ndarray | None, directions: np.ndarray) -> np.ndarray:
        """Radiance that comes in along rays that leave the mesh, (n, 3) float32; `origins` as in `arriving`."""
        if self.openings is None or origins is None:
            return self.environment(directions)
        radiance, inside = self.openings(origins, directions)
        sky = self.environment
        unfamiliar = sky.at(sky.unfamiliar, directions) if sky.seen else np.float32(1)
        share = (inside * unfamiliar)[:, None]
        return share * radiance + (1 - share) * sky(directions)

    def elements(self, hits: Hits) -> np.ndarray:
        """The element at each hit, (n,) int32; -1 where the ray escaped."""
        missed = np.flatnonzero(hits.triangle < 0)
        if len(missed) == len(hits.triangle):
            return np.full(len(missed), -1, np.int32)
        # u and v of a miss may be anything.
        u, v = hits.u, hits.v
        if len(missed):
            u, v = u.copy(), v.copy()
            u[missed] = v[missed] = 0
        element = self.lookup(hits.triangle, u, v)
        element[missed] = -1
        return element

    def along(self, origins: np.ndarray, directions: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Follow rays.

        Parameters
        ----------
        origins, directions : (n, 3) float32

        Returns
        -------
        radiance : (n, 3) float32
            Coming back along each ray.
        distance : (n,) float32
            inf where it escapes.
        element : (n,) int32
            -1 where it escapes.
        """
        hits = self.scene.intersect(origins, directions)
        element = self.elements(hits)
        return self.arriving(hits, element, directions, origins=origins), hits.distance, element

    def arriving(
        self,
        hits: Hits,
        element: np.ndarray,
        directions: np.ndarray,
        dark_in_mirrors: np.ndarray | None = None,
        origins: np.ndarray | None = None,
    ) -> np.ndarray:
        """Radiance that comes back along rays whose hits and `elements` are known, (n, 3) float32.

        Parameters
        ----------
        dark_in_mirrors : (t,) float32, optional
            Triangles with a value above 0 count as dark where they are seen in a mirror.
        origins : (n, 3) float32, optional
            Where the rays start; without, what comes in by openings is looked up in the environment.
        """
        radiance = self._sent(hits, element, directions, origins)
        if self.mirrors:
            on_mirrors = np.flatnonzero((self.mirror_of.take(hits.triangle) >= 0) & (element >= 0))
            if len(on_mirrors):
                radiance[on_mirrors] = self._mirrored(
                    hits.part(on_mirrors), directions.take(on_mirrors, 0), dark_in_mirrors
                )
        return radiance

    def _sent(self, hits: Hits, element: np.ndarray, directions: np.ndarray, origins: np.ndarray | None) -> np.ndarray:
        """L_d at hits, the environment where rays escape; what is `one_sided` is dark from behind."""
        radiance = self.radiance.take(element, 0)  # indexing by arrays takes several times as long
        escaped = np.flatnonzero(element < 0)
        if len(escaped):
            start = None if origins is None else origins.take(escaped, 0)
            radiance[escaped] = self.outside(start, directions.take(escaped, 0))
        front = np.flatnonzero(self.one_sided.take(hits.triangle) & (element >= 0)) if self._dark_backs else ()
        if len(front):
            normal = self.normal.take(hits.triangle.take(front), 0)
            behind = np.einsum("ij,ij->i", directions.take(front, 0), normal) > 0
            radiance[front[behind]] = 0
        return radiance

    def onward(self, hits: Hits, directions: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Origins and directions of rays reflected by the mirrors that they hit, and the mirrors' F0, (n, 3) each."""
        a, b, c = (self.mesh.vertices.take(corner, 0) for corner in self.mesh.triangles.take(hits.triangle, 0).T)
        u, v = hits.u[:, None], hits.v[:, None]
        point = ((1 - u - v) * a + u * b + v * c).astype(np.float32)
        normal = self.normal.take(hits.triangle, 0)
        cosine = np.einsum("ij,ij->i", directions, normal)[:, None]
        f0 = np.stack([mirror.f0 for mirror in self.mirrors]).astype(np.float32)
        origins = self.scene.off_surface(point, -np.sign(cosine) * normal)
        return origins, directions - 2 * cosine * normal, f0.take(self.mirror_of.take(hits.triangle), 0)

    def _mirrored(self, hits: Hits, directions: np.ndarray, dark: np.ndarray | None) -> np.ndarray:
        """What a mirror that was hit shows; a second mirror shows its L_d."""
        origins, onward, f0 = self.onward(hits, directions)
        further = self.scene.intersect(origins, onward)
        element = self.elements(further)
        radiance = self._sent(further, element, onward, origins)
        if dark is not None:
            radiance[(dark[further.triangle] > 0) & (element >= 0)] = 0
        return radiance * f0
