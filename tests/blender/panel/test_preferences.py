"""The preferences: what they draw, where the cache is, and clearing it."""

from __future__ import annotations

import time
from types import SimpleNamespace

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")


@pytest.fixture
def preferences(module, ops, tmp_path, monkeypatch):
    """The module, with a cache in `tmp_path` and preferences that were set."""
    found = module("operators.preferences")
    chosen = SimpleNamespace(cache_folder=str(tmp_path / "cache"), threads=2, memory_limit=1.5)
    monkeypatch.setattr(found, "preferences", lambda: chosen)
    found.forget_size()
    return found


def result(module, folder):
    store = module("addon.core.store").Store(folder)
    with store:
        store.save("surface", "key", {"values": np.zeros(250_000)})
    return folder


def test_they_are_drawn(preferences, module):
    from tests.blender.panel.conftest import Layout

    shown = Layout()
    cls = preferences.ScanRelightPreferences
    drawn = SimpleNamespace(layout=shown, bl_rna=bpy.types.ScanRelightPreferences.bl_rna
                            if hasattr(bpy.types, "ScanRelightPreferences") else cls.bl_rna)
    shown.prop = lambda owner, name, **_: shown.words.append(owner.bl_rna.properties[name].description)
    cls.draw(drawn, bpy.context)
    assert "scan_relight.clear_cache" in shown.buttons and all(shown.words)


def test_the_size_is_added_up_beside(preferences, module, tmp_path):
    result(module, tmp_path / "cache" / "room")
    end = time.monotonic() + 30
    while preferences.cache_text() == "Adding up" and time.monotonic() < end:
        time.sleep(0.02)
    assert preferences.cache_text() == f"1 result, 2.0 MB, in {tmp_path / 'cache'}"


def test_clearing_is_for_what_runs_left(preferences, module, tmp_path):
    room = result(module, tmp_path / "cache" / "room")
    (tmp_path / "cache" / "mine").mkdir()
    (tmp_path / "cache" / "mine" / "photo.png").write_text("mine")
    assert bpy.ops.scan_relight.clear_cache() == {"FINISHED"}
    assert room.is_dir() and not list((room / "stages").iterdir())
    assert bpy.ops.scan_relight.clear_cache(what="ALL") == {"FINISHED"}
    assert not room.exists() and (tmp_path / "cache" / "mine" / "photo.png").exists()


def test_threads_and_memory_reach_a_run(preferences, module, ops, monkeypatch, tmp_path):
    asked, limits = [], []
    monkeypatch.setattr(module("addon.bridge.run"), "run", lambda capture, result, settings, *rest, **where:
                        asked.append(settings) or {"warnings": []})
    props = module("operators.settings_props")
    guard = props.MemoryGuard
    monkeypatch.setattr(props, "MemoryGuard", lambda limit: limits.append(limit) or guard(0))
    ops.accumulate(capture_folder="a", result_folder=str(tmp_path))
    ops.accumulate(capture_folder="a", result_folder=str(tmp_path), threads=5)
    assert [settings.threads for settings in asked] == [2, 5] and limits == [1.5, 1.5]


def test_results_of_two_captures_of_one_name_are_apart(preferences, tmp_path):
    one, other = (preferences.result_folder("", str(tmp_path / where / "room")) for where in ("a", "b"))
    assert one != other and one.parent == other.parent == tmp_path / "cache" and one.name.startswith("room-")
    assert preferences.result_folder("/mine", str(tmp_path)).as_posix().endswith("/mine")
