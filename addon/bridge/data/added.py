"""Data that is added to the open file: to remove it again, and in collections of its own."""

from collections.abc import Iterable, Iterator
from contextlib import contextmanager

import bpy

KINDS = tuple(
    "scenes collections objects meshes curves armatures cameras lights shape_keys materials worlds node_groups images "
    "textures actions texts".split()
)
"""Kinds of datablocks; users come before what they use."""


class AddedData:
    """The datablocks that were added to the open file since this was made."""

    def __init__(self):
        self._before = {datablock.session_uid for kind in KINDS for datablock in getattr(bpy.data, kind)}

    def new(self, kind: str) -> list:
        """The new datablocks of one of `KINDS`."""
        return [datablock for datablock in getattr(bpy.data, kind) if datablock.session_uid not in self._before]

    def remove(self) -> None:
        """Remove all of them, except images that older data shows."""
        for kind in KINDS:
            removable = self.new(kind)
            if kind == "images":
                removable = [image for image in removable if image.users == image.use_fake_user]
            if removable:
                bpy.data.batch_remove(removable)

    def remove_unused(self, also: Iterable[int]) -> None:
        """Remove unused datablocks: of the new ones, and of those whose `session_uid` is in `also`."""
        also = set(also)
        for kind in KINDS[1:]:
            while unused := [
                datablock
                for datablock in getattr(bpy.data, kind)
                if (datablock.session_uid not in self._before or datablock.session_uid in also)
                and not datablock.users
                and not datablock.library
            ]:
                bpy.data.batch_remove(unused)


@contextmanager
def scene_apart(name: str) -> Iterator[tuple[bpy.types.Scene, AddedData]]:
    """A temporary scene, removed at the end with everything that was added meanwhile; nothing else changes."""
    added = AddedData()
    try:
        yield bpy.data.scenes.new(name), added
    finally:
        added.remove()


def _find_collection(scene: bpy.types.Scene, name: str) -> bpy.types.Collection | None:
    """The scene's collection `name`, with any number that Blender gave it."""
    return next((collection for collection in scene.collection.children if collection.name.split(".")[0] == name), None)


def own_collection(scene: bpy.types.Scene, name: str) -> bpy.types.Collection:
    """The scene's collection `name`; made where absent."""
    collection = _find_collection(scene, name)
    if collection is None:
        collection = bpy.data.collections.new(name)
        scene.collection.children.link(collection)
    return collection


def remove_own(scene: bpy.types.Scene, name: str, objects: list[bpy.types.Object]) -> int:
    """Remove objects with their data, and the collection `name` once it is empty; returns how many."""
    data = {obj.data for obj in objects}
    bpy.data.batch_remove(objects)
    bpy.data.batch_remove([datablock for datablock in data if not datablock.users])
    collection = _find_collection(scene, name)
    if collection is not None and not collection.all_objects:
        bpy.data.collections.remove(collection)
    return len(objects)
