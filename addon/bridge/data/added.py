"""Data that is added to the open file: so that it can be taken away again, and in collections of its own."""

from collections.abc import Iterable, Iterator
from contextlib import contextmanager

import bpy

KINDS = tuple(
    "scenes collections objects meshes curves armatures cameras lights shape_keys materials worlds node_groups images "
    "textures actions texts".split()
)
"""Owners come before what they own."""


class Made:
    """What has been added to the open file since this was made."""

    def __init__(self):
        self._before = {one.session_uid for kind in KINDS for one in getattr(bpy.data, kind)}

    def new(self, kind: str) -> list:
        """What is new among one of `KINDS`."""
        return [one for one in getattr(bpy.data, kind) if one.session_uid not in self._before]

    def remove(self) -> None:
        """Take all of it away, but for pictures that what was there shows already."""
        for kind in KINDS:
            found = [one for one in self.new(kind) if kind != "images" or one.users == one.use_fake_user]
            if found:
                bpy.data.batch_remove(found)

    def remove_unused(self, also: Iterable[int] = ()) -> None:
        """Take away what nothing uses: of what is new, and of the data whose `session_uid` is in `also`."""
        also = set(also)
        for kind in KINDS[1:]:
            while found := [
                one
                for one in getattr(bpy.data, kind)
                if (one.session_uid not in self._before or one.session_uid in also)
                and not one.users
                and not one.library
            ]:
                bpy.data.batch_remove(found)


@contextmanager
def scene_apart(name: str) -> Iterator[tuple[bpy.types.Scene, Made]]:
    """A scene of its own; it goes with all that came into the file meanwhile, and nothing else changes."""
    made = Made()
    try:
        yield bpy.data.scenes.new(name), made
    finally:
        made.remove()


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


def remove_own(scene: bpy.types.Scene, name: str, things: list[bpy.types.Object]) -> int:
    """Take things away with their data, and the collection `name` once it is empty; returns how many."""
    data = {thing.data for thing in things}
    bpy.data.batch_remove(things)
    bpy.data.batch_remove([one for one in data if not one.users])
    part = _known(scene, name)
    if part is not None and not part.all_objects:
        bpy.data.collections.remove(part)
    return len(things)
