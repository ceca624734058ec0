"""Blender's cameras project as the core's do."""

import numpy as np
import pytest

from addon.core.capture.model import Camera, Frame

bpy = pytest.importorskip("bpy")

from bpy_extras.object_utils import world_to_camera_view  # noqa: E402
from mathutils import Vector  # noqa: E402

from addon.bridge.cameras import differing, make_cameras, use_camera  # noqa: E402

POSE = np.array([[0.36, 0.48, -0.8, 1.5], [-0.8, 0.6, 0.0, -0.7], [0.48, 0.64, 0.6, 2.0], [0, 0, 0, 1.0]])
CAMERAS = {
    "plain": Camera(640, 480, 500, 500, 320, 240, POSE),
    "shifted": Camera(640, 480, 500, 500, 290.3, 261.7, POSE),
    "portrait": Camera(480, 640, 700, 700, 250.5, 300.25, POSE),
    "tall pixels": Camera(640, 480, 520, 430, 333.0, 222.0, POSE),
    "wide pixels": Camera(640, 480, 430, 520, 333.0, 222.0, POSE),
    "portrait, tall pixels": Camera(480, 640, 520, 430, 261.0, 299.0, POSE),
}


@pytest.mark.parametrize("name", CAMERAS)
def test_points_project_alike(scene, tmp_path, name):
    camera = CAMERAS[name]
    thing = make_cameras([Frame(name, tmp_path, camera)], scene.collection)[0]
    use_camera(scene, thing)
    bpy.context.view_layer.update()
    rng = np.random.default_rng(0)
    local = np.concatenate([rng.uniform(-0.6, 0.6, (50, 2)), np.full((50, 1), -1)], 1) * rng.uniform(1, 6, (50, 1))
    points = (local @ POSE[:3, :3].T + POSE[:3, 3]).astype(np.float32)
    expected, depth = camera.project(points.astype(np.float64))
    view = np.array([world_to_camera_view(scene, thing, Vector(p)) for p in points.tolist()])
    got = np.stack([view[:, 0] * camera.width, (1 - view[:, 1]) * camera.height], -1)
    print(f"{name}: {np.abs(got - expected).max():.2e} px")
    np.testing.assert_allclose(got, expected, atol=1e-3)
    np.testing.assert_allclose(view[:, 2], depth, rtol=1e-5)


@pytest.mark.parametrize("name", ["shifted", "tall pixels", "portrait, tall pixels"])
def test_cycles_renders_a_point_where_it_projects(scene, shoot, tmp_path, name):
    big = CAMERAS[name]
    camera = Camera(big.width // 10, big.height // 10, big.fx / 10, big.fy / 10, big.cx / 10, big.cy / 10, POSE)
    point = POSE[:3, :3] @ [0.5, 0.35, -3.0] + POSE[:3, 3]
    bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=3, radius=0.08, location=point)
    scene.render.film_transparent = True
    use_camera(scene, make_cameras([Frame(name, tmp_path, camera)], scene.collection)[0])
    alpha = shoot(camera.width, camera.height, 64)[..., 3].ravel()
    got = camera.pixel_centres().T @ alpha / alpha.sum()
    np.testing.assert_allclose(got, camera.project(point[None])[0][0], atol=0.1)


def test_names_sizes_and_properties(scene, tmp_path):
    things = make_cameras([Frame(f"f{i}", tmp_path, CAMERAS["tall pixels"]) for i in range(3)], scene.collection)
    assert [t.name for t in things] == ["f0", "f1", "f2"]
    use_camera(scene, things[1])
    render = scene.render
    assert scene.camera == things[1] and (render.resolution_x, render.resolution_y) == (640, 480)
    assert (things[1]["width"], things[1]["height"]) == (640, 480)
    assert render.pixel_aspect_y / render.pixel_aspect_x == pytest.approx(520 / 430, rel=1e-6)


def test_differing_sizes_are_told(tmp_path):
    frames = [Frame(n, tmp_path, c) for n, c in CAMERAS.items()]
    assert differing(frames[:2]) == ""
    assert "5 different" in differing(frames)
