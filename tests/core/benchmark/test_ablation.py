"""The ablation over a small room with truth: runs are not done twice, and the table says what was gained."""

from __future__ import annotations

import json
import sys

import numpy as np
import pytest

from addon import cli
from addon.benchmark.ablation import LINES, Ablation, _unwrap, read_lines, run_ablation
from addon.benchmark.ablation_table import FIGURES, gain_of, seconds_of, write_report
from addon.core.errors import BadInputError
from addon.core.io.exr import read_exr, write_exr
from addon.core.io.read import read_capture
from addon.core.passes.registry import PASSES
from addon.core.scene.rays import RayScene
from addon.core.scene.unwrap import by_xatlas
from tests.core.on_disk import ALBEDO, LAMP, OnDisk


def add_truth(disk: OnDisk) -> None:
    """Two of the frames as held-out views."""
    truth, capture = disk.root / "truth", read_capture(disk.root)
    scene = RayScene(capture.mesh.vertices, capture.mesh.triangles)
    told = json.loads((disk.root / "transforms.json").read_text())
    chosen = told["frames"][:2]
    for folder in ("object_id", "albedo", "image"):
        (truth / folder).mkdir(parents=True)
    for i, frame in enumerate(capture.frames[:2]):
        camera = frame.camera
        ways = camera.directions(camera.pixel_centres())
        hits = scene.intersect(np.broadcast_to(camera.centre.astype(np.float32), ways.shape), ways)
        ids = np.where(hits.triangle >= 0, capture.mesh.object_id[hits.triangle], -1)
        colours = np.float32([np.broadcast_to(ALBEDO.get(i, 0), 3) for i in range(7)])
        shape = (camera.height, camera.width, 3)
        write_exr(truth / "object_id" / f"{i:03d}.exr", np.repeat(ids, 3).reshape(shape).astype(np.float32))
        write_exr(truth / "albedo" / f"{i:03d}.exr", colours[ids].reshape(shape))
        write_exr(truth / "image" / f"{i:03d}.exr", read_exr(disk.path(i)).rgb)
        chosen[i]["file_path"] = f"image/{i:03d}.exr"
    (truth / "transforms.json").write_text(json.dumps(told | {"frames": chosen}))
    plain = {"bsdf": "diffuse", "alpha": None, "metallic": 0.0, "masked": False}
    objects = [plain | {"id": i, "emission": LAMP if i == 6 else None} for i in range(7)]
    (truth / "materials.json").write_text(json.dumps(objects))


@pytest.fixture(scope="module")
def room(tmp_path_factory) -> OnDisk:
    """A capture with truth."""
    disk = OnDisk(tmp_path_factory.mktemp("ablation") / "box")
    add_truth(disk)
    return disk


def asked(room, out, **more) -> Ablation:
    return Ablation(
        (room.root,), out, (0,), ("sun", "interpolation", "compensation"), "draft", unwrap=room.unwrap, **more
    )


@pytest.mark.slow
def test_runs_that_are_there_are_not_done_again(room, tmp_path):
    told = []
    path = run_ablation(asked(room, tmp_path), told.append)
    first = path.read_bytes()
    lines = read_lines([path])
    assert [one["without"] for one in lines] == ["", "sun", "interpolation", "compensation"] and len(told) == 4
    whole, sun, interpolation, compensation = lines
    assert whole["figures"]["albedo"] > 25 and whole["figures"]["right"] == whole["figures"]["objects"] >= 6
    assert sun["same"] and sun["figures"] == whole["figures"] and set(sun["seconds"]) == {"shading"}
    assert set(interpolation["seconds"]) == {"shading", "specular", "write"} and not interpolation["same"]
    assert set(compensation["seconds"]) == {"write"}
    run_ablation(asked(room, tmp_path), told.append)
    assert path.read_bytes() == first and len(told) == 4
    # Another source's run is no measure for this one's.
    path.write_text(first.decode().replace(compensation["code"], "another", 1))
    run_ablation(asked(room, tmp_path), told.append)
    assert len(told) == 5 and read_lines([path])[0]["code"] == compensation["code"]


@pytest.mark.slow
def test_passes_that_are_taken_out_together(room, tmp_path):
    """One line, from the first stage that any of them changes; what each says by itself is another's matter."""
    together = Ablation((room.root,), tmp_path, (0,), ("sun+compensation", "compensation"), "draft", unwrap=room.unwrap)
    _, compensation, both = read_lines([run_ablation(together)])
    assert (compensation["without"], both["without"]) == ("compensation", "sun+compensation")
    assert {"shading", "write"} <= set(both["seconds"]) and both["figures"] == compensation["figures"]


def test_a_torn_last_line_is_done_again(room, tmp_path):
    path = tmp_path / LINES
    path.write_text('{"room": "box", "pre')
    assert read_lines([path]) == []
    path.write_text('nothing\n{"room": 1}\n')
    with pytest.raises(BadInputError, match="Line 1 of"):
        read_lines([path])


