"""`bpy.ops.scan_relight.*` for statements on what an object is, and for painting what no frame saw."""

from pathlib import Path

import bpy
from mathutils import Vector

from ...addon.bridge.corrections import corrections, known_white, refitted, unseen
from ...addon.bridge.corrections.smooth import smooth
from ...addon.bridge.custom_properties import OBJECT_ID
from ...addon.bridge.data.instances import chosen_in, name_of
from ...addon.bridge.job import job as jobs
from ...addon.bridge.job.command import command
from ...addon.bridge.light.room import cast, depsgraph_of
from ...addon.bridge.results import file
from ...addon.bridge.slices import whole
from ...addon.core.errors import BadInputError, ScanRelightError
from ..base.job_operator import FOLLOWED, JobOperator
from ..base.operator import NAVIGATION_EVENTS, AtOnce, OneSentence, has_scene, mouse_ray, needs, no_run, object_mode
from ..base.properties import bool_property, enum_property, int_property, vector_property
from .props import ALBEDO, SMOOTH_ANGLE, STATEMENTS


def chosen(context) -> list[bpy.types.Object]:
    """The selected recovered objects; only the active one, where it is not among those."""
    active = context.view_layer.objects.active if context.view_layer else None
    selected = [obj for obj in context.selected_objects if corrections.correctable(obj)]
    if corrections.correctable(active) and active not in selected:
        return [active]
    return selected


def on_selected(cls):
    """Class decorator: for operators on the selected objects."""
    return needs(chosen, "Select a recovered object first.")(object_mode(has_scene(cls)))


def in_room(cls):
    """Class decorator: for operators on any object of the room."""
    has_correctable = needs(
        lambda context: any(map(corrections.correctable, context.scene.objects)), "The scene holds no recovered object."
    )
    return has_correctable(object_mode(has_scene(cls)))


class CorrectOperator(AtOnce):
    """Changes recovered objects at once, in one undo step; `work` returns remarks."""

    remarks = "INFO"


@no_run
class RefitOperator(OneSentence, JobOperator):
    """Makes a statement on the selected objects (`state`) and fits them again, all in one undo step."""

    bl_options = {"REGISTER", "UNDO"}
    always = False
    asks_for = ""
    """Property to ask for where it is not set: from a menu or the search."""

    def invoke(self, context, event):
        if self.asks_for and not self.properties.is_property_set(self.asks_for):
            return context.window_manager.invoke_props_dialog(self)
        return self.execute(context)

    def state(self, context, objects) -> list[bpy.types.Object]:
        """Apply the statement; returns the objects to fit again."""
        return objects

    def execute(self, context):
        """Apply the statement, then refit beside the window, or right here in the background."""
        self._stated = False

        def work() -> set[str]:
            objects = self.state(context, chosen(context))
            self._stated = True
            if not self.always and not context.scene.scan_relight_correct.refit_automatically:
                return {"FINISHED"}
            return self.refit(context, objects)

        return self._verdict(self.attempt(work))

    def refit(self, context, objects):
        folder, words, before = refitted.words(context.scene, objects)
        facts = {"title": self.bl_label, "result_folder": str(folder), "before": before}
        if not bpy.app.background:
            return self.start(context, command(words, **FOLLOWED), **facts)
        job = jobs.begin(command(words, **FOLLOWED), phase="run", **facts)
        job.wait()
        job.facts["phase"] = "end"
        if job.state != jobs.DONE:
            raise ScanRelightError(job.sentence)
        for sentence in (*job.warnings, *whole(self.change(context.scene, self.load(job)))):
            self.report({"WARNING"}, sentence)
        return {"FINISHED"}

    def load(self, job):
        folder = Path(job.facts["result_folder"])
        return folder, job.facts["before"], refitted.fitted(folder)

    def change(self, scene, loaded):
        warnings = yield from refitted.bringing(scene, *loaded)
        file.forget()
        return warnings

    def _leave(self, context, verdict):
        return super()._leave(context, self._verdict(verdict))

    def _verdict(self, verdict):
        """The statement stays, and is an undo step, even where the refit was stopped or failed."""
        return {"FINISHED"} if verdict == {"CANCELLED"} and self._stated and not self.always else verdict


_KEYS = {"model": "model", "roughness": "roughness", "f0": "F0", "base_color": "colour", "same_as": "likeness"}


@on_selected
class SCAN_RELIGHT_OT_refit(RefitOperator, bpy.types.Operator):
    """Fit the selected objects again under what is given of them, the rest of the room held; takes seconds. What is
    given is kept in the result folder's overrides.json"""

    bl_label = "Refit"
    always = True


