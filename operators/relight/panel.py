"""The tab's part Relight: the lamps of the scan, the outside, new lights, the view, objects, before and after."""

import bpy

from ...addon.bridge.data.cameras import frame_cameras
from ...addon.bridge.light import lamps as relight_lamps
from ...addon.bridge.light import outside as relight_outside
from ...addon.bridge.relight import exposure, lights, match_frame
from ...addon.core.kinds import Shown
from ...addon.core.naming import in_order
from ..base.panel import SidebarPanel, draw_name, fields, places
from .base import has_room, measure_soon
from .lights import PRESETS, picture

NAME: Shown[float] = 0.6
"""Share of the names in a row of the lamps."""
ICONS = {"WINDOW": "LIGHT_AREA", "SOFTBOX": "MESH_PLANE", "SPOT": "LIGHT_SPOT", "SUN": "LIGHT_SUN"}


class SCAN_RELIGHT_UL_lamps(bpy.types.UIList):
    """The lamps by the first object of each: for materials Blender would first render previews."""

    lamps: dict = {}  # result of the last `filter_items`, which runs before the rows are drawn

    def draw_item(self, context, layout, data, item, icon, active_data, active_property, index):
        column = layout.column(align=True)
        for material in self.lamps.get(item.name, ()):
            lamp = material.scan_relight_lamp
            row = column.split(factor=NAME, align=True)
            name = row.row(align=True)
            name.prop(lamp, "on", text="", icon="OUTLINER_OB_LIGHT" if lamp.on else "LIGHT", emboss=False)
            draw_name(name, material.name)
            value = row.row(align=True)
            value.enabled = lamp.on
            colour = value.row(align=True)
            colour.scale_x = 0.3
            colour.enabled = relight_lamps.colour(material) is not None
            colour.prop(lamp, "colour", text="")
            value.prop(lamp, "factor", text="")

    def filter_items(self, context, data, name):
        """Of all objects, one for each lamp; sorted by the lamps' names."""
        pattern = self.filter_name.casefold()
        lamps = type(self).lamps = relight_lamps.lamps_by_object(context.scene)
        names = [" ".join(lamp.name for lamp in lamps.get(obj.name, ())) for obj in getattr(data, name)]
        flags = [
            self.bitflag_filter_item if lamp_names and pattern in lamp_names.casefold() else 0 for lamp_names in names
        ]
        return flags, places([in_order(lamp_names) for lamp_names in names])


class RelightPanel(SidebarPanel):
    """A panel that needs a scanned room."""

    bl_parent_id = "SCAN_RELIGHT_PT_relight"

    @classmethod
    def poll(cls, context):
        return super().poll(context) and has_room(context.scene)


class SCAN_RELIGHT_PT_relight(SidebarPanel, bpy.types.Panel):
    """The lamps."""

    bl_label = "Relight"
    manual = "relighting"
    bl_order = 4

    def draw(self, context):
        layout, scene = self.layout, context.scene
        if not has_room(scene):
            self.say(layout, "Recover a capture, or open a result's scene.blend, to light it anew.", "INFO")
            return
        studio, lamps = scene.scan_relight_studio, relight_lamps.lamps_by_object(scene)
        if lamps:
            head = layout.split(factor=NAME)
            head.label(text="Lamp")
            head.label(text="Strength x")  # the swatch before it needs no word
            layout.template_list("SCAN_RELIGHT_UL_lamps", "", scene, "objects", studio, "lamp", rows=3)
            row = layout.row(align=True)
            row.operator("scan_relight.switch_lamps", text="All On", icon="OUTLINER_OB_LIGHT").on = True
            row.operator("scan_relight.switch_lamps", text="All Off", icon="LIGHT").on = False
            chosen = scene.objects[studio.lamp].name if 0 <= studio.lamp < len(scene.objects) else ""
            for lamp in lamps.get(chosen, ()):
                self.numbers(layout, lamp)
        else:
            self.say(layout, "The scan has no lamp.", "INFO")
        layout.operator("scan_relight.restore_light", icon="LOOP_BACK")

    def numbers(self, layout, lamp) -> None:
        """What a lamp emits now, and as recovered."""
        column = fields(layout.column())
        column.prop(lamp.scan_relight_lamp, "factor")
        coloured = relight_lamps.colour(lamp) is not None
        fields(column.column(), lamp.scan_relight_lamp, "kelvin", "colour").enabled = coloured
        present, recovered = (
            " ".join(f"{c:.3g}" for c in values)
            for values in (relight_lamps.radiance(lamp), relight_lamps.recovered_radiance(lamp))
        )
        self.say(layout, f"{lamp.name}: radiance {present} (R G B, in the frames' unit)")
        if relight_lamps.is_changed(lamp):
            row = layout.row()
            self.say(row.column(), f"Found: {recovered}")
            row.operator("scan_relight.restore_lamp", text="", icon="LOOP_BACK").name = lamp.name


class SCAN_RELIGHT_PT_outside(RelightPanel, bpy.types.Panel):
    """The world."""

    bl_label = "Outside"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context):
        layout, world = fields(self.layout), context.scene.world
        if not relight_outside.has_outside(context.scene):
            self.say(layout, "The scan saw no light from outside.", "INFO")
        else:
            outside = world.scan_relight_outside
            layout.prop(outside, "on")
            fields(layout.column(), outside, "factor", "rotation").enabled = outside.on
        row = layout.row(align=True)
        row.operator("scan_relight.use_hdri", text="HDR File", icon="FILE_FOLDER")
        if relight_outside.studio_lights():
            row.operator_menu_enum("scan_relight.use_studio_light", "picture", text="Built-in", icon="WORLD")