def test_no_run_is_begun_after_the_limit(room, tmp_path):
    assert not run_ablation(asked(room, tmp_path, limit=1e-9)).exists()


def test_a_room_without_truth_and_an_unknown_pass_are_told(disk, room, tmp_path, capsys):
    with pytest.raises(BadInputError, match="has no truth"):
        run_ablation(Ablation((disk.root,), tmp_path))
    with pytest.raises(BadInputError, match="no pass 'moon'"):
        run_ablation(Ablation((room.root,), tmp_path, passes=("moon",)))
    assert cli.main(["benchmark", "ablation", "--list"]) == 0
    out = capsys.readouterr().out
    assert all(one.name in out and one.does in out for one in PASSES)
    assert cli.main(["benchmark", "ablation", str(room.root)]) == 2


def line(room: str, seed: int, without: str, albedo: float, rough: float, seconds: dict) -> dict:
    figures = {"albedo": albedo, "roughness_by_pixel": rough, "right": 5, "objects": 6}
    return {
        "room": room, "preset": "normal", "seed": seed, "without": without, "same": False, "figures": figures,
        "seconds": seconds, "peak_mib": 100,
    }  # fmt: skip


def test_gains_and_their_error(tmp_path):
    lines = [
        line("a", 0, "", 30, 0.1, {"shading": 4, "specular": 5}), line("a", 0, "sun", 28, 0.2, {"shading": 3}),
        line("a", 1, "", 30, 0.1, {"shading": 4, "specular": 5}), line("a", 1, "sun", 26, 0.1, {"shading": 3}),
        line("b", 0, "", 20, 0.1, {"shading": 4, "specular": 5}), line("b", 0, "sun", 21, 0.1, {"shading": 1}),
    ]  # fmt: skip
    runs = {((one["room"], one["preset"]), one["seed"], one["without"]): one for one in lines}
    gain = gain_of(FIGURES[0], "sun", runs)
    assert gain.by_room == {("a", "normal"): 3, ("b", "normal"): -1} and gain.mean == 1
    # variance 2 between the seeds of a; the mean over rooms of (2 seeds, 1 seed)
    assert np.isclose(gain.error, np.sqrt(2 * (1 / 2 + 1)) / 2)
    assert np.isclose(gain_of(FIGURES[2], "sun", runs).mean, 25)  # 1/1000; less is better
    assert np.isclose(seconds_of("sun", runs), (1 + 1 + 3) / 3)
    assert gain_of(FIGURES[0], "compensation", runs) is None
    (tmp_path / "ablation-one.jsonl").write_text("\n".join(json.dumps(one) for one in lines[:3]))
    (tmp_path / "ablation-two.jsonl").write_text("\n".join(json.dumps(one) for one in lines[3:]))
    write_report(tmp_path, tmp_path / "table.md")
    text = (tmp_path / "table.md").read_text()
    row = next(one for one in text.splitlines() if one.startswith("| sun | 2 of 2"))
    assert row.endswith("| open |") and "+1.00 ± 0.87" in row and "-1.00 b" in row and "+3.00 a" in row
    assert "| -1.00 to +3.00 |" in row  # over b alone, over a alone
    assert "Taken out" not in text
    others = [line("a", 0, "moonlight", 29.5, 0.1, {}), line("a", 0, "sun+coat", 27, 0.1, {})]
    (tmp_path / "ablation-three.jsonl").write_text("\n".join(json.dumps(one) for one in others))
    write_report(tmp_path, tmp_path / "table.md")
    _, _, gone = (tmp_path / "table.md").read_text().partition("## Taken out of the method since")
    gone, _, together = gone.partition("## Taken out together")
    assert "| moonlight | 1 of 1 | +0.50 |" in gone and "| sun+coat | 1 of 1 | +3.00 |" in together
    # With one seed the rooms' deviation counts: gains of 2 and -1.
    first = {key: one for key, one in runs.items() if key[1] == 0}
    assert np.isclose(gain_of(FIGURES[0], "sun", first).error, np.std([2, -1], ddof=1) / np.sqrt(2))
    # A gain that one room makes is no verdict, however small its error.
    steady = [line(room, seed, name, 30 - (name == "sun") * gain, 0.1, {}) for room, gain in (("a", 9), ("b", -1))
              for seed in (0, 1) for name in ("", "sun")]  # fmt: skip
    (tmp_path / "steady").mkdir()
    (tmp_path / "steady" / "ablation.jsonl").write_text("\n".join(json.dumps(one) for one in steady))
    write_report(tmp_path / "steady", tmp_path / "table.md")
    assert "| +4.00 ± 0.00 |" in (text := (tmp_path / "table.md").read_text()) and "gains albedo" not in text
    with pytest.raises(BadInputError, match="no runs"):
        write_report(tmp_path / "empty", tmp_path / "other.md")


def test_without_blender_xatlas_lays_meshes_out(monkeypatch):
    monkeypatch.setitem(sys.modules, "addon.bridge.data.unwrap", None)
    assert _unwrap() is by_xatlas
