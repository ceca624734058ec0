"""`bpy.ops.scan_relight.*` for the room in the file: in another scene, its materials as assets, or removed."""

import bpy

from ...addon.bridge.export import assets
from ...addon.bridge.results import look
from ...addon.bridge.scene import parts
from ...addon.bridge.scene.parts import rooms
from ...addon.core.errors import BadInputError
from ..base.operator import AtOnce, NothingDone, has_scene, needs, object_mode
from ..base.properties import bool_property, enum_property
from ..results.look import needs_recovered


def show(previous: bpy.types.Scene, scene: bpy.types.Scene) -> None:
    """Show a room's own scene in the window; its panel gets the choices of the scene `previous`."""
    if scene != previous:
        copy_properties(scene.scan_relight, previous.scan_relight)
    parts.show(bpy.context.window, scene)


def copy_properties(choices, source) -> None:
    """Copy all properties of a group to another one of the same type."""
    for name, info in source.bl_rna.properties.items():
        if name in ("rna_type", "name"):
            continue
        if info.type == "POINTER":
            copy_properties(getattr(choices, name), getattr(source, name))
        elif not info.is_readonly and getattr(choices, name) != getattr(source, name):
            setattr(choices, name, getattr(source, name))


_items: list[tuple[str, str, str]] = []  # Blender keeps no reference to the items


def scene_items(operator, context) -> list[tuple[str, str, str]]:
    """The other scenes, as items of an enum."""
    _items[:] = [
        (scene.name, scene.name, "Show the room in this scene as well")
        for scene in bpy.data.scenes
        if context.scene is not None and scene != context.scene and not scene.library
    ]
    return _items


@needs(lambda context: len(bpy.data.scenes) > 1, "This file has no other scene to link the room into.")
@needs(lambda context: rooms(context.scene), "The scene holds no scanned room; run the recovery first.")
@has_scene
class SCAN_RELIGHT_OT_link_room(AtOnce, bpy.types.Operator):
    """Show the recovered room in another scene of this file as well: one room in two scenes, so that what is changed in
    one is changed in the other"""

    bl_label = "Link into Scene"
    remarks = "INFO"

    scene: enum_property("Scene", "Where the room is linked", scene_items)
    outside: bool_property("With Its Outside", "Give that scene the room's world and exposure, too")

    def work(self, context):
        from ...addon.bridge.room.bring import link_room

        target = bpy.data.scenes.get(self.scene)
        if target is None:
            raise BadInputError("Choose the scene to link the room into.")
        for top in rooms(context.scene):
            link_room(top, target, context.scene if self.outside else None)
        return [f"The room is in scene '{target.name}' as well."]


@needs_recovered
class SCAN_RELIGHT_OT_mark_assets(AtOnce, bpy.types.Operator):
    """Put the recovered materials into the Asset Browser, with tags and previews, or take them out again"""

    bl_label = "Mark Materials as Assets"
    remarks = "INFO"

    selected_only: bool_property("Selected Only", "Only what the selected objects wear")
    clear: bool_property("Take Out", "They are no assets any more", options={"SKIP_SAVE"})

    def work(self, context):
        objects = look.recovered(context.scene)
        if self.selected_only:
            objects = [obj for obj in objects if obj.select_get()]
        count = assets.clear(objects) if self.clear else assets.mark(objects, not bpy.app.background)
        if not count:
            raise NothingDone(
                "None of these materials is an asset." if self.clear else "No recovered object is selected."
            )
        message = "no assets any more" if self.clear else "in the Asset Browser, Current File"
        return [f"{count} material{'s' * (count > 1)} {message}."]


def _has_restorable(context) -> bool:
    from ...addon.bridge.own_scene.restore import restorable

    return bool(restorable(context.scene.objects))


@needs(_has_restorable, "No object of this scene wears a recovered material over its own.")
@object_mode
@has_scene
class SCAN_RELIGHT_OT_restore_materials(AtOnce, bpy.types.Operator):
    """Give your objects back the materials and UV maps that they had before the recovered ones; copies that were made
    for recovered materials are removed"""

    bl_label = "Restore Materials"

    selected_only: bool_property("Selected Only", "Leave the objects that are not selected as they are")

    def work(self, context):
        from ...addon.bridge.own_scene.restore import restore

        count, warnings = restore(list(context.selected_objects if self.selected_only else context.scene.objects))
        look.refresh(context.scene)
        if not count:
            raise NothingDone("None of the selected objects wears a recovered material over its own.")
        self.report({"INFO"}, f"{count} object{'s' * (count > 1)} restored")
        return warnings
