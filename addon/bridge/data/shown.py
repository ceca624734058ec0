"""Running Blender's operators on a scene of our own, with the user's left unchanged."""

from collections.abc import Iterator
from contextlib import contextmanager, nullcontext

import bpy


@contextmanager
def in_window(scene: bpy.types.Scene) -> Iterator[None]:
    """Show `scene` in Blender's window temporarily, so that operators work on it.

    The context is not overridden where there is a window in it: of one that is, Blender looks each member up in a dict
    of Python's while an operator has let go of the interpreter's lock, and crashes if another thread runs Python then
    (the memory guard's, the lock's).
    """
    window = bpy.context.window or bpy.context.window_manager.windows[0]
    before = window.scene, window.view_layer
    window.scene = scene
    try:
        with nullcontext() if bpy.context.window else bpy.context.temp_override(window=window):
            yield
    finally:
        window.scene, window.view_layer = before
