"""Flat mirrors among the objects: found before the shading, as light is followed over them there."""

from __future__ import annotations

import numpy as np

from ..capture.model import Instance
from ..lit_diffuse.accumulate import LitDiffuse
from ..material import METAL
from ..shading.field import FLAT, LightField
from ..shading.lamps import Lamp
from ..shading.mirrors import Mirror
from .models import choose_model, metal_f0
from .problems import Problems
from .samples import Samples

MIRROR_PHI = 0.03
"""Narrower lobes (GGX alpha) count as a mirror."""
FLAT_SHARE = 0.8
"""Share of an object's surface that must lie in one plane."""
PLANE_SHARE = 0.02
"""How far from that plane, as a share of the object's size."""
ELEMENTS, VIEWS, RAYS = 200, 12, 64


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
    field: LightField,
    lamps: tuple[Lamp, ...],
    lit_diffuse: LitDiffuse,
    samples: Samples,
    instances: tuple[Instance, ...],
    threads: int = 0,
    seed: int = 0,
) -> tuple[Mirror, ...]:
    """Flat objects whose frames show them to be metal with a lobe narrower than `MIRROR_PHI`."""
    maker = Problems(field, lit_diffuse, samples, threads, seed)
    mirrors = []
    glowing = {lamp.object_id for lamp in lamps}
    for instance in instances:
        plane = None if instance.object_id in glowing else plane_of(field, instance.object_id)
        if plane is None:
            continue
        index = maker.pick(instance.object_id, ELEMENTS, VIEWS)
        if not len(index):
            continue
        problem = maker.problem(index, RAYS)
        choice = choose_model(problem)
        if choice.model == METAL and choice.fit.phi <= MIRROR_PHI:
            f0 = metal_f0(problem, choice.fit.phi)
            mirrors.append(Mirror(instance.object_id, *plane, f0.astype(np.float32)))
    return tuple(mirrors)
