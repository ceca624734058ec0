"""Scans that are off: a room whose truth is known, perturbed by the script, loses little."""

from __future__ import annotations

import importlib.util
import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from addon.core.io.exr import read_exr
from addon.core.io.read import read_capture
from addon.core.passes.pose_refinement import poses as poses_found
from addon.core.passes.pose_refinement.poses import POSES
from addon.core.pipeline.recover import Recovery
from addon.core.progress import Progress
from addon.core.results.store import Store
from addon.core.scene.mesh_noise import noise_of
from addon.core.scene.weld import point_normals, welded
from tests.core.on_disk import ALBEDO, CHEAP, LAMP, OnDisk
from tests.core.rooms import cut_in_four, make_room, patches, quad, split

SCRIPT = Path(__file__).resolve().parents[3] / "scripts" / "perturb_capture.py"
pytestmark = pytest.mark.usefixtures("few_samples")
spec = importlib.util.spec_from_file_location("perturb_capture", SCRIPT)
perturb = importlib.util.module_from_spec(spec)
spec.loader.exec_module(perturb)


def perturbed(disk: OnDisk, out: Path, *switches: str) -> Path:
    assert perturb.main([str(disk.root), str(out), *switches]) == 0
    return out


def turned(a: np.ndarray, b: np.ndarray) -> float:
    """Degrees between two poses."""
    return float(np.degrees(np.arccos(np.clip((np.trace(a[:3, :3].T @ b[:3, :3]) - 1) / 2, -1, 1))))


def test_the_script_perturbs_by_what_it_says(disk, tmp_path):
    true, off = read_capture(disk.root), read_capture(perturbed(disk, tmp_path / "all"))
    poses = [(a.camera.camera_to_world, b.camera.camera_to_world) for a, b in zip(true.frames, off.frames)]
    assert np.sqrt(np.mean([turned(a, b) ** 2 for a, b in poses])) == pytest.approx(0.2, rel=0.3)
    moved = [np.sum((a[:3, 3] - b[:3, 3]) ** 2) for a, b in poses]
    assert np.sqrt(np.mean(moved)) == pytest.approx(0.005, rel=0.3)
    assert (off.mesh.object_id == true.mesh.object_id).all()
    way = np.linalg.norm(off.mesh.vertices - true.mesh.vertices, axis=1)
    assert 0.002 < np.sqrt(np.mean(way**2)) < 0.01
    exposure = np.array([frame.exposure for frame in off.frames])
    assert 0.5 <= exposure.min() < 0.65 and 1.5 < exposure.max() <= 2
    assert all(frame.saturation == pytest.approx(4, rel=2e-3) for frame in off.frames)
    for a, b in zip(true.frames, off.frames):
        before, after = read_exr(a.path).rgb, read_exr(b.path).rgb
        assert after.max() <= 4
        below = (after < 3.9) & (before > 0)
        assert np.std(after[below] / b.exposure / before[below] - 1) == pytest.approx(0.02, rel=0.15)


def test_one_perturbation_alone(disk, tmp_path):
    """Each is the same alone as among all; what is not asked for stays."""
    everything, alone = perturbed(disk, tmp_path / "all"), perturbed(disk, tmp_path / "mesh", "--mesh", "5")
    assert (everything / "mesh.ply").read_bytes() == (alone / "mesh.ply").read_bytes()
    assert json.loads((alone / "transforms.json").read_text()) == json.loads(
        (disk.root / "transforms.json").read_text()
    )
    assert np.allclose(read_exr(alone / "images/000.exr").rgb, read_exr(disk.path(0)).rgb, rtol=1e-3)
    told = read_capture(perturbed(disk, tmp_path / "told", "--clip", "4", "--tell"))
    assert [frame.saturation for frame in told.frames] == [4.0] * disk.count and not told.warnings


def test_a_perturbed_room_is_recovered(disk, tmp_path):
    """The lamp is burnt out in every frame; nothing but its light tells how bright it is."""
    capture = read_capture(perturbed(disk, tmp_path / "capture"))
    found = disk.run(tmp_path / "result", capture=capture)
    for object_id, rho in ALBEDO.items():
        assert np.abs(np.median(found.off(object_id, rho), 0)).max() < 0.15, object_id
        off = found.off(object_id, rho)
        assert np.sqrt(np.mean(off**2)) < 0.2, object_id
    lamp = next(one for one in found.shading.lamps if one.object_id == 6)
    assert np.allclose(lamp.radiance, LAMP, rtol=0.2) and lamp.clipped and not lamp.seen
    assert any("clip at 4" in warning for warning in found.report["warnings"])


def apart(mesh, size: int) -> np.ndarray:
    """An atlas with a cell for each triangle."""
    side = int(np.ceil(np.sqrt(len(mesh.triangles))))
    cell = np.stack(np.divmod(np.arange(len(mesh.triangles)), side), 1)[:, None]
    return ((cell + np.array([[0.1, 0.1], [0.9, 0.1], [0.1, 0.9]])) / side).astype(np.float32)


