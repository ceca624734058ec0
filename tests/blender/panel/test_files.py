"""From the disk into the panel: File > Import, dropped files, wrong folders, runs that were stopped."""

from __future__ import annotations

import json
import os
import shutil
from types import SimpleNamespace

import pytest

bpy = pytest.importorskip("bpy")


@pytest.fixture
def choices(ops):
    return bpy.context.scene.scan_relight


@pytest.fixture
def scan(grey_capture, tmp_path):
    return shutil.copytree(grey_capture, tmp_path / "scans" / "living-room")


@pytest.fixture
def result(tmp_path):
    made = tmp_path / "first"
    made.mkdir()
    (made / "materials.json").write_text(json.dumps({"objects": [], "capture": "living-room"}))
    (made / "scene.blend").write_bytes(b"BLENDER")
    return made


@pytest.fixture
def panel(module):
    return module("operators.recover.panel_capture").SCAN_RELIGHT_PT_capture


@pytest.fixture
def recover(module):
    return module("operators.recover.panel_recover").SCAN_RELIGHT_PT_recover


def drop(path, **more):
    """As Blender hands a dropped file over."""
    return bpy.ops.scan_relight.drop(directory=str(path.parent), files=[{"name": path.name}], **more)


def test_a_dropped_transforms_json_chooses_its_scan(choices, scan):
    assert drop(scan / "transforms.json") == {"FINISHED"}
    assert choices.capture_folder == str(scan)
    assert not any("object_id" in thing for thing in bpy.data.objects), "nothing comes in that was not asked for"


def test_a_dropped_scan_can_be_imported(choices, scan):
    assert drop(scan / "transforms.json", then="IMPORT") == {"FINISHED"}
    assert sum("object_id" in thing for thing in bpy.context.scene.objects) == 15


@pytest.mark.parametrize("text", ['{"colours": 3}', "[]", "no JSON"])
def test_another_json_is_refused_in_one_sentence(choices, tmp_path, text):
    (tmp_path / "package.json").write_text(text)
    with pytest.raises(RuntimeError, match=r"'package.json' is no part of a scan or of a result") as told:
        drop(tmp_path / "package.json")
    assert len(str(told.value).strip().splitlines()) == 1 and choices.capture_folder == ""


def test_the_handler_is_for_3d_views_and_json(ops):
    handler = bpy.types.SCAN_RELIGHT_FH_json
    assert handler.bl_file_extensions == ".json" and handler.bl_import_operator == "scan_relight.drop"
    assert handler.poll_drop(SimpleNamespace(area=SimpleNamespace(type="VIEW_3D")))
    assert not handler.poll_drop(SimpleNamespace(area=SimpleNamespace(type="IMAGE_EDITOR")))
    assert not handler.poll_drop(SimpleNamespace(area=None))


@pytest.mark.parametrize("chosen", ["", "mesh.ply", "transforms.json"])
def test_file_import_takes_the_folder_or_a_file_in_it(choices, scan, chosen):
    assert bpy.ops.scan_relight.open_capture(filepath=str(scan / chosen)) == {"FINISHED"}
    assert choices.capture_folder == str(scan)


def test_the_folder_above_the_only_scan_is_taken_for_it(choices, scan):
    bpy.ops.scan_relight.open_capture(filepath=str(scan.parent))
    assert choices.capture_folder == str(scan)


def test_what_is_no_scan_leaves_the_choice_alone(choices, scan, tmp_path):
    choices.capture_folder = str(scan)
    (tmp_path / "empty").mkdir()
    with pytest.raises(RuntimeError, match="'empty' is empty"):
        bpy.ops.scan_relight.open_capture(filepath=str(tmp_path / "empty"))
    with pytest.raises(RuntimeError, match="Choose the folder of a scan first"):
        bpy.ops.scan_relight.open_capture()
    assert choices.capture_folder == str(scan)


def test_open_result_refuses_what_is_none(ops, scan):
    with pytest.raises(RuntimeError, match="holds no finished result"):
        ops.open_result(folder=str(scan))


def test_the_menu_has_the_entry_once(package, ops):
    def entries():
        return [one for one in bpy.types.TOPBAR_MT_file_import.draw._draw_funcs if "scan_relight" in one.__module__]

    assert len(entries()) == 1
    package.unregister()
    assert entries() == []
    package.register()
    assert len(entries()) == 1


def test_a_scan_one_level_down_is_offered(draw, panel, choices, scan):
    choices.capture_folder = str(scan.parent)
    shown = draw(panel)
    assert "one scan is in it" in shown.text and "Use 'living-room'" in shown.words
    assert "scan_relight.use_folder" in shown.buttons and "scan_relight.check_capture" not in shown.buttons
    bpy.ops.scan_relight.use_folder(folder=str(scan))
    assert "scan_relight.check_capture" in draw(panel).buttons


def test_a_result_is_recognised(draw, panel, choices, result):
    choices.capture_folder = str(result)
    shown = draw(panel)
    assert "finished result of 'living-room'" in shown.text and shown.buttons[-1] == "scan_relight.open_result"


def test_a_format_that_was_given_is_tried(draw, panel, choices, tmp_path):
    choices.capture_folder = str(tmp_path)
    assert "scan_relight.check_capture" not in draw(panel).buttons
    choices.reading.reading_format = "nerfstudio"
    assert "scan_relight.check_capture" in draw(panel).buttons


def test_a_stopped_run_is_resumed_or_begun_anew(draw, recover, choices, scan, tmp_path):
    choices.capture_folder, choices.result_folder = str(scan), str(tmp_path / "result")
    assert "Run" in draw(recover).words and "Resume" not in draw(recover).words
    stages = tmp_path / "result" / "stages"
    stages.mkdir(parents=True)
    for time, name in enumerate(("surface", "lit_diffuse")):
        (stages / f"{name}.npz").write_bytes(b"")
        os.utime(stages / f"{name}.npz", (1000 + time, 1000 + time))
    shown = draw(recover)
    assert "Resume" in shown.words and "Goes on with: Light and albedo." in shown.text and "Start Anew" in shown.words
    (tmp_path / "result" / "report.json").write_text("{}")
    assert "Run" in draw(recover).words and "Resume" not in draw(recover).words


@pytest.fixture(scope="module")
def finished(grey_capture, tmp_path_factory):
    """A whole result, made as quickly as can be."""
    from addon.bridge.job.run import run
    from addon.core.progress import Progress
    from addon.core.settings import Settings

    out = tmp_path_factory.mktemp("finished") / "result"
    quick = Settings(
        shading_rays=16,
        specular_rays=4,
        emitter_rays=2,
        portal_rays=0,
        refine=0,
        texel_size=0.12,
        atlas_size=512,
        mirrors=False,
        threads=1,
    )
    run(grey_capture, out, quick, Progress())
    return out


@pytest.mark.slow
def test_a_dropped_result_comes_in_as_a_scene_of_its_own(choices, finished):
    before = set(bpy.data.scenes)
    assert drop(finished / "materials.json") == {"FINISHED"}
    [scene] = set(bpy.data.scenes) - before
    assert sum("object_id" in thing for thing in scene.objects) == 15
    assert scene.scan_relight.result_folder == str(finished), "its panel is about this result"
