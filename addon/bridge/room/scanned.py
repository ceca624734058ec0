"""A capture as it was scanned, in the open file: its objects without materials, its cameras with their frames."""

from collections.abc import Generator

import bpy
import numpy as np

from ...core.scene.model import Capture
from ..custom_properties import CAPTURE, OWN_SCENE
from ..data.added import AddedData
from ..data.cameras import make_cameras, make_track, use_camera
from ..data.mesh_objects import each_object
from ..relight.match_frame import show_picture
from ..scene.as_made import stamp
from ..scene.parts import CAMERAS, ROOM, find_room, new_room, part_of, scene_name, scenes_with
from .bring import ImportedRoom, link_room, ready
from .update import note_known


def importing(capture: Capture, scene: bpy.types.Scene | None = None) -> Generator[float, None, ImportedRoom]:
    """Bring a capture into the open file in slices of an object or camera each; yields the share done.

    It is linked into `scene`; by default it has one of its own. A later run finds the room and updates it. Nothing that
    was in the file changes before the last slice: a room of the capture that it has already only comes into the scene.
    """
    top = find_room(capture.root)
    if top is not None:
        existing = scenes_with(top)[0]
        if scene is not None:
            link_room(top, scene)
        message = (
            f"Capture '{capture.root.name}' is in this file already, in its scene '{existing.name}'; it stays as it is."
        )
        return ImportedRoom(scene or existing, top, (message,))
    added = AddedData()
    try:
        top = new_room(capture.root)
        total = len(capture.instances) + len(capture.frames)
        blank = np.zeros((len(capture.mesh.triangles), 3, 2), np.float32)
        names = {instance.object_id: instance.name for instance in capture.instances}
        objects = []
        for number, obj in each_object(capture.mesh, capture.instances, blank, part_of(top, ROOM)):
            stamp(obj, names[number])
            objects.append(obj)
            yield len(objects) / total
        cameras = []
        for index, frame in enumerate(capture.frames):
            cameras += make_cameras([frame], part_of(top, CAMERAS), index)
            show_picture(cameras[-1])
            cameras[-1].data.show_background_images = True
            yield (len(objects) + len(cameras)) / total
        track = make_track(cameras, part_of(top, CAMERAS))
        for obj in (*objects, *cameras, *filter(None, (track,))):
            obj[CAPTURE] = top[CAPTURE]
            stamp(obj)
        note_known(top, top.all_objects)
    except BaseException:
        added.remove()
        raise
    if scene is None:
        scene = bpy.data.scenes.new(scene_name(capture.root))
        scene[OWN_SCENE] = True
        scene.frame_start, scene.frame_end = 1, max(len(cameras), 1)
        if cameras:
            use_camera(scene, cameras[0])
    link_room(top, scene)
    ready(scene)
    return ImportedRoom(scene, top)
