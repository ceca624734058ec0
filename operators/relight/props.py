"""Properties of the panels Relight and Export: lamps and outside, and choices for the next operator.

The properties of lamps and outside store nothing: they read and write what the bridge stores with material and world.
"""

import math

import bpy

from ...addon.bridge.light import lamps, outside, switch, units
from ...addon.bridge.light.kelvin import HIGHEST, LOWEST
from ...addon.bridge.relight import match_frame
from ...addon.bridge.relight import setup as relight_setup
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
LOOKS = (
    ("MATTE", "Matte", "Grey, like chalk"),
    ("GLOSSY", "Glossy", "Red lacquer"),
    ("MIRROR", "Mirror", "Polished metal, to see the room's light in"),
)


_FACTOR = {"min": 0.0, "soft_max": 4.0, "step": 5, "precision": 2}
_TEMPERATURE = {"subtype": "TEMPERATURE", "max": HIGHEST, "step": 10000, "precision": 0}
_LUMENS = {"min": 0.0, "soft_max": 100000.0, "step": 1000, "precision": 0}

# Shared by the panel's choices and the operators that take them.
SHAPE = bpy.props.EnumProperty(
    name="Shape",
    description="What is set into the room",
    items=(("SPHERE", "Sphere", "A ball"), ("CUBE", "Cube", "A cube"), ("MONKEY", "Suzanne", "Blender's monkey")),
)
LOOK = bpy.props.EnumProperty(
    name="Material", description="Of the new object", items=LOOKS, default="MIRROR", translation_context=OWN
)
SIZE = bpy.props.FloatProperty(
    name="Size", description="Its largest extent", subtype="DISTANCE", min=0.001, soft_max=2.0, default=0.3
)
ENGINE = bpy.props.EnumProperty(
    name="Engine",
    description="Renders the two pictures",
    items=(
        ("CYCLES", "Cycles", "Path tracing: the room's own light bounces"),
        ("EEVEE", "EEVEE", "Quick; indirect light and large lamps are only approximate"),
    ),
)
AIM = bpy.props.EnumProperty(name="Aim At", description="What a new light is aimed at", items=AIMS)
UNIT = bpy.props.EnumProperty(name="Strength In", description="What a new light's strength is given in", items=UNITS)
KELVIN = bpy.props.FloatProperty(
    name="Temperature",
    description="Colour of a new light: 2700 a warm bulb, 6500 daylight; 0 takes what suits its kind",
    min=0.0,
    **_TEMPERATURE,
)
PLACE = bpy.props.EnumProperty(name="Place", description="Where an object is set down", items=PLACES)
SAMPLES = bpy.props.IntProperty(
    name="Samples", description="For each pixel; 0 takes the scene's", min=0, soft_max=4096, default=64
)
PERCENTAGE = bpy.props.IntProperty(
    name="Size",
    description="Of the scene's render size",
    subtype="PERCENTAGE",
    min=1,
    soft_max=100,
    max=1000,
    default=100,
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

    on: bpy.props.BoolProperty(
        name="On", description="Whether this lamp shines", **_lamp_property(lamps.is_on, lamps.set_on, False)
    )
    factor: bpy.props.FloatProperty(
        name="Strength x",
        description="Times the radiance that the scan found; 1 is the lamp as captured",
        max=switch.MAX_FACTOR,
        **_FACTOR,
        **_lamp_property(lamps.factor, lamps.set_factor, 1.0),
    )
    colour: bpy.props.FloatVectorProperty(
        name="Colour",
        description="Colour of its light",
        subtype="COLOR",
        size=3,
        min=0.0,
        soft_max=1.0,
        **_lamp_property(lambda material: lamps.colour(material) or (1.0,) * 3, lamps.set_colour, (1.0,) * 3),
    )
    kelvin: bpy.props.FloatProperty(
        name="Temperature",
        description="Colour of its light as a temperature, at the same luminance: 2700 a warm bulb, 6500 daylight",
        min=LOWEST,
        **_TEMPERATURE,
        **_lamp_property(lamps.kelvin, lamps.set_kelvin, 6500.0),
    )


class ScanRelightLight(bpy.types.PropertyGroup):
    """`Light.scan_relight_light`: a lamp of Blender's in lumens."""

    lumens: bpy.props.FloatProperty(
        name="Lumens",
        description="Luminous flux in lumens, a sun's in lux: 683 for each radiant watt of white light",
        **_LUMENS,
        **_stored_property(units.lumens, units.set_lumens),
    )


class ScanRelightOutside(bpy.types.PropertyGroup):
    """`World.scan_relight_outside`."""

    on: bpy.props.BoolProperty(
        name="Light from Outside",
        description="Whether light comes in from outside the scanned room",
        **_stored_property(outside.is_on, outside.set_on),
    )
    factor: bpy.props.FloatProperty(
        name="Strength",
        description="Times the light from outside that was recovered, or the picture's",
        max=switch.MAX_FACTOR,
        **_FACTOR,
        **_stored_property(outside.factor, outside.set_factor),
    )
    rotation: bpy.props.FloatProperty(
        name="Rotation",
        description="Turns the outside about the vertical, anticlockwise from above",
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

    lamp: bpy.props.IntProperty(
        name="Lamp",
        description="Click to select the lamp in the scene",
        get=lambda self: active_row(self.id_data),
        set=lambda self, row: choose_row(self.id_data, row),
    )
    frame: bpy.props.IntProperty(
        name="Frame",
        description="Look through the camera of this frame of the capture",
        get=lambda self: max(match_frame.current(self.id_data), 0),
        set=lambda self, index: look_through(self, index),
    )
    match_size: bpy.props.BoolProperty(
        name="Match Render Size",
        description="Going to a frame also sets the render size and the shape of the pixels to the frame's",
        update=_frame_changed,
    )
    show_frame: bpy.props.BoolProperty(
        name="Show Its Picture",
        description="Lay the frame's picture behind the scene, under the scene's exposure",
        default=True,
        update=_frame_changed,
    )
    frame_front: bpy.props.BoolProperty(
        name="In Front", description="Lay the picture before the scene instead of behind", update=_frame_changed
    )
    frame_alpha: bpy.props.FloatProperty(
        name="Opacity",
        description="Of the frame's picture",
        min=0.0,
        max=1.0,
        default=1.0,
        subtype="FACTOR",
        update=_frame_changed,
    )
    follow: bpy.props.BoolProperty(
        name="Follow",
        description="Set the exposure after each change of the light here, by an estimate, good to "
        "about a stop; nothing is rendered",
        update=lambda self, context: follow(self.id_data),
    )
    setup: bpy.props.StringProperty(
        name="Set-Up",
        description="The present light as a preset keeps it",
        options={"SKIP_SAVE"},
        get=lambda self: relight_setup.setup_of(self.id_data),
        set=lambda self, text: relight_setup.apply_setup(self.id_data, text),
    )
    aim: AIM
    unit: UNIT
    strength: bpy.props.FloatProperty(
        name="Strength x",
        description="Of a new light, times what keeps the scene's exposure readable",
        default=1.0,
        **_FACTOR,
    )
    watts: bpy.props.FloatProperty(
        name="Power",
        description="Radiant power of a new light, as Blender's own lamps have it; of a sun for each square metre",
        subtype="POWER",
        unit="POWER",
        min=0.0,
        soft_max=1000.0,
        default=10.0,
    )
    lumens: bpy.props.FloatProperty(
        name="Lumens",
        description="Luminous flux of a new light: 683 lm for each radiant watt of white; of a sun in lux",
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
