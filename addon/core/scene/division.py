"""A building divided into parts that are recovered one by one, each with its own light from the others.

What the frames see is counted in cells of surface, and space is halved, again and again, so that each part has as
many; planes lie where they cut the least. A part has its own triangles, and what of the other parts its surface and its
frames see: that sends light into it, or stands before it, and is measured coarsely.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy.sparse import csr_matrix

from ..parallel import ordered_map
from .model import Camera, Mesh
from .params import DIVISION, FRAME_CHOICE, SPARSE
from .rays import RayScene
from .seen_cells import cell_numbers
from .sparse_hits import pixel_edges, sparse_hits, step_for


class Division(NamedTuple):
    """A part of a capture.

    Attributes
    ----------
    triangle : (k,) int
        The mesh's triangles that it takes, sorted.
    far : (k,) bool
        Those that belong to other parts.
    frames : (m,) int
        The frames that it takes, sorted.
    """

    triangle: np.ndarray
    far: np.ndarray
    frames: np.ndarray


class Seen(NamedTuple):
    """Cells of surface that the frames see.

    Attributes
    ----------
    edge : float
        Of a cell, metres.
    number : (n,) uint64
        Of each, sorted (`seen_cells.cell_numbers`, by place and object).
    position, normal : (n, 3) float32
        A point that was seen in it, and the side of its surface that the frame saw.
    triangle : (n,) int32
        That the point lies on.
    frames : csr_matrix of (f, n) bool
        Which frame sees which.
    """

    edge: float
    number: np.ndarray
    position: np.ndarray
    normal: np.ndarray
    triangle: np.ndarray
    frames: csr_matrix


def seen_by(mesh: Mesh, scene: RayScene, cameras: Sequence[Camera], threads: int = 0) -> Seen:
    """The cells that cameras see, as wide as `SPARSE.cell` elements, of which each is as wide as a pixel."""
    normal = mesh.geometry[0]

    def look(camera: Camera) -> tuple[np.ndarray, ...]:
        step = step_for(camera, FRAME_CHOICE.rays)
        pixels, directions, hits = sparse_hits(scene, camera, step)
        facing = normal[hits.triangle]
        facing = np.where(np.einsum("ij,ij->i", facing, directions)[:, None] > 0, -facing, facing)
        position = (camera.centre + hits.distance[:, None] * directions).astype(np.float32)
        return position, facing, hits.triangle, pixel_edges(camera, pixels, hits)

    looks = list(ordered_map(look, cameras, threads))
    position, facing, triangle, edges = (np.concatenate(column) for column in zip(*looks, strict=True))
    known = edges[edges > 0]
    edge = SPARSE.cell * (float(np.percentile(known, 25)) if len(known) else 1.0)
    key = _cells(position, mesh.object_id[triangle], edge)
    number, first, cell = np.unique(key, return_index=True, return_inverse=True)
    start = np.cumsum([0, *(len(look[0]) for look in looks)])
    frames = csr_matrix((np.ones(len(cell), bool), cell.ravel(), start), (len(cameras), len(number)))
    frames.sum_duplicates()
    return Seen(edge, number, position[first], facing[first], triangle[first], frames)


def parts_for(seen: Seen, memory: float) -> int:
    """How many parts, so that the recovery of each takes so many bytes."""
    elements = max((memory - DIVISION.base) / DIVISION.each, 1) / (1 + DIVISION.off)
    return max(1, int(np.ceil(len(seen.number) * SPARSE.cell**2 / elements)))


def _cells(position: np.ndarray, object_id: np.ndarray, edge: float) -> np.ndarray:
    return cell_numbers(np.floor(position / edge).astype(np.int64), object_id, 0)


def divided(mesh: Mesh, scene: RayScene, seen: Seen, count: int) -> list[Division]:
    """A capture's parts; fewer than `count` where there are no more cells.

    Parameters
    ----------
    scene : RayScene
        Of the mesh.
    seen : Seen
        By the capture's cameras.
    """
    owner = _owners(mesh, seen, count)
    rng = np.random.default_rng(0)
    # What is cut lies in several parts: a piece is what one of them has of an object.
    piece = np.unique(owner.astype(np.int64) << 32 | mesh.object_id, return_inverse=True)[1].ravel()
    of_cell, parts = owner[seen.triangle], []
    for part in np.unique(of_cell):
        own = np.flatnonzero(of_cell == part)
        sent = _sources(scene, seen, own, rng)
        frames = _frames(mesh, seen, of_cell == part, sent)
        met = np.bincount(piece[sent.triangle], minlength=piece.max() + 1)
        taken = met > DIVISION.least * DIVISION.rays
        taken[piece[seen.triangle[np.unique(seen.frames[frames].indices)]]] = True
        triangle = np.flatnonzero(taken[piece] | (owner == part))
        parts.append(Division(triangle, owner[triangle] != part, frames))
    return parts


def _owners(mesh: Mesh, seen: Seen, count: int) -> np.ndarray:
    """The part that each triangle belongs to, (t,) int32.

    An object is one part's, that has most of it, unless it is large: then each of its triangles is where it lies.
    """
    tree = _tree(seen.position, mesh.object_id[seen.triangle], count)
    of_cell, owner = _part_at(tree, seen.position), _part_at(tree, mesh.vertices[mesh.triangles].mean(1))
    objects, row = np.unique(mesh.object_id, return_inverse=True)

    def shares(of_object: np.ndarray, part: np.ndarray) -> np.ndarray:
        ones = np.ones(len(part), np.int64)
        return csr_matrix((ones, (of_object, part)), (len(objects), count)).toarray()

    cells, triangles = shares(row[seen.triangle], of_cell), shares(row, owner)
    most = np.where(cells.any(1), cells.argmax(1), triangles.argmax(1)).astype(np.int32)
    large = cells.sum(1) > DIVISION.large * len(of_cell) / count
    return np.where(large[row], owner, most[row])


class _Node(NamedTuple):
    """Space halved by a plane across an axis; below and above it a node each, or a part's number."""

    axis: int
    plane: float
    below: "_Node | int"
    above: "_Node | int"


