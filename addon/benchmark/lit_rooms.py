"""Rooms with light in them for the shading benchmark: one lamp, a window, constant radiance, many lamps."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..core.kinds import Workload
from ..core.light.environment import Environment
from ..core.light.field import LightField
from ..core.light.over_surface import finest_spacing, irradiance
from ..core.scene.atlas import Atlas
from ..core.scene.rays import RayScene
from .synthetic import box, tiled

SIZE = np.array([5.0, 4.0, 2.6])
BOXES: Workload[int] = 10
BOUNCES: Workload[int] = 3
LAMP_COUNT: Workload[int] = 24
WINDOW: Workload[tuple[tuple[float, float], tuple[float, float]]] = ((0.3, 0.65), (0.35, 0.8))
"""Shares of its wall's edges."""


@dataclass(frozen=True)
class LitRoom:
    """A room and its light field.

    Attributes
    ----------
    name : str
    field : LightField
        With the L_d of a few bounces.
    lamps : (k,) int
        Objects that give light.
    exact : float or None
        E everywhere, where that is known without a reference.
    """

    name: str
    field: LightField
    lamps: np.ndarray
    exact: float | None = None

    @property
    def atlas(self) -> Atlas:
        return self.field.atlas


def _furnished(rng: np.random.Generator) -> tuple[list[np.ndarray], list[np.ndarray]]:
    """The room's six sides and boxes on its floor: quads and their objects."""
    quads, ids = [box(np.zeros(3), SIZE, inward=True)], [np.arange(6)]
    for i in range(BOXES):
        low = np.append(rng.uniform(0.05, 0.8, 2) * SIZE[:2], 0.0)
        sides = box(low, low + rng.uniform(0.2, 0.9, 3), inward=False)
        sides = sides[~((sides[:, 0, 2] == 0) & (sides[:, 1:, 2] == 0).all(1))]  # it stands on the floor
        quads.append(sides)
        ids.append(np.full(len(sides), 6 + i))
    return quads, ids


def _facing_down(centre: np.ndarray, edge: float) -> np.ndarray:
    """A square lamp that looks down, as a quad: (1, 3, 3)."""
    corner = centre - np.array([edge / 2, edge / 2, 0])
    return np.array([[corner, (0, edge, 0), (edge, 0, 0)]])


def _opened(quad: np.ndarray) -> np.ndarray:
    """What a wall leaves around its window: (8, 3, 3)."""
    (u0, u1), (v0, v1) = WINDOW
    us, vs = (0, u0, u1, 1), (0, v0, v1, 1)
    corner, edge_u, edge_v = quad
    parts = []
    for i in range(3):
        for j in range(3):
            if (i, j) != (1, 1):
                at = corner + us[i] * edge_u + vs[j] * edge_v
                parts.append((at, (us[i + 1] - us[i]) * edge_u, (vs[j + 1] - vs[j]) * edge_v))
    return np.array(parts)


def _sky() -> Environment:
    """Brighter above than below, a bright patch to one side."""
    height = 64
    v = (np.arange(height) + 0.5) / height
    radiance = np.where(v > 0.5, 4.0, 0.8)[:, None, None] * np.ones((1, 2 * height, 3))
    radiance[40:50, 56:72] *= 5
    return Environment(radiance.astype(np.float32), np.ones((height, 2 * height), np.int32))


def make_room(name: str, elements: int, seed: int, threads: int = 0) -> LitRoom:
    """One of `ROOMS` with about so many surface elements."""
    quads, ids = _furnished(np.random.default_rng(seed))
    rng = np.random.default_rng([seed, 1])
    first = 6 + BOXES
    sky, emitted = Environment.dark(), {}
    if name == "lamp":
        quads.append(_facing_down(SIZE * (0.45, 0.55, 1) - (0, 0, 0.02), 0.5))
        ids.append(np.array([first]))
        emitted = {first: 40.0}
    elif name == "many lamps":
        for i in range(LAMP_COUNT):
            quads.append(_facing_down(np.append(rng.uniform(0.1, 0.9, 2) * SIZE[:2], 2.55), 0.08))
            ids.append(np.array([first + i]))
            emitted[first + i] = float(rng.uniform(20, 200))
    elif name == "window":
        sides = quads[0]
        wall = int(
            np.argmin(
                [abs(np.cross(q[1], q[2]) / np.linalg.norm(np.cross(q[1], q[2])) - (1, 0, 0)).sum() for q in sides]
            )
        )
        quads[0] = np.concatenate([np.delete(sides, wall, 0), _opened(sides[wall])])
        ids[0] = np.concatenate([np.delete(np.arange(6), wall), np.full(8, wall)])
        sky = _sky()
    mesh, atlas = tiled(np.concatenate(quads), np.concatenate(ids), elements)
    scene = RayScene(mesh.vertices, mesh.triangles)
    if name == "furnace":
        ones = np.ones((len(atlas), 3), np.float32)
        return LitRoom(name, LightField(mesh, atlas, scene, ones, sky), np.zeros(0, int), np.pi)
    own = np.zeros((len(atlas), 3), np.float32)
    for object_id, radiance in emitted.items():
        own[atlas.object_id == object_id] = radiance * np.float32([1, 0.9, 0.75])
    albedo = rng.uniform(0.1, 0.8, (int(mesh.object_id.max()) + 1, 3)).astype(np.float32)[atlas.object_id]
    albedo[own.any(1)] = 0
    radiance = own
    finest = finest_spacing(atlas)
    for bounce in range(BOUNCES):
        field = LightField(mesh, atlas, scene, radiance, sky, list(emitted))
        E, _, _, _ = irradiance(
            field, np.arange(len(atlas)), rays=64, emitter_rays=32, portal_rays=32, interpolate=True,
            finest=finest, threads=threads, seed=seed + bounce,
        )  # fmt: skip
        radiance = own + albedo * E / np.float32(np.pi)
    return LitRoom(name, LightField(mesh, atlas, scene, radiance, sky, list(emitted)), np.array(list(emitted)))


ROOMS: tuple[str, ...] = ("lamp", "window", "furnace", "many lamps")
