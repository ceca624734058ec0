"""Where a capture's result goes: never where another's is, and never over what is somebody's."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from addon.core.results.result_folders import captures, documents, own_folder, write_capture
from addon.core.results.room_file import write_room
from addon.core.scene.model import Capture
from tests.core.results.test_room_file import a_capture


def result(folder: Path, capture: Path) -> Path:
    folder.mkdir(parents=True)
    write_capture(folder, capture)
    return folder


def test_a_capture_finds_its_own_again_and_no_other(tmp_path):
    home = tmp_path / "home"
    first, second, third = (tmp_path / where / "room" for where in "abc")
    assert own_folder(home, first) == home / "room" and not home.exists()
    result(home / "room", first)
    assert own_folder(home, second) == home / "room 2"
    result(home / "room 2", second)
    assert [own_folder(home, one).name for one in (first, second, third)] == ["room", "room 2", "room 3"]


def test_what_is_somebody_s_is_left(tmp_path):
    (tmp_path / "room").mkdir()
    assert own_folder(tmp_path, Path("/scans/room")) == tmp_path / "room"  # empty
    (tmp_path / "room" / "photo.png").write_text("mine")
    (tmp_path / "room 2").write_text("a file")
    assert own_folder(tmp_path, Path("/scans/room")) == tmp_path / "room 3"


def test_a_project_that_is_moved_as_a_whole_keeps_its_result(tmp_path):
    before, after = tmp_path / "before", tmp_path / "after"
    result(before / "scan relight" / "room", before / "scans" / "room")
    shutil.move(before, after)
    assert own_folder(after / "scan relight", after / "scans" / "room") == after / "scan relight" / "room"
    assert own_folder(after / "scan relight", tmp_path / "other" / "room").name == "room 2"


def test_results_of_earlier_versions_tell_by_their_room(tmp_path):
    capture = a_capture()
    (tmp_path / "capture").mkdir()
    write_room(
        tmp_path / "capture",
        Capture(Path("/scans/capture"), *(getattr(capture, name) for name in ("mesh", "instances", "frames"))),
    )
    assert own_folder(tmp_path, Path("/scans/capture")) == tmp_path / "capture"
    assert own_folder(tmp_path, Path("/others/capture")) == tmp_path / "capture 2"


@pytest.mark.parametrize("text", ["", "[]", '{"folder": 3}', "{}"])
def test_damage_is_nobody_s(tmp_path, text):
    (tmp_path / "capture.json").write_text(text)
    assert captures(tmp_path) == ()


def test_documents(tmp_path, monkeypatch):
    monkeypatch.setenv("HOME", str(tmp_path))
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path / "settings"))
    assert documents() == tmp_path
    (tmp_path / "Documents").mkdir()
    assert documents() == tmp_path / "Documents"
    (tmp_path / "settings").mkdir()
    (tmp_path / "settings" / "user-dirs.dirs").write_text(
        '# XDG_DOCUMENTS_DIR="$HOME/no"\nXDG_MUSIC_DIR="$HOME/Musik"\nXDG_DOCUMENTS_DIR="$HOME/Dokumente"\n'
    )
    assert documents() == tmp_path / "Documents"  # as that one does not exist
    (tmp_path / "Dokumente").mkdir()
    assert documents() == tmp_path / "Dokumente"
