"""Corrections from the command line: a run with them, and objects fitted again, down to the saved scene."""

from __future__ import annotations

import json
import shutil

import pytest

bpy = pytest.importorskip("bpy")

from addon.cli import main  # noqa: E402

FAST = ["--shading-rays", "32", "--specular-rays", "8", "--emitter-rays", "4", "--refine", "0", "--texel-size", "0.08",
        "--atlas-size", "1024"]  # fmt: skip


@pytest.fixture(scope="module")
def finished(tiny_capture, tmp_path_factory):
    """A result whose capture is gone."""
    folder = tmp_path_factory.mktemp("finished")
    capture = shutil.copytree(tiny_capture, folder / "capture")
    assert main(["recover", str(capture), "--out", str(folder / "result"), *FAST, "--quiet"]) == 0
    shutil.rmtree(capture)
    return folder / "result"


@pytest.fixture
def result(finished, tmp_path):
    return shutil.copytree(finished, tmp_path / "result")


def given(folder, objects):
    file = folder / "given.json"
    file.write_text(json.dumps({"objects": objects}))
    return str(file)


def shader(folder, object_id):
    """Values of the Principled node of an object in the saved scene."""
    bpy.ops.wm.open_mainfile(filepath=str(folder / "scene.blend"))
    thing = next(one for one in bpy.data.objects if one.get("object_id") == object_id)
    node = next(n for n in thing.material_slots[0].material.node_tree.nodes if n.type == "BSDF_PRINCIPLED")
    return {name: node.inputs[name].default_value for name in ("Metallic", "Roughness", "IOR", "Specular IOR Level")}


@pytest.mark.slow
def test_a_correction_reaches_the_scene_without_the_capture(result, tmp_path, capsys):
    assert shader(result, 0)["Metallic"] == 0
    file = given(tmp_path, {"0": {"model": "metal", "roughness": 0.25}})
    assert main(["refit", str(result), "--override", file]) == 0
    assert "Fitted again" in capsys.readouterr().out
    found = shader(result, 0)
    assert found["Metallic"] == 1 and found["Roughness"] == pytest.approx(0.25)
    report = json.loads((result / "report.json").read_text())
    assert report["refit"]["objects"] == [0] and report["figures"]["models"]["metal"] >= 1
    assert json.loads((result / "overrides.json").read_text())["objects"]["0"]["model"] == "metal"


def test_without_the_scene_its_age_is_told(result, tmp_path, capsys):
    before = (result / "scene.blend").stat().st_mtime_ns
    file = given(tmp_path, {"0": {"model": "specular", "roughness": 0.5, "f0": 0.04}})
    argv = ["refit", str(result), "--object", "0", "--override", file, "--progress", "json"]
    assert main([*argv, "--no-scene"]) == 0
    events = [json.loads(line) for line in capsys.readouterr().out.splitlines()]
    assert events[-1]["event"] == "done" and events[-1]["objects"] == [0]
    assert any("scene.blend" in one.get("text", "") for one in events)
    assert (result / "scene.blend").stat().st_mtime_ns == before
    assert main([*argv, "--scene"]) == 0
    assert not any("scene.blend" in one for one in json.loads((result / "report.json").read_text())["warnings"])
    assert shader(result, 0)["IOR"] == pytest.approx(1.5)


def test_what_is_wrong_is_one_sentence(result, tmp_path, capsys):
    before = (result / "materials.json").read_bytes()
    assert main(["refit", str(result), "--override", given(tmp_path, {"0": {"roughness": 3}})]) == 2
    assert "object 0: 'roughness' is 3; give a number from 0 to 1." in capsys.readouterr().err
    shutil.rmtree(result / "stages")
    assert main(["refit", str(result), "--object", "0"]) == 2
    assert "run recover again" in capsys.readouterr().err
    assert (result / "materials.json").read_bytes() == before and (result / "scene.blend").exists()


@pytest.mark.slow
@pytest.mark.once
def test_later_runs_heed_what_is_kept(tiny_capture, tmp_path, capsys):
    result = tmp_path / "result"
    file = given(tmp_path, {"0": {"model": "metal", "roughness": 0.25}})
    argv = ["recover", str(tiny_capture), "--out", str(result), *FAST]

    def model():
        told = json.loads((result / "materials.json").read_text())["objects"]
        return next(one["model"] for one in told if one["object_id"] == 0)

    assert main([*argv, "--override", file]) == 0 and model() == "metal"
    assert main(argv) == 0 and model() == "metal"
    capsys.readouterr()
    assert main([*argv, "--no-overrides"]) == 0 and model() != "metal"
    assert "left out" in capsys.readouterr().out
    assert (result / "overrides.json").exists()
    assert main(["recover", str(tiny_capture), "--out", str(result), "--override", str(tmp_path / "none")]) == 2


COARSE = [*FAST[: FAST.index("--texel-size")], "--atlas-size", "128"]
"""The room's atlas is too small for what the frames show: parts of it are finer."""


@pytest.mark.slow
@pytest.mark.once
@pytest.mark.parametrize("kind", ["object", "udim"])
def test_parts_of_an_atlas_are_renewed_without_the_capture(tiny_capture, tmp_path, capsys, kind):
    capture, result = shutil.copytree(tiny_capture, tmp_path / "capture"), tmp_path / "result"
    assert main(["recover", str(capture), "--out", str(result), *COARSE, "--atlas", kind, "--quiet"]) == 0
    shutil.rmtree(capture)

    def parts():
        return {
            path.relative_to(result).as_posix(): path.read_bytes()
            for path in sorted(result.rglob("*base_color.*"))
            if path.name != "base_color.exr"
        }

    before = parts()
    assert len(before) > 1
    file = given(tmp_path, {"0": {"base_color": [0.1, 0.2, 0.3]}})
    assert main(["refit", str(result), "--object", "0", "--override", file]) == 0
    after = parts()
    changed = {name for name in before if before[name] != after[name]}
    objects = json.loads((result / "materials.json").read_text())["objects"]
    told = {one["object_id"]: one.get("image") for one in objects}
    assert after.keys() == before.keys()
    assert changed == {told[0]} if kind == "object" else changed
    bpy.ops.wm.open_mainfile(filepath=str(result / "scene.blend"))
    assert any(
        "ScanRelightParts" in (layer.name for layer in thing.data.uv_layers)
        for thing in bpy.data.objects
        if thing.type == "MESH"
    )
    (result / "stages/detail.npz").unlink()
    written = {path: path.read_bytes() for path in result.rglob("[!.]*.*") if path.is_file()}
    capsys.readouterr()
    assert main(["refit", str(result), "--object", "0"]) == 2
    told = capsys.readouterr().err
    assert "run recover again" in told and len(told.strip().splitlines()) == 1
    assert written == {path: path.read_bytes() for path in result.rglob("[!.]*.*") if path.is_file()}
