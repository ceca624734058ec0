"""The sun: light from one small disc of the sky, whose shadows are followed exactly.

In a map of the sky it fills a texel or two, which rays find by chance; so it is taken from the map (`extract_sun`),
its part of E comes from shadow rays at every place (`sunlight`), and it goes back into the map that is written
(`insert_sun`). One that no frame saw is solved for (`sun_fit`).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..luminance import LUMINANCE
from ..scene.rays import RayScene
from ..scene.tangent_frame import tangent_frame
from .directions import shifted, sobol
from .environment import Environment
from .params import SKY

RADIUS = float(np.radians(0.27))
"""Of the sun's disc, as it is seen from the earth."""
EDGE = float(np.radians(0.3))
"""A shadow's edge is known no better than this: the direction that was solved for, the poses, the mesh."""
WIDE, RING = float(np.radians(2.5)), float(np.radians(7.0))
"""It and its glare fit into a disc of the first radius; from there to the second is the sky around it."""


@dataclass(frozen=True)
class Sun:
    """Attributes
    ----------
    direction : (3,) float32
        Unit, towards it.
    irradiance : (3,) float32
        On a surface that faces it, radiance * steradian, linear Rec.709.
    radius : float
        Of its disc, radians.
    seen : bool
        False: solved for from the light that it throws.
    edges : (float, float), optional
        Of one that was solved for: mean differences of log albedo between light and shade, without it and with it.
    """

    direction: np.ndarray
    irradiance: np.ndarray
    radius: float = RADIUS
    seen: bool = False
    edges: tuple[float, float] | None = None

    @property
    def note(self) -> str:
        """How it was found, one sentence."""
        if self.edges is None:
            return f"The frames see the sun: {self.where()}."
        before, after = self.edges
        return (
            f"A sun that no frame sees was solved from the patch of light that it throws: {self.where()} "
            f"(differences of log albedo between light and shade {before:.3f} to {after:.3f})."
        )

    def where(self) -> str:
        """Its place and strength in words."""
        x, y, z = (float(v) for v in self.direction)
        azimuth, elevation = np.degrees(np.arctan2(y, x)) % 360, np.degrees(np.arcsin(np.clip(z, -1, 1)))
        light = ", ".join(f"{v:.3g}" for v in self.irradiance)
        return f"azimuth {azimuth:.1f} (from +X towards +Y), elevation {elevation:.1f} degrees, irradiance {light}"


def around(direction: np.ndarray, disc: np.ndarray) -> np.ndarray:
    """Unit directions at offsets `disc` ((..., 2), radians) from one, (..., 3) float32."""
    right, up = tangent_frame(np.asarray(direction, np.float32)[None])
    directions = direction + disc[..., :1] * right[0] + disc[..., 1:] * up[0]
    return (directions / np.linalg.norm(directions, axis=-1, keepdims=True)).astype(np.float32)


def _disc(square: np.ndarray, radius: float) -> np.ndarray:
    """Points of the unit square, area kept in proportion, in a disc."""
    r, phi = radius * np.sqrt(square[..., 0]), 2 * np.pi * square[..., 1]
    return np.stack([r * np.cos(phi), r * np.sin(phi)], -1)


def shadow(
    scene: RayScene, sun: Sun, position: np.ndarray, normal: np.ndarray, edge: float, seed: int
) -> tuple[np.ndarray, np.ndarray]:
    """How much of the sun reaches places.

    Parameters
    ----------
    position, normal : (n, 3) float32
    edge : float
        Of a surface element, metres: E is its mean.

    Returns
    -------
    contribution : (n,) float32
        E at an irradiance of 1: the visible share times the cosine.
    error : (n,) float32
        Its standard error at a shadow's edge.
    """
    cosine = np.maximum(normal @ np.asarray(sun.direction, np.float32), 0)
    facing = np.flatnonzero(cosine > 0)
    visible = np.zeros(len(position), np.float32)
    if len(facing):
        count = len(facing)
        rng = np.random.default_rng([seed, 2])
        points = shifted(sobol(SKY.shadow_rays, seed, 4), min(64, count), rng)[rng.integers(0, min(64, count), count)]
        directions = around(sun.direction, _disc(points[..., :2], float(np.hypot(sun.radius, EDGE))))
        right, up = tangent_frame(normal[facing])
        offset = np.float32(edge) * (points[..., 2:] - np.float32(0.5))
        start = scene.off_surface(position[facing], normal[facing])[:, None]
        start = start + offset[..., :1] * right[:, None] + offset[..., 1:] * up[:, None]
        reach = np.full(count * SKY.shadow_rays, np.inf, np.float32)
        hidden = scene.occluded(start.reshape(-1, 3), directions.reshape(-1, 3), reach)
        visible[facing] = 1 - hidden.reshape(count, SKY.shadow_rays).mean(1)
    return cosine * visible, cosine * np.sqrt(visible * (1 - visible))


