"""The living room in every layout: the same poses, the same objects, the same albedo. And a room without frames."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import bpy
import numpy as np
import pytest

from addon.bridge.data.import_mesh import import_mesh
from addon.bridge.data.unwrap import unwrap
from addon.bridge.job.run import run
from addon.core.io.layout import Reading
from addon.core.io.pixels import read_pixels
from addon.core.io.ply import read_ply
from addon.core.io.read import read_capture
from addon.core.pipeline.recover import Recovery
from addon.core.progress import Progress
from addon.core.results.store import Store
from addon.core.scene.model import Capture
from addon.core.settings import Settings
from tests.core.io import layouts_on_disk as on_disk
from tests.core.io.hostile import cases
from tests.core.on_disk import ALBEDO, LAMP
from tests.core.replica_on_disk import ReplicaOnDisk
from tests.core.rooms import lit_box, make_room, radiosity
from tests.hostile.readers import mesh_files

LIVING_ROOM = Path(__file__).resolve().parents[3] / "shared/captures/living-room"
EVERY = 8
"""Frames that are taken: every eighth of 96."""
COARSE = Settings(texel_size=0.1, shading_rays=16, emitter_rays=8, portal_rays=8, mirrors=False, denoise_mesh=False)
READING = Reading(import_mesh=import_mesh)


def as_colmap(capture, root, names):
    for i, frame in enumerate(capture.frames):
        on_disk.put(frame.path, root / f"images/{i:05d}.exr")
    on_disk.write_colmap(capture.frames, root / "sparse/0", "{:05d}.exr")
    on_disk.write_ply(root / "mesh.ply", capture.mesh)
    (root / "info_semantic.json").write_text(
        json.dumps({"objects": [{"id": i, "class_name": name} for i, name in names.items()]})
    )


def in_traj(capture, root, names):
    on_disk.as_traj(capture, root)
    (root / "info_semantic.json").write_text(
        json.dumps({"objects": [{"id": i, "class_name": name} for i, name in names.items()]})
    )


WRITERS = {"colmap": as_colmap, "fipt": lambda c, r, n: on_disk.as_fipt(c, r, names=n),
           "fipt-real": lambda c, r, n: on_disk.as_fipt_real(c, r, names=n), "scannet++": on_disk.as_scannetpp,
           "traj": in_traj}  # fmt: skip


class Same:
    """The living room, and its albedo from a few frames at a coarse resolution; its unwrapping for all."""

    def __init__(self, folder: Path):
        if not LIVING_ROOM.is_dir():
            pytest.skip(f"{LIVING_ROOM} is absent")
        self.folder = folder
        whole = read_capture(LIVING_ROOM)
        # Names that tell all objects apart: classes count in the albedo, so they are the same for all layouts.
        instances = tuple(replace(one, class_name=f"{one.class_name} {one.object_id:02d}") for one in whole.instances)
        self.capture = replace(whole, frames=whole.frames[::EVERY], instances=instances)
        self.names = {one.object_id: one.class_name for one in instances}
        self.centre = self.capture.mesh.vertices[self.capture.mesh.triangles].mean(1)
        self.uv = None
        self.albedo, self.elements = self.recovered(self.capture, "own")

    def recovered(self, capture: Capture, name: str):
        def layout(mesh, size):
            if self.uv is None:
                self.uv = unwrap(mesh, size)
            return self.uv

        with Store(self.folder / f"result-{name}") as store:
            run = Recovery(capture, store, COARSE, Progress(), layout)
            return run.albedo_under(run.shading().irradiance, run.emitters).rho, run.surface().atlas


@pytest.fixture(scope="module")
def same(tmp_path_factory) -> Same:
    return Same(tmp_path_factory.mktemp("same"))


def test_polycams_own_mesh_is_moved_to_its_cameras(tmp_path):
    cases.polycam(tmp_path)
    told = read_capture(tmp_path).mesh  # a PLY of the same coordinates
    corners = read_ply(tmp_path / "mesh.ply").vertices
    (tmp_path / "mesh.ply").unlink()
    mesh_files(tmp_path, "raw.glb", corners)
    got = read_capture(tmp_path, READING)
    box = [(mesh.vertices.min(0), mesh.vertices.max(0)) for mesh in (got.mesh, told)]
    np.testing.assert_allclose(*box, atol=1e-5)


@pytest.mark.slow
@pytest.mark.once
@pytest.mark.parametrize("name", WRITERS)
def test_the_living_room_in_another_layout(same, tmp_path, name):
    root = tmp_path / "capture"
    root.mkdir()
    WRITERS[name](same.capture, root, same.names)
    got = read_capture(root, READING)
    assert got.format == name and len(got.frames) == len(same.capture.frames)
    for one, other in zip(got.frames, same.capture.frames):
        np.testing.assert_allclose(one.camera.camera_to_world, other.camera.camera_to_world, atol=1e-6)
        for what in ("width", "height", "fx", "fy", "cx", "cy"):
            assert getattr(one.camera, what) == pytest.approx(getattr(other.camera, what), rel=1e-6)
    # Objects by name: numbers are given anew where the mesh tells them by their names.
    names = {one.object_id: one.class_name for one in got.instances}
    order = np.lexsort(np.round(got.mesh.vertices[got.mesh.triangles].mean(1), 4).T)
    wanted = np.lexsort(np.round(same.centre, 4).T)
    told = [names[i] for i in got.mesh.object_id[order].tolist()]
    known = [same.names[i] for i in same.capture.mesh.object_id[wanted].tolist()]
    assert np.mean([a == b for a, b in zip(told, known, strict=True)]) > 0.999
    one, other = (read_pixels(capture.frames[0]) for capture in (got, same.capture))
    np.testing.assert_allclose(one.radiance, other.radiance, rtol=1e-6)
    if name != "fipt":
        return  # the same poses, mesh and pictures: the same albedo
    # Blender's importer lists triangles in the order of their objects; in the order of before the atlas is the same.
    place = np.empty(len(order), int)
    place[wanted] = order
    by_name = {one.class_name: one.object_id for one in same.capture.instances}
    ids = np.array([by_name[names[i]] for i in got.mesh.object_id[place].tolist()], np.int32)
    mesh = replace(got.mesh, triangles=got.mesh.triangles[place], object_id=ids)
    got = replace(got, mesh=mesh, instances=same.capture.instances)
    albedo, elements = same.recovered(got, name)
    assert len(elements) == len(same.elements)
    assert np.abs(albedo - same.albedo).mean() < 1e-3


@pytest.mark.slow
def test_a_replica_room_becomes_a_scene(tmp_path):
    room = make_room(lit_box(lamps=(((0.3, 0.7), (0.3, 0.7)),)), 0.05)
    made = ReplicaOnDisk(tmp_path / "room", room, radiosity(room, ALBEDO, {6: LAMP}), edge=0.4)
    settings = Settings(texel_size=0.1, shading_rays=32, emitter_rays=8)
    report = run(made.root, tmp_path / "result", settings, Progress())
    assert report["figures"]["frames"] == 0 and report["figures"]["lit_from"] == "textures on the mesh"
    assert not any("poses" in warning for warning in report["warnings"])
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "result/scene.blend"))
    scene = bpy.context.scene
    assert scene.camera is not None and scene.camera.name == "overview"
    assert {o["object_id"] for o in scene.objects if o.type == "MESH"} == set(range(7))
