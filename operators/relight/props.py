"""Properties of the panels Relight and Export: lamps and outside, and choices for the next operator.

The properties of lamps and outside store nothing: they read and write what the bridge stores with material and world.
"""

import math

import bpy

from ...addon.bridge.light import lamps, outside, switch, units
from ...addon.bridge.light.kelvin import HIGHEST, LOWEST
from ...addon.bridge.relight import match_frame
from ...addon.bridge.relight import setup as relight_setup
from ..base.properties import (
    bool_property,
    enum_property,
    float_property,
    int_property,
    string_property,
    vector_property,
)
from ..results.panel import active_row, choose_row
from ..translations import OWN
from .base import follow, follow_soon

UNITS = (
    ("ROOM", "Room's Light", "Relative to the light that the room was scanned in, so that the exposure can stay"),
    ("WATT", "Watts", "Radiant power, as Blender's own lamps have it; a sun: for each square metre"),
    ("LUMEN", "Lumens", "683 lm for each radiant watt of white light; a sun: lux"),
)
AIMS = (
    ("VIEW", "View", "What the middle of the camera's picture shows"),
    ("CURSOR", "3D Cursor", "Where the 3D cursor is"),
    ("OBJECT", "Object", "The active object"),
)
PLACES = AIMS[:2]
SHAPES = (("SPHERE", "Sphere", "A ball"), ("CUBE", "Cube", "A cube"), ("MONKEY", "Suzanne", "Blender's monkey"))
LOOKS = (
    ("MATTE", "Matte", "Grey, like chalk"),
    ("GLOSSY", "Glossy", "Red lacquer"),
    ("MIRROR", "Mirror", "Polished metal, to see the room's light in"),
)
ENGINES = (
    ("CYCLES", "Cycles", "Path tracing: the room's own light bounces"),
    ("EEVEE", "EEVEE", "Quick; indirect light and large lamps are only approximate"),
)


_FACTOR = {"min": 0.0, "soft_max": 4.0, "step": 5, "precision": 2}
_TEMPERATURE = {"subtype": "TEMPERATURE", "max": HIGHEST, "step": 10000, "precision": 0}
_LUMENS = {"min": 0.0, "soft_max": 100000.0, "step": 1000, "precision": 0}

# Shared by the panel's choices and the operators that take them.
SHAPE = enum_property("Shape", "What is set into the room", SHAPES)
LOOK = enum_property("Material", "Of the new object", LOOKS, default="MIRROR", translation_context=OWN)
SIZE = float_property("Size", "Its largest extent", subtype="DISTANCE", min=0.001, soft_max=2.0, default=0.3)
ENGINE = enum_property("Engine", "Renders the two pictures", ENGINES)
AIM = enum_property("Aim At", "What a new light is aimed at", AIMS)
UNIT = enum_property("Strength In", "What a new light's strength is given in", UNITS)
KELVIN = float_property(
    "Temperature",
    "Colour of a new light: 2700 a warm bulb, 6500 daylight; 0 takes what suits its kind",
    min=0.0,
    **_TEMPERATURE,
)
PLACE = enum_property("Place", "Where an object is set down", PLACES)
SAMPLES = int_property("Samples", "For each pixel; 0 takes the scene's", min=0, soft_max=4096, default=64)
PERCENTAGE = int_property(
    "Size", "Of the scene's render size", subtype="PERCENTAGE", min=1, soft_max=100, max=1000, default=100
)


def _stored_property(read, change) -> dict:
    """Getter and setter of a property that the bridge stores with its owner; the exposure follows a change."""

    def set_value(group, value):
        change(group.id_data, value)
        follow_soon()

    return {"get": lambda group: read(group.id_data), "set": set_value}


def _lamp_property(read, change, default) -> dict:
    """The same for a material, as long as it is a lamp's."""
    return _stored_property(
        lambda material: read(material) if lamps.is_lamp(material) else default,
        lambda material, value: change(material, value) if lamps.is_lamp(material) else None,
    )


class ScanRelightLamp(bpy.types.PropertyGroup):
    """`Material.scan_relight_lamp`."""

    on: bool_property("On", "Whether this lamp shines", **_lamp_property(lamps.is_on, lamps.set_on, False))
    factor: float_property(
        "Strength x",
        "Times the radiance that the scan found; 1 is the lamp as captured",
        max=switch.MAX_FACTOR,
        **_FACTOR,
        **_lamp_property(lamps.factor, lamps.set_factor, 1.0),
    )
    colour: vector_property(
        "Colour",
        "Colour of its light",
        subtype="COLOR",
        min=0.0,
        soft_max=1.0,
        **_lamp_property(lambda material: lamps.colour(material) or (1.0,) * 3, lamps.set_colour, (1.0,) * 3),
    )
    kelvin: float_property(
        "Temperature",
        "Colour of its light as a temperature, at the same luminance: 2700 a warm bulb, 6500 daylight",
        min=LOWEST,
        **_TEMPERATURE,
        **_lamp_property(lamps.kelvin, lamps.set_kelvin, 6500.0),
    )