@on_selected
class SCAN_RELIGHT_OT_this_is(RefitOperator, bpy.types.Operator):
    """Say what the selected objects are made of, and fit them again under that"""

    bl_label = "This Is"

    model: enum_property("Model", "What they are", STATEMENTS)
    asks_for = "model"

    @classmethod
    def description(cls, context, properties):
        item = next(item for item in STATEMENTS if item[0] == properties.model)
        return f"The selected objects are: {item[1].lower()}. {item[2]}"

    def state(self, context, objects):
        for obj in objects:
            corrections.give(obj, model=self.model)
        return objects


@needs(
    lambda context: len(chosen(context)) > 1 or context.scene.scan_relight_correct.like is not None,
    "Choose the other object, or select it too, last of all.",
)
@on_selected
class SCAN_RELIGHT_OT_same_as(RefitOperator, bpy.types.Operator):
    """The selected objects have the same highlight as another one, each with its own colours: the one that is chosen in
    the panel, else the active object"""

    bl_label = "The Same As"

    object_id: int_property(
        "Object",
        "Number of the other object in the capture; -1 takes the active one",
        default=-1,
        min=-1,
        options={"SKIP_SAVE"},
    )

    def state(self, context, objects):
        other = context.view_layer.objects.active if len(objects) > 1 else context.scene.scan_relight_correct.like
        if self.object_id >= 0:
            other = corrections.by_id(objects[0], self.object_id)
        if not corrections.correctable(other, self.object_id if self.object_id >= 0 else None):
            raise BadInputError("The other object is none of this room's recovered objects; choose one of those.")
        like = self.object_id if self.object_id >= 0 else chosen_in(other)
        others = [obj for obj in objects if (obj, chosen_in(obj)) != (other, like)]
        if not others:
            raise BadInputError(
                f"'{name_of(other, like)}' is the other object itself; select the ones that are like it."
            )
        if corrections.result_folder(other) != corrections.folder_for(others):
            raise BadInputError(f"'{other.name}' belongs to another result; choose an object of the same room.")
        for obj in others:
            corrections.give(obj, same_as=like)
        return others


@needs(lambda context: any(map(corrections.given, chosen(context))), "Nothing is given of the selected objects.")
@on_selected
class SCAN_RELIGHT_OT_take_back(RefitOperator, bpy.types.Operator):
    """Take back what is given of the selected objects: show, and fit, what the frames say"""

    bl_label = "Back to What Was Found"

    key: enum_property(
        "Value",
        "What is taken back",
        [("all", "All", "Everything"), *((key, name.capitalize(), f"The {name} alone") for key, name in _KEYS.items())],
    )

    @classmethod
    def description(cls, context, properties):
        target = "everything that is given" if properties.key == "all" else f"the {_KEYS[properties.key]} that is given"
        return f"Take back {target} of the selected objects: show, and fit, what the frames say"

    def state(self, context, objects):
        """Take it back; another refit is needed only where the result was made with it."""
        objects = [obj for obj in objects if corrections.given(obj)]
        self._made = any(corrections.entry(obj).get("given") for obj in objects)
        for obj in objects:
            corrections.take_back(obj, *(() if self.key == "all" else (self.key,)))
        return objects

    def refit(self, context, objects):
        """Only where the result was made with the statements that are taken back."""
        return super().refit(context, objects) if self._made else {"FINISHED"}


@in_room
class SCAN_RELIGHT_OT_smooth_by_angle(CorrectOperator, bpy.types.Operator):
    """Shade recovered objects smooth, with edges above an angle sharp; 0 makes them flat again. It stays when the room
    is recovered again"""

    bl_label = "Smooth by Angle"

    angle: SMOOTH_ANGLE
    everything: bool_property("Whole Room", "All recovered objects of the scene, not the selected ones alone")

    def work(self, context):
        objects = filter(corrections.correctable, context.scene.objects) if self.everything else chosen(context)
        objects = list(objects)
        if not objects:
            raise BadInputError("No recovered object is selected; select some, or choose the whole room.")
        count = smooth(objects, self.angle)
        return [f"{count} object{'s' * (count != 1)} shaded {'smooth' if self.angle else 'flat'}"]


@on_selected
class SCAN_RELIGHT_OT_this_is_white(RefitOperator, bpy.types.Operator):
    """The active object's albedo is known: the albedo of the whole room is scaled with it, channel by channel, and with
    it the colour of the light"""

    bl_label = "This Is White"

    albedo: ALBEDO
    asks_for = "albedo"

    def state(self, context, objects):
        obj = context.view_layer.objects.active
        obj = obj if obj in objects else objects[0]
        corrections.say_white(obj, self.albedo)
        self.report(
            {"INFO"},
            f"The whole room's albedo is scaled so that '{name_of(obj)}' has "
            f"{', '.join(f'{channel:.2f}' for channel in self.albedo)}",
        )
        return [obj]


