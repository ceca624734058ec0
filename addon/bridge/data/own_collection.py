"""Collections of the scene that hold what the artist adds."""

from __future__ import annotations

import bpy


def own_collection(scene: bpy.types.Scene, name: str) -> bpy.types.Collection:
    """The scene's collection `name`, however Blender numbered it; made where absent."""
    for part in scene.collection.children:
        if part.name.split(".")[0] == name:
            return part
    part = bpy.data.collections.new(name)
    scene.collection.children.link(part)
    return part
