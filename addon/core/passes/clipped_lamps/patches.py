"""Patches that the sensor clipped or that are far brighter than the rest, of a mesh that tells of no objects.

In a fused mesh ceiling lamps and windows are of one piece with the rest. What nearly all frames
that see it show clipped may be such a lamp, and its radiance is solved for. A white wall that few frames clip is none,
nor is what fades out: light that falls onto a surface, and highlights on it, do so, but a lamp ends at its rim.
Of what is bright and not clipped the radiance is known.
"""

from dataclasses import dataclass
from itertools import islice

import numpy as np
from scipy.spatial import cKDTree

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
    beside : tuple of float
        Texels off a patch between which the surface around it lies; nearer, poses that are off mix the two.
    fades : float
        Times a patch's median radiance that what lies around it sends where the patch is lit and no lamp. Five rooms as
        a phone gives them: .15 to .43 around lamps, .7 to 1.25 around what lamps light, .1 to .55 around sunlight.
    """

    core: float = 0.9
    bright: float = 40.0
    beside: tuple[float, float] = (4.0, 6.0)
    fades: float = 0.5


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
    enough = enough[np.argsort(-area[enough], kind="stable")]
    ends = (one for one in enough if not _fades(atlas, lit, of_element, one))
    kept = np.array(list(islice(ends, LEVELS.most)), int)
    first = int(mesh.object_id.max()) + 1
    number = np.full(parts, -1)
    number[kept] = first + np.arange(len(kept))
    triangle = np.flatnonzero(np.where(label >= 0, number[label], -1) >= 0)
    return Patches(triangle.astype(np.int32), number[label[triangle]].astype(np.int32))


def _fades(atlas: Atlas, lit: LitDiffuse, patch: np.ndarray, one: int) -> bool:
    """Whether `one` of the patches ((n,) int of each element, -1 for none) is about as bright as what is around it."""
    own = np.flatnonzero((patch == one) & lit.seen)
    near, far = np.multiply(PATCHES.beside, atlas.texel_edge)
    place, normal = atlas.position[own], atlas.normal[own].mean(0)
    within = ((atlas.position > place.min(0) - far) & (atlas.position < place.max(0) + far)).all(1)
    others = np.flatnonzero(within & (patch < 0) & lit.seen)
    others = others[atlas.normal[others] @ normal > 0.9 * np.linalg.norm(normal)]
    away, _ = cKDTree(place).query(atlas.position[others], distance_upper_bound=far)
    around = others[(away > near) & np.isfinite(away)]
    if len(around) < LEVELS.few:
        return False
    sent, beside = (float(np.median(lit.radiance[which] @ LUMINANCE)) for which in (own, around))
    return beside > PATCHES.fades * sent


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
