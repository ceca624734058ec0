"""`bpy.ops.scan_relight.*` for the light: lamps, new lights and set-ups, the outside, exposure, EEVEE's preview."""

import atexit
from contextlib import suppress
from functools import cache, partial
from pathlib import Path

import bpy
from bl_operators.presets import AddPresetBase
from bpy.utils import previews

from ...addon.bridge.light import lamps, outside
from ...addon.bridge.relight import exposure, lights, probe, setup
from ...addon.core.errors import BadInputError, ScanRelightError
from ..base.operator import Choosing, has_scene, needs
from ..base.properties import bool_property, enum_property, file_property, float_property, string_property
from ..results.look import make_active
from .base import RelightOperator, follow, has_room
from .props import AIM, KELVIN, UNIT


class SCAN_RELIGHT_OT_expose(RelightOperator, bpy.types.Operator):
    """Measure the light in a small picture and set the exposure so that its median is middle grey; takes some
    seconds"""

    bl_label = "Expose for This Light"

    def work(self, context):
        exposure.expose(context.scene)


class SCAN_RELIGHT_OT_restore_exposure(RelightOperator, bpy.types.Operator):
    """Set the exposure back to what it was before it was measured"""

    bl_label = "Captured Exposure"

    def work(self, context):
        exposure.restore(context.scene)


PRESETS = (
    ("WINDOW", "Window", "A window's soft, cool light from the side"),
    ("SOFTBOX", "Softbox", "A studio light beside the camera"),
    ("SPOT", "Spot", "A spot from above, a little on the camera's side"),
    ("SUN", "Evening Sun", "A low, warm sun: through an opening of the scan, else as a window would let it in"),
)
PICTURES = Path(__file__).resolve().parents[1] / "thumbnails"


@cache
def _pictures():
    """All presets' pictures, as previews."""
    pictures = previews.new()
    for name, _, _ in PRESETS:
        pictures.load(name, str(PICTURES / f"{name.lower()}.png"), "IMAGE")
    atexit.register(forget_pictures)
    return pictures


def picture(name: str) -> int:
    """Icon id of a preset's picture; 0 without a window."""
    return 0 if bpy.app.background else _pictures()[name].icon_id


def forget_pictures() -> None:
    """Free the pictures."""
    if _pictures.cache_info().currsize:
        previews.remove(_pictures())
        _pictures.cache_clear()
        atexit.unregister(forget_pictures)


class SCAN_RELIGHT_OT_switch_lamps(RelightOperator, bpy.types.Operator):
    """Switch all lamps of the scan on or off; their strength and colour stay"""

    bl_label = "Switch All Lamps"

    on: bool_property("On", "On or off")

    def work(self, context):
        for lamp in lamps.find_lamps(context.scene):
            lamps.set_on(lamp, self.on)
        follow(context.scene)


class SCAN_RELIGHT_OT_restore_lamp(RelightOperator, bpy.types.Operator):
    """Make this lamp exactly what the scan found"""

    bl_label = "Restore Lamp"

    name: string_property("Lamp", "Name of its material, or its class")

    def work(self, context):
        for lamp in lamps.lamp_named(context.scene, self.name):
            lamps.restore(lamp)
        follow(context.scene)


@needs(lambda context: setup.is_relit(context.scene), "The light is as it was captured.")
class SCAN_RELIGHT_OT_restore_light(RelightOperator, bpy.types.Operator):
    """Make lamps and outside exactly what was recovered, and remove the lights that were added here"""

    bl_label = "Restore Captured Light"

    def work(self, context):
        setup.restore_captured(context.scene)
        follow(context.scene)


