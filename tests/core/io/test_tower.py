"""The script that makes a building of one room: rooms with frames, objects and truth of their own."""

from __future__ import annotations

import importlib.util
import json
import os
from pathlib import Path

import numpy as np
import pytest

from addon.core.io.exr import read_numbers, write_exr
from addon.core.io.read import read_capture

spec = importlib.util.spec_from_file_location("tower", Path(__file__).resolve().parents[3] / "scripts" / "tower.py")
tower = importlib.util.module_from_spec(spec)
spec.loader.exec_module(tower)
FRAMES, VIEWS, ROOMS = 4, 2, 3


def with_truth(root: Path) -> None:
    for name in ("image", "albedo", "depth", "object_id", "relight_A"):
        (root / "truth" / name).mkdir(parents=True)
        for i in range(VIEWS):
            write_exr(root / f"truth/{name}/view_{i:03d}.exr", np.array([[-1, 0, 5]], np.float32))
    frames = json.loads((root / "transforms.json").read_text())["frames"][:VIEWS]
    views = [frame | {"file_path": f"image/view_{i:03d}.exr"} for i, frame in enumerate(frames)]
    materials = [{"id": i, "emission": None} for i in range(6)]
    for name, value in ("transforms", {"frames": views}), ("materials", materials), ("relight", {}):
        (root / f"truth/{name}.json").write_text(json.dumps(value))


def test_rooms_above_each_other(make_capture, tmp_path):
    root, out = make_capture(FRAMES).root, tmp_path / "tower"
    with_truth(root)
    tower.build(root, out, ROOMS)
    room, building = read_capture(root), read_capture(out)
    assert building.warnings == room.warnings

    mesh, height = building.mesh, 3 + tower.GAP
    copies = [building.mesh.object_id // 6 == k for k in range(ROOMS)]
    for k, copy in enumerate(copies):
        np.testing.assert_array_equal(mesh.object_id[copy], room.mesh.object_id + 6 * k)
        corners = room.mesh.vertices[room.mesh.triangles] + [0, 0, k * height]
        np.testing.assert_allclose(mesh.vertices[mesh.triangles[copy]], corners, atol=1e-6)
    assert [i.class_name for i in building.instances] == [i.class_name for i in room.instances] * ROOMS

    for i, frame in enumerate(building.frames):
        k, first = i // FRAMES, building.frames[i % FRAMES]
        moved = frame.camera.camera_to_world - room.frames[i % FRAMES].camera.camera_to_world
        np.testing.assert_allclose(moved[:, 3], [0, 0, k * height, 0], atol=1e-9)
        assert os.path.samefile(frame.path, first.path) and frame.path.name.startswith(f"room_{k:02d}")

    views = json.loads((out / "truth/transforms.json").read_text())["frames"]
    names = [Path(view["file_path"]).name for view in views]
    assert names[: ROOMS + 1] == [*(f"room_{k:02d}_view_000.exr" for k in range(ROOMS)), "room_00_view_001.exr"]
    assert views[1]["transform_matrix"][2][3] == pytest.approx(views[0]["transform_matrix"][2][3] + height)
    for i, name in enumerate(names):
        first = 6 * (i % ROOMS)
        assert read_numbers(out / "truth/object_id" / name).ravel().tolist() == [-1, first, first + 5]
        assert (out / "truth/relight_A" / name).exists() == (first == 0)
    assert [entry["id"] for entry in json.loads((out / "truth/materials.json").read_text())] == list(range(6 * ROOMS))
