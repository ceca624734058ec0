"""A part of a building as a capture: read like any other, with what is far apart from what is its own."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from addon.core.errors import BadInputError
from addon.core.io.layout import AS_FOUND
from addon.core.io.part import PART, write_part
from addon.core.io.read import read_capture
from addon.core.scene.division import Division
from tests.core.on_disk import OnDisk


@pytest.fixture(scope="module")
def whole(tmp_path_factory) -> Path:
    return OnDisk(tmp_path_factory.mktemp("building") / "capture").root


def division(capture) -> Division:
    """Floor and one wall, with half of the other wall's triangles far; every third frame."""
    own = np.isin(capture.mesh.object_id, (0, 2))
    half = np.flatnonzero(capture.mesh.object_id == 3)[:1]
    triangle = np.sort(np.r_[np.flatnonzero(own), half])
    return Division(triangle, ~np.isin(triangle, np.flatnonzero(own)), np.arange(0, len(capture.frames), 3))


@pytest.fixture
def part(whole, tmp_path) -> Path:
    capture = read_capture(whole)
    write_part(tmp_path / "01", capture, division(capture), AS_FOUND)
    return tmp_path / "01"


def test_a_part_has_its_triangles_its_frames_and_names(whole, part):
    capture, read = read_capture(whole), read_capture(part)
    chosen = division(capture)
    corners, expected = (
        mesh.vertices[mesh.triangles[rows]] for mesh, rows in ((read.mesh, ...), (capture.mesh, chosen.triangle))
    )
    assert (corners == expected).all()
    assert (read.mesh.far == chosen.far).all()
    assert [frame.path.resolve() for frame in read.frames] == [capture.frames[i].path.resolve() for i in chosen.frames]
    for frame, i in zip(read.frames, chosen.frames, strict=True):
        assert (frame.camera.camera_to_world == capture.frames[i].camera.camera_to_world).all()
    names = {instance.object_id: instance.class_name for instance in read.instances}
    assert {names[i] for i in (0, 2)} == {"thing 0", "thing 2"}
    assert set(read.mesh.object_id[~read.mesh.far]) == {0, 2}
    (far,) = np.unique(read.mesh.object_id[read.mesh.far])
    assert names[far] not in ("thing 0", "thing 2", "thing 3")


def test_an_object_that_is_cut_is_two(whole, tmp_path):
    capture = read_capture(whole)
    both = np.flatnonzero(capture.mesh.object_id == 0)
    far = np.arange(len(both)) % 2 == 1
    write_part(tmp_path / "01", capture, Division(both, far, np.arange(4)), AS_FOUND)
    read = read_capture(tmp_path / "01")
    assert (read.mesh.object_id == 0).tolist() == (~far).tolist()
    assert len(read.instances) == 2


def test_poses_read_by_a_convention_are_so_in_the_part(whole, tmp_path):
    reading = replace(AS_FOUND, convention="up:+y")
    capture = read_capture(whole, reading)
    write_part(tmp_path / "01", capture, division(capture), reading)
    read = read_capture(tmp_path / "01")
    expected = capture.mesh.vertices[capture.mesh.triangles[division(capture).triangle]]
    assert read.mesh.vertices[read.mesh.triangles] == pytest.approx(expected, abs=1e-12)
    assert (read.frames[1].camera.camera_to_world == capture.frames[3].camera.camera_to_world).all()


def test_a_part_without_objects_has_its_parts_by_shape(whole, tmp_path):
    reading = replace(AS_FOUND, segments="shape")
    capture = read_capture(whole, reading)
    triangle = np.flatnonzero(capture.mesh.vertices[capture.mesh.triangles].mean(1)[:, 2] < 1)
    write_part(tmp_path / "01", capture, Division(triangle, np.zeros(len(triangle), bool), np.arange(6)), AS_FOUND)
    read = read_capture(tmp_path / "01")
    assert read.mesh.whole
    assert all(instance.guess for instance in read.instances)


def test_a_part_that_moved_with_its_capture_is_read(whole, tmp_path):
    capture = read_capture(whole)
    write_part(whole.parent / "parts" / "01", capture, division(capture), AS_FOUND)
    whole.parent.rename(tmp_path / "elsewhere")
    try:
        assert len(read_capture(tmp_path / "elsewhere" / "parts" / "01").frames) == len(division(capture).frames)
    finally:
        (tmp_path / "elsewhere").rename(whole.parent)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"capture": "../nowhere"}, "is not there"),
        ({"frames": ["images/999.exr"]}, "999.exr"),
        ({"frames": 3}, "does not tell"),
        ({"capture": 3}, "does not tell"),
        ({"reading": {"format": "nonsense", "transfer": "", "convention": ""}}, "does not tell"),
        ({"reading": {"format": "", "transfer": "nonsense", "convention": ""}}, "does not tell"),
        ({"reading": {}}, "does not tell"),
    ],
)
def test_a_part_that_fits_no_capture_is_refused(part, change, words):
    told = json.loads((part / PART).read_text())
    (part / PART).write_text(json.dumps(told | change))
    with pytest.raises(BadInputError, match=words):
        read_capture(part)


def test_a_part_whose_mesh_is_given_is_refused(whole, part):
    with pytest.raises(BadInputError, match="leave --mesh out"):
        read_capture(part, replace(AS_FOUND, mesh=whole / "mesh.ply"))
