"""Objects from pictures of object ids: every triangle gets what most of the pixels that see it say."""

from collections.abc import Callable, Sequence

import numpy as np
from scipy import ndimage, sparse
from scipy.sparse.csgraph import dijkstra
from scipy.spatial import cKDTree

from ..errors import BadInputError
from ..kinds import Block
from .model import Frame
from .params import SIDES
from .rays import RayScene
from .weld import same_place, weld

PACK: Block[int] = 8
"""Frames whose votes are summed at once; bounds the memory."""


def vote(
    vertices: np.ndarray, triangles: np.ndarray, frames: Sequence[Frame], read: Callable[[Frame], np.ndarray]
) -> tuple[np.ndarray, list[str]]:
    """Give every triangle the id that most pixels have that see it first.

    Pixels next to one of another id are left out: at edges, a mesh and a picture rarely agree. A triangle that no
    pixel sees takes the id of the nearest one along the surface, or, where none is connected, through the air.

    Parameters
    ----------
    frames : sequence of Frame
        Those without `id_path` are passed over.
    read : callable
        The ids of a frame's pixels, (height, width) int64.

    Returns
    -------
    object_id : (t,) int64
    notes : list of str

    Raises
    ------
    BadInputError
        No picture of ids can be used, or none shows the mesh.
    """
    frames = [frame for frame in frames if frame.id_path is not None]
    scene = RayScene(vertices, triangles)
    total = sum(frame.camera.width * frame.camera.height for frame in frames)
    step = max(int(np.ceil(np.sqrt(total / SIDES.max_rays))), 1)
    problems: list[str] = []
    votes: list[tuple[np.ndarray, np.ndarray, np.ndarray]] = []
    for frame in frames:
        try:
            votes.append(_votes(scene, frame, read(frame), step))
        except BadInputError as error:
            problems.append(str(error))
        if len(votes) > PACK:
            votes = [_summed(votes)]
    if problems and len(problems) == len(frames):
        raise BadInputError(f"No picture of object ids can be used; the first: {problems[0]}")
    triangle, ids, count = _summed(votes)
    if not len(triangle):
        raise BadInputError("No picture of object ids shows any of the mesh; check the poses and the mesh.")
    # The last of a triangle's entries in this order has most votes; of equal ones the lowest id.
    order = np.lexsort((-ids, count, triangle))
    last = np.append(triangle[order][1:] != triangle[order][:-1], True)
    result, known = np.zeros(len(triangles), np.int64), np.zeros(len(triangles), bool)
    result[triangle[order][last]], known[triangle[order][last]] = ids[order][last], True
    agreeing = count[order][last].sum() / count.sum()
    result = _spread(vertices, triangles, result, known)
    notes = [
        f"The objects are voted from {len(frames) - len(problems)} pictures of ids; {agreeing:.1%} of the pixels "
        f"agree with their triangle, and {1 - known.mean():.1%} of the triangles, which none sees, take their "
        "neighbours'."
    ]
    if problems:
        notes.append(f"{len(problems)} pictures of ids can't be used; the first: {problems[0]}")
    return result, notes


def _votes(scene: RayScene, frame: Frame, ids: np.ndarray, step: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Triangle, id and number of votes of a frame; each pair once."""
    camera = frame.camera
    if ids.shape != (camera.height, camera.width):
        raise BadInputError(
            f"Frame '{frame.name}': '{frame.id_path}' has {ids.shape[1]} x {ids.shape[0]} pixels, but "
            f"its camera has {camera.width} x {camera.height}; give them one size."
        )
    cross = ndimage.generate_binary_structure(2, 1)
    same = ndimage.minimum_filter(ids, footprint=cross) == ndimage.maximum_filter(ids, footprint=cross)
    chosen = np.zeros(ids.shape, bool)
    chosen[step // 2 :: step, step // 2 :: step] = True
    y, x = np.nonzero(same & chosen)
    directions, ok = camera.rays(np.stack([x + 0.5, y + 0.5], -1))
    y, x, directions = y[ok], x[ok], directions[ok]
    hits = scene.intersect(camera.centre, directions)
    hit = hits.triangle >= 0
    triangle, seen_ids = hits.triangle[hit].astype(np.int64), ids[y[hit], x[hit]]
    return _summed([(triangle, seen_ids, np.ones(len(triangle), np.int64))])


def _summed(votes: list[tuple[np.ndarray, np.ndarray, np.ndarray]]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Votes with each pair of triangle and id once."""
    if not votes:
        return np.zeros(0, np.int64), np.zeros(0, np.int64), np.zeros(0, np.int64)
    triangle, ids, count = (np.concatenate(part) for part in zip(*votes))
    first, pair = same_place(np.column_stack([triangle, ids]))
    return triangle[first], ids[first], np.bincount(pair, count, len(first)).astype(np.int64)


def _spread(vertices: np.ndarray, triangles: np.ndarray, ids: np.ndarray, known: np.ndarray) -> np.ndarray:
    """Ids for the triangles that are not `known`: of the nearest known one along the surface, else through the air."""
    if known.all():
        return ids
    centre = vertices[triangles].mean(1)
    faces = weld(vertices)[triangles]
    edge = np.sort(np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]), 1)
    owner = np.tile(np.arange(len(triangles)), 3)
    order = np.lexsort((edge[:, 1], edge[:, 0]))
    shared = (edge[order][1:] == edge[order][:-1]).all(1)
    a, b = owner[order][:-1][shared], owner[order][1:][shared]
    length = np.linalg.norm(centre[a] - centre[b], axis=1) + 1e-9
    graph = sparse.coo_matrix((length, (a, b)), (len(triangles),) * 2).tocsr()
    sources = np.flatnonzero(known)
    _, _, source = dijkstra(graph, directed=False, indices=sources, return_predecessors=True, min_only=True)
    source = np.where(known, np.arange(len(triangles)), source)
    unreached = np.flatnonzero(source < 0)
    if len(unreached):
        source[unreached] = sources[cKDTree(centre[sources]).query(centre[unreached])[1]]
    return ids[source]
