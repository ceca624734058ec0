"""A result that was moved or overwritten: found again by itself, else told and pointed to; never another run's."""

import importlib
import json
import shutil
from types import SimpleNamespace

import numpy as np
import pytest

from addon.core.io.exr import write_exr

bpy = pytest.importorskip("bpy")

from tests.blender.artist.artist_room import box, bridge, mesh_object  # noqa: E402

RUN, OTHER = "0123456789abcdef", "fedcba9876543210"
FILES = {"base_color.exr": 0.25, "environment.exr": 0.5}


def result(folder, run=RUN, shift=0.0):
    """A result folder: two images and one object; another run's takes the place of one that is there."""
    folder.mkdir(parents=True, exist_ok=True)
    told = {"run": run, "layout": run[::-1], "objects": [{"object_id": 0, "model": "metal"}]}
    (folder / "materials.json").write_text(json.dumps(told))
    for name, value in FILES.items():
        write_exr(folder / name, np.full((2, 2, 3), value + shift, np.float32))
    return folder


@pytest.fixture
def home(ops, tmp_path, monkeypatch):
    """The results folder of the preferences."""
    preferences = importlib.import_module("scan_relight.operators.preferences")
    chosen = SimpleNamespace(results_folder=str(tmp_path / "home"), threads=0, memory_limit=0)
    monkeypatch.setattr(preferences, "preferences", lambda: chosen)
    return tmp_path / "home"


@pytest.fixture
def blend(ops, home, tmp_path):
    """A saved file with a wall and a room's collection of `tmp_path / "hall"`, and its two images."""
    folder, file = result(tmp_path / "hall"), tmp_path / "project" / "file.blend"
    file.parent.mkdir()
    bpy.ops.wm.save_as_mainfile(filepath=str(file))
    wall, top = mesh_object("wall", *box((0, 0, 0), (1, 1, 1))), bpy.data.collections.new("Scan Relight")
    bpy.context.scene.collection.children.link(top)
    wall["object_id"] = 0
    for owner in (wall, top):
        bridge("custom_properties").set_run(owner, folder, RUN)
    images = [bridge("data.images").load_image(folder / name) for name in FILES]
    bridge("results.images").settle(images, "RESULT")
    bpy.ops.wm.save_mainfile()
    return file


def opened(file):
    """The panel's words after opening a file."""
    bpy.ops.wm.open_mainfile(filepath=str(file))
    return said()


def said():
    from tests.blender.panel.conftest import Layout

    bridge("results.find").forget()
    module = importlib.import_module("scan_relight.operators.results.find")
    panel = module.SCAN_RELIGHT_PT_missing
    if not panel.poll(bpy.context):
        return ""
    layout = Layout()
    context = SimpleNamespace(scene=bpy.context.scene, preferences=bpy.context.preferences, region=None)
    panel.draw(SimpleNamespace(layout=layout, say=panel.say), context)
    assert ("scan_relight.find_result" in layout.buttons) == bool(bridge("results.find").missing())
    assert ("scan_relight.open_result" in layout.buttons) == bool(bridge("results.find").outdated())
    return layout.text


def shown():
    """First pixels of the images that can be shown, by file name."""
    return {
        one["scan_relight_image"].split("/")[-1]: one.pixels[0]
        for one in bpy.data.images
        if "scan_relight_image" in one and one.has_data or one.size[0]
    }


def marks():
    return {owner["scan_relight_result"] for owner in (bpy.data.objects["wall"], bpy.data.collections["Scan Relight"])}


def test_nothing_is_said_where_nothing_is_missing(blend):
    assert opened(blend) == "" and shown() == FILES
    with pytest.raises(RuntimeError, match="Nothing of a result is missing"):
        bpy.ops.scan_relight.find_result(directory=str(blend.parent))


@pytest.mark.parametrize("place", ["home/hall", "project/scan relight/hall", "project/hall", "project"])
def test_found_near_the_file_by_itself_and_said(blend, tmp_path, place):
    if place == "project":
        for path in (tmp_path / "hall").iterdir():
            shutil.move(path, tmp_path / "project")
        (tmp_path / "hall").rmdir()
    else:
        (tmp_path / place).parent.mkdir(exist_ok=True)
        shutil.move(tmp_path / "hall", tmp_path / place)
    words = opened(blend)
    assert "'hall' was moved and is found again" in words and "save the file" in words
    assert shown() == FILES and marks() == {str(tmp_path / place)}
    bpy.ops.wm.save_mainfile()
    assert said() == "" and opened(blend) == "" and shown() == FILES


def test_a_project_that_is_moved_as_a_whole(ops, blend, tmp_path):
    shutil.move(tmp_path / "hall", tmp_path / "project" / "scan relight" / "hall")
    opened(blend)
    bpy.ops.wm.save_mainfile()
    ops_free = tmp_path / "elsewhere"
    bpy.ops.wm.read_homefile(use_empty=True)
    shutil.move(tmp_path / "project", ops_free)
    assert "found again" in opened(ops_free / "file.blend")
    assert shown() == FILES and marks() == {str(ops_free / "scan relight" / "hall")}


@pytest.mark.parametrize("chosen", ["far/away", "far", "far/away/stages"])
def test_gone_and_found_by_the_artist(blend, tmp_path, chosen):
    shutil.move(tmp_path / "hall", tmp_path / "far" / "away")
    (tmp_path / "far" / "away" / "stages").mkdir()
    words = opened(blend)
    assert "The result folder '" in words and "hall' is gone: its pictures can't be shown." in words
    assert bpy.ops.scan_relight.find_result(directory=str(tmp_path / chosen)) == {"FINISHED"}
    assert shown() == FILES and marks() == {str(tmp_path / "far" / "away")} and said() == ""
    assert all(one.filepath.startswith("//") for one in bpy.data.images if "scan_relight_image" in one)


