"""What all operators share: when they can run, errors that become one sentence, files and places that are picked."""

from collections.abc import Callable
from functools import partial

import bpy
from bpy_extras import view3d_utils

from ...addon.console import unexpected
from ...addon.core.errors import ScanRelightError
from .job_operator import active, under_mouse

REPORTED = "Error: "
"""How Blender begins an operator's error where it raises it as an exception."""
TURNING = {"MIDDLEMOUSE", "WHEELUPMOUSE", "WHEELDOWNMOUSE"}
"""Events by which the view is turned, which an operator that picks a place leaves to Blender."""


def needs(fine: Callable, otherwise: str | Callable[[], str]):
    """Class decorator: `poll` asks this of the context after all that it asks already.

    Parameters
    ----------
    fine : callable
        From the context to whether the operator can run.
    otherwise : str or callable
        What the tooltip says where it can't.
    """

    def asking(cls):
        before = getattr(cls, "poll", None)
        before = before.__func__ if before else lambda cls, context: True

        def poll(cls, context):
            if not before(cls, context):
                return False
            if not fine(context):
                cls.poll_message_set(otherwise if isinstance(otherwise, str) else otherwise())
                return False
            return True

        cls.poll = classmethod(poll)
        return cls

    return asking


has_scene = needs(lambda context: context.scene is not None, "There is no scene to work in.")
object_mode = needs(lambda context: context.mode == "OBJECT", "Leave the editing mode for object mode first.")
no_run = needs(lambda context: active() is None, "A run is going on; stop it first or wait for its end.")
has_capture = needs(lambda context: context.scene.scan_relight.capture_folder, "Choose the capture's folder first.")


def free_scene(cls):
    """Class decorator: for all that changes the scene, or starts what does."""
    return no_run(object_mode(has_scene(cls)))


class NothingDone(Exception):
    """There was nothing to do: a warning, and no undo step."""


class OneSentence:
    """Tells every error of an operator in one sentence."""

    def attempt(self, work: Callable[[], set[str]], folder: str = "") -> set[str]:
        """What `work` returns; cancelled where it fails, and `error.log` of what nobody foresaw goes to `folder`."""
        try:
            return work()
        except ScanRelightError as error:
            self.report({"ERROR"}, str(error))
        except MemoryError:
            self.report({"ERROR"}, "The memory is used up; a greater texel size or a smaller atlas size takes less.")
        except NothingDone as error:
            self.report({"WARNING"}, str(error))
        except Exception as error:  # the last line of defence
            told = str(error).strip()
            if isinstance(error, RuntimeError) and told.startswith(REPORTED):  # by an operator that was called
                self.report({"ERROR"}, told.removeprefix(REPORTED))
            else:
                self.report({"ERROR"}, unexpected(error, folder or bpy.app.tempdir))
        return {"CANCELLED"}


class AtOnce(OneSentence):
    """Does `work` in one undo step; the sentences that it returns are told as `remarks` says."""

    bl_options = {"REGISTER", "UNDO"}
    remarks = "WARNING"

    def execute(self, context):
        def work() -> set[str]:
            for sentence in self.work(context) or ():
                self.report({self.remarks}, sentence)
            return {"FINISHED"}

        return self.attempt(work)


class Choosing:
    """Opens the file browser, unless the property `given` holds a path already."""

    given = ""

    def invoke(self, context, event):
        if self.given and getattr(self, self.given):
            return self.execute(context)
        context.window_manager.fileselect_add(self)
        return {"RUNNING_MODAL"}


def _path(subtype: str, name: str, description: str, *options: str, **more):
    return bpy.props.StringProperty(name=name, description=description, subtype=subtype, options=set(options), **more)


folder_property, file_property = partial(_path, "DIR_PATH"), partial(_path, "FILE_PATH")
"""Properties that hold a path: label, tooltip, options, and what else `StringProperty` takes."""
FOLDERS = bpy.props.BoolProperty(
    name="Folders", description="Only folders are shown", default=True, options={"HIDDEN", "SKIP_SAVE"}
)
"""What has the file browser show folders alone."""


def mouse_ray(context, event):
    """Origin and direction of the ray under the mouse; None outside the 3D views."""
    for area in context.screen.areas:
        main = [one for one in area.regions if one.type == "WINDOW" and area.type == "VIEW_3D"][:1]
        for region in under_mouse(event, main):
            view = region, area.spaces.active.region_3d, (event.mouse_x - region.x, event.mouse_y - region.y)
            return view3d_utils.region_2d_to_origin_3d(*view), view3d_utils.region_2d_to_vector_3d(*view)
    return None
