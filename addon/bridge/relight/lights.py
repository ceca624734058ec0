"""New lights for the room: where a photographer would put them, as strong as the room's own light.

All of them are lamps of Blender's with the custom property `KIND`; `relight/aim.py` says where they stand. Their power
follows from the irradiance E that they are to give at the target, at normal incidence, at the distance d:

- area light of area A, power P, spread s: E = P / (pi A) * integral of n(a) cos(a)^2 / r^2 over the light, with its
                                      falloff n = (tan(s/2) - tan(a)) / (tan(s/2) - s/2), 1 without spread;
- spot of power P:                    E = P / (4 pi d^2), as Blender spreads the power over the whole sphere;
- parallel beam of area A, power P:   E = P / A;
- sun of strength S:                  E = S.

Colours are temperatures, which keep the luminance.
"""

import math

import bpy
import numpy as np
from mathutils import Matrix

from ..data.added import own_collection, remove_own
from ..light.room import room_light
from ..light.units import ROOM, set_strength
from .aim import Placement, softbox_place, spot_place, sun_place, window_place
from .subject import Subject, side_of, subject_of

KIND = "scan_relight_light"
"""Custom property of a light that was added here: which of `PRESETS`."""
COLLECTION = "New Lights"
WINDOW, SOFTBOX, SPOT, SUN = "WINDOW", "SOFTBOX", "SPOT", "SUN"
PRESETS = (WINDOW, SOFTBOX, SPOT, SUN)
KELVIN = {WINDOW: 7500.0, SOFTBOX: 5500.0, SPOT: 3200.0, SUN: 2900.0}
"""Overcast sky, studio lamp, halogen, low sun."""
NAMES = {WINDOW: "Window light", SOFTBOX: "Softbox", SPOT: "Spot", SUN: "Evening sun"}
_RELATIVE_IRRADIANCE = {WINDOW: 4.0, SOFTBOX: 2.0, SPOT: 4.0, SUN: 24.0}
"""Irradiance on the target relative to the room's own. A light from one side has to compensate for all that it leaves
in shadow, and a small patch of sun looks like sun only where it is much brighter than its surroundings."""
_SPREAD = {WINDOW: math.radians(160), SOFTBOX: math.radians(100)}
"""Less than a half-space: an area light then falls off to its sides and leaves no edge on surfaces beside it."""
_PLACEMENTS = {WINDOW: window_place, SOFTBOX: softbox_place, SPOT: spot_place, SUN: sun_place}
_BEAM = math.radians(12.0)


def add_light(
    scene: bpy.types.Scene,
    preset: str,
    strength: float = 1.0,
    aim: str = "VIEW",
    obj: bpy.types.Object | None = None,
    kelvin: float | None = None,
    unit: str = ROOM,
) -> bpy.types.Object:
    """Add a light in the room, aimed at what the camera sees.

    Parameters
    ----------
    preset : str
        One of `PRESETS`.
    aim, obj
        See `light.room.target_of`.
    kelvin : float, optional
        Temperature of its colour; by default the preset's in `KELVIN`.
    unit : str
        Of `strength`, see `light.units`; `ROOM`: a factor on the light that falls on the target, 1 keeps the exposure
        readable.

    Raises
    ------
    BadInputError
        No room in the scene, or no object to aim at.
    """
    subject = subject_of(scene, aim, obj)
    placement = _PLACEMENTS[preset](scene, subject)
    irradiance = room_light(scene) * _RELATIVE_IRRADIANCE[preset] * (strength if unit == ROOM else 1.0)
    data = _lamp(preset, placement, (subject.target - placement.origin).length, irradiance, subject.radius)
    data.temperature = kelvin or KELVIN[preset]
    if unit != ROOM:
        set_strength(data, strength, unit)
    data.name = _name(scene, preset, subject, placement)
    return put_light(scene, preset, data, Matrix.LocRotScale(placement.origin, placement.rotation, None))


def put_light(scene: bpy.types.Scene, preset: str, data: bpy.types.Light, pose: Matrix) -> bpy.types.Object:
    """Put a lamp of Blender's into the room as one of the new lights."""
    light = bpy.data.objects.new(data.name, data)
    light.matrix_world, light[KIND] = pose, preset
    light.visible_camera = False  # it lights the picture; it is not part of it
    own_collection(scene, COLLECTION).objects.link(light)
    return light


def _name(scene, preset: str, subject: Subject, placement: Placement) -> str:
    """Name of a light, by what it does: "Softbox from the left", "Spot on sofa 12"."""
    if preset == SPOT and subject.name:
        return f"{NAMES[preset]} on {subject.name}"
    return f"{NAMES[preset]} from {side_of(scene, subject.target, placement.origin)}"


def added_lights(scene: bpy.types.Scene) -> list[bpy.types.Object]:
    """The lights that `add_light` made and that still exist."""
    return [obj for obj in scene.objects if obj.type == "LIGHT" and KIND in obj]


def remove_lights(scene: bpy.types.Scene) -> int:
    """Remove all added lights; returns how many."""
    return remove_own(scene, COLLECTION, added_lights(scene))


def _lamp(
    preset: str, placement: Placement, distance: float, irradiance: float, radius: float = 0.6
) -> bpy.types.Light:
    """The lamp that gives `irradiance` on the target, `radius` metres around it."""
    area = placement.width * placement.height
    kind = "SUN" if preset == SUN and placement.outside else "SPOT" if preset == SPOT else "AREA"
    data = bpy.data.lights.new(NAMES[preset], kind)
    data.use_temperature, data.color = True, (1, 1, 1)
    if kind == "SUN":
        data.energy, data.angle = irradiance, math.radians(0.53)
    elif kind == "SPOT":
        data.energy = irradiance * 4 * math.pi * distance**2
        # The cone falls off from its axis to its rim, so it is wider than the target.
        data.spot_size = min(max(2 * math.atan(2.2 * radius / distance), math.radians(40)), math.radians(80))
        data.spot_blend, data.shadow_soft_size = 1.0, min(0.05 * distance, 0.1)
    else:
        data.shape, data.size, data.size_y = "RECTANGLE", placement.width, placement.height
        data.spread = _BEAM if preset == SUN else _SPREAD[preset]
        per_watt = 1 / area if preset == SUN else _irradiance_per_watt(placement, distance, data.spread)
        data.energy = irradiance / per_watt
    return data


def _irradiance_per_watt(placement: Placement, distance: float, spread: float) -> float:
    """Irradiance on the axis of an area light of 1 W, per square metre."""
    x, y = (((np.arange(32) + 0.5) / 32 - 0.5) * size for size in (placement.width, placement.height))
    tangent = np.hypot(*np.meshgrid(x, y)) / distance  # tangent of the angle from the axis
    max_tangent = math.tan(spread / 2)
    falloff = np.maximum(max_tangent - tangent, 0) / (max_tangent - spread / 2)
    return float((falloff / (1 + tangent**2) ** 2).mean()) / (math.pi * distance**2)