def test_noise_is_taken_out_of_the_mesh_and_stored(disk, tmp_path):
    capture = read_capture(disk.root)
    fine = cut_in_four(capture.mesh, 4)
    points, faces, place = welded(fine)
    offset = np.random.default_rng(1).normal(size=len(points))
    moved = points + (0.005 * offset)[:, None] * point_normals(points, faces)
    far = np.array([4e5, 5e6, 300.0])
    noisy = replace(capture, mesh=replace(fine, vertices=moved[place]))

    def surface(what, where, settings=CHEAP):
        with Store(tmp_path / where) as store:
            run = Recovery(what, store, settings, Progress(), apart)
            return run.surface(), run.room_mesh(), run.report()

    found, mesh, report = surface(noisy, "noisy")
    assert found.noise == pytest.approx(0.005, rel=0.4) == report["figures"]["mesh_noise_metres"]
    assert any("The mesh has noise of" in warning for warning in report["warnings"])
    off = [np.sqrt(np.mean((v - fine.vertices) ** 2)) for v in (noisy.mesh.vertices, mesh.vertices)]
    assert off[1] < 0.7 * off[0]
    again, same, report = surface(noisy, "noisy")
    assert report["stages"]["surface"]["stored"] and again.noise == found.noise
    assert np.array_equal(same.vertices, mesh.vertices) and np.array_equal(again.atlas.normal, found.atlas.normal)
    # Switched off, or with nothing to take out, every vertex is the capture's own, far from the origin, too.
    assert np.array_equal(surface(noisy, "off", replace(CHEAP, denoise_mesh=False))[1].vertices, noisy.mesh.vertices)
    frames = tuple(
        replace(
            f,
            camera=replace(f.camera, camera_to_world=f.camera.camera_to_world + np.pad(far[:, None], ((0, 1), (3, 0)))),
        )
        for f in capture.frames
    )
    distant = replace(capture, mesh=replace(fine, vertices=fine.vertices + far), frames=frames)
    _, mesh, report = surface(distant, "far")
    assert np.array_equal(mesh.vertices, distant.mesh.vertices) and report["figures"]["mesh_noise_metres"] == 0


def test_noise_of_a_mesh_is_measured_and_curvature_is_none():
    rng = np.random.default_rng(0)
    room = make_room(split(quad((0, 0, 0), (2, 0, 0), (0, 2, 0), 0), 40), 0.05)
    mesh = room.mesh
    _, place = np.unique(np.round(mesh.vertices, 6), axis=0, return_inverse=True)
    bent = mesh.vertices + 0.2 * np.sin(mesh.vertices[:, :1]) * np.array([0, 0, 1.0])
    height = rng.normal(size=place.max() + 1)[place.ravel()][:, None] * np.array([0, 0, 1.0])

    def with_vertices(vertices):
        return type(mesh)(vertices, mesh.triangles, mesh.object_id)

    assert noise_of(with_vertices(bent)) < 1e-4
    noisy = with_vertices(bent + 0.004 * height)
    assert noise_of(noisy) == pytest.approx(0.004, rel=0.25)


@pytest.mark.slow
def test_poses_are_put_right_stored_and_told(tmp_path, monkeypatch):
    monkeypatch.setattr(poses_found, "POSES", replace(POSES, least_shift=0.25))  # the pictures are tiny
    far = np.array([4e5, 5e5, 300.0])
    disk = OnDisk(tmp_path / "true", light=lambda room: patches(room, 0.7), shift=far)
    off = read_capture(perturbed(disk, tmp_path / "off", "--poses", "20", "3"))
    true = np.stack([frame.camera.camera_to_world for frame in read_capture(disk.root).frames])
    read = np.stack([frame.camera.camera_to_world for frame in off.frames])

    def poses(settings=CHEAP):
        with Store(tmp_path / "result") as store:
            run = Recovery(off, store, settings, Progress(), disk.unwrap)
            return run.room_poses(), run.frames, run.report()

    found, frames, report = poses()
    angle = [np.mean([turned(a, b) for a, b in zip(true, some)]) for some in (read, found.camera_to_world)]
    assert angle[1] < 0.95 * angle[0]
    assert report["figures"]["poses_refined"] == found.moved.sum() > 4
    assert report["figures"]["pose_shift_pixels"] > 0.3
    assert any("beside what all of them show" in warning for warning in report["warnings"])
    # In the capture's coordinates, and around the origin where the stages work.
    way = found.camera_to_world[:, :3, 3] - read[:, :3, 3]
    assert 0 < np.linalg.norm(way, axis=1).max() < 0.1
    near = np.stack([frame.camera.camera_to_world for frame in frames])
    assert np.ptp(found.camera_to_world[:, :3, 3] - near[:, :3, 3], axis=0).max() < 1e-6
    again, _, report = poses()
    assert report["stages"]["lit_diffuse"]["stored"]
    assert np.array_equal(again.camera_to_world, found.camera_to_world)
    as_read, _, report = poses(replace(CHEAP, refine_poses=False))
    assert np.array_equal(as_read.camera_to_world[:, :3, :3], read[:, :3, :3]) and not as_read.moved.any()
    assert "pose_shift_pixels" not in report["figures"]
