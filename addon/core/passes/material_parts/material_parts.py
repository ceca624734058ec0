"""Objects of several materials: a cupboard with its handles, a table with its cloth.

Scans are often segmented by the names of things, so that one object has wood and steel. Its connected pieces are set
apart while the light is found, so that each may be a lamp or a mirror. Afterwards those that look alike are put
together again: whose distributions of log(pi L_d / E) overlap by half. What remains apart has a model, lobe and prior
of its own.

What it gains in rooms whose objects were put together by what touches: `docs/benchmark/material_parts.md`.
"""

from collections.abc import Collection

import numpy as np
from scipy.spatial import cKDTree
from scipy.stats import ks_2samp

from ...groups import by_number
from ...scene.atlas import Atlas
from ...scene.connected_parts import connected_pieces
from ...scene.lit_diffuse import LitDiffuse
from ...scene.model import Mesh
from ...scene.patches import Patches
from ...significance import LEVELS


def seen_pieces(mesh: Mesh, atlas: Atlas, seen: np.ndarray) -> Patches:
    """Connected pieces of objects that enough `seen` elements ((n,) bool) show, but for the most seen of each."""
    count = np.bincount(atlas.triangle[seen], minlength=len(mesh.triangles))
    next_id, pieces = int(mesh.object_id.max()) + 1, [Patches()]
    for triangles in by_number(mesh.object_id).values():
        if count[triangles].sum() < LEVELS.few:
            continue
        piece = connected_pieces(mesh.vertices, mesh.triangles[triangles])
        seen_count = np.bincount(piece, count[triangles])
        for number in np.argsort(-seen_count, kind="stable")[1 : LEVELS.most]:
            if seen_count[number] >= LEVELS.enough:
                triangle = triangles[piece == number].astype(np.int32)
                ids = np.full(len(triangle), next_id, np.int32)
                pieces.append(Patches(triangle, ids, parts=np.array([next_id], np.int32)))
                next_id += 1
    return Patches.together(pieces)


def unlike_pieces(
    pieces: Patches,
    whole: np.ndarray,
    atlas: Atlas,
    lit_diffuse: LitDiffuse,
    irradiance: np.ndarray,
    sources: Collection[int],
) -> list[list[int]]:
    """Groups of pieces that stay apart, each of one material; what is alike to the greatest piece is in none.

    Parameters
    ----------
    whole : (n,) int
        The object of each element as the capture has it.
    irradiance : (n, 3) float32
    sources : collection of int
        Lamps and mirrors, which stay by themselves.
    """
    groups = [[piece] for piece in pieces.objects if piece in sources]
    if not len(pieces.parts):
        return groups
    usable = lit_diffuse.seen & (irradiance.min(1) > 0) & (lit_diffuse.radiance.min(1) > 0)
    elements = by_number(np.where(usable, atlas.object_id, -1))

    def may_be_alike(i: int) -> bool:
        return i not in sources and len(elements.get(i, ())) >= LEVELS.few

    def log_albedo(i: int) -> np.ndarray:
        sample = elements[i][:: -(-len(elements[i]) // LEVELS.sample)]
        return np.log(np.pi * lit_diffuse.radiance[sample] / irradiance[sample])

    siblings: dict[int, list[int]] = {}
    for i in filter(may_be_alike, pieces.parts.tolist()):
        siblings.setdefault(int(whole[elements[i][0]]), []).append(i)
    for parent, others in siblings.items():
        ids = [i for i in others if not _is_other_side(elements[i], elements.get(parent), atlas)]
        ids += [parent] if may_be_alike(parent) else []
        found: list[tuple[np.ndarray, list[int]]] = []
        for i in sorted(ids, key=lambda i: (i != parent, -len(elements[i]))):
            look = log_albedo(i)
            group = next((group for first, group in found if _alike(first, look)), None)
            if group is None:
                found.append((look, [i]))
            else:
                group.append(i)
        groups += [group for _, group in found if parent not in group]
    return groups


def _is_other_side(piece: np.ndarray, rest: np.ndarray | None, atlas: Atlas) -> bool:
    """Whether most elements of a piece face away from some of the rest right behind them, as a pane's two sheets do.

    What is behind a pane shows on either sheet, and they look unlike for that.
    """
    if rest is None:
        return False
    nearest = cKDTree(atlas.position[rest]).query(
        atlas.position[piece], distance_upper_bound=LEVELS.likely * atlas.texel_edge
    )[1]
    near = np.flatnonzero(nearest < len(rest))
    facing = np.einsum("ij,ij->i", atlas.normal[piece[near]], atlas.normal[rest[nearest[near]]])
    return 2 * int((facing < 0).sum()) > len(piece)


def _alike(a: np.ndarray, b: np.ndarray) -> bool:
    """Whether two pieces may be of one material, by the log albedo of their elements, (p, 3) and (q, 3).

    Medians alone don't tell: what L_d / E is of a metal varies with what it mirrors. Kolmogorov and Smirnov's statistic
    is above a half where most of one lies beyond most of the other.
    """
    if np.abs(np.median(a, 0) - np.median(b, 0)).max() <= LEVELS.gain:  # E errs by as much
        return True
    return max(float(ks_2samp(x, y, method="asymp").statistic) for x, y in zip(a.T, b.T, strict=True)) <= 0.5
