"""The settings as properties of an operator, made from the `Settings` dataclass; base classes of operators."""

import contextlib
import importlib.util
from dataclasses import replace
from functools import cache

import bpy

from ...addon.bridge.job.command import command
from ...addon.bridge.results import default_folders
from ...addon.bridge.slices import whole
from ...addon.core.errors import BadInputError
from ...addon.core.settings import PRESETS, Settings
from ...addon.core.stages import LABELS, RUN_STAGES, WRITE
from ...addon.leash import MemoryGuard
from ...addon.settings_info import SettingInfo, setting_infos
from .. import preferences
from ..base.job_operator import FOLLOWED, JobOperator
from ..base.operator import OneSentence, free_scene, needs
from ..base.panel import fields
from ..base.properties import bool_property, enum_property, float_property, folder_property, int_property
from ..translations import OWN
from . import reading_props, room
from .reading_props import ReadingProps
from .settings_words import words

PRESET_TEXTS = {
    "draft": "A first look: coarse texels, few rays",
    "normal": "Texels as fine as the frames, rays enough for most rooms",
    "fine": "Finer texels and three times the rays; takes several times as long",
    "paper": "The published method, for comparison; very slow",
}
TARGETS = [
    ("AUTO", "What Was Captured", "Imported objects of a scan; your own objects where they were captured"),
    ("IMPORTED", "Imported Objects", "The objects that Import Capture made"),
    (
        "SELECTED",
        "Your Own Objects",
        "The objects that were selected when the scene was captured; what they wear now is kept and can be restored",
    ),
]
IMAGE_PLACES = [
    ("RESULT", "In the Result Folder", "Refer to the images where they are"),
    ("FOLDER", "Beside the File", "Copy the images into a folder beside the saved .blend"),
    ("PACK", "Packed", "Keep the images within the .blend"),
]
SCENES = [
    ("OWN", "A Scene of Its Own", "With its light, exposure and cameras; your scenes stay as they are"),
    ("SCENE", "This Scene", "Only link the room into this scene; its world, exposure, engine and camera stay"),
]
AGAIN_FROM = [
    ("NONE", "Nothing", "Go on from what is stored"),
    *((name, LABELS[name], f"From '{LABELS[name]}' on") for name in RUN_STAGES),
]
IMAGES = enum_property("Images", "Where the recovered images are kept", IMAGE_PLACES)
INTO = enum_property("Into", "Where the room goes", SCENES)
COPIES = bool_property(
    "Make Copies",
    "Where modifiers or instances make an object's faces, put the material onto a "
    "copy of it and hide the object; without this such objects are left as they are",
)
FROM_STAGE = enum_property("Again From", "Do this stage and all later ones anew, though they are stored", AGAIN_FROM)
SAVED_AS = {"median": (2, 3, 4)}
"""Numbers of choices in saved files, where some were removed: 0 was 'adaptive', 1 'batched'."""
PACKAGES = ("scipy", "embreex", "OpenEXR")


def property_for(info: SettingInfo):
    """The Blender property that holds one setting."""
    name, text, choices = words(info)
    if info.choices:
        numbers = SAVED_AS.get(info.name, range(len(info.choices)))
        items = [(choice, *choices[choice], number) for choice, number in zip(info.choices, numbers)]
        return enum_property(name, text, items, default=info.default)
    if info.kind is bool:
        return bool_property(name, text, default=info.default)
    if info.kind is int:
        return int_property(name, text, default=info.default, min=0)
    return float_property(name, text, default=info.default, min=0, precision=3)


class SettingsProps:
    """One property for each field of `Settings`, for operators and property groups."""

    __annotations__ = {info.name: property_for(info) for info in setting_infos()}


def setting_value(owner, info: SettingInfo):
    """The value in `owner`; for a removed choice the default. Blender stores floats in single precision, so six digits
    are as typed."""
    value = getattr(owner, info.name)
    if info.choices:
        return value or info.default
    return float(f"{value:.6g}") if info.kind is float else value


@cache
def missing_packages() -> tuple[str, ...]:
    """The bundled packages that are missing."""
    return tuple(name for name in PACKAGES if importlib.util.find_spec(name) is None)


def startable(operator):
    """Class decorator: `poll` of operators that read a capture, or start another one that does."""
    packages = needs(
        lambda context: not missing_packages(),
        lambda: f"{' and '.join(missing_packages())} missing: install the extension again.",
    )
    return free_scene(packages(operator))


def preset_property(description: str, **kwargs):
    """A property for the name of a preset."""
    items = [(name, name.capitalize(), PRESET_TEXTS.get(name, "")) for name in PRESETS]
    return enum_property("Preset", description, items, default="normal", translation_context=OWN, **kwargs)


@startable
class CaptureOperator(ReadingProps, OneSentence, JobOperator):
    """Works on a capture: in a job that `modal` follows; in the background `execute` does it itself."""

    bl_options = {"UNDO", "PRESET"}
    capture_folder: folder_property("Capture", "Folder with transforms.json, mesh.ply and the frames", "SKIP_PRESET")
    ask: bpy.props.BoolProperty(default=True, options={"HIDDEN", "SKIP_SAVE"}, description="Ask for the folders first")

    def invoke(self, context, event):
        if not self.ask:
            return self.execute(context)
        choices = context.scene.scan_relight
        for name in ("capture_folder", "result_folder"):
            if name in self.properties.bl_rna.properties and not getattr(self, name):
                setattr(self, name, getattr(choices, name))
        return context.window_manager.invoke_props_dialog(self, width=420)

    def execute(self, context):

        def work() -> set[str]:
            if not bpy.app.background:
                return self.begin(context)
            for sentence in self.work(context):
                self.report({"WARNING"}, sentence)
            return {"FINISHED"}

        return self.attempt(work, bpy.path.abspath(getattr(self, "result_folder", "")))

    def folder(self, name: str):
        """The absolute path in the property `name`; raises where it is empty."""
        value = getattr(self, name)
        if not value:
            raise BadInputError(f"Choose the {name.replace('_', ' ')} first.")
        folder = bpy.path.abspath(value)
        if name == "result_folder":
            default_folders.check(folder)
        return folder


