"""A building divided, recovered part by part: as right as recovered whole, and the same wherever a part is done."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from addon import cli
from tests.core.on_disk import ALBEDO, EYES, LAMP, OnDisk
from tests.core.rooms import around, lit_box, radiosity
from tests.farm.conftest import OPTIONS, contents

LENGTH = 4.05
HOLE = (0.3, 0.7), (0.0, 0.8)
SECOND = 10
"""What object numbers of the second room begin at."""


def two_rooms():
    """Two rooms with a hole in the wall between; only the first has a lamp."""
    quads = []
    for k, wall in ((0, 3), (1, 2)):
        for side in lit_box(lamps=(((0.3, 0.7), (0.3, 0.7)),)):
            number = 1 if k and side.object_id == 6 else side.object_id
            moved = type(side)(side.corner + (k * LENGTH, 0, 0), side.edge_u, side.edge_v, number + SECOND * k)
            quads += around(moved, *(HOLE[::-1] if wall == 3 else HOLE)) if number == wall else [moved]
    return quads


def truth():
    return ALBEDO | {number + SECOND: np.array(value) * 0.9 for number, value in ALBEDO.items()}


@pytest.fixture(scope="module")
def building(tmp_path_factory) -> Path:
    eyes = [*EYES, *(np.array(eye) + (LENGTH, 0, 0) for eye in EYES)]
    root = tmp_path_factory.mktemp("building") / "capture"
    return OnDisk(root, two_rooms(), light=lambda room: radiosity(room, truth(), {6: LAMP}), eyes=eyes).root


def run(*argv) -> int:
    return cli.main([str(word) for word in argv])


def recover(capture: Path, result: Path) -> Path:
    assert run("recover", capture, "--out", result, "--quiet", *OPTIONS, "--texel-size", 0.08) == 0
    return result


@pytest.fixture(scope="module")
def parts(building, tmp_path_factory) -> list[Path]:
    folder = tmp_path_factory.mktemp("parts") / "of"
    assert run("divide", building, "--out", folder, "--parts", 2, "--quiet") == 0
    return sorted(folder.iterdir())


@pytest.fixture(scope="module")
def results(parts, tmp_path_factory) -> list[Path]:
    folder = tmp_path_factory.mktemp("results")
    return [recover(part, folder / part.name) for part in parts]


def albedo(result: Path) -> dict[int, np.ndarray]:
    """Mean albedo of each object that was measured."""
    objects = json.loads((result / "materials.json").read_text())["objects"]
    return {
        entry["object_id"]: np.array(entry["evidence"]["albedo"])
        for entry in objects
        if entry.get("evidence", {}).get("measured_share") and entry["object_id"] in truth()
    }


@pytest.mark.slow
def test_parts_are_recovered_as_the_whole_is(building, results, tmp_path):
    """All light of the second room comes from the other part: directly, and from what the lamp shines on there."""
    whole = albedo(recover(building, tmp_path / "whole"))
    first, second = (albedo(result) for result in results)
    assert not first.keys() & second.keys()
    divided = first | second
    assert divided.keys() == whole.keys()
    for object_id, found in divided.items():
        assert found == pytest.approx(whole[object_id], abs=0.03), object_id


@pytest.mark.slow
def test_a_part_done_again_elsewhere_is_the_same(building, results, tmp_path):
    assert run("divide", building, "--out", tmp_path / "again", "--parts", 2, "--quiet") == 0
    first, second = (contents(result) for result in (results[0], recover(tmp_path / "again" / "01", tmp_path / "01")))
    names = [name for name in first if name.endswith(".exr")]
    assert names
    assert all(first[name] == second[name] for name in names)


def test_parts_are_told(building, tmp_path, capsys):
    assert run("divide", building, "--out", tmp_path / "parts", "--parts", 2) == 0
    assert len(capsys.readouterr().out.strip().splitlines()) == 2
    assert run("info", tmp_path / "parts" / "01") == 0


def test_enough_memory_leaves_a_building_whole(building, tmp_path):
    assert run("divide", building, "--out", tmp_path / "parts", "--memory", 50, "--quiet") == 0
    assert [path.name for path in (tmp_path / "parts").iterdir()] == ["01"]


@pytest.mark.parametrize(
    ("options", "words"),
    [(["--parts", -1], "more than 0"), (["--memory", -1], "more than 0"), (["--format", "nonsense"], "nonsense")],
)
def test_bad_input_is_refused_and_nothing_written(building, tmp_path, capsys, options, words):
    assert run("divide", building, "--out", tmp_path / "parts", *options) == 2
    assert words in capsys.readouterr().err
    assert not (tmp_path / "parts").exists()


def test_parts_are_not_mixed_with_what_is_there(building, parts, tmp_path, capsys):
    (tmp_path / "note.txt").write_text("mine")
    assert run("divide", building, "--out", tmp_path) == 2
    assert "not empty" in capsys.readouterr().err
    assert [path.name for path in tmp_path.iterdir()] == ["note.txt"]
    assert run("divide", parts[0], "--out", tmp_path / "more") == 2
    assert "is a part already" in capsys.readouterr().err
