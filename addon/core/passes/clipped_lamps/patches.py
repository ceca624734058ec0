"""Patches that the sensor clipped or that are far brighter than the rest, of a mesh that tells of no objects.

In a fused mesh ceiling lamps and windows are of one piece with the rest. What nearly all frames
that see it show clipped may be such a lamp, and its radiance is solved for. A white wall that few frames clip is none.
Of what is bright and not clipped the radiance is known.
"""

from dataclasses import dataclass

import numpy as np

from ...luminance import LUMINANCE
from ...scene.atlas import Atlas
from ...scene.elements import ElementLookup
from ...scene.lit_diffuse import LitDiffuse
from ...scene.model import Mesh
from ...scene.patches import Patches
from ...scene.uv_islands import connected
from ...scene.weld import weld
from ...significance import LEVELS
from ...weighted import weighted_median


@dataclass(frozen=True)
class PatchParams:
    """What is set apart.

    Attributes
    ----------
    core : float
        Of an element's, somewhere in a patch: what frames only clip at times has none.
    bright : float
        Times the median radiance of the surface that an element must send to be of a patch unclipped. Sunlight on a
        floor is some ten to twenty times as bright as a room, a lamp some hundred times.
    """

    core: float = 0.9
    bright: float = 40.0


PATCHES = PatchParams()


def clipped_patches(mesh: Mesh, atlas: Atlas, lookup: ElementLookup, lit: LitDiffuse) -> Patches:
    """Connected triangles that nearly all frames show clipped, or that are bright; `lookup` is the atlas's."""
    count = len(mesh.triangles)
    told = np.where(lit.seen, atlas.area, 0)
    apart = np.maximum(lit.clipped, _bright(atlas, lit))
    of_triangle = np.bincount(atlas.triangle, told, count)
    share = np.bincount(atlas.triangle, told * apart, count) / np.maximum(of_triangle, 1e-20)
    # A triangle too small for an element of its own shows one beside it.
    bare, beside = lookup.bare
    share[bare] = np.where(lit.seen[beside], apart[beside], 0)
    # At a patch's edge poses that are off mix in what lies beside it: of a ceiling lamp's 0.27 square metres 0.285
    # have more than .3, 0.279 more than .5 and 0.261 more than .7, and none of the wall.
    chosen = np.flatnonzero(share > 0.5)
    if not len(chosen):
        return Patches.none()
    label = np.full(count, -1)
    label[chosen] = connected(weld(mesh.vertices)[mesh.triangles[chosen]])
    of_element = label[atlas.triangle]
    own = (of_element >= 0) & lit.seen
    parts = int(label.max()) + 1
    elements = np.bincount(of_element[own], minlength=parts)
    core = np.bincount(of_element[own & (apart > PATCHES.core)], minlength=parts)
    area = np.bincount(of_element[own], atlas.area[own], parts)
    enough = np.flatnonzero((elements >= LEVELS.few) & (core > 0))
    kept = enough[np.argsort(-area[enough], kind="stable")][: LEVELS.most]
    first = int(mesh.object_id.max()) + 1
    number = np.full(parts, -1)
    number[kept] = first + np.arange(len(kept))
    triangle = np.flatnonzero(np.where(label >= 0, number[label], -1) >= 0)
    return Patches(triangle.astype(np.int32), number[label[triangle]].astype(np.int32))


def _bright(atlas: Atlas, lit: LitDiffuse) -> np.ndarray:
    """Elements that are far brighter than the surface at large, (n,) bool."""
    luminance = np.zeros(len(atlas))
    luminance[lit.seen] = lit.radiance[lit.seen] @ LUMINANCE
    if not lit.seen.any():
        return np.zeros(len(atlas), bool)
    return luminance > PATCHES.bright * weighted_median(luminance[lit.seen], atlas.area[lit.seen])


def told_of(patches: list[int], atlas: Atlas, lit: LitDiffuse) -> list[int]:
    """Those of the patches whose radiance frames tell: most of what they saw of them is not clipped."""
    own = {one: lit.seen & (atlas.object_id == one) for one in patches}
    return [one for one, seen in own.items() if np.median(lit.clipped[seen]) <= 0.5]
