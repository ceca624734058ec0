"""The capture's cameras in Blender, exact to a thousandth of a pixel."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

import bpy
import numpy as np
from mathutils import Matrix

from ..core.capture.model import Camera, Frame

_SENSOR = 36.0


def make_cameras(frames: Iterable[Frame], collection: bpy.types.Collection) -> list[bpy.types.Object]:
    """Make a camera object for each frame and link it to a collection.

    Parameters
    ----------
    frames : iterable of Frame
    collection : bpy.types.Collection

    Returns
    -------
    list of bpy.types.Object
        Named after the frames. Custom properties ``width``, ``height`` (pixels) and ``pixel_aspect`` (fx / fy) tell
        the render size each one is exact for; `use_camera` sets it. ``frame_path`` and ``frame_exposure`` tell the
        frame's picture and what its radiance was multiplied by.
    """
    made = []
    for frame in frames:
        thing = _camera_object(frame.name, frame.camera, collection)
        thing["frame_path"], thing["frame_exposure"] = str(Path(frame.path).absolute()), float(frame.exposure)
        made.append(thing)
    return made


def use_camera(scene: bpy.types.Scene, thing: bpy.types.Object) -> None:
    """Render through one of `make_cameras`: active camera, size of the picture and shape of its pixels."""
    aspect = float(thing["pixel_aspect"])
    render = scene.render
    render.resolution_x, render.resolution_y = int(thing["width"]), int(thing["height"])
    render.resolution_percentage = 100
    # Blender takes numbers from 1 on.
    render.pixel_aspect_x, render.pixel_aspect_y = max(1.0, 1 / aspect), max(1.0, aspect)
    scene.camera = thing


def frame_cameras(scene: bpy.types.Scene) -> list[bpy.types.Object]:
    """The cameras of a scene that `make_cameras` made, in the capture's order."""
    return [thing for thing in scene.objects if thing.type == "CAMERA" and "pixel_aspect" in thing]


def differing(frames: Iterable[Frame]) -> str:
    """One sentence if the frames don't all share one size and pixel shape ('' if they do).

    Those are settings of the scene in Blender, not of a camera.
    """
    kinds = {(f.camera.width, f.camera.height, round(f.camera.fx / f.camera.fy, 6)) for f in frames}
    if len(kinds) < 2:
        return ""
    return (f"The frames have {len(kinds)} different sizes or pixel shapes, which Blender keeps in the scene, not in a "
            "camera: set the render size from the camera's custom properties before you render through another one.")


def _camera_object(name: str, camera: Camera, collection) -> bpy.types.Object:
    data = bpy.data.cameras.new(name)
    data.sensor_fit = "HORIZONTAL"
    data.sensor_width = _SENSOR
    data.lens = camera.fx * _SENSOR / camera.width
    aspect = camera.fx / camera.fy
    # Shifts count in widths of the picture; a tall pixel counts by its true height.
    data.shift_x = 0.5 - camera.cx / camera.width
    data.shift_y = (camera.cy - camera.height / 2) * aspect / camera.width
    data.clip_start, data.clip_end = 0.01, 1000.0
    data.display_size = 0.15
    thing = bpy.data.objects.new(name, data)
    thing.matrix_world = Matrix(np.asarray(camera.camera_to_world, np.float64).tolist())
    thing["width"], thing["height"], thing["pixel_aspect"] = camera.width, camera.height, aspect
    collection.objects.link(thing)
    return thing
