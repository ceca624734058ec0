"""A room's collections: one that is marked with its capture, and within it the objects, the lamps and the cameras."""

from __future__ import annotations

from pathlib import Path

import bpy

from ...core.errors import MissingStageError
from ..marks import CAPTURE, OWN_SCENE

ROOM, LAMPS, CAMERAS = "Room", "Lamps", "Cameras"
PART = "scan_relight_part"
"""Of a collection within a room's: which of the three it is, whatever the artist calls it."""


def new_room(capture_folder: Path | str) -> bpy.types.Collection:
    """A collection "Scan Relight" with its parts, linked to no scene."""
    top = bpy.data.collections.new("Scan Relight")
    top[CAPTURE] = str(Path(capture_folder).absolute())
    for name in (ROOM, LAMPS, CAMERAS):
        part = bpy.data.collections.new(name)
        part[PART] = name
        top.children.link(part)
    return top


def hide_cameras(scene: bpy.types.Scene, top: bpy.types.Collection) -> None:
    """Close the eye of the cameras' part in a scene: as many cameras as frames would hide the room.

    The eye and not "disabled in viewports", under which Blender would not even tell where a camera stands.
    """
    part = part_of(top, CAMERAS)
    for layer in scene.view_layers:
        if layer.layer_collection is None:  # Blender 5: a new scene's layers know nothing before their first update
            layer.update()
        found = [layer.layer_collection]
        for one in found:
            found.extend(one.children)
            if one.collection == part != top:
                one.hide_viewport = True


def scene_name(capture_folder: Path | str) -> str:
    """What the scene is called that is made for a capture's room."""
    return f"Scan Relight: {Path(capture_folder).name}"


def part_of(top: bpy.types.Collection, name: str) -> bpy.types.Collection:
    """One of a room's parts; the room's own collection where the artist took it away."""
    found = [part for part in top.children_recursive if part.get(PART, part.name.split(".")[0]) == name]
    return found[0] if found else top


def rooms(scene: bpy.types.Scene) -> list[bpy.types.Collection]:
    """The collections of the rooms in a scene."""
    return [one for one in scene.collection.children_recursive if CAPTURE in one]


def find_room(capture_folder: Path | str) -> bpy.types.Collection | None:
    """The collection of a capture's room that any scene of this file shows; None without one."""
    wanted = Path(capture_folder).resolve()
    for scene in sorted(bpy.data.scenes, key=lambda one: not one.get(OWN_SCENE)):
        for top in rooms(scene):
            if top.library is None and Path(top[CAPTURE]).resolve() == wanted:
                return top
    return None


def imported(capture_folder: Path | str) -> bpy.types.Collection:
    """`find_room`; raises `MissingStageError` without one."""
    top = find_room(capture_folder)
    if top is None:
        raise MissingStageError(f"Capture '{capture_folder}' is not in this file; import it first.")
    return top


def scenes_with(top: bpy.types.Collection) -> list[bpy.types.Scene]:
    """The scenes that show a room, its own first."""
    found = [scene for scene in bpy.data.scenes if top in scene.collection.children_recursive]
    return sorted(found, key=lambda scene: not scene.get(OWN_SCENE))


def own_scene(top: bpy.types.Collection) -> bpy.types.Scene | None:
    """The scene that was made for a room; None without one."""
    return next((scene for scene in scenes_with(top) if scene.get(OWN_SCENE)), None)
