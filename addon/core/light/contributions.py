"""What each of many objects would throw on a few elements, were it the only light: rays that all of them share."""

import numpy as np

from ..parallel import blocks, for_blocks
from .directions import cosine_patterns, turned
from .emitters import BrightTriangles, shining
from .environment import Environment
from .few_elements import ELEMENTS_AT_ONCE
from .field import LightField
from .irradiance import balance, direct
from .over_mirrors import direct_over_mirrors
from .params import LIGHT_FIT


def contributions(
    field: LightField, element: np.ndarray, groups: list[list[int]], seed: int, more: int = 1
) -> np.ndarray:
    """E at m elements from each of g groups of objects at radiance 1 and nothing else, (m, g) float64.

    As by `direct` and `gather`, but that one trace over the hemisphere does for all, with `more` times the rays aimed
    at the groups. No object may be of two groups.
    """
    position, normal = field.atlas.position[element], field.atlas.normal[element]
    rays, emitter_rays = LIGHT_FIT.rays, more * LIGHT_FIT.emitter_rays
    E, density = np.zeros((len(element), len(groups))), np.zeros(len(field.mesh.triangles), np.float32)
    one_sided = np.zeros(len(density), bool)
    for k, objects in enumerate(groups):
        alone = np.repeat(np.isin(field.atlas.object_id, objects)[:, None], 3, 1)
        lit_alone = field.with_light(alone, Environment.dark(), objects)
        own = np.isin(field.mesh.object_id, objects)
        one_sided[own] = lit_alone.one_sided[own]
        aimed = shining(lit_alone)
        density[aimed.triangle] = aimed.density[aimed.triangle]

        def aim(part: slice, k: int = k, lit_alone: LightField = lit_alone, aimed: BrightTriangles = aimed) -> None:
            p, n, block_seed = position[part], normal[part], seed + part.start
            E[part, k] = direct(lit_alone, aimed, p, n, rays, emitter_rays, block_seed)[0][:, 0]
            E[part, k] += direct_over_mirrors(lit_alone, aimed, p, n, emitter_rays, block_seed)[:, 0]

        for_blocks(aim, len(element), ELEMENTS_AT_ONCE, 0)
    group_of, patterns = _group_of(field, groups), cosine_patterns(rays, seed)

    def gather(part: slice) -> None:
        p, n = position[part], normal[part]
        directions, cosine = turned(patterns, n, np.random.default_rng(seed + part.start))
        directions = directions.reshape(-1, 3)
        hits = field.scene.intersect(np.repeat(field.scene.off_surface(p, n), rays, 0), directions)
        hit = np.flatnonzero((hits.triangle >= 0) & (group_of[hits.triangle] >= 0))
        triangle = hits.triangle[hit]
        facing = -np.einsum("ij,ij->i", directions[hit], field.normal[triangle])
        aimed = density[triangle] * hits.distance[hit] ** 2 / np.maximum(np.abs(facing), 1e-6)
        # Most lamps are dark from behind.
        lit_side = (facing > 0) | ~one_sided[triangle]
        value = np.pi / rays * balance(rays * cosine.ravel()[hit], emitter_rays * aimed) * lit_side
        cell = hit // rays * len(groups) + group_of[triangle]
        E[part] += np.bincount(cell, value, len(p) * len(groups)).reshape(len(p), len(groups))

    if groups:
        for_blocks(gather, len(element), ELEMENTS_AT_ONCE, 0)
    return E


def reaching_most(field: LightField, element: np.ndarray, groups: list[list[int]], count: int, seed: int) -> list[int]:
    """Of groups of objects the `count` that would light a few elements most, were all of one radiance: rising indices.

    One trace for all groups, so that it takes no longer for thousands.
    """
    group_of = _group_of(field, groups)
    position, normal = field.atlas.position[element], field.atlas.normal[element]
    patterns, rng = cosine_patterns(LIGHT_FIT.emitter_rays, seed), np.random.default_rng(seed)
    hit_count = np.zeros(len(groups))
    for part in blocks(len(element), ELEMENTS_AT_ONCE):
        start = np.repeat(field.scene.off_surface(position[part], normal[part]), LIGHT_FIT.emitter_rays, 0)
        triangle = field.scene.intersect(start, turned(patterns, normal[part], rng)[0].reshape(-1, 3)).triangle
        group = group_of[triangle[triangle >= 0]]
        np.add.at(hit_count, group[group >= 0], 1)
    return np.sort(np.argsort(-hit_count, kind="stable")[:count]).tolist()


def _group_of(field: LightField, groups: list[list[int]]) -> np.ndarray:
    """The group that each triangle's object is of, (t,) int; -1 where it is of none."""
    of_object = np.full(int(field.mesh.object_id.max(initial=0)) + 1, -1)
    for index, objects in enumerate(groups):
        of_object[objects] = index
    return of_object[field.mesh.object_id]
