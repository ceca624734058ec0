"""Two opposite walls under one number, in a whole run."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from tests.core.on_disk import ALBEDO, CHEAP, OnDisk

RED, GREEN = 2, 3


@pytest.fixture(scope="module")
def disk(tmp_path_factory):
    disk = OnDisk(tmp_path_factory.mktemp("capture"))
    mesh = disk.root / "mesh.ply"
    lines = mesh.read_text().splitlines()
    lines = [f"{line[:-1]}{RED}" if line.startswith("3 ") and line.endswith(f" {GREEN}") else line for line in lines]
    mesh.write_text("\n".join(lines) + "\n")
    names = json.loads((disk.root / "info_semantic.json").read_text())
    names["objects"] = [entry for entry in names["objects"] if entry["id"] != GREEN]
    (disk.root / "info_semantic.json").write_text(json.dumps(names))
    return disk


def test_each_wall_has_a_material_of_its_own(disk, tmp_path):
    first, again = disk.run(tmp_path), disk.run(tmp_path)
    (part,) = (m for m in first.materials if m.class_name == f"thing {RED} part 2")
    of_part = first.atlas.object_id == part.object_id
    rho = np.median(first.albedo.rho[of_part], 0), np.median(first.albedo.rho[first.atlas.object_id == RED], 0)
    assert np.allclose(sorted(map(list, rho)), sorted([ALBEDO[RED], ALBEDO[GREEN]]), atol=0.04)
    assert first.report["figures"]["parts"] == [part.object_id]
    told = {entry["object_id"]: entry for entry in json.loads((tmp_path / "materials.json").read_text())["objects"]}
    assert told[part.object_id]["part_of"] == RED and "part_of" not in told[RED]
    assert set(again.stored.values()) == {True}
    assert [m.object_id for m in again.materials] == [m.object_id for m in first.materials]
    assert (again.atlas.object_id == first.atlas.object_id).all()


def test_left_out_it_is_one_object(disk, tmp_path):
    run = disk.run(tmp_path, replace(CHEAP, without=("material-parts",)))
    assert [m.object_id for m in run.materials] == [0, 1, 2, 4, 5, 6] and run.report["figures"]["parts"] == []