def sunlight(
    scene: RayScene, sun: Sun, position: np.ndarray, normal: np.ndarray, edge: float, seed: int = 0
) -> np.ndarray:
    """The sun's part of E in three channels, and the luminance of its error, (n, 4) float32; see `shadow`."""
    contribution, error = shadow(scene, sun, position, normal, edge, seed)
    light = np.float32(sun.irradiance)
    return np.concatenate([contribution[:, None] * light, (error * light.mean())[:, None]], 1).astype(np.float32)


def _solid_angle(height: int) -> np.ndarray:
    """Of a texel in each row of a map, (h, 1) float64."""
    edges = np.sin(np.arange(height + 1) / height * np.pi - np.pi / 2)
    return (np.diff(edges) * np.pi / height)[:, None]


def extract_sun(environment: Environment) -> tuple[Environment, Sun | None]:
    """The map without the sun that frames saw in it, and that sun.

    It is what lies within `WIDE` of the middle of the brightest seen texels, if it is more than `above` times over the
    sky around (the median from there to `RING`), nothing else in the map is, and it gives `least_share` of the light.
    A clipped sun is none that was seen: its light is solved for.
    """
    luminance = environment.radiance @ LUMINANCE
    seen = environment.measured
    if not seen.any():
        return environment, None
    directions, solid_angle = environment.directions.reshape(environment.radiance.shape), _solid_angle(len(luminance))
    radius = max(WIDE, 1.5 * np.pi / len(luminance))  # its own texel and those around it, where they are coarse
    peak = np.unravel_index(np.where(seen, luminance, -1).argmax(), luminance.shape)
    disc = (directions @ directions[peak] > np.cos(2 * radius)) & (luminance > luminance[peak] / 4)
    middle = (directions * (solid_angle * disc)[..., None]).sum((0, 1))
    angle = np.arccos(np.clip(directions @ (middle / np.linalg.norm(middle)), -1, 1))
    near = angle <= radius
    ring = seen & ~near & (angle < RING)
    surroundings = ring if ring.any() else seen & ~near
    if not surroundings.any():
        return environment, None
    sky = np.median(environment.radiance[surroundings], 0)
    level = SKY.above * max(float(sky @ LUMINANCE), 1e-12)
    bright = (luminance > level) & (environment.observations > 0)
    if not bright[near & seen].any() or (bright & ~near).any() or (bright & environment.clipped).any():
        return environment, None
    sun_texels = near & (luminance > 2 * float(sky @ LUMINANCE))
    flux = ((environment.radiance - sky) * solid_angle[..., None])[sun_texels].sum(0)
    # A quarter: the mean over all directions that a surface may face.
    mean_irradiance = float((luminance * solid_angle).sum() / 4)
    if float(flux @ LUMINANCE) / 4 < SKY.least_share * mean_irradiance:
        return environment, None
    middle = (directions * (luminance * solid_angle * sun_texels)[..., None]).sum((0, 1))
    direction = (middle / np.linalg.norm(middle)).astype(np.float32)
    dark = np.where(sun_texels[..., None], np.float32(sky), environment.radiance).astype(np.float32)
    return environment.refilled(dark), Sun(direction, np.maximum(flux, 0).astype(np.float32), RADIUS, True)


def insert_sun(environment: Environment, sun: Sun | None) -> np.ndarray:
    """Radiance of the map with the sun in it, (h, 2h, 3) float32; of at least `written_rows` where there is one.

    Points of its disc are shared out bilinearly between texel centres: who looks the map up bilinearly sees the sun at
    its place, and the irradiance is exact.
    """
    if sun is None:
        return environment.radiance
    times = max(-(-SKY.max_height // len(environment.radiance)), 1)
    radiance = environment.radiance.repeat(times, 0).repeat(times, 1).astype(np.float64)
    height, width = radiance.shape[:2]
    directions = around(sun.direction, _disc(sobol(256, 0), sun.radius)).astype(np.float64)
    column = (0.5 - np.arctan2(directions[:, 1], directions[:, 0]) / (2 * np.pi)) * width - 0.5
    row = np.clip((0.5 + np.arcsin(np.clip(directions[:, 2], -1, 1)) / np.pi) * height - 0.5, 0, height - 1)
    left, low = np.floor(column), np.minimum(np.floor(row), height - 2)
    solid_angle = _solid_angle(height)
    for a in (0, 1):
        for b in (0, 1):
            share = np.abs(1 - a - (row - low)) * np.abs(1 - b - (column - left)) / len(directions)
            texel = (low + a).astype(int), (left + b).astype(int) % width
            for c in range(3):
                np.add.at(radiance[..., c], texel, share * sun.irradiance[c] / solid_angle[texel[0], 0])
    return radiance.astype(np.float32)
