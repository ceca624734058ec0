"""A box with one lamp whose reflections are summed up by brute force, sharing no rays with the code under test."""

from __future__ import annotations

from functools import cached_property

import numpy as np

from addon.core.fit.lobe_fit import Problem
from addon.core.light.emitters import bright_triangles
from addon.core.light.lobes import reflected_light
from tests.core.rooms import lit_box, make_room, polygon_irradiance

SIZE = np.array([4.0, 3.0, 2.5])
LAMP = (1.6, 2.4), (1.2, 1.8)
WALLS = np.array([[0.3] * 3, [0.6] * 3, [0.8, 0.3, 0.2], [0.3, 0.7, 0.3], [0.5] * 3, [0.3, 0.4, 0.6]])
GLOW = np.array([30.0, 28.0, 25.0])


def fresnel_rise(cosine):
    """How Fresnel's reflectance of glass rises with the angle, 0 to 1: by the angles of Snell's law."""
    outside = np.arccos(np.clip(cosine, 0, 1))
    within = np.arcsin(np.sin(outside) / 1.5)
    across = (np.cos(outside) - 1.5 * np.cos(within)) / (np.cos(outside) + 1.5 * np.cos(within))
    along = (np.cos(within) - 1.5 * np.cos(outside)) / (np.cos(within) + 1.5 * np.cos(outside))
    return ((across**2 + along**2) / 2 - 0.04) / 0.96


class Box:
    """The floor is looked at from many places; walls of plain radiance, a lamp in the ceiling (object 6)."""

    def __init__(self, walls=WALLS, glow=GLOW):
        self.walls, self.glow = np.asarray(walls, float), np.asarray(glow, float)
        self.room = make_room(lit_box(tuple(SIZE)), 0.1)

    @cached_property
    def field(self):
        values = {i: self.walls[i] for i in range(6)} | {6: self.glow}
        return self.room.field(self.room.by_object(values))

    @cached_property
    def bright(self):
        return bright_triangles(self.field)

    @cached_property
    def irradiance(self) -> np.ndarray:
        """E of each element from walls and lamp, not from the floor, (n, 3)."""
        atlas = self.room.atlas
        E = np.zeros((len(atlas), 3))
        for object_id, radiance in ({i: self.walls[i] for i in range(1, 6)} | {6: self.glow}).items():
            quads = [quad for quad in self.room.quads if quad.object_id == object_id]
            one = polygon_irradiance(atlas.position.astype(float), atlas.normal.astype(float), quads).sum(1)
            E += one[:, None] * radiance
        return E

    def arriving(self, origin, w) -> np.ndarray:
        """Radiance along rays from points within the box, (n, 3)."""
        with np.errstate(divide="ignore", invalid="ignore"):
            far = np.where(w > 0, (SIZE - origin) / w, np.where(w < 0, -origin / w, np.inf))
        axis = far.argmin(1)
        distance = far[np.arange(len(w)), axis]
        where = origin + distance[:, None] * w
        positive = w[np.arange(len(w)), axis] > 0
        side = np.array([[2, 3], [4, 5], [0, 1]])[axis, positive.astype(int)]
        L = self.walls[side].copy()
        inside = (side == 1) & ((where[:, :2] > [r[0] for r in LAMP]) & (where[:, :2] < [r[1] for r in LAMP])).all(1)
        L[inside] = self.glow
        return L

    def views(self, elements: int, views: int, seed: int = 0):
        """Floor elements, each with views from about head height: element (m,), direction (m, 3), frame (m,)."""
        rng = np.random.default_rng(seed)
        atlas = self.room.atlas
        floor = np.flatnonzero(atlas.object_id == 0)
        element = np.repeat(rng.choice(floor, elements, replace=False), views)
        eyes = rng.uniform([0.4, 0.4, 1.0], [3.6, 2.6, 2.2], (views, 3))
        frame = np.tile(np.arange(views), elements)
        way = eyes[frame] - atlas.position[element]
        return element, (way / np.linalg.norm(way, axis=1, keepdims=True)).astype(np.float32), frame

    def lobe(self, element, direction, phi: float, across: int = 40, rise=fresnel_rise):
        """A and B of elements, (m, 3) each; as `lobe_at`."""
        return self.lobe_at(self.room.atlas.position[element].astype(float), direction.astype(float), phi, across, rise)

    def lobe_at(self, position, direction, phi: float, across: int, rise=fresnel_rise):
        """A and B at points, (m, 3) each: the normals' distribution cut into across * across cells of equal weight."""
        u, v = np.meshgrid(*[(np.arange(across) + 0.5) / across] * 2, indexing="ij")
        angle, turn = np.arctan(phi * np.sqrt(u.ravel() / (1 - u.ravel()))), 2 * np.pi * v.ravel()
        h = np.stack([np.sin(angle) * np.cos(turn), np.sin(angle) * np.sin(turn), np.cos(angle)], -1)
        A, B = np.zeros((len(position), 3)), np.zeros((len(position), 3))

        def masking(x):
            return 2 / (1 + np.sqrt(1 + phi**2 * (1 / x**2 - 1)))

        for start in range(0, len(position), 200):
            part = slice(start, start + 200)
            c = direction[part] @ h.T
            w = 2 * c[..., None] * h - direction[part, None]
            up = (w[..., 2] > 1e-4) & (c > 0)
            # f cos dw = G2 F / (4 n.w n.wo) D n.w 4 (wo.h) dh, and D (n.h) dh is one cell
            n_w, n_wo = np.maximum(w[..., 2], 1e-4), direction[part, 2:]
            share = np.where(up, masking(n_w) * masking(n_wo) * c / (n_wo * h[:, 2]), 0) / across**2
            L = self.arriving(np.repeat(position[part], len(h), 0), w.reshape(-1, 3)).reshape(*c.shape, 3)
            s = rise(c)
            A[part], B[part] = (np.einsum("mk,mkc->mc", share * x, L) for x in (1 - s, s))
        return A, B

    def problem(self, element, direction, phi, psi, diffuse, noise=0.02, rays=256, seed=0) -> Problem:
        """What frames see of a floor with this lobe over `diffuse` ((m, 3)); A and B by the code under test."""
        m = len(element)
        seen = np.array(diffuse, float)
        if phi is not None:
            A, B = self.lobe(element, direction, phi)
            seen = seen + np.asarray(psi) * A + B
        seen = seen * np.exp(np.random.default_rng(seed).normal(0, noise, (m, 3)))
        light = reflected_light(self.field, self.bright, element, direction, rays=rays, threads=2, seed=seed)
        return Problem(element, seen, light, direction[:, 2])
