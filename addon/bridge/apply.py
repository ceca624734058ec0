"""The two halves of a recovery in the user's own scene: the capture comes in, later its materials are put on."""

from __future__ import annotations

from collections.abc import Generator, Iterable
from pathlib import Path

import bpy
import numpy as np

from ..core.capture.model import Capture
from ..core.errors import MissingStageError
from ..core.material import EMITTER, ObjectMaterial, undescribed
from ..core.room_file import run_of
from . import result_images
from .cameras import make_cameras
from .marks import CAPTURE, OBJECT_ID, mark
from .match_frame import show_picture
from .materials import make_material
from .mesh_objects import ATLAS_UV, each_object


def whole(slices: Generator):
    """Do all slices of a piece of work at once; what it returns."""
    while True:
        try:
            next(slices)
        except StopIteration as end:
            return end.value


def import_capture(scene: bpy.types.Scene, capture: Capture) -> bpy.types.Collection:
    """Add a capture's objects and cameras, each with its frame behind it, to a scene; an earlier import stays.

    Returns
    -------
    bpy.types.Collection
        "Scan Relight" with "Room", "Lamps" and "Cameras" within, linked to the scene.
    """
    return whole(importing(scene, capture))


def importing(scene: bpy.types.Scene, capture: Capture) -> Generator[float, None, bpy.types.Collection]:
    """`import_capture` in slices of an object or camera each; yields the share done, so that a window can be drawn."""
    top = bpy.data.collections.new("Scan Relight")
    top[CAPTURE] = str(capture.root.absolute())
    room, lamps, eyes = (bpy.data.collections.new(name) for name in ("Room", "Lamps", "Cameras"))
    for part in (room, lamps, eyes):
        top.children.link(part)
    total = len(capture.instances) + len(capture.frames)
    blank = np.zeros((len(capture.mesh.triangles), 3, 2), np.float32)
    for done, _ in enumerate(each_object(capture.mesh, capture.instances, blank, room), 1):
        yield done / total
    for done, frame in enumerate(capture.frames, len(capture.instances) + 1):
        [thing] = make_cameras([frame], eyes)
        show_picture(thing)
        thing.data.show_background_images = True
        yield done / total
    scene.collection.children.link(top)  # not before: a window that is drawn in between would draw each half
    return top


def imported(scene: bpy.types.Scene, capture: Capture) -> bpy.types.Collection:
    """The collection that `import_capture` made of `capture` in `scene`; raises `MissingStageError` without one."""
    return imported_from(scene, capture.root)


def imported_from(scene: bpy.types.Scene, folder: Path | str) -> bpy.types.Collection:
    """`imported` by the capture's folder."""
    root = str(Path(folder).absolute())
    for collection in reversed(scene.collection.children_recursive):
        if collection.get(CAPTURE) == root:
            return collection
    raise MissingStageError(f"Capture '{folder}' is not in this scene; import it first.")


def apply_recovery(scene: bpy.types.Scene, capture: Capture, atlas_uv: np.ndarray,
                   materials: Iterable[ObjectMaterial], result_folder: Path | str,
                   where: str = result_images.RESULT) -> tuple[str, ...]:
    """Put atlas coordinates, images and materials onto the imported objects; what they wore before is replaced.

    Parameters
    ----------
    scene : bpy.types.Scene
    capture : Capture
        Imported into `scene`.
    atlas_uv : (t, 3, 2) float32
    materials : iterable of ObjectMaterial
    result_folder : path
        Holds the images.
    where : str
        Where the images go: see `result_images`.

    Returns
    -------
    tuple of str
        Warnings, one sentence each.

    Raises
    ------
    MissingStageError
        The capture was not imported into the scene.
    BadInputError
        An image can't be read.
    """
    return whole(applying(scene, capture, atlas_uv, materials, result_folder, where))


def applying(scene: bpy.types.Scene, capture: Capture, atlas_uv: np.ndarray, materials: Iterable[ObjectMaterial],
             result_folder: Path | str,
             where: str = result_images.RESULT) -> Generator[float, None, tuple[str, ...]]:
    """`apply_recovery` in slices of an object each; yields the share done, so that a window can be drawn."""
    top = imported(scene, capture)
    folder = Path(result_folder).absolute()
    run = run_of(folder)
    mark(top, folder, run)
    base_color = result_images.bring(folder, where)
    things = {thing[OBJECT_ID]: thing for thing in top.all_objects if OBJECT_ID in thing}
    parts = {part.name.split(".")[0]: part for part in top.children}
    descriptions = {one.object_id: one for one in materials}
    warnings = []
    order = np.argsort(capture.mesh.object_id, kind="stable")
    sorted_id = capture.mesh.object_id[order]
    for done, instance in enumerate(capture.instances):
        yield done / len(capture.instances)
        thing = things.get(instance.object_id)
        first, last = np.searchsorted(sorted_id, [instance.object_id, instance.object_id + 1])
        own = order[first:last]
        if thing is None or len(thing.data.polygons) != len(own):
            what = "was deleted" if thing is None else "was edited"
            warnings.append(f"{instance.name} {what} and is left as it is.")
            continue
        layers = thing.data.uv_layers
        layer = layers.get(ATLAS_UV) or layers.new(name=ATLAS_UV)
        layer.uv.foreach_set("vector", atlas_uv[own].astype(np.float32).ravel())
        layers.active, layer.active_render = layer, True
        description = descriptions.get(instance.object_id) or undescribed(instance.object_id, instance.class_name)
        thing.data.materials.clear()
        thing.data.materials.append(make_material(description, base_color))
        mark(thing, folder, run)
        if description.model == EMITTER and "Lamps" in parts and thing.name not in parts["Lamps"].objects:
            for part in parts.values():
                if thing.name in part.objects:
                    part.objects.unlink(thing)
            parts["Lamps"].objects.link(thing)
    return tuple(warnings)