class SCAN_RELIGHT_OT_add_light(RelightOperator, bpy.types.Operator):
    """Add a light inside the room"""

    bl_label = "Add Light"

    preset: enum_property("Light", "What kind of light", PRESETS)
    strength: float_property(
        "Strength",
        "In the unit below; of the room's light 1 keeps the scene's exposure readable",
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


@needs(lambda context: lights.added_lights(context.scene), "No light was added here.")
class SCAN_RELIGHT_OT_remove_lights(RelightOperator, bpy.types.Operator):
    """Remove all lights that were added here"""

    bl_label = "Remove New Lights"

    def work(self, context):
        lights.remove_lights(context.scene)
        follow(context.scene)


def put_around(scene, picture: str) -> list[str]:
    """Put a picture around the room, scaled to typical daylight for such a room; returns warnings."""
    outside.use_hdri(scene, picture, outside.outdoor_radiance(scene))
    return outside.remarks(scene)


class SCAN_RELIGHT_OT_use_hdri(Choosing, RelightOperator, bpy.types.Operator):
    """Put an equirectangular HDR picture around the room; the recovered outside is kept"""

    bl_label = "Picture Around the Room"
    given = "filepath"

    filepath: file_property("Picture", "EXR or HDR file", "SKIP_SAVE")
    filter_glob: bpy.props.StringProperty(default="*.exr;*.hdr;*.png;*.jpg", options={"HIDDEN"})

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


@needs(lambda context: outside.studio_lights(), "This Blender comes without its HDR pictures; choose a file instead.")
class SCAN_RELIGHT_OT_use_studio_light(RelightOperator, bpy.types.Operator):
    """Put one of the HDR pictures that come with Blender around the room"""

    bl_label = "Blender's Pictures"

    picture: enum_property("Picture", "Which one", _studio_items)

    def work(self, context):
        return put_around(context.scene, self.picture)


SETUPS = "scan_relight/light"


class SCAN_RELIGHT_MT_light_presets(bpy.types.Menu):
    """The set-ups that were saved."""

    bl_label = "My Lights"
    bl_description = "Light this room as another one was lit"
    preset_subdir = SETUPS
    preset_operator = "script.execute_preset"
    draw = bpy.types.Menu.draw_preset


@needs(lambda context: has_room(context.scene), "The scene holds no scanned room to light.")
@has_scene
class SCAN_RELIGHT_OT_light_preset_add(AddPresetBase, bpy.types.Operator):
    """Save the lights that were added, the lamps' factors and the outside under a name, to light other rooms the same
    way"""

    bl_label = "Save This Light"
    preset_menu = "SCAN_RELIGHT_MT_light_presets"
    preset_subdir = SETUPS
    preset_defines = ["studio = bpy.context.scene.scan_relight_studio"]
    preset_values = ["studio.setup"]


class SCAN_RELIGHT_OT_bake_preview(RelightOperator, bpy.types.Operator):
    """Bake how light bounces through the room for EEVEE, and make its preview about as bright as the picture by Cycles
    through several of the cameras. Bake again after the light has changed. The status bar shows how far it is, ESC
    ends it"""

    bl_label = "Bake Preview Light"

    _wait = True

    def invoke(self, context, event):
        """From a button: does not block the window."""
        self._wait = False
        return self.execute(context)

    def work(self, context):
        probe.bake(context.scene, self._wait)
        if self._wait:
            probe.fit(context.scene)
        else:
            bpy.app.timers.register(partial(_fit_when_baked, context.scene.name), first_interval=0.5)


def _fit_when_baked(name: str) -> float | None:
    """A timer: once Blender's own bake has ended, fit its brightness to Cycles."""
    baking = {
        operator.bl_idname for window in bpy.context.window_manager.windows for operator in window.modal_operators
    }
    if "OBJECT_OT_lightprobe_cache_bake" in baking:
        return 0.5
    scene = bpy.data.scenes.get(name)
    if scene is not None:
        with suppress(ScanRelightError):  # then the light stays as baked
            probe.fit(scene)
    return None


@needs(lambda context: probe.probes(context.scene), "No preview light was baked here.")
class SCAN_RELIGHT_OT_remove_preview(RelightOperator, bpy.types.Operator):
    """Remove the light that was baked for EEVEE"""

    bl_label = "Remove Preview Light"

    def work(self, context):
        probe.remove(context.scene)