class StageOperator(SettingsProps, CaptureOperator):
    """An operator that runs stages of the method: also a result folder and the settings."""

    bl_options = set()  # the scene stays as it is: no undo step
    result_folder: folder_property("Result", "Folder for the recovered scene and the finished stages", "SKIP_PRESET")
    preset: preset_property("What the settings that are not given start from")
    from_stage: FROM_STAGE

    def work(self, context) -> list[str]:
        return self.run()["warnings"]

    def draw(self, context):
        """The dialog with the main choices; all others come from the preset or the caller."""
        fields(self.layout, self, "capture_folder", "result_folder", "preset", "from_stage")

    def settings(self) -> Settings:
        """The preset with every setting that is set; threads from the preferences where they are not."""
        given = (info for info in setting_infos() if self.properties.is_property_set(info.name))
        values = {info.name: setting_value(self, info) for info in given}
        if not values.get("threads"):
            values["threads"] = getattr(preferences.preferences(), "threads", 0)
        return replace(PRESETS[self.preset], **values)

    def run(self, **options) -> dict:
        """Run the stages up to the last one here; returns the report. `options` goes to `bridge.job.run.run`."""
        from ...addon.bridge.job.run import run
        from ...addon.core.pipeline.run import Request, progress_of_run  # not earlier: Blender's start should not wait

        settings = self.settings()
        request = Request(self.until, self.first_stage(), reading=reading_props.reading(self))
        folders = self.folder("capture_folder"), self.folder("result_folder")
        with contextlib.closing(MemoryGuard(self.memory_limit())) as guard:
            return run(*folders, settings, progress_of_run(should_stop=guard), request, **options)

    def first_stage(self) -> str | None:
        """The stage that is computed again with all later ones; None continues from the stored ones."""
        return None if self.from_stage == "NONE" else self.from_stage

    @staticmethod
    def memory_limit() -> float | None:
        """Gigabytes that a run may use; None for most of the free memory."""
        return getattr(preferences.preferences(), "memory_limit", None) or None

    def begin(self, context):
        """Start the run as a job of the command line, so that its result is the same."""
        capture, result, settings = self.folder("capture_folder"), self.folder("result_folder"), self.settings()
        words = command(
            ["recover", capture, *reading_props.options(self)],
            out=result,
            until=self.until,
            from_stage=self.first_stage(),
            memory_limit=self.memory_limit(),
            **{info.name: getattr(settings, info.name) for info in setting_infos()},
            **FOLLOWED,
        )
        facts = {"capture_folder": capture, "result_folder": result, "until": self.until}
        return self.start(context, words, title=self.bl_label, **facts)


class SceneStageOperator(StageOperator):
    """A stage operator whose end also changes the scene, in one undo step."""

    bl_options = {"UNDO", "PRESET"}
    until = WRITE
    import_first = True
    target: enum_property("Onto", "Which objects the materials go onto", TARGETS)
    images: IMAGES
    copies: COPIES
    into: INTO

    def work(self, context):
        """Run, then bring in the room, so that a failed run does not change the file."""
        from ...addon.core.results.room_file import read_room
        from ...addon.core.results.store import Store

        self.check_target()
        report, folder = self.run(fresh=False), self.folder("result_folder")
        report["warnings"] += whole(self.change(context.scene, read_room(folder)))
        with Store(folder) as store:
            store.write_json("report.json", report)
        return report["warnings"]

    def begin(self, context):
        self.check_target()
        return super().begin(context)

    def check_target(self) -> None:
        """Raise where the capture should be in the file and is not: before the work, not after it."""
        from ...addon.bridge.own_scene.capture import check_own
        from ...addon.bridge.own_scene.write_back import is_own
        from ...addon.bridge.results import images as result_images
        from ...addon.bridge.scene.parts import imported

        result_images.check(self.images)
        capture = self.folder("capture_folder")
        if is_own(capture, self.target):
            check_own(capture)
        elif not self.import_first:
            imported(capture)

    def load(self, job):
        from ...addon.core.results.room_file import read_room

        return read_room(job.facts["result_folder"])

    def change(self, scene, loaded):
        """Bring in the room, or assign the materials to the artist's own objects."""
        from ...addon.bridge.own_scene.write_back import is_own, writing_back
        from ...addon.bridge.room.bring import bringing

        if is_own(loaded.capture.root, self.target):
            return (
                yield from writing_back(
                    scene, loaded.capture, loaded.atlas_uv, loaded.materials, loaded.folder, self.images, self.copies
                )
            )
        brought = yield from bringing(
            loaded.folder, scene if self.into == "SCENE" else None, self.images, known=not self.import_first
        )
        if self.into == "OWN":
            room.show(scene, brought.scene)
        if self.job is not None:
            self.job.facts["room"] = brought.scene.name
        return brought.warnings
