"""Rooms like the demo's, but of other colours, gloss and light, rendered by Cycles; and their albedo at every texel."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from addon.bridge.demo.render import render_frames
from addon.bridge.demo.room import SIZE, Paint, RoomObject, grid, look_at, room, tour, write_all_but_frames
from addon.core.brdf.compensation import layer_reflectance
from addon.core.progress import Progress
from addon.core.scene.atlas import Atlas


@dataclass(frozen=True)
class KnownRoom:
    """A room whose paints are known, and a walk through it, (frames, 4, 4)."""

    things: tuple[RoomObject, ...]
    poses: np.ndarray

    def render(self, folder: Path, size: tuple[int, int], samples: int) -> Path:
        """Write the capture `folder`; its frames have `size` pixels (width, height)."""
        write_all_but_frames(folder, self.things, self.poses, size)
        render_frames(folder, self.things, self.poses, size, samples, Progress())
        return folder

    def albedo(self, atlas: Atlas) -> np.ndarray:
        """True diffuse albedo of each element, averaged over its texel, (n, 3) float32; NaN on lamps.

        A glossy thing's is what its specular layer leaves of its base colour, as Principled has it.
        """
        result = np.full((len(atlas), 3), np.nan, np.float32)
        for thing in self.things:
            own = np.flatnonzero(atlas.object_id == thing.object_id)
            gloss = thing.paints[0]
            if len(own) and gloss.emission is None:
                left = 1 - layer_reflectance(gloss.f0, gloss.roughness**2) if gloss.f0 else 1.0
                result[own] = left * base_colour(thing, atlas, own)
        return result


def base_colour(thing: RoomObject, atlas: Atlas, own: np.ndarray) -> np.ndarray:
    """Mean base colour over the texels of a thing's elements `own`, (m, 3)."""
    if len(thing.paints) == 1 and thing.paints[0].albedo.ndim == 1:
        return np.broadcast_to(thing.paints[0].albedo, (len(own), 3))
    n = atlas.normal[own]
    across = np.cross(n, np.where(np.abs(n[:, 2:]) > 0.9, (1.0, 0, 0), (0, 0, 1.0)))
    across /= np.linalg.norm(across, axis=1, keepdims=True)
    up, edge = np.cross(n, across), np.sqrt(atlas.area[own])[:, None]
    shifts = [(a, b) for a in (-1 / 3, 0, 1 / 3) for b in (-1 / 3, 0, 1 / 3)]
    return np.mean([_colour_at(thing, atlas.position[own] + edge * (a * across + b * up)) for a, b in shifts], 0)


def _colour_at(thing: RoomObject, points: np.ndarray) -> np.ndarray:
    """Base colour of a thing's nearest quad at points (m, 3)."""
    best, quad = np.full(len(points), np.inf), np.zeros(len(points), int)
    place = np.zeros((len(points), 2))
    for k, corners in enumerate(thing.quads):
        edges = np.stack([corners[1] - corners[0], corners[3] - corners[0]], 1)
        at = (points - corners[0]) @ np.linalg.pinv(edges).T
        inside = np.clip(at, 0, 1)
        off = np.linalg.norm(points - corners[0] - inside @ edges.T, axis=1)
        nearer = off < best - 1e-6
        best[nearer], quad[nearer], place[nearer] = off[nearer], k, inside[nearer]
    a, b = place[:, :1], place[:, 1:]
    corner = thing.uv[quad]
    weights = (1 - a) * (1 - b), a * (1 - b), a * b, (1 - a) * b
    uv = sum(weight * corner[:, k] for k, weight in enumerate(weights))
    return thing.colours(thing.slot[quad], uv)


