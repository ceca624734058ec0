"""The settings as properties of an operator, made from the `Settings` dataclass; and what all operators share."""

# No `from __future__ import annotations` here: Blender reads the properties off the annotations.
import importlib.util
from dataclasses import replace
from functools import cache

import bpy

from ..addon.console import unexpected
from ..addon.core.errors import BadInputError, ScanRelightError
from ..addon.core.settings import PAPER, Settings
from ..addon.settings_info import SettingInfo, setting_infos

PACKAGES = ("scipy", "embreex", "OpenEXR")


def property_for(info: SettingInfo):
    """The Blender property that holds one setting."""
    name = info.name.replace("_", " ").capitalize()
    if info.choices:
        items = [(choice, choice.capitalize(), "") for choice in info.choices]
        return bpy.props.EnumProperty(name=name, description=info.help, items=items, default=info.default)
    make = {bool: bpy.props.BoolProperty, int: bpy.props.IntProperty, float: bpy.props.FloatProperty}[info.kind]
    extra = {} if info.kind is bool else {"min": 0}
    if info.kind is float:
        extra["precision"] = 4
    return make(name=name, description=info.help, default=info.default, **extra)


def with_settings(operator):
    """Class decorator: give an operator one property for each field of `Settings`."""
    own = dict(operator.__dict__.get("__annotations__", {}))
    operator.__annotations__ = own | {info.name: property_for(info) for info in setting_infos()}
    return operator


@cache
def missing_packages() -> tuple[str, ...]:
    """The bundled packages that are not there."""
    return tuple(name for name in PACKAGES if importlib.util.find_spec(name) is None)


class CaptureOperator:
    """What every operator has: a capture folder, and errors that become one sentence."""

    bl_options = {"REGISTER", "UNDO"}
    capture_folder: bpy.props.StringProperty(
        name="Capture", description="Folder with transforms.json, mesh.ply and the frames", subtype="DIR_PATH")

    @classmethod
    def poll(cls, context):
        """Whether the operator can run now; where not, one sentence says what is missing."""
        if missing_packages():
            cls.poll_message_set(f"{' and '.join(missing_packages())} missing: install the extension again.")
            return False
        if context.scene is None:
            cls.poll_message_set("There is no scene to work in.")
            return False
        if context.mode != "OBJECT":
            cls.poll_message_set("Leave the editing mode for object mode first.")
            return False
        return True

    def invoke(self, context, event):
        """Ask for the folders and settings."""
        return context.window_manager.invoke_props_dialog(self, width=420)

    def execute(self, context):
        """Do the work; every error that is foreseen becomes one sentence."""
        try:
            for sentence in self.work(context):
                self.report({"WARNING"}, sentence)
        except ScanRelightError as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        except MemoryError:
            self.report({"ERROR"}, "The memory is used up; a greater texel size or a smaller atlas size takes less.")
            return {"CANCELLED"}
        except Exception as error:  # the last line of defence: a sentence, never a bare traceback
            self.report({"ERROR"}, unexpected(error, bpy.path.abspath(getattr(self, "result_folder", ""))))
            return {"CANCELLED"}
        return {"FINISHED"}

    def folder(self, name: str):
        """The absolute path in the property `name`; raises where it is empty."""
        value = getattr(self, name)
        if not value:
            raise BadInputError(f"Choose the {name.replace('_', ' ')} first.")
        return bpy.path.abspath(value)


class StageOperator(CaptureOperator):
    """An operator that runs stages of the method: also a result folder and the settings."""

    result_folder: bpy.props.StringProperty(
        name="Result", description="Folder for the recovered scene and the finished stages", subtype="DIR_PATH")
    paper: bpy.props.BoolProperty(
        name="As in the paper", description="The published method; the other settings are not looked at", default=False)

    def settings(self) -> Settings:
        """The settings as chosen."""
        if self.paper:
            return replace(PAPER, threads=self.threads, seed=self.seed)
        return Settings(**{info.name: getattr(self, info.name) for info in setting_infos()})

    def run(self, context, until: str, **where) -> list[str]:
        """Run the stages up to `until`; returns the report's warnings. `where` goes to `bridge.run.run`."""
        from ..addon.bridge.run import progress_for, run  # not earlier: Blender's start should not wait for it

        settings = self.settings()
        manager = context.window_manager
        shown = None if bpy.app.background else (lambda event: manager.progress_update(event.overall))
        report = run(self.folder("capture_folder"), self.folder("result_folder"), settings,
                     progress_for(settings, shown), until, **where)
        return report["warnings"]
