"""The preferences: what they draw, where results go, and clearing stages."""

from __future__ import annotations

import time
from types import SimpleNamespace

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")


@pytest.fixture
def preferences(module, ops, tmp_path, monkeypatch):
    """The module, with results in `tmp_path` and preferences that were set."""
    found = module("operators.preferences")
    chosen = SimpleNamespace(results_folder=str(tmp_path / "home"), threads=2, memory_limit=1.5)
    monkeypatch.setattr(found, "preferences", lambda: chosen)
    found.forget_size()
    return found


def result(module, folder):
    store = module("addon.core.results.store").Store(folder)
    with store:
        store.save("surface", "key", {"values": np.zeros(250_000)})
    return folder


def test_they_are_drawn(preferences, module):
    from tests.blender.panel.conftest import Layout

    shown = Layout()
    cls = preferences.ScanRelightPreferences
    drawn = SimpleNamespace(
        layout=shown,
        bl_rna=bpy.types.ScanRelightPreferences.bl_rna if hasattr(bpy.types, "ScanRelightPreferences") else cls.bl_rna,
    )
    shown.prop = lambda owner, name, **_: shown.words.append(owner.bl_rna.properties[name].description)
    cls.draw(drawn, bpy.context)
    assert "scan_relight.clear_cache" in shown.buttons and all(shown.words)


def test_the_size_is_added_up_beside(preferences, module, tmp_path):
    result(module, tmp_path / "home" / "room")
    end = time.monotonic() + 30
    while preferences.size_text() == "Adding up" and time.monotonic() < end:
        time.sleep(0.02)
    assert preferences.size_text() == f"1 result, 2.0 MB, of it 2.0 MB that can be made again, in {tmp_path / 'home'}"


def test_clearing_is_for_what_runs_left(preferences, module, tmp_path):
    room = result(module, tmp_path / "home" / "room")
    (tmp_path / "home" / "mine").mkdir()
    (tmp_path / "home" / "mine" / "photo.png").write_text("mine")
    assert bpy.ops.scan_relight.clear_cache() == {"FINISHED"}
    assert room.is_dir() and not list((room / "stages").iterdir())
    assert (tmp_path / "home" / "mine" / "photo.png").exists()
    with pytest.raises(TypeError):
        bpy.ops.scan_relight.clear_cache(what="ALL")  # as of earlier versions: whole results never go


def test_stages_beside_the_file_are_cleared_too(preferences, module, ops, tmp_path):
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "file.blend"))
    room = result(module, tmp_path / "scan relight" / "room")
    chosen = result(module, tmp_path / "chosen")
    (chosen / "materials.json").write_text("{}")
    bpy.context.scene.scan_relight.result_folder = str(chosen)
    bpy.ops.scan_relight.clear_cache()
    assert not list((room / "stages").iterdir()) and not list((chosen / "stages").iterdir())
    assert (chosen / "materials.json").exists()


def test_threads_and_memory_reach_a_run(preferences, module, ops, monkeypatch, tmp_path):
    asked, limits = [], []
    monkeypatch.setattr(
        module("addon.bridge.job.run"),
        "run",
        lambda capture, result, settings, *rest, **where: asked.append(settings) or {"warnings": []},
    )
    props = module("operators.recover.settings_props")
    guard = props.MemoryGuard
    monkeypatch.setattr(props, "MemoryGuard", lambda limit: limits.append(limit) or guard(0))
    ops.accumulate(capture_folder="a", result_folder=str(tmp_path))
    ops.accumulate(capture_folder="a", result_folder=str(tmp_path), threads=5)
    assert [settings.threads for settings in asked] == [2, 5] and limits == [1.5, 1.5]


