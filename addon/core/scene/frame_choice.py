"""Frames that show something new: a video has far more of each place than its medians need.

A frame shows cells of surface, each at its resolution (in octaves) and from its direction. Where enough other frames
show most of them so, it is passed over.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ..parallel import ordered_map
from .model import Camera, Capture, Mesh
from .params import FRAME_CHOICE
from .rays import RayScene
from .seen_cells import cell_numbers, sides
from .sparse_hits import pixel_edges, sparse_hits, step_for


def with_frames_that_add(capture: Capture, threads: int = 0) -> Capture:
    """A capture without the frames that show nothing new; of few frames, the same one."""
    if len(capture.frames) <= FRAME_CHOICE.few:
        return capture
    chosen = frames_that_add(capture.mesh, [frame.camera for frame in capture.frames], threads)
    if chosen.all():
        return capture
    frames = tuple(frame for frame, adds in zip(capture.frames, chosen, strict=True) if adds)
    warning = (
        f"{len(capture.frames) - len(frames)} of {len(capture.frames)} frames show nothing that others don't show from "
        "as near and were passed over; --without frame-choice takes all."
    )
    return replace(capture, frames=frames, warnings=(*capture.warnings, warning))


def frames_that_add(mesh: Mesh, cameras: Sequence[Camera], threads: int = 0) -> np.ndarray:
    """Which cameras show something new, in an order that is spread over the whole video, (f,) bool."""
    scene, side = RayScene(mesh.vertices, mesh.triangles), sides(mesh)

    def look(camera: Camera) -> np.ndarray:
        """What a camera sees: numbers of cells, each at its resolution and from its direction."""
        step = step_for(camera, FRAME_CHOICE.rays)
        pixels, directions, hits = sparse_hits(scene, camera, step)
        level = np.log2(step * pixel_edges(camera, pixels, hits)).round().astype(np.int64)
        place = (camera.centre + hits.distance[:, None] * directions) / np.exp2(level)[:, None]
        # Cells of a cube around the spot: three by three on each face.
        cube_cell = np.round(1.5 * directions / np.abs(directions).max(1, keepdims=True))
        label = side[hits.triangle] * 125 + (cube_cell + 2).astype(np.int64) @ np.array([25, 5, 1])
        return np.unique(cell_numbers(np.floor(place).astype(np.int64), label, level))

    seen = list(ordered_map(look, cameras, threads))
    number = np.unique(np.concatenate(seen), return_inverse=True)[1]
    cells = np.split(number, np.cumsum([len(cells_of_frame) for cells_of_frame in seen])[:-1])
    count, chosen = np.zeros(number.max(initial=-1) + 1, np.int32), np.zeros(len(cameras), bool)
    for i in _spread(len(cameras)):
        if len(cells[i]) and np.median(count[cells[i]]) < FRAME_CHOICE.enough:
            chosen[i] = True
            count[cells[i]] += 1
    return chosen


def _spread(count: int) -> np.ndarray:
    """Numbers below `count`, each far from those before it (van der Corput's sequence), (count,) int."""
    bits = max((count - 1).bit_length(), 1)
    bit = 1 << np.arange(bits)
    order = (np.arange(1 << bits)[:, None] & bit > 0) @ bit[::-1]
    return order[order < count]
