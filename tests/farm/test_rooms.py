"""Rooms of units of work: the graph, what is handed over, and how far it is."""

from __future__ import annotations

import json
import re
import shutil

import pytest

from addon import cli
from addon.cli.common import settings_from
from addon.core.stages import RUN_STAGES
from addon.farm import commands
from addon.farm.plan import Room
from tests.farm.conftest import OPTIONS, assert_same, do, unit


def plan(capsys, *argv) -> list[dict]:
    assert cli.main(["plan", *map(str, argv)]) == 0
    return json.loads(capsys.readouterr().out)["rooms"]


@pytest.mark.slow
def test_the_graph_says_the_same_as_the_command(capture, whole, tmp_path, capsys, monkeypatch):
    """The commands of a plan, done in its order, with none before those that it waits for."""
    [room] = plan(capsys, capture, "--out", tmp_path, "--blocks", "2", *OPTIONS)
    done: set[str] = set()
    for task in room["tasks"]:
        assert set(task["after"]) <= done and task["command"][0] == "scan-relight"
        assert cli.main([*task["command"][1:], "--quiet"]) == 0
        done.add(task["name"])
    assert set(RUN_STAGES) <= done
    assert "specular-2-of-2" in done
    assert_same(tmp_path / "capture", whole)
    told = json.loads((tmp_path / "capture" / "report.json").read_text())["settings"]
    assert told == json.loads((whole / "report.json").read_text())["settings"]


def test_all_options_reach_the_units(tmp_path, capsys):
    given = ["--preset=paper", "--seed=7", "--no-interpolate", "--without=sun", "--without=mirrors", "--transfer=2.2"]
    given += [
        "--convention=x",
        "--outside",
        "--no-scene",
        "--unwrap=own",
        "--no-overrides",
        "--format=nerfstudio",
        "--white=wall",
    ]
    paths = [f"--{name}={tmp_path / name}" for name in ("mesh", "exposures", "segments", "override")]
    [room] = plan(capsys, "capture", "--out", tmp_path, *given, *paths)
    argv = room["tasks"][0]["command"][1:]
    parser = cli.make_parser()
    direct = parser.parse_args(["stage", "c", "--out", "r", "--stage", "surface", *given, *paths])
    arrived = parser.parse_args(argv)
    assert settings_from(arrived) == settings_from(direct) and settings_from(direct).seed == 7
    names = ("format", "mesh", "outside", "transfer", "exposures", "segments", "convention", "white", "scene", "unwrap",
             "override")  # fmt: skip
    assert [getattr(arrived, one) for one in names] == [getattr(direct, one) for one in names]
    assert arrived.no_overrides


def test_lists_of_rooms(tmp_path, capsys):
    (tmp_path / "list").write_text("one\ntwo\telsewhere/2\n\n")
    rooms = plan(capsys, "--list", tmp_path / "list", "--out", tmp_path / "out", "zero")
    assert [room["result"] for room in rooms] == [
        str(tmp_path / "out" / "zero"), str(tmp_path / "out" / "one"), str(tmp_path / "elsewhere" / "2"),
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("argv", "told"),
    [
        ([], "No room is named"),
        (["a/room", "b/room"], "would both be written"),
        (["room", "--out", "."], "is the capture itself"),
        (["room", "--out", "x", "--blocks", "0"], "can't be divided into 0"),
        (["--list", "nowhere", "--out", "x"], "can't be read"),
        (["room", "--out", "x", "--unwrap", "own"], "goes with --no-scene"),
        (["room", "--out", "x", "--seed", "-1"], "seed"),
    ],
)
def test_what_is_no_farm_is_bad_input(argv, told, capsys):
    assert cli.main(["plan", *argv]) == 2
    err = capsys.readouterr().err
    assert told in err and err.count("\n") == 1


def test_one_rooms_failure_stops_no_other(capture, tmp_path, capsys):
    argv = ["submit", "--engine", "openjd", str(tmp_path / "missing"), str(capture), "--out", str(tmp_path / "out")]
    assert cli.main([*argv, *OPTIONS]) == 2
    out, err = capsys.readouterr()
    assert "'missing' was not handed over" in err and err.count("\n") == 1
    assert out.startswith("capture: ") and (tmp_path / "out" / "capture" / "farm" / "plan.json").is_file()
    assert not (tmp_path / "out" / "missing").exists()


def test_how_far_rooms_are(capture, whole, tmp_path, capsys):
    half, failed = tmp_path / "half", tmp_path / "failed"
    do(capture, half, "surface", "lit_diffuse")
    assert cli.main(unit(tmp_path / "no capture", failed, "surface")) == 2
    capsys.readouterr()
    page = tmp_path / "pages" / "rooms.html"
    page.parent.mkdir()
    results = [str(half), str(failed), str(whole), str(tmp_path)]
    assert cli.main(["status", *results, "--json", "--page", str(page)]) == 1
    rooms = {one["room"]: one for one in json.loads(capsys.readouterr().out)["rooms"]}
    assert (rooms["half"]["state"], rooms["half"]["stage"]) == ("waiting", "shading") and 0 < rooms["half"]["share"] < 1
    assert rooms["failed"]["state"] == "failed" and "no capture" in rooms["failed"]["error"]
    assert rooms["result"]["state"] == "done" and rooms[tmp_path.name]["state"] == "no plan"
    assert all(one["seconds"] > 0 and one["memory"] > 0 for one in rooms["half"]["units"][:2])
    assert cli.main(["status", str(half)]) == 0
    assert re.search(r"half +waiting +Light and albedo +\d+%", capsys.readouterr().out)

    assert page.read_text().count("<a href") == 1  # of the one that has a report
    do(capture, half, "shading", "specular", "write")
    assert cli.main(["status", str(half), "--json", "--page", str(page)]) == 0
    [room] = json.loads(capsys.readouterr().out)["rooms"]
    assert (room["state"], room["share"]) == ("done", 1)
    link = re.search('<a href="([^"]+)"', page.read_text())[1]
    assert (page.parent / link).resolve() == (half / "report.html").resolve()


def test_a_stage_that_was_cleared_waits_again(capture, tmp_path, capsys):
    do(capture, tmp_path / "room", "surface")
    shutil.rmtree(tmp_path / "room" / "stages")
    cli.main(["status", str(tmp_path / "room"), "--json"])
    assert json.loads(capsys.readouterr().out)["rooms"][0]["units"][0]["state"] == "waiting"


def test_a_plan_that_is_damaged_is_told(tmp_path, capsys):
    (tmp_path / "room" / "farm").mkdir(parents=True)
    for content in ("", "[]", '{"tasks": [1]}', "\0"):
        (tmp_path / "room" / "farm" / "plan.json").write_text(content)
        assert cli.main(["status", str(tmp_path / "room")]) == 1
        assert "can't be read" in capsys.readouterr().out


def test_blocks_come_before_what_joins_them():
    tasks = {one.name: one for one in Room(*map(commands.Path, ("/c", "/r")), blocks=3, divided=("specular",)).tasks()}
    assert tasks["specular"].after == ("specular-1-of-3", "specular-2-of-3", "specular-3-of-3")
    assert tasks["specular-2-of-3"].after == ("shading",) and tasks["write"].after == ("specular",)
