"""A capture far from the origin, moved near it: rays, elements and trees are in single precision.

In a national grid's coordinates a room lies thousands of kilometres off, where float32 tells no two of its walls apart.
Poses and vertices are double as they are read, so nothing is lost where they are moved before anything is rounded.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..kinds import Unit
from .model import Capture

COARSE: Unit[float] = 1e-6
"""Step of float32, as a share of the room's diagonal, from which on the room is moved."""


def near_origin(capture: Capture) -> Capture:
    """The same capture around the origin, if float32 is coarse where it lies; else as it is."""
    used = capture.mesh.vertices[capture.mesh.triangles.ravel()]
    low, high = used.min(0), used.max(0)
    step = float(np.spacing(np.float32(np.abs([low, high]).max())))
    if step <= COARSE * float(np.linalg.norm(high - low)):
        return capture
    centre = (low + high) / 2
    frames = []
    for frame in capture.frames:
        pose = frame.camera.camera_to_world.copy()
        pose[:3, 3] -= centre
        frames.append(replace(frame, camera=replace(frame.camera, camera_to_world=pose)))
    mesh = replace(capture.mesh, vertices=capture.mesh.vertices - centre)
    mirrors = tuple(replace(mirror, point=mirror.point - centre) for mirror in capture.mirrors)
    return replace(capture, mesh=mesh, frames=tuple(frames), mirrors=mirrors)
