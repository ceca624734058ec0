"""Flat mirrors among the objects: found before the shading, as light is followed over them there.

A mirror shows in each view what lies in the mirrored direction: over all its observations, radiance over what the light
field has there is one number, F0. Anything else shows its own light:

| flat object | deviation from the mirrored room | from its own mean | correlation |
|---|---|---|---|
| four mirrors and panes, two rooms | .04 to .12 | .12 to .69 | .87 to .96 |
| one of them on a mesh off by 5 mm, poses by 0.2 degrees | .07 | .60 | .84 |
| 25 other flat objects, six rooms | .33 to 1.4 | .002 to .10 | at most .40 |
"""

from __future__ import annotations

import numpy as np
from scipy.optimize import minimize

from ..capture.model import Instance
from ..shading.field import FLAT, LightField
from ..shading.lamps import Lamp
from ..shading.mirrors import Mirror
from .samples import Samples

FLAT_SHARE = 0.8
"""Share of an object's surface that must lie in one plane."""
PLANE_SHARE = 0.02
"""How far from that plane, as a share of the object's size."""
ELEMENTS = 400
LEAST = 100
"""Observations whose mirrored direction shows something that frames saw; with fewer nothing is said."""
TOGETHER = 0.6
"""Least correlation, within the elements, of what they show and of what a mirror would."""
LEAST_F0 = 0.2
"""A black pane shows the room mirrored as well, as a dielectric: by 0.04 to 0.1 as it is looked at."""
DARK = 1e-5
"""What nobody saw is dark in the field so far."""
TILT, TILTS = 0.01, 40
"""Radians by which the plane is turned first to fit what is mirrored, and how often: a scan's planes are off."""


def plane_of(field: LightField, object_id: int) -> tuple[np.ndarray, np.ndarray] | None:
    """Point and normal ((3,) float32 each) of the plane that most of an object lies in; None if it is not flat."""
    atlas = field.atlas
    own = np.flatnonzero(atlas.object_id == object_id)
    if not len(own):
        return None
    position, normal, area = atlas.position[own], atlas.normal[own], atlas.area[own]
    # The plane of the largest triangle: a frame or bevel around the glass must not tilt it.
    triangle, index = np.unique(atlas.triangle[own], return_inverse=True)
    largest = np.argmax(np.bincount(index, area))
    at = np.flatnonzero(index == largest)
    n, point = normal[at[0]], np.median(position[at], 0)
    size = float(np.linalg.norm(np.ptp(position, axis=0)))
    within = (normal @ n > FLAT) & (np.abs((position - point) @ n) < PLANE_SHARE * size)
    if area[within].sum() < FLAT_SHARE * area.sum():
        return None
    return point.astype(np.float32), n.astype(np.float32)


def find_mirrors(
    field: LightField, lamps: tuple[Lamp, ...], samples: Samples, instances: tuple[Instance, ...], seed: int = 0
) -> tuple[Mirror, ...]:
    """Flat objects whose frames show the room mirrored."""
    rng = np.random.default_rng(seed)
    owner = field.atlas.object_id[samples.element]
    glowing = {lamp.object_id for lamp in lamps}
    mirrors = []
    for instance in instances:
        plane = None if instance.object_id in glowing else plane_of(field, instance.object_id)
        if plane is None:
            continue
        point, normal = plane
        own = np.flatnonzero((owner == instance.object_id) & ~samples.saturated)
        own = own[field.atlas.normal[samples.element[own]] @ normal > FLAT]
        elements = np.unique(samples.element[own])
        if len(elements) > ELEMENTS:
            own = own[np.isin(samples.element[own], rng.choice(elements, ELEMENTS, replace=False))]
        found = _mirrored(field, samples, own, normal)
        if found is not None:
            mirrors.append(Mirror(instance.object_id, point, *found))
    return tuple(mirrors)


def _mirrored(
    field: LightField, samples: Samples, index: np.ndarray, normal: np.ndarray
) -> tuple[np.ndarray, np.ndarray] | None:
    """Normal and F0 ((3,) float32 each) of the mirror that these observations see, None if they see none."""
    element, direction = samples.element[index], samples.direction[index]
    position, facing = field.atlas.position[element], field.atlas.normal[element]
    origin = field.scene.off_surface(position, facing)

    def compare(normals: np.ndarray) -> tuple[float, float, float, np.ndarray]:
        """Deviation from the mirrored room, from the elements' own means, their correlation, and F0."""
        along = 2 * np.einsum("ij,ij->i", direction, normals)[:, None] * normals - direction
        shown = field.along(origin, along.astype(np.float32))[0]
        known = shown.mean(1) > DARK
        if known.sum() < LEAST:
            return np.inf, 0.0, 0.0, np.zeros(3)
        seen, shown = samples.radiance[index[known]], shown[known]
        a, b = (np.log(np.maximum(x.mean(1), DARK)) for x in (seen, shown))
        _, group, count = np.unique(element[known], return_inverse=True, return_counts=True)
        own_a, own_b = (x - (np.bincount(group, x) / count)[group] for x in (a, b))
        together = float(np.mean(own_a * own_b) / max(own_a.std() * own_b.std(), 1e-12))
        off = float(np.median(np.abs(a - b - np.median(a - b))))
        return off, float(np.median(np.abs(own_a))), together, np.median(seen / np.maximum(shown, DARK), 0)

    off, own, together, f0 = compare(facing)
    if not (off < own and together > TOGETHER and f0.mean() > LEAST_F0):
        return None
    across = np.cross(normal, np.eye(3)[np.argmin(np.abs(normal))])
    sides = np.stack([across, np.cross(normal, across)]) / np.linalg.norm(across)

    def turned(by: np.ndarray) -> np.ndarray:
        way = normal + by @ sides
        return np.broadcast_to(np.float32(way / np.linalg.norm(way)), facing.shape)

    first = np.array([[0, 0], [TILT, 0], [0, TILT]])
    how = {"initial_simplex": first, "maxfev": TILTS, "xatol": 3e-4, "fatol": 1e-3}
    best = minimize(lambda by: -compare(turned(by))[2], first[0], method="Nelder-Mead", options=how).x
    return turned(best)[0].copy(), np.clip(f0, 0.02, 1).astype(np.float32)
