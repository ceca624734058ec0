"""`bpy.ops.scan_relight.*` for the light: switch and restore lamps, add lights, another picture around the room."""

# No `from __future__ import annotations` here: Blender reads the properties off the annotations.
import atexit
from pathlib import Path

import bpy

from ...addon.bridge.light import lamps, outside
from ...addon.bridge.relight import lights, setup
from ...addon.core.errors import BadInputError
from ..base import poll
from ..results.select import make_active
from .base import RelightOperator
from .exposure import follow
from .props import AIM, KELVIN, UNIT

PRESETS = (
    ("WINDOW", "Window", "A window's soft, cool light from the side"),
    ("SOFTBOX", "Softbox", "A studio light beside the camera"),
    ("SPOT", "Spot", "A spot from above, a little on the camera's side"),
    ("SUN", "Evening Sun", "A low, warm sun: through an opening of the scan, else as a window would let it in"),
)
FOLDER = Path(__file__).resolve().parents[1] / "thumbnails"
_pictures = None


def picture(name: str) -> int:
    """Blender's number of a preset's picture; 0, for none, where it has no window to show one in."""
    global _pictures
    if bpy.app.background:
        return 0
    if _pictures is None:
        from bpy.utils import previews

        _pictures = previews.new()
        atexit.register(forget_pictures)
    path = FOLDER / f"{name.lower()}.png"
    if name not in _pictures:
        _pictures.load(name, str(path), "IMAGE")
    return _pictures[name].icon_id


def forget_pictures() -> None:
    """Let go of the pictures."""
    global _pictures
    if _pictures is not None:
        from bpy.utils import previews

        previews.remove(_pictures)
        _pictures = None
        atexit.unregister(forget_pictures)


class SCAN_RELIGHT_OT_switch_lamps(RelightOperator, bpy.types.Operator):
    """Switch all lamps of the scan on or off; their strength and colour stay"""

    bl_idname = "scan_relight.switch_lamps"
    bl_label = "Switch All Lamps"

    on: bpy.props.BoolProperty(name="On", description="On or off", default=False)

    def work(self, context):
        for lamp in lamps.find_lamps(context.scene):
            lamps.set_on(lamp, self.on)
        follow(context.scene)


class SCAN_RELIGHT_OT_restore_lamp(RelightOperator, bpy.types.Operator):
    """Make this lamp exactly what the scan found"""

    bl_idname = "scan_relight.restore_lamp"
    bl_label = "Restore Lamp"

    name: bpy.props.StringProperty(name="Lamp", description="Name of its material, or its class")

    def work(self, context):
        for lamp in lamps.lamp_named(context.scene, self.name):
            lamps.restore(lamp)
        follow(context.scene)


@poll.needs(lambda context: setup.is_relit(context.scene), "The light is as it was captured.")
class SCAN_RELIGHT_OT_restore_light(RelightOperator, bpy.types.Operator):
    """Make lamps and outside exactly what was recovered, and remove the lights that were added here"""

    bl_idname = "scan_relight.restore_light"
    bl_label = "Restore Captured Light"

    def work(self, context):
        setup.restore_captured(context.scene)
        follow(context.scene)


class SCAN_RELIGHT_OT_add_light(RelightOperator, bpy.types.Operator):
    """Add a light inside the room"""

    bl_idname = "scan_relight.add_light"
    bl_label = "Add Light"

    preset: bpy.props.EnumProperty(name="Light", description="What kind of light", items=PRESETS)
    strength: bpy.props.FloatProperty(
        name="Strength",
        description="In the unit below; of the room's light 1 keeps the scene's exposure readable",
        min=0.0,
        soft_max=4.0,
        default=1.0,
    )
    unit: UNIT
    kelvin: KELVIN
    aim: AIM

    @classmethod
    def description(cls, context, properties):
        text = next(text for name, _, text in PRESETS if name == properties.preset)
        return f"{text}; stands inside the room, as strong as the room's own light asks for"

    def work(self, context):
        light = lights.add_light(
            context.scene, self.preset, self.strength, self.aim, context.object, self.kelvin or None, self.unit
        )
        make_active(context, light)
        follow(context.scene)


@poll.needs(lambda context: lights.added_lights(context.scene), "No light was added here.")
class SCAN_RELIGHT_OT_remove_lights(RelightOperator, bpy.types.Operator):
    """Remove all lights that were added here"""

    bl_idname = "scan_relight.remove_lights"
    bl_label = "Remove New Lights"

    def work(self, context):
        lights.remove_lights(context.scene)
        follow(context.scene)


def put_around(scene, picture: str) -> list[str]:
    """Put a picture around the room, scaled to a day outside such a room; returns warnings."""
    outside.use_hdri(scene, picture, outside.usual_radiance(scene))
    return outside.remarks(scene)


class SCAN_RELIGHT_OT_use_hdri(RelightOperator, bpy.types.Operator):
    """Put an equirectangular HDR picture around the room; the recovered outside is kept"""

    bl_idname = "scan_relight.use_hdri"
    bl_label = "Picture Around the Room"

    filepath: bpy.props.StringProperty(
        name="Picture", description="EXR or HDR file", subtype="FILE_PATH", options={"SKIP_SAVE"}
    )
    filter_glob: bpy.props.StringProperty(default="*.exr;*.hdr;*.png;*.jpg", options={"HIDDEN"})

    def invoke(self, context, event):
        if self.filepath:
            return self.execute(context)
        context.window_manager.fileselect_add(self)
        return {"RUNNING_MODAL"}

    def work(self, context):
        if not self.filepath:
            raise BadInputError("Choose the picture first.")
        return put_around(context.scene, bpy.path.abspath(self.filepath))


_items: list[tuple[str, str, str]] = []  # Blender keeps no reference to what a callback returns


def _studio_items(operator, context):
    _items[:] = [
        (str(path), path.stem.capitalize(), f"Blender's own picture '{path.stem}'") for path in outside.studio_lights()
    ]
    return _items


@poll.needs(
    lambda context: outside.studio_lights(), "This Blender comes without its HDR pictures; choose a file instead."
)
class SCAN_RELIGHT_OT_use_studio_light(RelightOperator, bpy.types.Operator):
    """Put one of the HDR pictures that come with Blender around the room"""

    bl_idname = "scan_relight.use_studio_light"
    bl_label = "Blender's Pictures"

    picture: bpy.props.EnumProperty(name="Picture", description="Which one", items=_studio_items)

    def work(self, context):
        return put_around(context.scene, self.picture)