def test_another_run_is_refused(blend, tmp_path):
    shutil.rmtree(tmp_path / "hall")
    result(tmp_path / "home" / "hall", OTHER, shift=0.25)  # not even by itself
    assert "is gone" in opened(blend)
    with pytest.raises(RuntimeError, match="holds another run than 'hall' did"):
        bpy.ops.scan_relight.find_result(directory=str(tmp_path / "home"))
    with pytest.raises(RuntimeError, match="is no result folder"):
        bpy.ops.scan_relight.find_result(directory=str(blend.parent))
    assert marks() == {str(tmp_path / "hall")} and shown() == {}


def test_only_some_images_are_missing(blend, tmp_path):
    (tmp_path / "hall" / "environment.exr").unlink()
    kept = tmp_path / "hall" / "kept" / RUN[::-1] / "environment.exr"
    kept.rename(tmp_path / "put away.exr")
    words = opened(blend)
    assert "'environment.exr' is missing in '" in words and "is gone" not in words
    assert shown() == {"base_color.exr": 0.25}
    (tmp_path / "put away.exr").rename(kept)
    assert said() == ""
    bridge("results.find").reload(tmp_path / "hall")
    assert shown() == FILES


def test_packed_images_stay_and_the_values_are_told(blend, tmp_path):
    bridge("results.images").settle(list(bpy.data.images), "PACK")
    bpy.ops.wm.save_mainfile()
    shutil.move(tmp_path / "hall", tmp_path / "far")
    assert "what was found of each object can't be listed" in opened(blend)
    assert shown() == FILES
    bpy.ops.scan_relight.find_result(directory=str(tmp_path / "far"))
    assert shown() == FILES and all(one.packed_file for one in bpy.data.images if "scan_relight_image" in one)
    assert marks() == {str(tmp_path / "far")}


def test_copies_beside_the_file_that_are_gone_show_the_result_s_again(blend, tmp_path):
    bridge("results.images").settle(list(bpy.data.images), "FOLDER")
    bpy.ops.wm.save_mainfile()
    assert opened(blend) == "" and shown() == FILES
    shutil.rmtree(blend.parent / "file images")
    assert "2 pictures are shown from" in opened(blend) and shown() == FILES


def without_the_extension(file):
    """Open a file as a Blender without the extension does."""
    handlers = list(bpy.app.handlers.load_post)
    bpy.app.handlers.load_post.clear()
    try:
        bpy.ops.wm.open_mainfile(filepath=str(file))
    finally:
        bpy.app.handlers.load_post.extend(handlers)


def test_an_older_copy_keeps_its_own_pictures(blend, tmp_path):
    older = shutil.copy(blend, blend.with_name("older.blend"))
    kept = tmp_path / "hall" / "kept" / RUN[::-1] / "base_color.exr"
    assert kept.samefile(tmp_path / "hall" / "base_color.exr")  # a further name: no space is taken
    result(tmp_path / "hall", OTHER, shift=0.25)
    without_the_extension(older)
    assert shown() == FILES
    assert opened(older) == "" and shown() == FILES
    bpy.ops.wm.save_mainfile()
    without_the_extension(older)
    assert shown() == FILES and kept.is_file()


def test_an_older_copy_finds_its_own_pictures_where_they_were_moved(blend, tmp_path):
    result(tmp_path / "hall", OTHER, shift=0.25)
    shutil.move(tmp_path / "hall", tmp_path / "home" / "hall")
    assert "found again" in opened(blend) and shown() == FILES
    shutil.rmtree(tmp_path / "home" / "hall" / "kept")
    assert "found again" not in opened(blend) and shown() == {}  # never the other layout's


@pytest.mark.parametrize("kept", [True, False])
def test_a_file_whose_pictures_were_overwritten_says_so(blend, tmp_path, kept):
    """As Blender leaves it that saves by itself, or without the extension."""
    for one in bpy.data.images:
        if "scan_relight_image" in one:
            one.filepath = one["scan_relight_image"]
    handlers = list(bpy.app.handlers.save_pre)
    bpy.app.handlers.save_pre.clear()
    bpy.ops.wm.save_mainfile()
    bpy.app.handlers.save_pre.extend(handlers)
    if not kept:
        shutil.rmtree(tmp_path / "hall" / "kept")
    result(tmp_path / "hall", OTHER, shift=0.25)
    words = opened(blend)
    if kept:
        assert words == "" and shown() == FILES
    else:
        assert "'hall' was recovered anew with other textures" in words and "Bring In" in words


def test_scene_blend_in_its_own_result_refers_to_what_is_beside_it(blend, tmp_path):
    shutil.rmtree(tmp_path / "hall" / "kept")
    for one in bpy.data.images:
        if "scan_relight_image" in one:
            one.filepath = one["scan_relight_image"]
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "hall" / "scene.blend"))
    assert not (tmp_path / "hall" / "kept").exists()
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "mine.blend"))  # the artist goes on in a file of her own
    result(tmp_path / "hall", OTHER, shift=0.25)
    assert opened(tmp_path / "mine.blend") == "" and shown() == FILES


def test_copies_beside_the_file_are_not_overwritten_by_another_layout(blend, tmp_path):
    bridge("results.images").settle(list(bpy.data.images), "FOLDER")
    bpy.ops.wm.save_mainfile()
    older = shutil.copy(blend, blend.with_name("older.blend"))
    result(tmp_path / "hall", OTHER, shift=0.25)
    bridge("results.images").settle(
        [bridge("data.images").load_image(tmp_path / "hall" / name) for name in FILES], "FOLDER"
    )
    assert shown() == {name: value + 0.25 for name, value in FILES.items()}
    without_the_extension(older)
    assert shown() == FILES
