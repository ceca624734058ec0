"""One animated camera that goes along the capture's track: a frame of the timeline for each frame of the capture."""

from __future__ import annotations

from collections.abc import Sequence

import bpy

from .cameras import FRAME_INDEX

TRACK = "Scan Relight track"
"""Name of the camera."""
NO_FRAME = -1
"""Its `FRAME_INDEX`: it is none of the frames' cameras."""


def make_track(cameras: Sequence[bpy.types.Object], collection: bpy.types.Collection) -> bpy.types.Object | None:
    """Make the camera from those of the frames, in the capture's order; None of fewer than two.

    Its lens, size and pixel shape are the first frame's. The timeline's frame k shows the capture's k-th, from 1.
    """
    if len(cameras) < 2:
        return None
    thing = cameras[0].copy()
    thing.name, thing.data = TRACK, cameras[0].data.copy()
    thing.data.name = TRACK
    for name in ("frame_path", "frame_exposure"):
        if name in thing:
            del thing[name]
    thing[FRAME_INDEX] = NO_FRAME
    thing.rotation_mode = "QUATERNION"
    before = None
    for frame, camera in enumerate(cameras, 1):
        place, turn, _ = camera.matrix_basis.decompose()
        if before is not None:
            turn.make_compatible(before)  # of its two signs the one that turns the shorter way
        thing.location, thing.rotation_quaternion, before = place, turn, turn
        thing.keyframe_insert("location", frame=frame)
        thing.keyframe_insert("rotation_quaternion", frame=frame)
    thing.animation_data.action.name = TRACK
    thing.matrix_basis = cameras[0].matrix_basis
    collection.objects.link(thing)
    return thing


def track_cameras(scene: bpy.types.Scene) -> list[bpy.types.Object]:
    """The cameras of a scene that go along the track of a capture."""
    return [thing for thing in scene.objects if thing.type == "CAMERA" and thing.get(FRAME_INDEX, 0) == NO_FRAME]