def _tree(position: np.ndarray, object_id: np.ndarray, count: int, first: int = 0) -> _Node | int:
    """Space divided so that each part, numbered from `first` on, has as many of some cells: a k-d tree."""
    if count < 2 or len(position) < 2:
        return first
    low, high = np.percentile(position, (5, 95), axis=0)
    axis, lower = int((high - low).argmax()), count // 2
    plane = _plane(position[:, axis], object_id, lower / count, DIVISION.off / count)
    below = position[:, axis] < plane
    return _Node(
        axis, plane, _tree(position[below], object_id[below], lower, first),
        _tree(position[~below], object_id[~below], count - lower, first + lower),
    )  # fmt: skip


def _part_at(tree: _Node | int, points: np.ndarray) -> np.ndarray:
    """The part that points ((n, 3) float) lie in, (n,) int32."""
    if not isinstance(tree, _Node):
        return np.full(len(points), tree, np.int32)
    part, below = np.empty(len(points), np.int32), points[:, tree.axis] < tree.plane
    part[below], part[~below] = _part_at(tree.below, points[below]), _part_at(tree.above, points[~below])
    return part


def _plane(place: np.ndarray, object_id: np.ndarray, share: float, off: float) -> float:
    """Where to cut along an axis: with about this share of the cells below, where objects lose the fewest of theirs.

    Of those where they lose as few, the one with the most room about it.
    """
    order = np.argsort(place, kind="stable")
    sorted_place, number = place[order], np.unique(object_id, return_inverse=True)[1].ravel()[order]
    total = np.bincount(number)
    low, high = (
        int(np.clip(round(quantile * len(place)), 1, len(place) - 1)) for quantile in (share - off, share + off)
    )
    gaps = sorted_place[low : high + 1] - sorted_place[low - 1 : high]
    choices = []
    for at in low + np.argsort(-gaps, kind="stable")[: DIVISION.planes]:
        below = np.bincount(number[:at], minlength=len(total))
        lost = int(np.minimum(below, total - below).sum())
        choices.append((lost, -gaps[at - low], abs(at / len(place) - share), at))
    at = min(choices)[-1]
    return float(sorted_place[at - 1 : at + 1].mean())


class _Sources(NamedTuple):
    """Where light comes from that falls onto a part: what rays from its surface meet."""

    triangle: np.ndarray
    position: np.ndarray


def _sources(scene: RayScene, seen: Seen, own: np.ndarray, rng: np.random.Generator) -> _Sources:
    start = rng.choice(own, DIVISION.rays)
    normal = seen.normal[start]
    # A normal plus a point of the unit sphere is distributed by the cosine.
    directions = normal + _unit(rng.standard_normal((len(start), 3)))
    directions = _unit(directions).astype(np.float32)
    origins = scene.off_surface(seen.position[start], normal)
    hits = scene.intersect(origins, directions)
    met = hits.triangle >= 0
    return _Sources(hits.triangle[met], (origins[met] + hits.distance[met, None] * directions[met]).astype(np.float32))


def _unit(vectors: np.ndarray) -> np.ndarray:
    return vectors / np.maximum(np.linalg.norm(vectors, axis=1, keepdims=True), 1e-12)


def _frames(mesh: Mesh, seen: Seen, own: np.ndarray, sent: _Sources) -> np.ndarray:
    """The frames of a part: those that look at its own cells ((n,) bool), and enough of others for what lights it."""
    views = seen.frames.astype(np.float32)
    count = np.maximum(np.diff(seen.frames.indptr), 1)
    chosen = views @ own.astype(np.float32) >= DIVISION.looks * count
    key = _cells(sent.position, mesh.object_id[sent.triangle], seen.edge)
    cell = np.minimum(np.searchsorted(seen.number, key), len(seen.number) - 1)
    weight = np.bincount(cell[seen.number[cell] == key], minlength=len(seen.number)).astype(np.float32)
    weight[own] = 0
    seen_often = views[np.flatnonzero(chosen)].sum(0).A1 if chosen.any() else np.zeros(len(weight), np.float32)
    while True:
        wanted = np.where(seen_often < DIVISION.views, weight, 0)
        gain = np.where(chosen, 0, views @ wanted)
        best = int(gain.argmax())
        if wanted.sum() <= DIVISION.least * DIVISION.rays or gain[best] <= 0:
            return np.flatnonzero(chosen)
        chosen[best] = True
        seen_often += views[best].toarray()[0]
