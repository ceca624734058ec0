"""Clearing stages: what counts as ours, what is cleared, what is left alone."""

from __future__ import annotations

import numpy as np
import pytest

from addon.core.results.cache import clear, results, size
from addon.core.results.store import Store


def made(folder, **files):
    """A result folder as a run leaves it."""
    with Store(folder) as store:
        store.save("surface", "key", {"values": np.zeros(1000)})
        store.write_json("report.json", {})
    for name, text in files.items():
        (folder / name.replace("_", ".")).write_text(text)
    return folder


@pytest.fixture
def cache(tmp_path):
    """Two results among what others have put there."""
    made(tmp_path / "cache" / "room", albedo_exr="picture")
    made(tmp_path / "cache" / "hall")
    (tmp_path / "cache" / "photos").mkdir()
    (tmp_path / "cache" / "photos" / "mine.png").write_text("mine")
    (tmp_path / "cache" / "stages").mkdir()
    (tmp_path / "cache" / "notes.txt").write_text("mine")
    (tmp_path / "elsewhere").mkdir()
    made(tmp_path / "elsewhere" / "kept")
    (tmp_path / "cache" / "link").symlink_to(tmp_path / "elsewhere" / "kept", target_is_directory=True)
    return tmp_path / "cache"


def test_only_folders_of_a_store_are_results(cache):
    assert [one.name for one in results(cache)] == ["hall", "room"]
    assert results(cache / "not-there") == []


def test_size_counts_files_and_follows_no_link(cache, tmp_path):
    (tmp_path / "elsewhere" / "kept" / "big.bin").write_bytes(bytes(10**6))
    assert size(cache / "photos") == 4 and 16000 < size(cache) < 10**6 < size(tmp_path / "elsewhere")


def test_stages_go_and_results_stay(cache, tmp_path):
    before = size(cache / "room")
    done = clear([*results(cache), cache / "photos", cache / "link", cache / "not-there"])
    assert done.results == 2 and done.freed > 16000 and not done.left
    assert not any(list((one / "stages").iterdir()) for one in results(cache))
    assert (cache / "room" / "albedo.exr").read_text() == "picture"
    assert (cache / "photos" / "mine.png").exists() and (cache / "notes.txt").exists()
    assert (tmp_path / "elsewhere" / "kept" / "stages" / "surface.npz").exists()
    assert size(cache / "room") < before and len(results(cache)) == 2


def test_a_folder_that_is_being_written_is_left(cache):
    with Store(cache / "room"):
        done = clear(results(cache))
    assert done.results == 1 and "another run" in done.left[0]
    assert (cache / "room" / "stages" / "surface.npz").exists()


def test_what_others_keep_among_the_stages_stays(cache, tmp_path):
    """Whatever the folder of results is set to: a theatre's project may have a lock and a folder of stages."""
    stages = cache / "hall" / "stages"
    (stages / "act one").mkdir()
    (stages / "act one" / "scene.npz").write_text("mine")
    (stages / "plan.txt").write_text("mine")
    (tmp_path / "mine.npz").write_text("mine")
    (stages / "link.npz").symlink_to(tmp_path / "mine.npz")
    assert not clear([cache / "hall"]).left
    assert sorted(one.name for one in stages.iterdir()) == ["act one", "link.npz", "plan.txt"]
    assert (stages / "act one" / "scene.npz").exists() and (tmp_path / "mine.npz").exists()
