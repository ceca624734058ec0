"""What a chosen folder or file turns out to be, and what is offered instead."""

from __future__ import annotations

import json
import shutil

import pytest

from addon.core.io import folder as found
from addon.core.io.folder import look_into, of_path


@pytest.fixture
def scan(grey_capture, tmp_path):
    """A capture in a folder of its own."""
    return shutil.copytree(grey_capture, tmp_path / "scans" / "living-room")


@pytest.fixture
def result(tmp_path):
    """What a finished run leaves, as far as it is known by."""
    made = tmp_path / "results" / "first"
    made.mkdir(parents=True)
    (made / "materials.json").write_text(json.dumps({"objects": [], "capture": "living-room"}))
    (made / "scene.blend").write_bytes(b"BLENDER")
    return made


def test_a_capture_is_one(scan):
    content = look_into(scan)
    assert (content.kind, content.sentence, content.name) == (found.CAPTURE, "", "living-room")


def test_a_capture_one_level_down_is_offered(scan):
    (scan.parent / "notes").mkdir()
    content = look_into(scan.parent)
    assert content.kind == found.WAY and content.captures == (scan,) and "one scan is in it" in content.sentence


def test_a_folder_within_a_capture_leads_up(scan):
    frames = next(one.parent for one in scan.rglob("*.exr"))
    content = look_into(frames)
    assert frames != scan and content.kind == found.WAY and content.captures == (scan,)


def test_a_result_is_recognised_here_and_below(result):
    content = look_into(result)
    assert content.kind == found.RESULT and content.name == "living-room"
    assert "finished result of 'living-room'" in content.sentence
    assert look_into(result.parent).results == (result,)


@pytest.mark.parametrize(
    ("files", "kind", "words"),
    [
        ((), found.EMPTY, "is empty"),
        (("room.blend",), found.OTHER, "Blender file 'room.blend'"),
        (("a.exr", "b.exr"), found.OTHER, "pictures, but no cameras"),
        (("mesh.ply",), found.OTHER, "a mesh, but no cameras"),
        (("letter.txt",), found.OTHER, "holds no scan"),
    ],
)
def test_everything_else_is_one_sentence(tmp_path, files, kind, words):
    chosen = tmp_path / "chosen"
    chosen.mkdir()
    for name in files:
        (chosen / name).write_bytes(b"")
    content = look_into(chosen)
    assert content.kind == kind and words in content.sentence and "'chosen'" in content.sentence
    assert len(content.sentence) < 160 and "\n" not in content.sentence
    assert not content.captures and not content.results


def test_what_is_not_there_is_told(tmp_path):
    assert "does not exist" in look_into(tmp_path / "nowhere").sentence


@pytest.mark.parametrize("name", ["transforms.json", "mesh.ply", "info_semantic.json"])
def test_a_file_of_a_capture_means_its_folder(scan, name):
    content = of_path(scan / name)
    assert content.kind == found.CAPTURE and content.folder == scan


def test_a_file_of_a_colmap_model_means_the_folder_that_holds_it(tmp_path):
    model = tmp_path / "room" / "sparse" / "0"
    model.mkdir(parents=True)
    for name in ("cameras.txt", "images.txt", "points3D.txt"):
        (model / name).write_text("")
    assert of_path(model / "cameras.txt").folder == tmp_path / "room"


@pytest.mark.parametrize("name", ["materials.json", "scene.blend"])
def test_a_file_of_a_result_means_it(result, name):
    content = of_path(result / name)
    assert content.kind == found.RESULT and content.folder == result


@pytest.mark.parametrize("text", ['{"colours": 3}', "no JSON at all"])
def test_another_json_is_refused(scan, text):
    (scan / "package.json").write_text(text)
    content = of_path(scan / "package.json")
    assert content.kind == found.OTHER and "'package.json' is no part of a scan" in content.sentence
