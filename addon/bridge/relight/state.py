"""The light as it was captured, for as long as a picture of it takes; afterwards everything is as it was."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import bpy

from ..light import lamps as relight_lamps
from ..light import outside as relight_outside
from . import lights


@contextmanager
def captured_light(scene: bpy.types.Scene) -> Iterator[None]:
    """Within: recovered lamps and world, no other lamp of Blender's. Afterwards: the artist's light again, exactly."""
    lamps = relight_lamps.find_lamps(scene)
    world, kept_world = scene.world, scene.get(relight_outside.RECOVERED)
    hidden = {thing: thing.hide_render for thing in scene.objects if thing.type == "LIGHT"}
    states = [(lamp, relight_lamps.snapshot(lamp)) for lamp in lamps]
    recovered = relight_outside.recovered_world(scene)
    outside = relight_outside.snapshot(recovered)
    try:
        for lamp in lamps:
            relight_lamps.restore(lamp)
        relight_outside.restore(scene)
        for thing in hidden:
            thing.hide_render = True
        yield
    finally:
        for lamp, state in states:
            relight_lamps.put_back(lamp, state)
        scene.world = world
        relight_outside.put_back(recovered, outside)
        if kept_world is not None:
            scene[relight_outside.RECOVERED] = kept_world
        for thing, was in hidden.items():
            thing.hide_render = was


def is_relit(scene: bpy.types.Scene) -> bool:
    """Whether the scene's light differs from the captured one."""
    return (
        any(map(relight_lamps.is_changed, relight_lamps.find_lamps(scene)))
        or relight_outside.is_changed(scene)
        or any(not light.hide_render for light in lights.added_lights(scene))
    )


def restore_captured(scene: bpy.types.Scene) -> None:
    """Back to the captured light for good: lamps and outside restored, added lights removed."""
    for lamp in relight_lamps.find_lamps(scene):
        relight_lamps.restore(lamp)
    relight_outside.restore(scene)
    lights.remove_lights(scene)
