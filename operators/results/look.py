"""`bpy.ops.scan_relight.*` for recovered objects: select one, choose what the viewport shows; the tab's fourth part."""

import bpy

from ...addon.bridge.data.instances import choose, slots_of
from ...addon.bridge.results import look
from ...addon.core.errors import BadInputError
from ..base.operator import AtOnce, has_scene, needs, object_mode
from ..base.panel import SidebarPanel
from ..base.properties import bool_property, enum_property, int_property


def make_active(context, obj: bpy.types.Object, extend: bool = False) -> None:
    """Select an object, with `extend` beside what is selected, and make it the active one."""
    if not extend:
        for other in context.view_layer.objects.selected:
            other.select_set(False)
    obj.select_set(True)
    context.view_layer.objects.active = obj


def select(context, obj: bpy.types.Object, extend: bool = False) -> None:
    """Select an object and make it the active one; raises `BadInputError` where it can't be."""
    if obj.name not in context.view_layer.objects:
        raise BadInputError(f"Object '{obj.name}' is not in this view layer; include its collection first.")
    if not obj.visible_get():
        raise BadInputError(f"Object '{obj.name}' is hidden; show it first.")
    make_active(context, obj, extend)


@object_mode
@has_scene
class SCAN_RELIGHT_OT_select_result_object(AtOnce, bpy.types.Operator):
    """Select this object in the scene; of a part, its material slot becomes the active one"""

    bl_label = "Select Object"

    object_id: int_property("Object", "Number of the object in the capture", min=0)
    extend: bool_property("Extend", "Keep what is selected", options={"SKIP_SAVE"})

    def work(self, context):
        meshes = (obj for obj in context.scene.objects if obj.type == "MESH")
        matches = [obj for obj in meshes if self.object_id in slots_of(obj)]
        if not matches:
            raise BadInputError(f"Object {self.object_id} is not in this scene; import the capture first.")
        select(context, matches[-1], self.extend)  # from the last of several imports
        choose(matches[-1], self.object_id)


LOOKS = [(name, entry.label, entry.text) for name, entry in look.LOOKS.items()]
needs_recovered = needs(
    lambda context: context.scene is not None and look.recovered(context.scene),
    "No object of this scene wears recovered materials; run the recovery first.",
)


@object_mode
@needs_recovered
class SCAN_RELIGHT_OT_look(AtOnce, bpy.types.Operator):
    """What the viewport shows on the recovered objects; renders and materials stay as they are"""

    bl_label = "Show Look"

    look: enum_property("Look", "What the viewport shows", LOOKS)
    switch_view: bool_property(
        "Switch the View",
        "Turn viewports that show no materials (Solid, Wireframe) to Material Preview, where the look can be seen",
        default=True,
    )

    @classmethod
    def description(cls, context, properties):
        return f"{look.LOOKS[properties.look].text}. Only the viewport changes, never a render"

    def work(self, context):
        look.set_look(context.scene, self.look)
        if self.switch_view and context.screen is not None:
            for area in context.screen.areas:
                if area.type == "VIEW_3D" and area.spaces.active.shading.type in ("SOLID", "WIREFRAME"):
                    area.spaces.active.shading.type = "MATERIAL"


class SCAN_RELIGHT_PT_look(SidebarPanel, bpy.types.Panel):
    """What the viewport shows on the recovered objects."""

    bl_label = "Look"
    manual = "panel#look"
    bl_order = 3

    def draw(self, context):
        layout, scene = self.layout, context.scene
        if not look.recovered(scene):
            self.say(layout, "Shows albedo, light and coverage in the viewport, once materials are recovered.", "INFO")
            return
        current_look = look.current(scene)
        grid = layout.grid_flow(row_major=True, columns=2, even_columns=True, align=True)
        for name, entry in look.LOOKS.items():
            grid.operator("scan_relight.look", text=entry.label, depress=name == current_look).look = name
        if current_look == look.MATERIAL:
            return
        self.say(layout, f"{look.LOOKS[current_look].text}.")
        self.say(layout, "Renders show the materials all the same.", "RESTRICT_RENDER_OFF")
        if scene.view_settings.view_transform not in ("Standard", "Raw") and not look.LOOKS[current_look].light:
            self.say(layout, "Colours are exact under the view transform Standard (Render, Color Management).", "INFO")
        space = context.space_data
        if space is not None and space.type == "VIEW_3D" and space.shading.type in ("SOLID", "WIREFRAME"):
            self.say(layout, "Visible in Material Preview.", "INFO")
