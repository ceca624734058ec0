"""Flat mirrors among the objects: found before the shading, as light is followed over them there.

A mirror shows in each view what lies in the mirrored direction: over all its observations, radiance over what the light
field has there is one number, F0. Anything else shows its own light:

| flat object | deviation from the mirrored room | from its own mean | correlation |
|---|---|---|---|
| four mirrors and panes, two rooms | .04 to .12 | .12 to .69 | .87 to .96 |
| one of them on a mesh off by 5 mm, poses by 0.2 degrees | .07 | .60 | .84 |
| 25 other flat objects, six rooms | .33 to 1.4 | .002 to .10 | at most .40 |
"""

from collections.abc import Iterator

import numpy as np
from scipy.optimize import minimize

from ...groups import by_number
from ...light.field import FLAT, LightField
from ...light.lamps import Lamp
from ...light.mirrors import Mirror
from ...parallel import ordered_map
from ...scene.model import Instance
from ...scene.patches import MIRROR
from ...scene.samples import Samples
from ...significance import LEVELS
from .mirrored import Views, tangents_of, turned
from .params import MIRRORS


def plane_of(field: LightField, object_id: int) -> tuple[np.ndarray, np.ndarray] | None:
    """Point and normal ((3,) float32 each) of the plane that most of an object lies in; None if it is not flat."""
    atlas = field.atlas
    elements = atlas.elements_of(object_id)
    if not len(elements):
        return None
    position, normal, area = atlas.position[elements], atlas.normal[elements], atlas.area[elements]
    # The plane of the largest triangle: a frame or bevel around the glass must not tilt it.
    triangle, index = np.unique(atlas.triangle[elements], return_inverse=True)
    largest = np.argmax(np.bincount(index, area))
    at = np.flatnonzero(index == largest)
    n, point = normal[at[0]], np.median(position[at], 0)
    size = float(np.linalg.norm(np.ptp(position, axis=0)))
    within = (normal @ n > FLAT) & (np.abs((position - point) @ n) < MIRRORS.plane_share * size)
    if area[within].sum() < MIRRORS.flat_share * area.sum():
        return None
    return point.astype(np.float32), n.astype(np.float32)


def find_mirrors(
    field: LightField, lamps: tuple[Lamp, ...], samples: Samples, instances: tuple[Instance, ...], seed: int = 0
) -> tuple[Mirror, ...]:
    """Flat objects in which frames show the mirrored room."""
    rng = np.random.default_rng(seed)
    clear = np.flatnonzero(~samples.saturated)
    observations_of = by_number(field.atlas.object_id[samples.element[clear]])
    glowing = {lamp.object_id for lamp in lamps}

    def flat_objects() -> Iterator[tuple[Instance, np.ndarray, np.ndarray, np.ndarray]]:
        for instance in instances:
            plane = None if instance.object_id in glowing else plane_of(field, instance.object_id)
            if plane is None:
                continue
            point, normal = plane
            observations = clear[observations_of.get(instance.object_id, [])]
            observations = observations[field.atlas.normal[samples.element[observations]] @ normal > FLAT]
            elements = np.unique(samples.element[observations])
            if len(elements) > LEVELS.of_object:
                observations = observations[
                    np.isin(samples.element[observations], rng.choice(elements, LEVELS.of_object, replace=False))
                ]
            yield instance, point, normal, observations

    def fitted(candidate: tuple[Instance, np.ndarray, np.ndarray, np.ndarray]) -> Mirror | None:
        instance, point, normal, observations = candidate
        # `mirror_patches` has found that what it sets apart mirrors.
        least = LEVELS.enough if instance.guess and instance.class_name == MIRROR else LEVELS.many
        views = Views.of(field, samples, observations, least)
        fit = _fit_mirror(views, field.atlas.normal[views.element], normal)
        return None if fit is None else Mirror(instance.object_id, point, *fit)

    return tuple(mirror for mirror in ordered_map(fitted, flat_objects(), 0) if mirror is not None)


def _fit_mirror(views: Views, facing: np.ndarray, normal: np.ndarray) -> tuple[np.ndarray, np.ndarray] | None:
    """Normal and F0 ((3,) float32 each) of the mirror that these observations see, None if they see none.

    `facing` ((m, 3)) are the normals of their elements, `normal` is the mesh's.
    """
    deviation, own_deviation, correlation, f0 = views.compare(facing)
    alike = deviation < own_deviation and correlation > MIRRORS.together
    if not (alike and MIRRORS.least_f0 < f0.mean() < MIRRORS.most_f0):
        return None
    tangents = tangents_of(normal)
    sample = views.part(np.arange(0, len(views), -(-len(views) // LEVELS.sample)))
    tilt = np.zeros(2)
    # The correlation finds the direction from farther off, the deviation more closely.
    for cost in (lambda direction: -sample.compare(direction)[2], sample.deviation):
        simplex = tilt + MIRRORS.tilt * np.array([[0, 0], [1, 0], [0, 1]])
        options = {"initial_simplex": simplex, "maxfev": MIRRORS.tilts, "xatol": 3e-4, "fatol": 1e-4}
        tilt = minimize(
            lambda x, cost=cost: cost(turned(normal, tangents, x)), tilt, method="Nelder-Mead", options=options
        ).x
    best = turned(normal, tangents, tilt)
    if not sample.deviation(best) < MIRRORS.tells * sample.deviation(normal):
        best = np.asarray(normal, np.float32)
    return best, np.clip(f0, 0.02, 1).astype(np.float32)
