"""A room from the panel's run to a file that is saved, moved and opened again: nothing of it is ever lost."""

import importlib
import json
import shutil

import pytest

bpy = pytest.importorskip("bpy")

QUICK = {"shading_rays": 16, "specular_rays": 4, "emitter_rays": 2, "refine": 0, "texel_size": 0.1, "atlas_size": 256}


def shown():
    """Names of the result's images that can be shown, and of those that can't."""
    images = [one for one in bpy.data.images if "scan_relight_image" in one]
    return {one["scan_relight_image"].replace("\\", "/").split("/")[-1]: bool(one.size[0]) for one in images}


@pytest.mark.slow
def test_from_run_to_reopened(ops, tiny_capture, tmp_path, monkeypatch):
    monkeypatch.setenv("HOME", str(tmp_path / "me"))
    monkeypatch.delenv("XDG_CONFIG_HOME", raising=False)
    (tmp_path / "me" / "Documents").mkdir(parents=True)
    choices = bpy.context.scene.scan_relight
    choices.capture_folder = str(tiny_capture)
    for name, value in QUICK.items():
        setattr(choices.settings, name, value)
    assert ops.run() == {"FINISHED"}
    result = tmp_path / "me" / "Documents" / "Scan Relight" / tiny_capture.name
    assert json.loads((result / "capture.json").read_text())["folder"] == str(tiny_capture)
    run = json.loads((result / "materials.json").read_text())["run"]
    wearing = [thing for thing in bpy.data.objects if thing.get("scan_relight_run") == run and thing.type == "MESH"]
    assert wearing and {thing["scan_relight_result"] for thing in wearing} == {str(result)}
    rows_of_parts = importlib.import_module("scan_relight.addon.bridge.results.file").rows_of_parts

    def fits(thing):
        return thing["object_id"] in rows_of_parts([thing]).get(thing, {})

    assert all(map(fits, wearing))

    file = tmp_path / "project" / "file.blend"
    file.parent.mkdir()
    bpy.ops.wm.save_as_mainfile(filepath=str(file))
    scene = next(one for one in bpy.data.scenes if one.scan_relight.capture_folder)
    result_folder = importlib.import_module("scan_relight.operators.preferences").result_folder
    assert result_folder("", str(tiny_capture), scene) == result  # a further run goes on there
    ops.clear_cache()
    assert not list((result / "stages").iterdir()) and set(shown().values()) == {True}

    shutil.move(result, tmp_path / "project" / "scan relight" / result.name)
    bpy.ops.wm.open_mainfile(filepath=str(file))
    assert "base_color.exr" in shown() and set(shown().values()) == {True}
    wearing = [thing for thing in bpy.data.objects if thing.get("scan_relight_run") == run and thing.type == "MESH"]
    assert all(map(fits, wearing)) and wearing
    bpy.ops.wm.save_mainfile()
    bpy.ops.wm.read_homefile(use_empty=True)
    shutil.move(tmp_path / "project", tmp_path / "moved")
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "moved" / "file.blend"))
    assert set(shown().values()) == {True}
    assert {thing["scan_relight_result"] for thing in bpy.data.objects if "scan_relight_run" in thing} == {
        str(tmp_path / "moved" / "scan relight" / result.name)
    }
