"""The library as docs/api.md shows it: its code is taken from there, and run where there is no Blender."""

from __future__ import annotations

import json
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from addon.core.io.exr import read_exr
from addon.core.io.read import read_capture
from tests.core.on_disk import ALBEDO, LAMP, OnDisk
from tests.core.rooms import Room, patches, radiosity

WITHOUT_BLENDER = """
import importlib.util, sys
sys.modules["bpy"] = None
spec = importlib.util.spec_from_file_location("scan_relight", {root!r} + "/__init__.py",
                                              submodule_search_locations=[{root!r}])
sys.modules["scan_relight"] = package = importlib.util.module_from_spec(spec)
spec.loader.exec_module(package)
"""


@pytest.fixture(scope="module")
def blocks(root) -> list[str]:
    """The documentation's Python."""
    return re.findall(r"^```python\n(.*?)^```", (root / "docs" / "api.md").read_text(), re.MULTILINE | re.DOTALL)


def painted(room: Room) -> np.ndarray:
    """L_d with a pattern all over, so that frames and mesh can be seen to fit."""
    shade = np.where((room.atlas.object_id == 6)[:, None], 1, 0.75 + 0.25 * patches(room, 0.4))
    return (radiosity(room, ALBEDO, {6: LAMP}) * shade / np.median(shade)).astype(np.float32)


@pytest.fixture(scope="module")
def room(tmp_path_factory) -> OnDisk:
    """A capture whose mesh has texture coordinates of its own."""
    disk = OnDisk(tmp_path_factory.mktemp("own") / "CAPTURE", light=painted)
    path = disk.root / "mesh.ply"
    lines = path.read_text().splitlines()
    at, count = lines.index("end_header") + 1, len(disk.room.mesh.vertices)
    uv = np.zeros((count, 2))
    uv[disk.room.mesh.triangles] = disk.room.uv
    lines[at : at + count] = [f"{line} {u!r} {v!r}" for line, (u, v) in zip(lines[at:], uv.tolist())]
    lines[6:6] = ["property double u", "property double v"]
    path.write_text("\n".join(lines) + "\n")
    return disk


def python(root: Path, code: str, where: Path) -> subprocess.CompletedProcess:
    """Run `code` in `where`, in a Python that has no Blender."""
    return subprocess.run(
        [sys.executable, "-c", WITHOUT_BLENDER.format(root=str(root)) + code], cwd=where, capture_output=True, text=True
    )


@pytest.fixture(scope="module")
def ran(root, blocks, room) -> subprocess.CompletedProcess:
    """The first of them, where it finds its CAPTURE."""
    return python(root, blocks[0], room.root.parent)


def test_it_takes_ten_lines(blocks):
    assert len([line for line in blocks[0].splitlines() if line]) <= 10


def test_they_recover_the_room(ran, room):
    assert ran.returncode == 0, ran.stderr
    told = ran.stdout.splitlines()
    assert any(line.startswith("specular ") for line in told) and any(line.startswith("write ") for line in told)
    assert any(re.match(r"\(\d+, \d+, 3\)", line) for line in told)
    assert any("thing 6 6 emitter" in line for line in told)
    result = room.root.parent / "RESULT"
    objects = json.loads((result / "materials.json").read_text())["objects"]
    assert [one["object_id"] for one in objects] == list(range(7))
    albedo = read_exr(result / "albedo.exr").rgb
    lit = albedo[(albedo > 0).all(-1)]
    assert np.abs(np.median(lit, 0) - np.median([np.broadcast_to(rho, 3) for rho in ALBEDO.values()], 0)).max() < 0.2
    assert json.loads((result / "report.json").read_text())["versions"].keys() >= {"scan_relight", "python", "numpy"}
    assert not (result / "scene.blend").exists()


def test_its_arrays_are_what_it_writes(root, room, ran, tmp_path):
    code = """
import numpy, scan_relight
found = scan_relight.recover("CAPTURE", "RESULT", scan_relight.Settings(detail=0.5, shading_rays=64))
numpy.savez({out!r}, albedo=found.albedo, shading=found.irradiance, lit_diffuse=found.lit_diffuse, uv=found.uv,
            triangles=found.mesh.triangles)
"""
    done = python(root, code.format(out=str(tmp_path / "arrays.npz")), room.root.parent)
    assert done.returncode == 0, done.stderr
    with np.load(tmp_path / "arrays.npz") as arrays:
        for name in ("albedo", "shading", "lit_diffuse"):
            written = read_exr(room.root.parent / "RESULT" / f"{name}.exr").rgb
            assert np.allclose(arrays[name], written, rtol=2e-3, atol=1e-4), name
        assert arrays["uv"].shape == (len(arrays["triangles"]), 3, 2)


def test_importing_it_loads_next_to_nothing(root, tmp_path):
    code = "print(sorted({'numpy', 'scipy', 'embreex', 'OpenEXR'} & set(sys.modules)), 'recover' in package.__all__)"
    done = python(root, code, tmp_path)
    assert done.stdout.split("\n")[0] == "[] True", done.stdout + done.stderr


