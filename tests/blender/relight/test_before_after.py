"""Before and after: where the picture goes, which scene is rendered, on what, and what is told meanwhile."""

import json
import sys
from pathlib import Path

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from addon import cli  # noqa: E402
from addon.bridge import render_device  # noqa: E402
from addon.bridge.custom_properties import RESULT  # noqa: E402
from addon.bridge.relight import before_after  # noqa: E402
from addon.core.errors import BadInputError  # noqa: E402
from addon.core.io.exr import read_exr  # noqa: E402
from tests.blender.relight.sheets import sheet  # noqa: E402


def test_the_picture_goes_to_the_rooms_result(scene, tmp_path):
    thing = sheet(scene, "floor", 1, (0, 0, 0))
    result, chosen = tmp_path / "result", tmp_path / "chosen"
    chosen.mkdir()
    assert before_after.picture_folder(scene) == (Path(bpy.app.tempdir), False)
    assert before_after.picture_folder(scene, str(chosen)) == (chosen, True)
    thing[RESULT] = str(result)
    assert before_after.picture_folder(scene, str(chosen)) == (chosen, True)  # the mark's folder is gone
    result.mkdir()
    assert before_after.picture_folder(scene, str(chosen)) == (result, True)


def test_a_result_that_was_moved_keeps_its_pictures(scene, tmp_path):
    thing = sheet(scene, "floor", 1, (0, 0, 0))
    old, new = tmp_path / "old", tmp_path / "new"
    for folder in (old, new):
        folder.mkdir()
    thing[RESULT] = str(old)
    (new / "materials.json").write_text("{}")
    bpy.ops.wm.save_as_mainfile(filepath=str(new / "scene.blend"))
    assert before_after.picture_folder(bpy.context.scene) == (new, True)
    (new / "materials.json").unlink()
    assert before_after.picture_folder(bpy.context.scene) == (old, True)


def test_a_never_saved_file_gets_its_picture(package, scene, look_down):
    sheet(scene, "floor", 1, (0, 0, 0))
    sheet(scene, "lamp 1", 1, (0, 0, 2), (np.pi, 0, 0), emission=(1, 1, 1), object_id=1)
    look_down()
    scene.render.engine, scene.render.resolution_x, scene.render.resolution_y = "CYCLES", 16, 12
    assert scene.scan_relight.result_folder == "" and not bpy.data.filepath
    assert bpy.ops.scan_relight.before_after(samples=2) == {"FINISHED"}
    assert (Path(bpy.app.tempdir) / "before_after.png").stat().st_size


def test_the_wanted_scene_of_several_is_rendered(scene, look_down, tmp_path):
    """The artist's own scene is the file's active one, the room's stands beside it."""
    room = bpy.data.scenes.new("Scan Relight: room")
    sheet(room, "lamp 1", 4, (0, 0, 0), emission=(3, 2, 1))
    look_down()
    scene.collection.objects.unlink(scene.camera)
    room.collection.objects.link(scene.camera)
    room.camera, scene.camera = scene.camera, None
    for one in (room, scene):
        one.render.engine, one.render.resolution_x, one.render.resolution_y = "CYCLES", 8, 8
    before_after.save_copy(tmp_path)
    words = ["relight", str(tmp_path), "--out", str(tmp_path / "a.exr"), "--samples", "2", "--quiet"]
    assert cli.main(words) == 2  # the artist's own has no camera
    assert cli.main([*words, "--scene", "another"]) == 2 and not (tmp_path / "a.exr").exists()
    assert cli.main([*words, "--scene", "Scan Relight: room"]) == 0
    assert np.allclose(read_exr(tmp_path / "a.exr").rgb.mean((0, 1)), (3, 2, 1), atol=0.05)


def test_a_device_that_is_not_there_is_the_processor_and_told(scene):
    kinds = [one for one in render_device.TYPES if not cards(one)]
    if not kinds:
        pytest.skip("this machine has graphics cards of all kinds")
    scene.cycles.device = "GPU"
    assert "the processor renders" in render_device.use_device(scene, f"{kinds[0]}=some|card")
    assert scene.cycles.device == "CPU" and render_device.current_device(scene) == render_device.CPU
    assert render_device.use_device(scene, "cpu") == ""
    with pytest.raises(BadInputError, match="no device 'abacus'"):
        render_device.use_device(scene, "abacus")


def cards(kind):
    """The devices that Cycles itself finds."""
    preferences = bpy.context.preferences.addons["cycles"].preferences
    try:
        return [one for one in preferences.get_devices_for_type(kind) if one.type == kind]
    except (TypeError, ValueError):
        return []


@pytest.mark.slow
def test_progress_is_told_during_each_picture(result, tmp_path, capfd):
    """Not only at its ends, and never backwards."""
    capfd.readouterr()
    words = "--before-after --samples 128 --size 100 --lamps off --spot --device cpu --progress json".split()
    assert cli.main(["relight", str(result), "--out", str(tmp_path / "a.png"), *words]) == 0
    sys.stdout.flush()
    told = [json.loads(line) for line in capfd.readouterr().out.splitlines() if line.startswith('{"event": "progress"')]
    for stage in ("before", "after"):
        shares = [one["share"] for one in told if one["stage"] == stage]
        assert shares == sorted(shares) and shares[0] == 0 and shares[-1] == 1
        assert any(0.05 < share < 0.95 for share in shares), shares
