"""The operators on pip's bpy, registered from the checkout as the package that Blender would install."""

from __future__ import annotations

import importlib
import importlib.util
import json
import re
import shutil
from dataclasses import replace

import pytest

bpy = pytest.importorskip("bpy")

NAMES = ("import_capture", "accumulate", "shade", "fit", "write", "recover")
QUICK = {"shading_rays": 16, "specular_rays": 4, "emitter_rays": 2, "refine": 0, "texel_size": 0.12, "atlas_size": 512}


def one_sentence(told) -> bool:
    """Whether an operator's error is one line without a traceback."""
    return len(str(told.value).strip().splitlines()) == 1 and "Traceback" not in str(told.value)


def things():
    return {thing["object_id"]: thing for thing in bpy.context.scene.objects if "object_id" in thing}


@pytest.mark.parametrize("name", NAMES)
def test_registered_with_its_text(ops, name):
    kind = getattr(ops, name).get_rna_type()
    assert kind.name and kind.description and "capture_folder" in kind.properties


@pytest.mark.parametrize("name", NAMES[1:])
def test_every_setting_is_a_property(ops, name):
    from addon.settings_info import setting_infos

    properties = getattr(ops, name).get_rna_type().properties
    for info in setting_infos():
        assert (
            properties[info.name].default == pytest.approx(info.default)
            if info.kind is float
            else properties[info.name].default == info.default
        )


def test_import_brings_objects_cameras_and_frames(ops, grey_capture):
    assert ops.import_capture(capture_folder=str(grey_capture)) == {"FINISHED"}
    cameras = [thing for thing in bpy.context.scene.objects if "frame_path" in thing]
    assert len(things()) == 15 and len(cameras) == 3
    assert {thing.name.rpartition(" ")[0] for thing in things().values()} >= {"floor", "sofa", "ball"}
    assert all(camera.data.background_images[0].image for camera in cameras)


@pytest.mark.parametrize("name", NAMES)
def test_an_empty_folder_is_told(ops, name):
    with pytest.raises(RuntimeError, match="Choose the capture folder first"):
        getattr(ops, name)()


def test_a_result_folder_is_needed(ops, grey_capture):
    with pytest.raises(RuntimeError, match="Choose the result folder first"):
        ops.accumulate(capture_folder=str(grey_capture))


@pytest.mark.parametrize("name", NAMES)
def test_a_missing_capture_is_told(ops, name, tmp_path):
    folders = {"capture_folder": str(tmp_path / "nowhere")}
    if name != "import_capture":
        folders["result_folder"] = str(tmp_path / "result")
    with pytest.raises(RuntimeError, match="nowhere"):
        getattr(ops, name)(**folders)
    assert len(bpy.context.scene.objects) == 0


def test_a_bad_setting_is_told(ops, grey_capture, tmp_path):
    with pytest.raises(RuntimeError, match="atlas_size"):
        ops.accumulate(capture_folder=str(grey_capture), result_folder=str(tmp_path), atlas_size=1)


def test_editing_is_told(ops, grey_capture):
    mesh = bpy.data.meshes.new("edited")
    thing = bpy.data.objects.new("edited", mesh)
    bpy.context.scene.collection.objects.link(thing)
    bpy.context.view_layer.objects.active = thing
    bpy.ops.object.mode_set(mode="EDIT")
    with pytest.raises(RuntimeError, match="object mode"):
        ops.import_capture(capture_folder=str(grey_capture))
    bpy.ops.object.mode_set(mode="OBJECT")


def test_writing_needs_the_import(ops, grey_capture, tmp_path):
    with pytest.raises(RuntimeError, match="import it first"):
        ops.write(capture_folder=str(grey_capture), result_folder=str(tmp_path))