def test_results_of_two_captures_of_one_name_are_apart(preferences, module, ops, tmp_path):
    place = module("addon.core.results.result_folders")
    one, other = ((tmp_path / where / "room") for where in ("a", "b"))
    folder = preferences.result_folder("", str(one))
    assert folder == tmp_path / "home" / "room"
    folder.mkdir(parents=True)
    place.write_capture(folder, one)
    assert preferences.result_folder("", str(one)) == folder
    assert preferences.result_folder("", str(other)) == tmp_path / "home" / "room 2"
    assert preferences.result_folder("/mine", str(tmp_path)).as_posix().endswith("/mine")


def test_beside_the_file_once_it_is_saved_and_where_the_room_is(preferences, module, ops, tmp_path):
    scene, capture = bpy.context.scene, tmp_path / "room"
    (tmp_path / "project").mkdir()
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "project" / "file.blend"))
    beside = tmp_path / "project" / "scan relight" / "room"
    assert preferences.result_folder("", str(capture), scene) == beside
    # The room came from a run before the file was saved: that one is gone on with.
    before = tmp_path / "home" / "room"
    before.mkdir(parents=True)
    module("addon.core.results.result_folders").write_capture(before, capture)
    top = bpy.data.collections.new("Scan Relight")
    scene.collection.children.link(top)
    module("addon.bridge.custom_properties").set_run(top, before, "a" * 16, capture)
    assert preferences.result_folder("", str(capture), scene) == before
    assert preferences.result_folder("", str(tmp_path / "other" / "room"), scene) == beside


@pytest.fixture
def extension(package, monkeypatch, tmp_path):
    """Blender's folders as they are where the extension is installed: its own ones lie in `tmp_path / "own"`."""
    own = tmp_path / "own"
    monkeypatch.setattr(
        bpy.utils, "extension_path_user", lambda name, path="", create=False: str(own / ".user" / "scan_relight" / path)
    )
    resource = bpy.utils.user_resource
    monkeypatch.setattr(
        bpy.utils,
        "user_resource",
        lambda kind, path="", create=False: (
            str(own / path) if kind == "EXTENSIONS" else resource(kind, path=path, create=create)
        ),
    )
    return own


def test_no_result_is_kept_where_removing_the_extension_deletes_it(extension, module, ops, root, tmp_path, monkeypatch):
    """Whatever is preferred, chosen or open: nothing leads into the extension's folders."""
    preferences, default_folders = module("operators.preferences"), module("addon.bridge.results.default_folders")
    monkeypatch.setenv("HOME", str(tmp_path / "me"))
    monkeypatch.delenv("XDG_CONFIG_HOME", raising=False)
    (tmp_path / "me" / "Documents").mkdir(parents=True)
    documents = tmp_path / "me" / "Documents" / "Scan Relight"
    user = extension / ".user" / "scan_relight"
    for preferred in ("", str(user / "cache"), str(extension / "repo"), str(root / "results")):
        chosen = SimpleNamespace(results_folder=preferred, threads=0, memory_limit=0)
        monkeypatch.setattr(preferences, "preferences", lambda chosen=chosen: chosen)
        assert preferences.results_folder() == documents
        assert preferences.result_folder("", str(tmp_path / "room")) == documents / "room"
        assert default_folders.capture_folder(preferences.results_folder(), "").is_relative_to(documents)
    (user / "cache" / "room").mkdir(parents=True)
    bpy.ops.wm.save_as_mainfile(filepath=str(user / "cache" / "room" / "scene.blend"))
    assert preferences.result_folder("", str(tmp_path / "room"), bpy.context.scene) == documents / "room"
    before = sorted(extension.rglob("*"))
    for folder in (user / "result", root / "result"):
        with pytest.raises(RuntimeError, match="removing that would delete the result; choose another"):
            ops.recover(capture_folder=str(tmp_path), result_folder=str(folder))
        assert not folder.exists()
    with pytest.raises(RuntimeError, match="removing that would delete the result"):
        bpy.ops.mesh.primitive_cube_add()
        ops.capture_from_scene(result_folder=str(user))
    assert sorted(extension.rglob("*")) == before
