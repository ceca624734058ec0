"""Mirrors in a mesh that tells of no objects, where they are of one piece with the wall that they hang on.

A mirror hangs before its wall or in a frame, so it is a flat piece by itself. Of a part, which may be a chimney and its
sides, every way that much of it faces is looked along. Each observed element is asked together with those around it
whether they show the mirrored room, as `flat_mirrors` asks an object. Share of a piece's elements that do: two mirrors
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
    first, found = int(mesh.object_id.max()) + 1, [Patches.none()]
    for number, shown in by_number(atlas.object_id[samples.element[clear]]).items():
        seen, left = clear[shown], mesh.object_id == number
        for normal in _facings(atlas.normal[np.unique(samples.element[seen])]):
            flat = np.flatnonzero(left & (normals @ normal > FLAT))
            left[flat] = False  # none is of two pieces
            own = seen[atlas.normal[samples.element[seen]] @ normal > FLAT]
            element, mirrored = _mirrored(Views.of(field, samples, own), normal)
            if mirrored.sum() < LEVELS.enough:
                continue
            piece = np.full(len(mesh.triangles), -1)
            piece[flat] = connected(welded[mesh.triangles[flat]])
            within = piece[atlas.triangle[element]]
            there, told = (np.bincount(within[which & (within >= 0)], minlength=1) for which in (mirrored, within >= 0))
            there = np.pad(there, (0, len(told) - len(there)))
            for one in np.flatnonzero((there >= LEVELS.enough) & (2 * there > told)):
                triangle = np.flatnonzero(piece == one).astype(np.int32)
                found.append(Patches(triangle, np.full(len(triangle), first, np.int32), np.array([first], np.int32)))
                first += 1
    return Patches.together(found)


def _facings(normals: np.ndarray) -> Iterator[np.ndarray]:
    """Ways ((3,) float32, unit) that many of some normals ((n, 3)) share, the most common first."""
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
    """The elements ((k,) int) that views tell something of, and around which a mirror surely explains it, (k,) bool."""
    known = views.known(normal)
    if known is None:
        return np.zeros(0, int), np.zeros(0, bool)
    index, _, seen, shown = known
    element, group, count = np.unique(views.element[index], return_inverse=True, return_counts=True)
    position = views.field.atlas.position[element]
    near = cKDTree(position).query(position, k=min(LEVELS.enough, len(element)))[1].reshape(len(element), -1)

    def summed(x: np.ndarray) -> np.ndarray:
        return np.bincount(group, x, len(element))

    def around(x: np.ndarray) -> np.ndarray:
        return summed(x)[near].sum(1)

    a, b = (x - (summed(x) / count)[group] for x in (seen, shown))
    f0 = np.median((summed(seen - shown) / count)[near], 1)
    own = around(a * a)
    together = around(a * b) / np.sqrt(np.maximum(own * around(b * b), 1e-12))
    off = around((seen - shown - f0[group]) ** 2)
    return element, (off < own) & (together > MIRRORS.together) & (f0 > np.log(MIRRORS.least_f0))
