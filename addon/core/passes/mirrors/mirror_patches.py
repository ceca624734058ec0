"""Mirrors in a mesh without objects, where they are of one piece with the wall that they hang on.

A fused mesh has a mirror in its wall's plane, or as a flat piece before it or in a frame. Of a part, which may be a
chimney and its sides, every direction that much of it faces is tried. Each observed element is tested together with
those around it for showing the mirrored room, as `flat_mirrors` tests an object. A piece is a mirror if most of its
elements do: two mirrors of two rooms .69 and .98; polished worktops and fronts, which mirror a window in one place, at
most .11. A region of a larger piece is one if the mirrored room explains what it shows, by the same measure as a
flat object: .06 and .08 of the deviation from its own means are left in the mirrors of two studies, .33 to 2.3 in some
twenty regions of worktops, fronts, screens and walls in five rooms.
"""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from scipy.spatial import Delaunay, cKDTree

from ...groups import by_number
from ...light.field import FLAT, LightField
from ...scene.closing import plane_axes
from ...scene.connected_parts import weld
from ...scene.params import COPLANAR
from ...scene.patches import Patches
from ...scene.samples import Samples
from ...scene.uv_islands import components, connected
from ...significance import LEVELS
from .mirrored import Views
from .params import MIRRORS


def mirror_patches(field: LightField, samples: Samples) -> Patches:
    """Flat pieces of parts whose frames show the room mirrored.

    Parameters
    ----------
    field : LightField
        With L_d, dark where no frame saw it.
    """
    atlas, mesh = field.atlas, field.mesh
    clear = np.flatnonzero(~samples.saturated)
    welded, normals = weld(mesh.vertices), mesh.geometry[0]
    next_id, patches = int(mesh.object_id.max()) + 1, [Patches()]
    for object_id, index in by_number(atlas.object_id[samples.element[clear]]).items():
        observations, free = clear[index], mesh.object_id == object_id
        for normal in _facings(atlas.normal[np.unique(samples.element[observations])]):
            flat, level = (
                np.flatnonzero(free & (normals @ normal > cosine)) for cosine in (FLAT, np.cos(COPLANAR.turn))
            )
            free[flat] = False  # none is of two pieces
            facing = observations[atlas.normal[samples.element[observations]] @ normal > FLAT]
            views = Views.of(field, samples, facing)
            element, mirrored, log_f0 = _mirrored(views, normal)
            if mirrored.sum() < LEVELS.enough:
                continue
            piece = np.full(len(mesh.triangles), -1)
            piece[flat] = connected(welded[mesh.triangles[flat]])
            within = piece[atlas.triangle[element]]
            whole = _mirroring(within, mirrored)
            rest = mirrored & ~np.isin(within, whole)
            # What noise has turned within a region is of it.
            level = level[~np.isin(piece[level], whole)]
            middle = mesh.vertices[mesh.triangles[level]].mean(1)
            regions = [level[chosen] for chosen in _regions_in(middle, views, element, rest, log_f0, normal)]
            for triangle in (*(flat[piece[flat] == label] for label in whole), *regions):
                free[triangle] = False
                triangle, count = triangle.astype(np.int32), len(triangle)
                patches.append(Patches(triangle, np.full(count, next_id, np.int32), np.array([next_id], np.int32)))
                next_id += 1
    return Patches.together(patches)


def _facings(normals: np.ndarray) -> Iterator[np.ndarray]:
    """Directions ((3,) float32, unit) that many of some normals ((n, 3)) share, the most common first."""
    while len(normals):
        cell = np.round(normals / np.sqrt(1 - FLAT**2))
        _, cell, count = np.unique(cell, axis=0, return_inverse=True, return_counts=True)
        if count.max() < LEVELS.many:
            return
        normal = normals[cell.ravel() == np.argmax(count)].mean(0)
        normal = (normal / np.linalg.norm(normal)).astype(np.float32)
        yield normal
        normals = normals[normals @ normal <= FLAT]


def _mirroring(within: np.ndarray, mirrored: np.ndarray) -> np.ndarray:
    """The pieces that are mirrors, as most of their elements are; `within` is each element's, (k,) int, or -1."""
    known = np.bincount(within[within >= 0], minlength=1)
    mirroring = np.bincount(within[mirrored & (within >= 0)], minlength=len(known))
    return np.flatnonzero((mirroring >= LEVELS.enough) & (2 * mirroring > known))