def _repainted(
    things: tuple[RoomObject, ...], seed: int, low: float, high: float, glossy: dict[str, tuple[float, float]]
):
    """The same things with each plain colour drawn anew between `low` and `high`; `glossy`: roughness and F0."""
    rng = np.random.default_rng(seed)
    result = []
    for thing in things:
        roughness, f0 = glossy.get(thing.class_name, (1.0, 0.0))
        paints = []
        for paint in thing.paints:
            if paint.emission is None:
                tint = rng.uniform(0.7, 1.0, 3) * np.exp(rng.uniform(np.log(low), np.log(high)))
                albedo = paint.albedo if paint.albedo.ndim > 1 else tint.astype(np.float32)
                paint = Paint(albedo, roughness, f0)
            paints.append(paint)
        result.append(replace(thing, paints=tuple(paints)))
    return tuple(result)


def _glowing(
    things: tuple[RoomObject, ...], radiance: dict[str, tuple[float, float, float] | None]
) -> tuple[RoomObject, ...]:
    """The same with other lamps; None takes one away."""
    result = []
    for thing in things:
        if thing.class_name in radiance:
            if radiance[thing.class_name] is None:
                continue
            thing = replace(thing, paints=(replace(thing.paints[0], emission=radiance[thing.class_name]),))
        result.append(thing)
    return tuple(result)


def _with_window(things: tuple[RoomObject, ...]) -> tuple[RoomObject, ...]:
    """The papered wall gets an opening, with a bright panel outside."""
    x, y, z = SIZE
    low, high, sill, top = 2.2, 3.6, 0.9, 2.1
    pieces = [(0, low, 0, z), (high, x, 0, z), (low, high, 0, sill), (low, high, top, z)]
    parts = [grid((x - a, y, c), (a - b, 0, 0), (0, 0, d - c), 6, 6) for a, b, c, d in pieces]
    quads = np.concatenate([part[0] for part in parts])
    uv = np.stack([(x - quads[..., 0]) / x, quads[..., 2] / z], -1)
    panel = grid((x - low + 0.4, y + 0.3, sill - 0.4), (low - high - 0.8, 0, 0), (0, 0, top - sill + 0.8), 2, 2)
    glow = Paint(np.zeros(3, np.float32), emission=(5.0, 6.0, 7.5))
    wall = next(thing for thing in things if thing.class_name == "papered wall")
    cut = replace(wall, quads=quads, uv=uv, slot=np.zeros(len(quads), int))
    outside = RoomObject(max(thing.object_id for thing in things) + 1, "panel", *panel, np.zeros(4, int), (glow,))
    return tuple(cut if thing is wall else thing for thing in things) + (outside,)


def _level_tour(frames: int) -> np.ndarray:
    """A walk that never looks up: what hangs at the ceiling stays unseen."""
    t = 2 * np.pi * np.arange(frames) / frames
    eye = np.stack([2.2 + 1.2 * np.cos(t), 1.8 + 0.8 * np.sin(t), 1.5 + 0.1 * np.sin(3 * t)], -1)
    gaze = t + np.pi + 0.8 * np.sin(2 * t)
    target = eye + np.stack([np.cos(gaze), np.sin(gaze), -0.45 + 0.2 * np.sin(5 * t)], -1)
    return np.stack([look_at(a, b) for a, b in zip(eye, target)])


def known_rooms(frames: int) -> dict[str, KnownRoom]:
    """Rooms by name, each with a walk of so many frames."""
    demo, walk = room(), tour(frames)
    gloss = {"table": (0.3, 0.04), "ball": (0.3, 0.04), "cabinet": (0.45, 0.06)}
    dark = _repainted(demo, 3, 0.03, 0.4, gloss | {"sofa": (0.5, 0.04)})
    light = _repainted(demo, 8, 0.3, 0.85, {"floor": (0.4, 0.04), "ball": (0.35, 0.05), "door": (0.5, 0.04)})
    return {
        "demo": KnownRoom(demo, walk),
        "dark, one small lamp": KnownRoom(_glowing(dark, {"ceiling lamp": None, "lamp shade": (60, 50, 38)}), walk),
        "light, window": KnownRoom(_with_window(_glowing(light, {"ceiling lamp": None})), walk),
        "lamp unseen": KnownRoom(_repainted(demo, 21, 0.1, 0.7, gloss), _level_tour(frames)),
    }