class ScanRelightLight(bpy.types.PropertyGroup):
    """`Light.scan_relight_light`: a lamp of Blender's in lumens."""

    lumens: float_property(
        "Lumens",
        "Luminous flux in lumens, a sun's in lux: 683 for each radiant watt of white light",
        **_LUMENS,
        **_stored_property(units.lumens, units.set_lumens),
    )


class ScanRelightOutside(bpy.types.PropertyGroup):
    """`World.scan_relight_outside`."""

    on: bool_property(
        "Light from Outside",
        "Whether light comes in from outside the scanned room",
        **_stored_property(outside.is_on, outside.set_on),
    )
    factor: float_property(
        "Strength",
        "Times the light from outside that was recovered, or the picture's",
        max=switch.MAX_FACTOR,
        **_FACTOR,
        **_stored_property(outside.factor, outside.set_factor),
    )
    rotation: float_property(
        "Rotation",
        "Turns the outside about the vertical, anticlockwise from above",
        subtype="ANGLE",
        soft_min=-math.pi,
        soft_max=math.pi,
        step=100,
        **_stored_property(outside.rotation, outside.set_rotation),
    )


def look_through(studio, index: int, size: bool = False) -> str:
    """Make the scene's camera that of a frame, its picture shown as chosen; returns the sentence of `match_frame`."""
    return match_frame.match_frame(
        studio.id_data,
        index,
        studio.show_frame,
        studio.frame_alpha,
        studio.frame_front,
        bpy.path.abspath(studio.id_data.scan_relight.capture_folder),
        size or studio.match_size,
    )


def _frame_changed(studio, context):
    index = match_frame.current(studio.id_data)
    if index >= 0:
        look_through(studio, index)


class ScanRelightStudio(bpy.types.PropertyGroup):
    """`Scene.scan_relight_studio`."""

    lamp: int_property(
        "Lamp",
        "Click to select the lamp in the scene",
        get=lambda self: active_row(self.id_data),
        set=lambda self, row: choose_row(self.id_data, row),
    )
    frame: int_property(
        "Frame",
        "Look through the camera of this frame of the capture",
        get=lambda self: max(match_frame.current(self.id_data), 0),
        set=lambda self, index: look_through(self, index),
    )
    match_size: bool_property(
        "Match Render Size",
        "Going to a frame also sets the render size and the shape of the pixels to the frame's",
        update=_frame_changed,
    )
    show_frame: bool_property(
        "Show Its Picture",
        "Lay the frame's picture behind the scene, under the scene's exposure",
        default=True,
        update=_frame_changed,
    )
    frame_front: bool_property("In Front", "Lay the picture before the scene instead of behind", update=_frame_changed)
    frame_alpha: float_property(
        "Opacity", "Of the frame's picture", min=0.0, max=1.0, default=1.0, subtype="FACTOR", update=_frame_changed
    )
    follow: bool_property(
        "Follow",
        "Set the exposure after each change of the light here, by an estimate, good to "
        "about a stop; nothing is rendered",
        update=lambda self, context: follow(self.id_data),
    )
    setup: string_property(
        "Set-Up",
        "The present light as a preset keeps it",
        options={"SKIP_SAVE"},
        get=lambda self: relight_setup.setup_of(self.id_data),
        set=lambda self, text: relight_setup.apply_setup(self.id_data, text),
    )
    aim: AIM
    unit: UNIT
    strength: float_property(
        "Strength x", "Of a new light, times what keeps the scene's exposure readable", default=1.0, **_FACTOR
    )
    watts: float_property(
        "Power",
        "Radiant power of a new light, as Blender's own lamps have it; of a sun for each square metre",
        subtype="POWER",
        unit="POWER",
        min=0.0,
        soft_max=1000.0,
        default=10.0,
    )
    lumens: float_property(
        "Lumens",
        "Luminous flux of a new light: 683 lm for each radiant watt of white; of a sun in lux",
        default=800.0,
        **_LUMENS,
    )
    kelvin: KELVIN
    place: PLACE
    shape: SHAPE
    look: LOOK
    size: SIZE
    engine: ENGINE
    samples: SAMPLES
    percentage: PERCENTAGE