class SCAN_RELIGHT_PT_new_lights(RelightPanel, bpy.types.Panel):
    """Presets."""

    bl_label = "New Lights"

    def draw(self, context):
        studio = context.scene.scan_relight_studio
        field = {"ROOM": "strength", "WATT": "watts", "LUMEN": "lumens"}[studio.unit]
        layout = fields(self.layout, studio, "aim", "unit", field, "kelvin")
        grid = layout.grid_flow(row_major=True, columns=2, even_columns=True, align=True)
        for name, text, _ in PRESETS:
            cell = grid.column(align=True)
            cell.template_icon(icon_value=picture(name), scale=4.0)
            button = cell.operator("scan_relight.add_light", text=text, icon=ICONS[name])
            button.preset, button.aim, button.strength = name, studio.aim, getattr(studio, field)
            button.unit, button.kelvin = studio.unit, studio.kelvin
        for light in lights.added_lights(context.scene):
            column = layout.column(align=True)
            row = column.row(align=True)
            row.prop(light, "hide_render", text="", icon_only=True, emboss=False)
            row.label(text=light.name)
            row = column.row(align=True)
            row.prop(light.data, "temperature" if light.data.use_temperature else "color", text="")
            if studio.unit == "LUMEN":
                row.prop(light.data.scan_relight_light, "lumens", text="lx" if light.data.type == "SUN" else "lm")
            else:
                row.prop(light.data, "energy", text="W/m²" if light.data.type == "SUN" else "W")
        layout.operator("scan_relight.remove_lights", icon="TRASH")
        row = layout.row(align=True)
        row.menu("SCAN_RELIGHT_MT_light_presets", text="My Lights")
        row.operator("scan_relight.light_preset_add", text="", icon="ADD")
        row.operator("scan_relight.light_preset_add", text="", icon="REMOVE").remove_active = True


class SCAN_RELIGHT_PT_exposure(RelightPanel, bpy.types.Panel):
    """Exposure, and the preview in EEVEE."""

    bl_label = "Exposure and Preview"

    def draw(self, context):
        layout, scene = fields(self.layout), context.scene
        column = layout.column(align=True)
        # Half of a narrow sidebar is too little for these words.
        column.use_property_split = column.use_property_decorate = False
        column.prop(scene.view_settings, "exposure", text="Exposure (stops)")
        column.operator("scan_relight.expose", icon="LIGHT_SUN")
        column.prop(scene.scan_relight_studio, "follow", toggle=True)
        measure_soon(scene)
        sentence = exposure.darkness(scene)
        if sentence:
            self.say(layout, sentence, "INFO")
        if exposure.CAPTURED in scene:
            layout.operator("scan_relight.restore_exposure", icon="LOOP_BACK")
        row = layout.row(align=True)
        row.operator("scan_relight.bake_preview", icon="LIGHTPROBE_VOLUME")
        row.operator("scan_relight.remove_preview", text="", icon="TRASH")


class SCAN_RELIGHT_PT_view(SidebarPanel, bpy.types.Panel):
    """Frames."""

    bl_label = "Camera"
    bl_parent_id = "SCAN_RELIGHT_PT_relight"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context):
        layout, scene = fields(self.layout), context.scene
        cameras, studio = frame_cameras(scene), scene.scan_relight_studio
        row = layout.row(align=True)
        row.operator("scan_relight.match_frame", text="", icon="TRIA_LEFT").step = -1
        row.prop(studio, "frame", text="")
        row.operator("scan_relight.match_frame", text="", icon="TRIA_RIGHT").step = 1
        if not cameras:
            self.say(layout, "The scene has no camera of a capture.", "INFO")
            return
        index = match_frame.current(scene)
        name = cameras[index].name if index >= 0 else "The camera is none of the capture's."
        self.say(layout, f"{name} ({index + 1} of {len(cameras)})" if index >= 0 else name)
        layout.operator("scan_relight.follow_track", icon="ANIM")
        fields(layout, studio, "match_size", "show_frame")
        fields(layout.column(), studio, "frame_front", "frame_alpha").enabled = studio.show_frame


class SCAN_RELIGHT_PT_virtual(RelightPanel, bpy.types.Panel):
    """Objects that were not scanned."""

    bl_label = "Objects"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context):
        studio = context.scene.scan_relight_studio
        layout = fields(self.layout, studio, "place", "shape", "look", "size")
        button = layout.operator("scan_relight.add_virtual", icon="ADD")
        button.shape, button.look, button.size, button.place = studio.shape, studio.look, studio.size, studio.place
        layout.label(text="The selected object")
        row = layout.row(align=True)
        row.operator("scan_relight.place_object", icon="TRIA_DOWN_BAR").place = studio.place
        row.operator("scan_relight.pick_place", icon="EYEDROPPER")
        layout.operator("scan_relight.virtual_look", icon="MATERIAL").look = studio.look


class SCAN_RELIGHT_PT_before_after(RelightPanel, bpy.types.Panel):
    """The preview."""

    bl_label = "Before and After"

    def draw(self, context):
        studio = context.scene.scan_relight_studio
        layout = fields(self.layout, studio, "engine", "samples", "percentage")
        button = layout.operator("scan_relight.before_after", text="Render Both", icon="RENDER_STILL")
        button.engine, button.samples, button.percentage = studio.engine, studio.samples, studio.percentage
