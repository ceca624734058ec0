"""`bpy.ops.scan_relight.*` for the view: a frame's camera, virtual objects in the room, before and after."""

import shutil
import tempfile
from contextlib import suppress
from pathlib import Path

import bpy

from ...addon.bridge.custom_properties import OBJECT_ID
from ...addon.bridge.data.cameras import frame_cameras, track_cameras, use_camera
from ...addon.bridge.job.command import command
from ...addon.bridge.light.room import cast
from ...addon.bridge.relight import before_after, match_frame, pictures
from ...addon.bridge.relight import virtual_object as virtual
from ...addon.bridge.render_device import current_device
from ...addon.core.errors import BadInputError, ScanRelightError
from ..base.job_operator import FOLLOWED, JobOperator, areas
from ..base.operator import NAVIGATION_EVENTS, mouse_ray, needs, no_run
from ..base.properties import bool_property, enum_property, file_property, int_property
from ..results.look import make_active
from ..translations import OWN
from .base import RelightOperator, SceneOperator
from .props import ENGINE, LOOK, LOOKS, PERCENTAGE, PLACE, SAMPLES, SHAPE, SIZE, look_through


@needs(lambda context: frame_cameras(context.scene), "The scene has no camera of a capture; import a capture first.")
class SCAN_RELIGHT_OT_match_frame(SceneOperator, bpy.types.Operator):
    """Look and render through the camera of a frame of the capture"""

    bl_label = "Look Through Frame"

    index: int_property("Frame", "In the capture's order, from 0", min=0)
    size: bool_property("Match Render Size", "Render at the frame's size and with its shape of pixels, too")
    step: int_property("Step", "So many frames on from the present one; 0 takes the frame")

    def work(self, context):
        scene = context.scene
        count = len(frame_cameras(scene))
        index = (match_frame.current(scene) + self.step) % count if self.step else self.index
        if index >= count:
            raise BadInputError(f"There is no frame {index}; the capture's last one is {count - 1}.")
        message = look_through(scene.scan_relight_studio, index, self.size)
        see_through_camera(context)
        return [message] if message else []


@needs(
    lambda context: track_cameras(context.scene),
    "The scene has no camera along a capture's track; bring a room of at least two frames in first.",
)
class SCAN_RELIGHT_OT_follow_track(SceneOperator, bpy.types.Operator):
    """Look and render through a camera that goes where the capture's went: play the timeline, a frame of it for each of
    the capture's"""

    bl_label = "Go Along the Track"

    def work(self, context):
        use_camera(context.scene, track_cameras(context.scene)[0], size=False)
        see_through_camera(context)


def see_through_camera(context) -> None:
    """Switch the 3D view of the context to the scene's camera."""
    space = context.space_data
    if space is not None and space.type == "VIEW_3D" and space.region_3d is not None:
        space.region_3d.view_perspective = "CAMERA"


def surface(scene, place: str, ignored=None):
    """The surface for a choice of `PLACES`."""
    return virtual.below_cursor(scene) if place == "CURSOR" else virtual.place_in_view(scene, ignored)


class SCAN_RELIGHT_OT_add_virtual(RelightOperator, bpy.types.Operator):
    """Set a simple object onto a surface of the room, in its light"""

    bl_label = "Add Object"

    shape: SHAPE
    look: LOOK
    size: SIZE
    place: PLACE

    def work(self, context):
        obj = virtual.add_virtual(context.scene, self.shape, self.size, self.look, surface(context.scene, self.place))
        make_active(context, obj)


@needs(
    lambda context: context.object and context.object.type == "MESH" and OBJECT_ID not in context.object,
    "Select an object of your own, not one of the scan.",
)
class OwnObject(RelightOperator):
    """Works on the active object, which is not part of the scan."""


class SCAN_RELIGHT_OT_place_object(OwnObject, bpy.types.Operator):
    """Set the active object onto a surface of the room; its size and rotation stay"""

    bl_label = "Set Down"

    place: PLACE

    def work(self, context):
        virtual.stand(context.scene, context.object, surface(context.scene, self.place, context.object))


class SCAN_RELIGHT_OT_virtual_look(OwnObject, bpy.types.Operator):
    """Give the active object a simple material in place of its own"""

    bl_label = "Give It This Material"

    look: enum_property("Material", "Which one", LOOKS, translation_context=OWN)

    def work(self, context):
        virtual.set_look(context.object, self.look)