@pytest.mark.parametrize("name", [name for name in NAMES[1:] if name != "write"])  # that asks for the import first
def test_a_capture_that_cant_be_used_is_told(ops, name, grey_capture, tmp_path):
    """One sentence; the scene stays as it was, and no result is begun."""
    broken = shutil.copytree(grey_capture, tmp_path / "capture")
    (broken / "mesh.ply").write_bytes(b"")
    with pytest.raises(RuntimeError, match="mesh.ply' is empty") as told:
        getattr(ops, name)(capture_folder=str(broken), result_folder=str(tmp_path / "result"))
    assert one_sentence(told)
    assert len(bpy.context.scene.objects) == 0 and not (tmp_path / "result").exists()


def test_a_file_in_the_way_is_told(ops, grey_capture, tmp_path):
    (tmp_path / "file").write_text("mine")
    with pytest.raises(RuntimeError, match="a file is in its way") as told:
        ops.accumulate(capture_folder=str(grey_capture), result_folder=str(tmp_path / "file"))
    assert one_sentence(told)


def test_the_capture_as_result_is_told(ops, grey_capture):
    with pytest.raises(RuntimeError, match="is the capture itself"):
        ops.recover(capture_folder=str(grey_capture), result_folder=str(grey_capture))
    assert len(bpy.context.scene.objects) == 0


def bring_nothing(package, monkeypatch):
    """There is no result, and so none is brought into the file."""
    for place, function in (("bridge.scene.parts", "imported"), ("core.results.room_file", "read_room")):
        monkeypatch.setattr(importlib.import_module(f"scan_relight.addon.{place}"), function, lambda folder: None)
    props = importlib.import_module("scan_relight.operators.recover.settings_props")
    monkeypatch.setattr(props, "whole", lambda slices: ())


def fails_with(package, monkeypatch, error):
    """Let the whole of the work fail."""

    def fail(*arguments, **keywords):
        raise error

    monkeypatch.setattr(importlib.import_module("scan_relight.addon.bridge.job.run"), "run", fail)


def test_an_unforeseen_error_is_told_and_logged(ops, package, grey_capture, tmp_path, monkeypatch):
    fails_with(package, monkeypatch, ValueError("deep\ninside"))
    with pytest.raises(RuntimeError, match="Unexpected error .ValueError: deep inside.") as told:
        ops.recover(capture_folder=str(grey_capture), result_folder=str(tmp_path))
    assert one_sentence(told)
    assert "Traceback" in (tmp_path / "error.log").read_text()


def test_used_up_memory_is_told(ops, package, grey_capture, tmp_path, monkeypatch):
    fails_with(package, monkeypatch, MemoryError())
    with pytest.raises(RuntimeError, match="memory is used up") as told:
        ops.shade(capture_folder=str(grey_capture), result_folder=str(tmp_path))
    assert one_sentence(told)


@pytest.mark.parametrize("name", NAMES)
def test_missing_packages_are_told(ops, name, package, monkeypatch):
    monkeypatch.setattr(
        importlib.import_module("scan_relight.operators.recover.settings_props"),
        "missing_packages",
        lambda: ("scipy", "OpenEXR"),
    )
    with pytest.raises(RuntimeError, match="scipy and OpenEXR missing: install the extension again"):
        getattr(ops, name)()


@pytest.mark.parametrize(
    "name, until",
    [
        ("accumulate", "lit_diffuse"),
        ("shade", "shading"),
        ("fit", "specular"),
        ("write", "write"),
        ("recover", "write"),
    ],
)
@pytest.mark.parametrize("preset", ["normal", "paper"])
def test_what_is_chosen_arrives(ops, name, until, preset, package, tmp_path, monkeypatch):
    """Folders, settings and the last stage, in the words of the one function that does the work."""
    asked = []
    module = importlib.import_module("scan_relight.addon.bridge.job.run")
    settings = importlib.import_module("scan_relight.addon.core.settings")

    def remember(capture, result, chosen, progress, what, **how):
        asked.append((capture, result, chosen, what))
        return {"warnings": ["This was odd."]}

    monkeypatch.setattr(module, "run", remember)
    bring_nothing(package, monkeypatch)
    monkeypatch.chdir(tmp_path)
    done = getattr(ops, name)(capture_folder="a", result_folder="b", preset=preset, seed=5, median="mean")
    assert done == {"FINISHED"}
    [(capture, result, chosen, what)] = asked
    assert (capture, result, what.until) == ("a", "b", until)
    assert chosen == replace(settings.PRESETS[preset], seed=5, median="mean")
    assert what.from_stage is None and what.reading.format == ""


