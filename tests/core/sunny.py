"""A box room with a window under sun and sky: its light by patches, the sun by shadow lines through the window."""

from __future__ import annotations

import numpy as np

from tests.core.rooms import Quad, Room, around, box_sides, cut, make_room, polygon_irradiance, split

SIZE = (2.4, 2.0, 1.8)
WINDOW = ((0.3, 0.75), (0.25, 0.7))
"""Where in the wall at x = X it lies, as shares of its height and its width."""
TOWARDS = np.array([0.72, -0.3, 0.62]) / np.linalg.norm([0.72, -0.3, 0.62])
SUN, SKY = np.array([14.0, 12.0, 9.0]), np.array([1.6, 2.0, 2.6])
RADIUS = np.radians(0.27)
ALBEDO = {0: (0.5, 0.35, 0.2), 1: 0.8, 2: (0.6, 0.55, 0.5), 3: 0.7, 4: (0.3, 0.5, 0.35), 5: (0.5, 0.5, 0.6)}
PARTS = 8
"""Patches along an edge of more than a metre."""


def sides(size=SIZE) -> tuple[list[Quad], Quad]:
    """The room's quads, and the window."""
    quads = box_sides(size)
    wall = quads.pop(3)
    return [*quads, *around(wall, *WINDOW)], cut(wall, *WINDOW)


def sunny_room(texel: float = 0.05) -> Room:
    return make_room(sides()[0], texel)


def in_sun(points: np.ndarray, normals: np.ndarray, towards: np.ndarray, window: Quad) -> np.ndarray:
    """Cosine of the sun where its light comes in by the window, else 0: (n,)."""
    facing = np.cross(window.edge_u, window.edge_v)
    way = ((window.corner - points) @ facing) / (towards @ facing)
    at = points + way[:, None] * towards - window.corner
    u, v = at @ window.edge_u / (window.edge_u @ window.edge_u), at @ window.edge_v / (window.edge_v @ window.edge_v)
    inside = (way > 0) & (u > 0) & (u < 1) & (v > 0) & (v < 1)
    return inside * np.maximum(normals @ towards, 0)


def sun_on(room: Room, towards=TOWARDS, radius: float = RADIUS, count: int = 24, seed: int = 0) -> np.ndarray:
    """E of each element from a sun of irradiance 1, mean over the element and the disc, (n,)."""
    window, atlas = sides()[1], room.atlas
    rng = np.random.default_rng(seed)
    normal = atlas.normal.astype(float)
    first = np.cross(normal, np.eye(3)[np.abs(normal).argmin(1)])
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    second = np.cross(normal, first)
    total = np.zeros(len(atlas))
    for _ in range(count):
        a, b = (np.sqrt(atlas.area) * (rng.random(len(atlas)) - 0.5) for _ in "ab")
        r, phi = radius * np.sqrt(rng.random()), 2 * np.pi * rng.random()
        side = np.cross(towards, (0, 0, 1))
        side /= np.linalg.norm(side)
        way = towards + r * np.cos(phi) * side + r * np.sin(phi) * np.cross(side, towards)
        total += in_sun(atlas.position + a[:, None] * first + b[:, None] * second, normal, way, window)
    return total / count


def light(room: Room, albedo=ALBEDO, sun=SUN, sky=SKY, towards=TOWARDS, extra=None, radius=RADIUS) -> np.ndarray:
    """Radiance of every element, (n, 3). `extra`: callable(points, normals) -> (n, 3), E that comes from nowhere."""
    walls, window = sides()
    patches = [p for q in walls for p in (split(q, PARTS) if np.linalg.norm(q.edge_u) > 1 else split(q, 4))]
    ids = np.array([p.object_id for p in patches])
    middle = np.array([p.corner + (p.edge_u + p.edge_v) / 2 for p in patches])
    normal = np.array([np.cross(p.edge_u, p.edge_v) for p in patches])
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    rho = np.stack([np.broadcast_to(albedo[i], 3) for i in ids])
    sky_E = polygon_irradiance(middle, normal, split(window, 4))
    inner = np.linspace(0.1, 0.9, 5)
    sun_E = np.mean([
        in_sun(np.array([p.corner + a * p.edge_u + b * p.edge_v for p in patches]), normal, towards, window)
        for a in inner for b in inner
    ], 0)  # fmt: skip
    apart = np.abs((window.corner - middle) @ np.array([1.0, 0, 0])) > 1e-9  # not the window's own wall
    first = np.where(apart, sky_E.sum(1), 0)[:, None] * sky + sun_E[:, None] * sun
    if extra is not None:
        first = first + extra(middle, normal)
    apart = np.abs(((middle[None] - middle[:, None]) * normal[:, None]).sum(-1)) > 1e-9
    form = polygon_irradiance(middle, normal, patches) * apart / np.pi
    sent = np.stack([
        np.linalg.solve(np.eye(len(ids)) - rho[:, c, None] * form, rho[:, c] * first[:, c] / np.pi) for c in range(3)
    ], 1)  # fmt: skip
    atlas = room.atlas
    position, facing = atlas.position.astype(float), atlas.normal.astype(float)
    above = np.abs((middle @ facing.T - (position * facing).sum(1)).T) > 1e-4
    E = (polygon_irradiance(position, facing, patches) * above) @ sent
    of_sky = polygon_irradiance(position, facing, split(window, 4)).sum(1)
    E += np.where(np.abs(position[:, 0] - window.corner[0]) > 1e-4, of_sky, 0)[:, None] * sky
    E += sun_on(room, towards, radius)[:, None] * sun
    if extra is not None:
        E = E + extra(position, facing)
    return (room.by_object(albedo) * E / np.pi).astype(np.float32)