@needs(lambda context: corrections.white_of(context.view_layer.objects.active) is not None, "No white is given.")
@on_selected
class SCAN_RELIGHT_OT_white_back(RefitOperator, bpy.types.Operator):
    """Take back the known white: the frames alone say how bright the room's surfaces are"""

    bl_label = "No Known White"

    def state(self, context, objects):
        corrections.take_white_back(context.view_layer.objects.active)
        return objects[:1]


@in_room
class SCAN_RELIGHT_OT_pick_white(RefitOperator, bpy.types.Operator):
    """Click on a spot of the room whose albedo is known, such as a grey card or white paint; the whole room's albedo is
    scaled with it. ESC stops"""

    bl_label = "Pick White Spot"

    albedo: ALBEDO
    origin: vector_property(
        "From", "Where the ray to the spot begins, in metres", subtype="TRANSLATION", options={"SKIP_SAVE"}
    )
    direction: vector_property("Direction", "Of the ray to the spot", subtype="DIRECTION", options={"SKIP_SAVE"})

    def invoke(self, context, event):
        self._picking = True
        context.window_manager.modal_handler_add(self)
        context.window.cursor_modal_set("EYEDROPPER")
        context.workspace.status_text_set("Click on the spot whose albedo is known   ESC or right click: stop")
        return {"RUNNING_MODAL"}

    def modal(self, context, event):
        if not getattr(self, "_picking", False):
            return super().modal(context, event)
        if event.type in {"ESC", "RIGHTMOUSE"}:
            self._end(context)
            return {"CANCELLED"}
        if event.type != "LEFTMOUSE" or event.value != "PRESS":
            return {"PASS_THROUGH"} if event.type in NAVIGATION_EVENTS | {"MOUSEMOVE", "TIMER"} else {"RUNNING_MODAL"}
        ray = mouse_ray(context, event)
        if ray is None:
            return {"RUNNING_MODAL"}
        self._end(context)
        self.origin, self.direction = ray
        return self.execute(context)

    def state(self, context, objects):
        hit = cast(context.scene, Vector(self.origin), Vector(self.direction)) if any(self.direction) else None
        if hit is not None and OBJECT_ID in hit.obj:
            hit.obj.active_material_index = hit.slot
        if hit is None or not corrections.correctable(hit.obj):
            raise BadInputError("There is no recovered object at that spot; click on one.")
        albedo = known_white.of_object(hit.obj, hit.location, tuple(self.albedo), depsgraph_of(context.scene))
        corrections.say_white(hit.obj, albedo)
        self.report({"INFO"}, f"The whole room's albedo is scaled by that spot on '{name_of(hit.obj)}'")
        return [hit.obj]

    def _end(self, context) -> None:
        self._picking = False
        context.window.cursor_modal_restore()
        context.workspace.status_text_set(None)


@on_selected
class SCAN_RELIGHT_OT_paint_unseen(CorrectOperator, bpy.types.Operator):
    """Paint what no frame saw of the active object in Texture Paint, on an image of your own that no run writes over;
    what was seen is masked"""

    bl_label = "Paint"

    masked: bool_property("Only Unseen Spots", "Protect what any frame saw by a stencil mask", default=True)

    def work(self, context):
        obj = context.view_layer.objects.active
        if obj not in chosen(context):
            raise BadInputError("Make the object that is to be painted the active one: click on it.")
        colour = corrections.effective(obj).get("base_color")
        unseen.paint(context, obj, context.scene.scan_relight.images, colour, self.masked)
        return [f"Painting '{unseen.painted(obj).name}'; leave Texture Paint for object mode when done"]


@on_selected
class SCAN_RELIGHT_OT_fill_unseen(CorrectOperator, bpy.types.Operator):
    """Fill what no frame saw of the selected objects from the measured spots around, on an image of your own that no
    run writes over"""

    bl_label = "Fill"

    def work(self, context):
        count, remarks = unseen.fill(chosen(context), context.scene.scan_relight.images)
        if not count:
            raise BadInputError(" ".join(remarks))
        return [f"{count} texels filled", *remarks]


@needs(
    lambda context: any(map(unseen.painted, chosen(context))), "Nothing was painted or filled on the selected objects."
)
@on_selected
class SCAN_RELIGHT_OT_restore_painted(CorrectOperator, bpy.types.Operator):
    """Show what was found instead of what was painted or filled on the selected objects"""

    bl_label = "Restore"

    discard: bool_property("Forget What Was Painted", "Take it out of your image too; else Paint shows it again")

    def work(self, context):
        count = unseen.restore(chosen(context), self.discard)
        return [f"{count} object{'s' * (count != 1)} restored"]


@bpy.app.handlers.persistent
def keep_painted(*_) -> None:
    """Before the file is saved: painted images are saved with it."""
    unseen.keep_painted()
