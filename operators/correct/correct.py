"""`bpy.ops.scan_relight.*` by which an artist says what an object is, and has it fitted again under that."""

# No `from __future__ import annotations` here: Blender reads the properties off the annotations.
import bpy

from ...addon.bridge.corrections import corrections
from ...addon.bridge.marks import OBJECT_ID
from ...addon.core.errors import BadInputError
from ..base import poll
from .base import CorrectOperator, RefitOperator, chosen, in_room, on_selected
from .props import SMOOTH_ANGLE, STATEMENTS

_KEYS = {"model": "model", "roughness": "roughness", "f0": "F0", "base_color": "colour", "same_as": "likeness"}


@on_selected
class SCAN_RELIGHT_OT_refit(RefitOperator, bpy.types.Operator):
    """Fit the selected objects again under what is given of them, the rest of the room held; takes seconds. What is
    given is kept in the result folder's overrides.json"""

    bl_idname = "scan_relight.refit"
    bl_label = "Refit"
    always = True


@on_selected
class SCAN_RELIGHT_OT_this_is(RefitOperator, bpy.types.Operator):
    """Say what the selected objects are made of, and fit them again under that"""

    bl_idname = "scan_relight.this_is"
    bl_label = "This Is"

    model: bpy.props.EnumProperty(name="Model", description="What they are", items=STATEMENTS)
    asks_for = "model"

    @classmethod
    def description(cls, context, properties):
        item = next(item for item in STATEMENTS if item[0] == properties.model)
        return f"The selected objects are: {item[1].lower()}. {item[2]}"

    def state(self, context, things):
        for thing in things:
            corrections.give(thing, model=self.model)
        return things


@poll.needs(
    lambda context: len(chosen(context)) > 1 or context.scene.scan_relight_correct.like is not None,
    "Choose the other object, or select it too, last of all.",
)
@on_selected
class SCAN_RELIGHT_OT_same_as(RefitOperator, bpy.types.Operator):
    """The selected objects have the same highlight as another one, each with its own colours: the one that is chosen in
    the panel, else the active object"""

    bl_idname = "scan_relight.same_as"
    bl_label = "The Same As"

    object_id: bpy.props.IntProperty(
        name="Object",
        description="Number of the other object in the capture; -1 takes the active one",
        default=-1,
        min=-1,
        options={"SKIP_SAVE"},
    )

    def state(self, context, things):
        other = context.view_layer.objects.active if len(things) > 1 else context.scene.scan_relight_correct.like
        if self.object_id >= 0:
            other = corrections.by_id(things[0], self.object_id)
        if not corrections.correctable(other):
            raise BadInputError("The other object is none of this room's recovered objects; choose one of those.")
        others = [thing for thing in things if thing != other]
        if not others:
            raise BadInputError(f"'{other.name}' is the other object itself; select the ones that are like it.")
        if corrections.result_folder(other) != corrections.folder_for(others):
            raise BadInputError(f"'{other.name}' belongs to another result; choose an object of the same room.")
        for thing in others:
            corrections.give(thing, same_as=other[OBJECT_ID])
        return others


@poll.needs(lambda context: any(map(corrections.given, chosen(context))), "Nothing is given of the selected objects.")
@on_selected
class SCAN_RELIGHT_OT_take_back(RefitOperator, bpy.types.Operator):
    """Take back what is given of the selected objects: show, and fit, what the frames say"""

    bl_idname = "scan_relight.take_back"
    bl_label = "Back to What Was Found"

    key: bpy.props.EnumProperty(
        name="Value",
        description="What is taken back",
        default="all",
        items=[
            ("all", "All", "Everything"),
            *((key, name.capitalize(), f"The {name} alone") for key, name in _KEYS.items()),
        ],
    )

    @classmethod
    def description(cls, context, properties):
        what = "everything that is given" if properties.key == "all" else f"the {_KEYS[properties.key]} that is given"
        return f"Take back {what} of the selected objects: show, and fit, what the frames say"

    def state(self, context, things):
        """Take it back; only what a refit was made with asks for another one."""
        things = [thing for thing in things if corrections.given(thing)]
        self._made = any(corrections.entry(thing).get("given") for thing in things)
        for thing in things:
            corrections.take_back(thing, *(() if self.key == "all" else (self.key,)))
        return things

    def refit(self, context, things):
        """Only where the result was made with what is taken back."""
        return super().refit(context, things) if self._made else {"FINISHED"}


@in_room
class SCAN_RELIGHT_OT_smooth_by_angle(CorrectOperator, bpy.types.Operator):
    """Shade recovered objects smooth, with edges above an angle sharp; 0 makes them flat again. It stays when the room
    is recovered again"""

    bl_idname = "scan_relight.smooth_by_angle"
    bl_label = "Smooth by Angle"

    angle: SMOOTH_ANGLE
    everything: bpy.props.BoolProperty(
        name="Whole Room", description="All recovered objects of the scene, not the selected ones alone"
    )

    def work(self, context, things):
        from ...addon.bridge.corrections.smoothing import smooth

        if self.everything:
            things = [thing for thing in context.scene.objects if corrections.correctable(thing)]
        if not things:
            raise BadInputError("No recovered object is selected; select some, or choose the whole room.")
        count = smooth(things, self.angle)
        return [f"{count} object{'s' * (count != 1)} shaded {'smooth' if self.angle else 'flat'}"]
