"""The room of a finished run: what is written is what is read."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from addon.core.brdf.dielectric import DIELECTRIC
from addon.core.brdf.lambertian import LAMBERTIAN
from addon.core.brdf.material import ObjectMaterial
from addon.core.brdf.metal import METAL
from addon.core.errors import BadInputError, MissingStageError
from addon.core.results.room_file import objects_of, read_capture_file, read_room, run_of, write_room
from addon.core.scene.lenses import Cropped
from addon.core.scene.lenses_colmap import polynomial
from addon.core.scene.model import Camera, Capture, Frame, Instance, Mesh


def a_capture(uv=None):
    pose = np.eye(4)
    pose[:3, 3] = 1, 2, 3
    mesh = Mesh(np.arange(12.0).reshape(4, 3), np.int32([[0, 1, 2], [1, 2, 3]]), np.int32([4, 7]), uv)
    fisheye = Cropped(polynomial("OPENCV_FISHEYE", fisheye=True, numerator=(0.1, -0.02)), 0.9, 0.8)
    frames = tuple(
        Frame(f"frame {k}", Path(f"/capture/{k}.exr"), Camera(32, 24, 20.5, 21, 16, 12, pose, lens))
        for k, lens in enumerate((None, fisheye, fisheye))
    )
    return Capture(Path("/capture"), mesh, (Instance(4, "sofa"), Instance(7, "")), frames, format="nerfstudio")


@pytest.mark.parametrize("with_uv", [False, True])
def test_there_and_back(tmp_path, with_uv):
    capture = a_capture(np.random.default_rng(0).random((2, 3, 2), np.float32) if with_uv else None)
    uv = np.random.default_rng(1).random((2, 3, 2), np.float32)
    write_room(tmp_path, capture, uv)
    back, back_uv = read_capture_file(tmp_path)
    assert back.root == capture.root.absolute() and back.format == "nerfstudio" and back.instances == capture.instances
    assert [(f.name, f.path) for f in back.frames] == [(f.name, f.path.absolute()) for f in capture.frames]
    for one, other in zip(back.frames, capture.frames):
        assert (one.camera.fx, one.camera.width) == (other.camera.fx, other.camera.width)
        assert one.camera.lens == other.camera.lens
        assert np.array_equal(one.camera.camera_to_world, other.camera.camera_to_world)
    for name in ("vertices", "triangles", "object_id"):
        assert np.array_equal(getattr(back.mesh, name), getattr(capture.mesh, name))
        assert getattr(back.mesh, name).dtype == getattr(capture.mesh, name).dtype
    assert np.array_equal(back_uv, uv) and (back.mesh.uv is None) == (capture.mesh.uv is None)


def test_materials_come_from_their_file(tmp_path):
    write_room(tmp_path, a_capture())
    metal = ObjectMaterial(4, "sofa", METAL, alpha=0.25, f0=(0.9, 0.8, 0.7), note="shiny")
    told = json.loads(json.dumps(metal.as_dict())) | {"evidence": {"area": 1.0}}
    (tmp_path / "materials.json").write_text(json.dumps({"objects": [told]}))
    room = read_room(tmp_path)
    assert room.materials == (metal,) and room.folder == tmp_path and not room.atlas_uv.any()
    assert room.run == "" == run_of(tmp_path)  # of an older version
    (tmp_path / "materials.json").write_text(json.dumps({"run": "0123456789abcdef", "objects": [told]}))
    assert read_room(tmp_path).run == run_of(tmp_path) == "0123456789abcdef"


def test_the_objects_of_a_result_are_those_that_its_materials_list(tmp_path):
    assert objects_of(tmp_path) == set()
    (tmp_path / "materials.json").write_text(json.dumps({"objects": [{"object_id": 4}, {"object_id": 62}]}))
    assert objects_of(tmp_path) == {4, 62}  # 62 may be a lamp that the capture knows nothing of
    (tmp_path / "materials.json").write_text("{")
    assert objects_of(tmp_path) == set()


OLD = {
    "objects": [
        {"object_id": 4, "class_name": "sofa", "model": "specular", "phi": 0.25, "psi": 0.05, "f0": None},
        {"object_id": 5, "class_name": "tap", "model": "metal", "phi": 0.04, "psi": None, "f0": [0.9, 0.8, 0.7]},
        {"object_id": 6, "class_name": "wall", "model": "lambertian", "phi": None, "psi": None, "f0": None},
    ]
}
"""As version 0.1 wrote it."""


def test_results_of_version_0_1_open(tmp_path):
    write_room(tmp_path, a_capture())
    (tmp_path / "materials.json").write_text(json.dumps(OLD))
    glossy, metal, diffuse = read_room(tmp_path).materials
    assert (glossy.model, glossy.alpha, glossy.f0) == (DIELECTRIC, 0.25, 0.05)
    assert (metal.model, metal.alpha, metal.f0) == (METAL, 0.04, (0.9, 0.8, 0.7))
    assert (diffuse.model, diffuse.alpha, diffuse.f0) == (LAMBERTIAN, None, None)


def test_a_model_that_is_not_there_is_told(tmp_path):
    write_room(tmp_path, a_capture())
    told = {"objects": [{"object_id": 4, "class_name": "sofa", "model": "velvet"}]}
    (tmp_path / "materials.json").write_text(json.dumps(told))
    with pytest.raises(BadInputError, match="no reflectance model 'velvet'"):
        read_room(tmp_path)


@pytest.mark.parametrize("text", [None, "", "[1]", '{"run": 3}'])
def test_the_run_of_what_is_none(tmp_path, text):
    if text is not None:
        (tmp_path / "materials.json").write_text(text)
    assert run_of(tmp_path) == ""


def test_an_unfinished_result_is_told(tmp_path):
    with pytest.raises(MissingStageError, match="room.npz' is missing"):
        read_room(tmp_path)
    write_room(tmp_path, a_capture())
    with pytest.raises(MissingStageError, match="materials.json' is missing"):
        read_room(tmp_path)


@pytest.mark.parametrize("name", ["room.npz", "materials.json"])
def test_damage_is_told(tmp_path, name):
    write_room(tmp_path, a_capture())
    (tmp_path / "materials.json").write_text('{"objects": []}')
    content = (tmp_path / name).read_bytes()
    (tmp_path / name).write_bytes(content[: len(content) // 2])
    with pytest.raises(BadInputError, match="is damaged"):
        read_room(tmp_path)