class SCAN_RELIGHT_OT_pick_place(OwnObject, bpy.types.Operator):
    """Move the mouse over the room to set the active object down; click to leave it there, ESC to stop"""

    bl_label = "Pick Place"
    bl_options = {"REGISTER", "UNDO", "BLOCKING"}

    def invoke(self, context, event):
        if not areas(context, "VIEW_3D"):
            self.report({"ERROR"}, "There is no 3D view to pick in.")
            return {"CANCELLED"}
        self._object_name, self._matrix_before = context.object.name, context.object.matrix_world.copy()
        context.window_manager.modal_handler_add(self)
        context.workspace.status_text_set("Click: set down here   ESC or right click: back to where it was")
        return {"RUNNING_MODAL"}

    def work(self, context):
        """Without a mouse: in the middle of the view."""
        virtual.stand(context.scene, context.object)

    def modal(self, context, event):
        obj = context.scene.objects.get(self._object_name)
        if obj is None or event.type in {"ESC", "RIGHTMOUSE"}:
            if obj is not None:
                obj.matrix_world = self._matrix_before
            return self._leave(context, {"CANCELLED"})
        if event.type == "LEFTMOUSE" and event.value == "PRESS":
            return self._leave(context, {"FINISHED"})
        if event.type == "MOUSEMOVE":
            self._move(context, obj, event)
            return {"RUNNING_MODAL"}
        return {"PASS_THROUGH"} if event.type in NAVIGATION_EVENTS else {"RUNNING_MODAL"}

    def _move(self, context, obj, event):
        ray = mouse_ray(context, event)
        if ray is None:
            return
        obj.hide_viewport = True
        try:
            hit = cast(context.scene, *ray)
        finally:
            obj.hide_viewport = False
        if hit is not None:
            with suppress(ScanRelightError):  # no surface to stand on: it stays where it was last
                virtual.stand(context.scene, obj, hit)

    def _leave(self, context, status):
        context.workspace.status_text_set(None)
        return status


FILE = "before_after.png"


@no_run
@needs(
    lambda context: context.scene.camera is not None, "The scene has no camera to render through; choose a frame first."
)
class SCAN_RELIGHT_OT_before_after(JobOperator, RelightOperator, bpy.types.Operator):
    """Render this view under the captured and the present light, side by side, into an image and a file"""

    bl_label = "Before and After"
    bl_options = {"UNDO"}

    filepath: file_property(
        "File", "Picture to write; by default before_after.png in the room's result folder", "SKIP_SAVE"
    )
    engine: ENGINE
    samples: SAMPLES
    percentage: PERCENTAGE

    def target(self, scene) -> Path:
        if self.filepath:
            return Path(bpy.path.abspath(self.filepath)).absolute()
        folder, stays = before_after.picture_folder(scene, scene.scan_relight.result_folder)
        if not stays:
            self.report({"INFO"}, "The picture goes with this session: there is no result folder to keep it in.")
        return folder / FILE

    def work(self, context):
        scene, out = context.scene, self.target(context.scene)
        with pictures.settings_kept(scene):
            pictures.prepare(scene, self.engine, self.samples, self.percentage)
            before_after.render_pair(scene, out)
        before_after.show(out)

    def execute(self, context):
        """Blocks in the background; otherwise starts the job."""
        if bpy.app.background:
            return RelightOperator.execute(self, context)
        return self.attempt(lambda: self.begin(context))

    def begin(self, context) -> set[str]:
        out = self.target(context.scene)
        pictures.check_format(out)
        self._folder = Path(tempfile.mkdtemp(prefix="scan_relight_"))
        before_after.save_copy(self._folder)
        words = command(
            ["relight", self._folder],
            out=self._folder / out.name,
            before_after=True,
            engine=self.engine.lower(),
            samples=self.samples,
            size=self.percentage,
            device=current_device(context.scene),
            scene=context.scene.name,
            **FOLLOWED,
        )
        return self.start(context, words, title="Before and After", out=str(out), result_folder="")

    def load(self, job):
        out = Path(job.facts["out"])
        out.parent.mkdir(parents=True, exist_ok=True)
        with pictures.saving(out) as temporary:
            shutil.copyfile(self._folder / out.name, temporary)
        return out

    def change(self, scene, loaded):
        before_after.show_in_window(before_after.show(loaded))
        yield 1.0
        return ()

    def tidy(self, job):
        shutil.rmtree(self._folder, ignore_errors=True)
