"""New lights for the room: where a photographer would put them, as strong as the room's own light.

All of them are lamps of Blender's with the custom property `KIND`; `relight_aim.py` says where they stand. Their power
follows from the irradiance E that they are to throw on the target, straight on, at the distance d:

- disc of area A, power P:          E = P / (pi (r^2 + d^2)), r^2 = A / pi (a Lambertian disc seen from its axis);
- spot of power P:                  E = P / (4 pi d^2), as Blender spreads the power over the whole sphere;
- parallel beam of area A, power P: E = P / A;
- sun of strength S:                E = S.
"""

from __future__ import annotations

import math

import bpy
from mathutils import Matrix

from ..core.errors import BadInputError
from .own_collection import own_collection
from .relight_aim import Placement, softbox_place, spot_place, sun_place, window_place
from .relight_room import OBJECT, room_light, target_of

KIND = "scan_relight_light"
"""Custom property of a light that was added here: which of `PRESETS`."""
COLLECTION = "New Lights"
WINDOW, SOFTBOX, SPOT, SUN = "WINDOW", "SOFTBOX", "SPOT", "SUN"
PRESETS = (WINDOW, SOFTBOX, SPOT, SUN)
TINTS = {WINDOW: (0.86, 0.93, 1.0), SOFTBOX: (1.0, 0.95, 0.88), SPOT: (1.0, 0.86, 0.68), SUN: (1.0, 0.62, 0.32)}
"""Linear Rec.709, largest component 1: overcast sky, studio lamp, halogen, low sun."""
NAMES = {WINDOW: "Window light", SOFTBOX: "Softbox", SPOT: "Spot", SUN: "Evening sun"}
_STRONGER = {WINDOW: 4.0, SOFTBOX: 2.0, SPOT: 4.0, SUN: 24.0}
"""Irradiance on the target relative to the room's own. A light from one side has to make up for all that it leaves in
the dark, and a small patch of sun is read as sun only where it is much brighter than its surroundings."""
_PLACES = {WINDOW: window_place, SOFTBOX: softbox_place, SPOT: spot_place, SUN: sun_place}
_BEAM = math.radians(4.0)


def add_light(scene: bpy.types.Scene, preset: str, strength: float = 1.0, aim: str = "VIEW",
              thing: bpy.types.Object | None = None,
              colour: tuple[float, float, float] | None = None) -> bpy.types.Object:
    """Add a light within the room, aimed at what is looked at.

    Parameters
    ----------
    scene : bpy.types.Scene
    preset : str
        One of `PRESETS`.
    strength : float
        1 keeps the exposure readable; a factor on the light that falls on the target.
    aim : str
        See `relight_room.target_of`.
    thing : bpy.types.Object, optional
        What `aim` = "OBJECT" means.
    colour : (3,) tuple of float, optional
        Linear Rec.709; by default the preset's in `TINTS`.

    Raises
    ------
    BadInputError
        No such preset, no room in the scene, or no object to aim at.
    """
    if preset not in PRESETS:
        raise BadInputError(f"There is no light '{preset}'; choose one of {', '.join(PRESETS)}.")
    target = target_of(scene, aim, thing)
    place = _PLACES[preset](scene, target, thing if aim == OBJECT else None)
    irradiance = room_light(scene) * _STRONGER[preset] * strength
    data = _lamp(preset, place, (target - place.origin).length, irradiance)
    data.color = colour or TINTS[preset]
    light = bpy.data.objects.new(NAMES[preset], data)
    light.matrix_world = Matrix.LocRotScale(place.origin, place.rotation, None)
    light[KIND] = preset
    light.visible_camera = False  # it lights the picture; it is not part of it
    own_collection(scene, COLLECTION).objects.link(light)
    return light


def added_lights(scene: bpy.types.Scene) -> list[bpy.types.Object]:
    """The lights that `add_light` made and that are still there."""
    return [thing for thing in scene.objects if thing.type == "LIGHT" and KIND in thing]


def remove_lights(scene: bpy.types.Scene) -> int:
    """Take all added lights away; returns how many."""
    lights = added_lights(scene)
    data = {light.data for light in lights}
    bpy.data.batch_remove(lights)
    bpy.data.batch_remove([one for one in data if not one.users])
    part = next((c for c in scene.collection.children if c.name.split(".")[0] == COLLECTION), None)
    if part and not part.all_objects:
        bpy.data.collections.remove(part)
    return len(lights)


def _lamp(preset: str, place: Placement, distance: float, irradiance: float) -> bpy.types.Light:
    """The lamp that throws `irradiance` on the target."""
    area = place.width * place.height
    if preset == SUN and place.outside:
        data = bpy.data.lights.new(NAMES[preset], "SUN")
        data.energy, data.angle = irradiance, math.radians(0.53)
        return data
    if preset == SPOT:
        data = bpy.data.lights.new(NAMES[preset], "SPOT")
        data.energy = irradiance * 4 * math.pi * distance ** 2
        data.spot_size, data.spot_blend, data.shadow_soft_size = math.radians(65), 0.6, 0.04
        return data
    data = bpy.data.lights.new(NAMES[preset], "AREA")
    data.shape, data.size, data.size_y = "RECTANGLE", place.width, place.height
    if preset == SUN:
        data.spread, data.energy = _BEAM, irradiance * area
    else:
        data.energy = irradiance * (area + math.pi * distance ** 2)
    return data