def _regions_in(
    middle: np.ndarray, views: Views, element: np.ndarray, mirrored: np.ndarray, log_f0: np.ndarray, normal: np.ndarray
) -> list[np.ndarray]:
    """Triangles ((t,) bool, by the `middle` of each) in regions that are mirrors, each in one."""
    position, margin, count = views.field.atlas.position[element], views.field.atlas.texel_edge, len(element)
    neighbours = cKDTree(position).query(position, k=min(LEVELS.neighbours, count))[1].reshape(count, -1)
    region = _connected(mirrored[neighbours].mean(1) > 0.5, neighbours)
    axes, taken, parts = np.stack(plane_axes(normal, [])), np.zeros(len(middle), bool), []
    in_plane, middle_in_plane = position @ axes.T, middle @ axes.T
    for label in range(region.max() + 1):
        inside = region == label
        if inside.sum() < LEVELS.enough:
            continue
        of_region = views.part(np.flatnonzero(np.isin(views.element, element[inside])))
        deviation, own_deviation, _, f0 = replace(of_region, least=LEVELS.enough).compare(normal)
        if deviation > MIRRORS.unexplained * own_deviation or not MIRRORS.least_f0 < f0.mean() < MIRRORS.most_f0:
            continue
        # Where it mirrors an even wall nothing varies that would tell; its F0 does.
        stray = np.minimum(np.abs(log_f0 - np.median(log_f0[inside])), MIRRORS.stray)[neighbours].mean(1)
        grown = _connected(inside | (stray < np.median(stray[inside])), neighbours)
        inside = grown == grown[inside][0]
        # Mirrors are convex, and beside what hangs over one it is not sure that they are some.
        hull, depth = Delaunay(in_plane[inside], qhull_options="QJ"), position[inside] @ normal
        chosen = (middle @ normal > depth.min() - margin) & (middle @ normal < depth.max() + margin) & ~taken
        # Most are rectangles, unless views of the corners tell that these are something else.
        low, high = in_plane[inside].min(0), in_plane[inside].max(0)
        corners = ((in_plane > low) & (in_plane < high)).all(1) & (hull.find_simplex(in_plane) < 0)
        if corners.sum() < LEVELS.few or np.median(stray[corners]) < LEVELS.likely * np.median(stray[inside]):
            chosen &= ((middle_in_plane > low) & (middle_in_plane < high)).all(1)
        else:
            chosen &= hull.find_simplex(middle_in_plane) >= 0
        taken |= chosen
        if chosen.any():
            parts.append(chosen)
    return parts


def _connected(inside: np.ndarray, neighbours: np.ndarray) -> np.ndarray:
    """The connected region ((k,) int, or -1) of each element `inside` ((k,) bool), by `neighbours` ((k, c) int)."""
    a = np.repeat(np.flatnonzero(inside), neighbours.shape[1])
    b = neighbours[inside].ravel()
    region = np.full(len(inside), -1)
    linked = components(a[inside[b]], b[inside[b]], len(inside))[inside]
    region[inside] = np.unique(linked, return_inverse=True)[1]
    return region


def _mirrored(views: Views, normal: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Elements ((k,) int) whose mirrored radiance is known, and around which a mirror surely explains it, (k,) bool.

    Then the logarithm of their F0 as mirrors, (k,).
    """
    views_known = views.known(normal)
    if views_known is None:
        return np.zeros(0, int), np.zeros(0, bool), np.zeros(0)
    index, _, observed, predicted = views_known
    element, group, count = np.unique(views.element[index], return_inverse=True, return_counts=True)
    position = views.field.atlas.position[element]
    neighbours = cKDTree(position).query(position, k=min(LEVELS.enough, len(element)))[1].reshape(len(element), -1)

    def summed(x: np.ndarray) -> np.ndarray:
        return np.bincount(group, x, len(element))

    def around(x: np.ndarray) -> np.ndarray:
        return summed(x)[neighbours].sum(1)

    a, b = (x - (summed(x) / count)[group] for x in (observed, predicted))
    log_f0 = summed(observed - predicted) / count
    f0 = np.median(log_f0[neighbours], 1)
    variance = around(a * a)
    correlation = around(a * b) / np.sqrt(np.maximum(variance * around(b * b), 1e-12))
    several = (count > 1)[group]  # one view of an element has no variance
    residual = np.where(several, observed - predicted - f0[group], 0)
    unexplained = around(residual**2) / np.maximum(variance, 1e-12)
    possible = (f0 > np.log(MIRRORS.least_f0)) & (f0 < np.log(MIRRORS.most_f0))
    mirrored = (unexplained < 1) & (correlation > MIRRORS.together) & possible
    return element, mirrored, log_f0
