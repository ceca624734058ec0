"""Irradiance from bright triangles by way of flat mirrors: what a lamp throws on a wall over the glass opposite."""

import numpy as np

from ..kinds import Block
from ..parallel import blocks
from .directions import shifted, sobol
from .emitters import BrightTriangles, sample_bright
from .field import LightField
from .mirrors import reflect
from .params import GATHER

RAYS_AT_ONCE: Block[int] = 1 << 16


def direct_over_mirrors(
    field: LightField, bright: BrightTriangles, position: np.ndarray, normal: np.ndarray, emitter_rays: int, seed: int
) -> np.ndarray:
    """E from bright triangles by way of one mirror, (n, 3) float32.

    Rays are aimed at the mirror images of points on the bright triangles; those count that meet the mirror first and
    are free from there on. The path's length is that to the image.

    Parameters
    ----------
    position, normal : (n, 3) float32
    emitter_rays : int
        For each point and mirror.
    """
    total = np.zeros((len(position), 3), np.float32)
    if not len(bright) or not emitter_rays:
        return total
    emitter_rays = max(emitter_rays // GATHER.mirror_fewer, 1)
    step = max(RAYS_AT_ONCE // emitter_rays, 1)
    pattern = sobol(emitter_rays, seed, 3)
    for mirror in field.mirrors:
        rng = np.random.default_rng([seed, mirror.object_id])
        front = np.flatnonzero((position - mirror.point) @ mirror.normal > field.scene.offset)
        for part in blocks(len(front), step):
            index = front[part]
            p, n = position[index], normal[index]
            pick = sample_bright(bright, shifted(pattern, len(index), rng))
            image = pick.point - 2 * ((pick.point - mirror.point) @ mirror.normal)[:, None] * mirror.normal
            origin = np.repeat(field.scene.off_surface(p, n), emitter_rays, 0)
            to_image = image - origin
            distance = np.sqrt(np.einsum("ij,ij->i", to_image, to_image))
            direction = to_image / np.maximum(distance, 1e-12)[:, None]
            cosine = np.einsum("ij,ij->i", direction, np.repeat(n, emitter_rays, 0))
            reflected = reflect(direction, mirror.normal)
            facing = -np.einsum("ij,ij->i", reflected, bright.normal[pick.index])
            useful = np.flatnonzero(
                (cosine > 0)
                & ((pick.point - mirror.point) @ mirror.normal > 0)
                & ((facing > 1e-6) | ~field.one_sided[pick.triangle])
            )
            hits = field.scene.intersect(origin[useful], direction[useful])
            on_mirror = (hits.triangle >= 0) & (field.mirror_of[hits.triangle] == field.mirrors.index(mirror))
            useful, to_mirror = useful[on_mirror], hits.distance[on_mirror]
            mirror_point = origin[useful] + to_mirror[:, None] * direction[useful]
            mirror_point = field.scene.off_surface(mirror_point, np.broadcast_to(mirror.normal, mirror_point.shape))
            # To the point itself: where the mesh is a millimetre off the mirror's plane, the mirrored way would end
            # behind it as often as before it, and the lamp would be in its own shadow.
            to_lamp = pick.point[useful] - mirror_point
            length = np.sqrt(np.einsum("ij,ij->i", to_lamp, to_lamp))
            hidden = field.scene.occluded(
                mirror_point,
                to_lamp / np.maximum(length, 1e-12)[:, None],
                length * np.float32(1 - 1e-4) - field.scene.offset,
            )
            useful = useful[~hidden]
            element = field.lookup(pick.triangle[useful], pick.u[useful], pick.v[useful])
            weight = cosine[useful] * np.abs(facing[useful]) / (distance[useful] ** 2 * pick.density[useful])
            value = np.zeros((len(origin), 3), np.float32)
            value[useful] = mirror.f0 * field.radiance[element] * weight[:, None]
            total[index] += value.reshape(len(index), emitter_rays, 3).sum(1) / emitter_rays
    return total