@pytest.mark.slow
def test_each_operator_brings_its_forerunners_and_no_more(ops, grey_capture, tmp_path):
    folders = {"capture_folder": str(grey_capture), "result_folder": str(tmp_path)}
    stages = ["surface", "lit_diffuse", "shading", "specular"]
    before = 0
    for name, count in (("accumulate", 2), ("shade", 3), ("fit", 4)):
        assert getattr(ops, name)(**folders, **QUICK) == {"FINISHED"}
        assert sorted(path.stem for path in (tmp_path / "stages").glob("*.npz")) == sorted(stages[:count])
        report = json.loads((tmp_path / "report.json").read_text())
        assert list(report["stages"]) == stages[:count]
        assert [report["stages"][stage]["stored"] for stage in stages[:count]] == [k < before for k in range(count)]
        before = count
    assert not (tmp_path / "scene.blend").exists() and len(bpy.context.scene.objects) == 0


@pytest.mark.slow
def test_an_object_that_was_edited_is_left_alone(ops, grey_capture, tmp_path):
    folders = {"capture_folder": str(grey_capture), "result_folder": str(tmp_path)}
    ops.import_capture(capture_folder=str(grey_capture))
    ball = next(thing for thing in things().values() if thing.name.startswith("ball "))
    ball.data.clear_geometry()
    bpy.data.objects.remove(next(thing for thing in things().values() if thing.name.startswith("sofa ")))
    assert ops.write(**folders, **QUICK) == {"FINISHED"}
    assert not ball.data.polygons and not any(thing.name.startswith("sofa ") for thing in things().values())
    warnings = "\n".join(json.loads((tmp_path / "report.json").read_text())["warnings"])
    assert re.search(r"'ball \d+': the mesh was edited and is left", warnings)
    assert re.search(r"'sofa \d+': was deleted and stays so", warnings)


@pytest.mark.slow
def test_step_by_step(ops, tiny_capture, tmp_path):
    folders = {"capture_folder": str(tiny_capture), "result_folder": str(tmp_path)}
    bpy.context.scene.collection.objects.link(bpy.data.objects.new("the user's own", None))
    ops.import_capture(capture_folder=str(tiny_capture))
    ops.accumulate(**folders, **QUICK)
    ops.shade(**folders, **QUICK)
    ops.fit(**folders, **QUICK)
    assert not any(thing.data.materials for thing in things().values())
    ops.write(**folders, **QUICK)
    assert all(thing.data.materials[0]["scan_relight_model"] for thing in things().values())
    assert "the user's own" in bpy.data.objects
    assert len(things()) == 15
    lamp = next(thing for thing in things().values() if thing.name.startswith("ceiling lamp "))
    assert lamp.data.materials[0]["scan_relight_model"] == "emitter"
    assert lamp.users_collection[0].name.startswith("Lamps")


@pytest.mark.slow
def test_recover_does_it_all(ops, tiny_capture, tmp_path):
    bpy.context.scene.collection.objects.link(bpy.data.objects.new("the user's own", None))
    ops.recover(capture_folder=str(tiny_capture), result_folder=str(tmp_path), **QUICK)
    assert all(thing.data.materials[0]["scan_relight_model"] for thing in things().values())
    assert "the user's own" in bpy.data.objects
    for name in ("scene.blend", "albedo.exr", "base_color.exr", "shading.exr", "materials.json", "report.json"):
        assert (tmp_path / name).stat().st_size > 0, name