def test_all_public_names_are_there(root, tmp_path):
    code = """
from scan_relight.addon import api
print(package.__all__ == api.__all__, all(getattr(package, name) is getattr(api, name) for name in api.__all__))
print(hasattr(package, "nonsense"))
"""
    done = python(root, code, tmp_path)
    assert done.stdout.split() == ["True", "True", "False"], done.stderr


@pytest.mark.slow
def test_a_mesh_that_can_not_be_laid_out_is_told(root, disk, tmp_path):
    code = """
import scan_relight
sys.modules["xatlas"] = None
try:
    scan_relight.recover({capture!r}, "RESULT", unwrap={unwrap!r})
except scan_relight.BadInputError as error:
    print(error)
"""
    for unwrap, said in (("own", "no texture coordinates"), ("xatlas", "'xatlas' is missing"), ("blender", "'bpy' is")):
        done = python(root, code.format(capture=str(disk.root), unwrap=unwrap), tmp_path)
        assert said in done.stdout and done.stdout.count("\n") == 1, done.stderr


@pytest.mark.parametrize("scene, code, said", [([], 2, "recover --no-scene"), (["--no-scene"], 0, "materials.json")])
def test_the_command_line_without_blender(root, room, tmp_path, scene, code, said):
    command = ["recover", str(room.root), "--out", str(tmp_path / "result"), "--preset", "draft", "--unwrap", "own"]
    command = [*command, "--texel-size", "0.2", *scene] if scene else [*command[:-2]]
    done = python(root, f"from scan_relight.addon import cli\nsys.exit(cli.main({command!r}))", tmp_path)
    assert done.returncode == code and said in done.stdout + done.stderr, done.stderr
    assert (tmp_path / "result" / "materials.json").is_file() is bool(scene)
    assert not (tmp_path / "result" / "scene.blend").exists()


# Readers


@pytest.fixture
def rig(room, tmp_path) -> Path:
    """The room in the layout that the documentation makes up."""
    folder = tmp_path / "rig"
    folder.mkdir()
    (folder / "images").symlink_to(room.root / "images")
    top = json.loads((room.root / "transforms.json").read_text())
    shots = [
        {"name": f"shot {i}", "picture": one["file_path"], "pose": one["transform_matrix"]}
        for i, one in enumerate(top["frames"])
    ]
    rig = {"size": [top["w"], top["h"]], "focal_lengths": [top["fl_x"], top["fl_y"]], "centre": [top["cx"], top["cy"]]}
    (folder / "rig.json").write_text(json.dumps(rig | {"shots": shots}))
    mesh = room.room.mesh
    np.savez(folder / "mesh.npz", vertices=mesh.vertices, triangles=mesh.triangles, object_id=mesh.object_id)
    return folder


SHOW = """
found = scan_relight.read_capture({folder!r}, scan_relight.Reading(outside=True))
print(found.format, len(found.frames), len(found.mesh.triangles))
"""


def test_the_documented_reader_reads(root, blocks, rig, room, tmp_path):
    done = python(root, blocks[1] + SHOW.format(folder=str(rig)), tmp_path)
    assert done.stdout.split() == ["rig", str(room.count), str(len(room.room.mesh.triangles))], done.stderr


def test_an_entry_point_is_a_reader(root, blocks, rig, room, tmp_path):
    """As pip leaves it: a module, and a folder with its metadata; another one of them is broken."""
    (tmp_path / "rig_reader.py").write_text(blocks[1].replace("scan_relight.register_reader(READER)", ""))
    entries = re.search(r"^```toml\n(.*?)^```", (root / "docs" / "api.md").read_text(), re.MULTILINE | re.DOTALL)[1]
    group, line = entries.splitlines()
    for name, point in (("rig_reader", line.replace('"', "")), ("broken", "odd = not_there:READER")):
        told = tmp_path / f"{name}-1.0.dist-info"
        told.mkdir()
        (told / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: 1.0\n")
        (told / "entry_points.txt").write_text(f"{group.removeprefix('[project.entry-points.').replace(chr(34), '')}\n")
        text = "[scan_relight.readers]\n" + point + "\n"
        assert "[" + (told / "entry_points.txt").read_text().strip() == text.splitlines()[0]
        (told / "entry_points.txt").write_text(text)
    ask = """
import scan_relight
try:
    scan_relight.read_capture({folder!r}, scan_relight.Reading("odd"))
except scan_relight.BadInputError as error:
    print(error)
"""
    code = f"sys.path.insert(0, {str(tmp_path)!r})\nimport scan_relight\n" + SHOW + ask
    done = python(root, code.format(folder=str(rig)), tmp_path)
    read, refused, *_ = done.stdout.splitlines()
    assert read.split() == ["rig", str(room.count), str(len(room.room.mesh.triangles))], done.stderr
    assert "'odd' can't be loaded from the Python package 'broken'" in refused


def test_a_known_format_stays_as_it_is(room):
    from addon.core.errors import BadInputError
    from addon.core.io.readers import READERS, register_reader

    with pytest.raises(BadInputError, match="There is a format 'nerfstudio' already"):
        register_reader(next(one for one in READERS if one.name == "nerfstudio"))
    assert read_capture(room.root).format == "nerfstudio"
