"""Shared by all operators: `poll`, errors as one sentence, the file browser, rays under the mouse; stopping a run."""

from collections.abc import Callable

import bpy
from bpy_extras import view3d_utils

from ...addon.console import unexpected
from ...addon.core.errors import ScanRelightError
from .job_operator import active, redraw, under_mouse

REPORTED = "Error: "
"""Prefix of an operator's error where Blender raises it as an exception."""
NAVIGATION_EVENTS = {"MIDDLEMOUSE", "WHEELUPMOUSE", "WHEELDOWNMOUSE"}
"""Events that navigate the view, which an operator that picks a place passes through to Blender."""


def needs(condition: Callable, message: str | Callable[[], str]):
    """Class decorator: `poll` also checks a condition, after those it has already.

    Parameters
    ----------
    condition : callable
        Whether the operator can run, from the context.
    message : str or callable
        The tooltip where it can't.
    """

    def decorate(cls):
        base_poll = getattr(cls, "poll", None)
        base_poll = base_poll.__func__ if base_poll else lambda cls, context: True

        def poll(cls, context):
            if not base_poll(cls, context):
                return False
            if not condition(context):
                cls.poll_message_set(message if isinstance(message, str) else message())
                return False
            return True

        cls.poll = classmethod(poll)
        return cls

    return decorate


has_scene = needs(lambda context: context.scene is not None, "There is no scene to work in.")
object_mode = needs(lambda context: context.mode == "OBJECT", "Leave the editing mode for object mode first.")
no_run = needs(lambda context: active() is None, "A run is going on; stop it first or wait for its end.")
has_capture = needs(lambda context: context.scene.scan_relight.capture_folder, "Choose the capture's folder first.")


def free_scene(cls):
    """Class decorator: for operators that change the scene, or start others that do."""
    return no_run(object_mode(has_scene(cls)))


class NothingDone(Exception):
    """There was nothing to do: a warning, and no undo step."""


class OneSentence:
    """Reports every error of an operator in one sentence."""

    def attempt(self, work: Callable[[], set[str]], folder: str = "") -> set[str]:
        """The result of `work`; cancelled where it fails, with an `error.log` in `folder` for unexpected errors."""
        try:
            return work()
        except ScanRelightError as error:
            self.report({"ERROR"}, str(error))
        except MemoryError:
            self.report({"ERROR"}, "The memory is used up; a greater texel size or a smaller atlas size takes less.")
        except NothingDone as error:
            self.report({"WARNING"}, str(error))
        except Exception as error:  # the last line of defence
            message = str(error).strip()
            if isinstance(error, RuntimeError) and message.startswith(REPORTED):  # of an operator that was called
                self.report({"ERROR"}, message.removeprefix(REPORTED))
            else:
                self.report({"ERROR"}, unexpected(error, folder or bpy.app.tempdir))
        return {"CANCELLED"}


class AtOnce(OneSentence):
    """Does `work` in one undo step; the sentences that it returns are reported with the level `remarks`."""

    bl_options = {"REGISTER", "UNDO"}
    remarks = "WARNING"

    def execute(self, context):
        def work() -> set[str]:
            for sentence in self.work(context) or ():
                self.report({self.remarks}, sentence)
            return {"FINISHED"}

        return self.attempt(work)


class Choosing:
    """Opens the file browser, unless the property named `given` has a path already."""

    given = ""

    def invoke(self, context, event):
        if self.given and getattr(self, self.given):
            return self.execute(context)
        context.window_manager.fileselect_add(self)
        return {"RUNNING_MODAL"}


@needs(lambda context: active() is not None, "No run is going on.")
class SCAN_RELIGHT_OT_stop(bpy.types.Operator):
    """Stop the run within a second; finished stages are kept and the next run goes on from them"""

    bl_label = "Stop Recovery"

    def execute(self, context):
        """Request it; the operator that follows the job handles its end."""
        job = active()
        job.stop()
        job.facts["unwanted"] = True
        redraw(context)
        return {"FINISHED"}


def mouse_ray(context, event):
    """Origin and direction of the ray under the mouse; None outside the 3D views."""
    for area in context.screen.areas:
        main_region = [item for item in area.regions if item.type == "WINDOW" and area.type == "VIEW_3D"][:1]
        for region in under_mouse(event, main_region):
            view = region, area.spaces.active.region_3d, (event.mouse_x - region.x, event.mouse_y - region.y)
            return view3d_utils.region_2d_to_origin_3d(*view), view3d_utils.region_2d_to_vector_3d(*view)
    return None
