"""Mirrors in a mesh without objects, where they are of one piece with the wall that they hang on.

A mirror hangs before its wall or in a frame, so it is a flat piece by itself. Of a part, which may be a chimney and its
sides, every direction that much of it faces is tried. Each observed element is tested together with those around it
for showing the mirrored room, as `flat_mirrors` tests an object. Share of a piece's elements that do: two mirrors
of two rooms .69 and .98; polished worktops and fronts, which mirror a window in one place, at most .11.
"""

from collections.abc import Iterator

import numpy as np
from scipy.spatial import cKDTree

from ...groups import by_number
from ...light.field import FLAT, LightField
from ...scene.connected_parts import weld
from ...scene.patches import Patches
from ...scene.samples import Samples
from ...scene.uv_islands import connected
from ...significance import LEVELS
from .mirrored import Views
from .params import MIRRORS


def mirror_patches(field: LightField, samples: Samples) -> Patches:
    """Flat pieces of parts whose frames show the room mirrored.

    Parameters
    ----------
    field : LightField
        With L_d, dark where no frame saw it.
    samples : Samples
    """
    atlas, mesh = field.atlas, field.mesh
    clear = np.flatnonzero(~samples.saturated)
    welded, normals = weld(mesh.vertices), mesh.geometry[0]
    next_id, patches = int(mesh.object_id.max()) + 1, [Patches.none()]
    for object_id, index in by_number(atlas.object_id[samples.element[clear]]).items():
        observations, free = clear[index], mesh.object_id == object_id
        for normal in _facings(atlas.normal[np.unique(samples.element[observations])]):
            flat = np.flatnonzero(free & (normals @ normal > FLAT))
            free[flat] = False  # none is of two pieces
            facing = observations[atlas.normal[samples.element[observations]] @ normal > FLAT]
            element, mirrored = _mirrored(Views.of(field, samples, facing), normal)
            if mirrored.sum() < LEVELS.enough:
                continue
            piece = np.full(len(mesh.triangles), -1)
            piece[flat] = connected(welded[mesh.triangles[flat]])
            within = piece[atlas.triangle[element]]
            mirroring, known = (
                np.bincount(within[mask & (within >= 0)], minlength=1) for mask in (mirrored, within >= 0)
            )
            mirroring = np.pad(mirroring, (0, len(known) - len(mirroring)))
            for label in np.flatnonzero((mirroring >= LEVELS.enough) & (2 * mirroring > known)):
                triangle = np.flatnonzero(piece == label).astype(np.int32)
                patches.append(
                    Patches(triangle, np.full(len(triangle), next_id, np.int32), np.array([next_id], np.int32))
                )
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


def _mirrored(views: Views, normal: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Elements ((k,) int) whose mirrored radiance is known, and around which a mirror surely explains it, (k,) bool."""
    views_known = views.known(normal)
    if views_known is None:
        return np.zeros(0, int), np.zeros(0, bool)
    index, _, observed, predicted = views_known
    element, group, count = np.unique(views.element[index], return_inverse=True, return_counts=True)
    position = views.field.atlas.position[element]
    neighbours = cKDTree(position).query(position, k=min(LEVELS.enough, len(element)))[1].reshape(len(element), -1)

    def summed(x: np.ndarray) -> np.ndarray:
        return np.bincount(group, x, len(element))

    def around(x: np.ndarray) -> np.ndarray:
        return summed(x)[neighbours].sum(1)

    a, b = (x - (summed(x) / count)[group] for x in (observed, predicted))
    f0 = np.median((summed(observed - predicted) / count)[neighbours], 1)
    variance = around(a * a)
    correlation = around(a * b) / np.sqrt(np.maximum(variance * around(b * b), 1e-12))
    residual = around((observed - predicted - f0[group]) ** 2)
    return element, (residual < variance) & (correlation > MIRRORS.together) & (f0 > np.log(MIRRORS.least_f0))
