"""Patches that the sensor clipped or that are far brighter than the rest, of a mesh without objects.

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
    rim : float
        Of the smallest rim that a patch of its area has, what must have been seen for it to tell whether light fades
        out: a window lies in a recess, and a few elements of its frame, which it lights, are all that lies beside it.
        Eight rooms as a phone gives them: at least .4 beside what lamps light, .04 beside such a window.
    """

    core: float = 0.9
    bright: float = 40.0
    beside: tuple[float, float] = (4.0, 6.0)
    fades: float = 0.5
    rim: float = 0.25


PATCHES = PatchParams()


def clipped_patches(mesh: Mesh, atlas: Atlas, lookup: ElementLookup, lit: LitDiffuse) -> Patches:
    """Connected triangles that nearly all frames show clipped, or that are bright; `lookup` is the atlas's."""
    count = len(mesh.triangles)
    seen_area = np.where(lit.seen, atlas.area, 0)
    score = np.maximum(lit.clipped, _bright(atlas, lit))
    triangle_area = np.bincount(atlas.triangle, seen_area, count)
    share = np.bincount(atlas.triangle, seen_area * score, count) / np.maximum(triangle_area, 1e-20)
    # A triangle too small for an element of its own shows one beside it.
    bare, nearest = lookup.bare
    share[bare] = np.where(lit.seen[nearest], score[nearest], 0)
    # At a patch's edge poses that are off mix in what lies beside it: of a ceiling lamp's 0.27 square metres 0.285
    # have more than .3, 0.279 more than .5 and 0.261 more than .7, and none of the wall.
    chosen = np.flatnonzero(share > 0.5)
    if not len(chosen):
        return Patches()
    label = np.full(count, -1)
    # A table by a window, both clipped, is of one piece with it in a fused mesh.
    label[chosen] = connected(weld(mesh.vertices)[mesh.triangles[chosen]], mesh.object_id[chosen].astype(np.int64))
    of_element = label[atlas.triangle]
    inside = (of_element >= 0) & lit.seen
    parts = int(label.max()) + 1
    elements = np.bincount(of_element[inside], minlength=parts)
    core = np.bincount(of_element[inside & (score > PATCHES.core)], minlength=parts)
    area = np.bincount(of_element[inside], atlas.area[inside], parts)
    candidates = np.flatnonzero((elements >= LEVELS.few) & (core > 0))
    candidates = candidates[np.argsort(-area[candidates], kind="stable")]
    lamps = (patch for patch in candidates if not _fades(atlas, lit, of_element, patch))
    patches = np.array(list(islice(lamps, LEVELS.most)), int)
    first = int(mesh.object_id.max()) + 1
    number = np.full(parts, -1)
    number[patches] = first + np.arange(len(patches))
    triangle = np.flatnonzero(np.where(label >= 0, number[label], -1) >= 0)
    return Patches(triangle.astype(np.int32), number[label[triangle]].astype(np.int32))


def _fades(atlas: Atlas, lit: LitDiffuse, patch_of: np.ndarray, patch: int) -> bool:
    """Whether a `patch` is about as bright as its surround; `patch_of` ((n,) int): each element's, -1 for none."""
    elements = np.flatnonzero((patch_of == patch) & lit.seen)
    near, far = np.multiply(PATCHES.beside, atlas.texel_edge)
    position, normal = atlas.position[elements], atlas.normal[elements].mean(0)
    in_box = ((atlas.position > position.min(0) - far) & (atlas.position < position.max(0) + far)).all(1)
    others = np.flatnonzero(in_box & (patch_of < 0) & lit.seen)
    others = others[atlas.normal[others] @ normal > 0.9 * np.linalg.norm(normal)]
    distance, _ = cKDTree(position).query(atlas.position[others], distance_upper_bound=far)
    surround = others[(distance > near) & np.isfinite(distance)]
    smallest_rim = 2 * np.sqrt(np.pi * len(elements)) * np.ptp(PATCHES.beside)
    if len(surround) < max(PATCHES.rim * smallest_rim, LEVELS.few):
        return False
    patch_radiance, surround_radiance = (
        float(np.median(lit.radiance[group] @ LUMINANCE)) for group in (elements, surround)
    )
    return surround_radiance > PATCHES.fades * patch_radiance


def _bright(atlas: Atlas, lit: LitDiffuse) -> np.ndarray:
    """Elements that are far brighter than the surface at large, (n,) bool."""
    luminance = np.zeros(len(atlas))
    luminance[lit.seen] = lit.radiance[lit.seen] @ LUMINANCE
    if not lit.seen.any():
        return np.zeros(len(atlas), bool)
    return luminance > PATCHES.bright * weighted_median(luminance[lit.seen], atlas.area[lit.seen])


def measured_patches(patches: list[int], atlas: Atlas, lit: LitDiffuse) -> list[int]:
    """The patches whose radiance was measured: most of what frames saw of them is not clipped."""
    seen_of = {patch: lit.seen & (atlas.object_id == patch) for patch in patches}
    return [patch for patch, seen in seen_of.items() if np.median(lit.clipped[seen]) <= 0.5]
