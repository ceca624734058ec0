"""Collections of the scene that hold what the artist adds."""

from __future__ import annotations

from collections.abc import Iterable

import bpy


def _known(scene: bpy.types.Scene, name: str) -> bpy.types.Collection | None:
    """The scene's collection `name`, however Blender numbered it."""
    return next((part for part in scene.collection.children if part.name.split(".")[0] == name), None)


def own_collection(scene: bpy.types.Scene, name: str) -> bpy.types.Collection:
    """The scene's collection `name`; made where absent."""
    part = _known(scene, name)
    if part is None:
        part = bpy.data.collections.new(name)
        scene.collection.children.link(part)
    return part


def remove_own(scene: bpy.types.Scene, name: str, things: Iterable[bpy.types.Object]) -> int:
    """Take things away with their data, and the collection `name` once it is empty; returns how many."""
    things = list(things)
    data = {thing.data for thing in things}
    bpy.data.batch_remove(things)
    bpy.data.batch_remove([one for one in data if not one.users])
    part = _known(scene, name)
    if part is not None and not part.all_objects:
        bpy.data.collections.remove(part)
    return len(things)
