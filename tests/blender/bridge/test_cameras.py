"""Blender's cameras project as the core's do."""

import numpy as np
import pytest

from addon.core.scene.lenses import Cropped, EnhancedUnified, Equirectangular
from addon.core.scene.lenses_colmap import polynomial
from addon.core.scene.model import Camera, Frame, Mesh

bpy = pytest.importorskip("bpy")

from bpy_extras.object_utils import world_to_camera_view  # noqa: E402
from mathutils import Vector  # noqa: E402

from addon.bridge.data.cameras import best_view, lens_warning, make_cameras, max_pixel_error, size_warning, use_camera  # noqa: E402

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
    assert size_warning(frames[:2]) == ""
    assert "5 different" in size_warning(frames)


LENSES = {
    "panorama": (Equirectangular(), 160, 80),
    "fisheye of 200 degrees": (polynomial("FISHEYE", fisheye=True), 96, 80),
    "bent fisheye": (polynomial("OPENCV_FISHEYE", fisheye=True, numerator=(-0.02, 0.004, 0.0, 0.0)), 96, 80),
    "cropped": (Cropped(polynomial("OPENCV_FISHEYE", fisheye=True, numerator=(0.03, 0.0, 0.0, 0.0)), 1.6, 1.6), 96, 80),
    "unified": (EnhancedUnified(0.7, 1.0), 96, 80),
}


def through(name):
    lens, width, height = LENSES[name]
    if name == "panorama":
        return Camera(width, height, width / 2 / np.pi, height / np.pi, width / 2, height / 2, POSE, lens)
    return Camera(width, height, 30.0, 33.0, 44.7, 42.2, POSE, lens)


@pytest.mark.slow
@pytest.mark.parametrize("place", [(0.5, 0.35, -1.0), (-0.9, -0.4, -0.3), (0.2, -0.9, -0.6), (-0.7, 0.3, 0.05)])
@pytest.mark.parametrize("name", LENSES)
def test_cycles_renders_through_lenses(scene, shoot, tmp_path, name, place):
    camera = through(name)
    off = max_pixel_error(camera)
    assert off < (0.1 if name != "unified" else 1.5)  # its angle is no polynomial
    assert bool(lens_warning([Frame(name, tmp_path, camera)])) == (name == "unified")
    point = POSE[:3, :3] @ np.multiply(place, 3) + POSE[:3, 3]
    pixel, depth = camera.project(point[None])
    if depth[0] < 0 or not ((pixel > 5) & (pixel < (camera.width - 5, camera.height - 5))).all():
        pytest.skip("not in this picture")
    bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=3, radius=0.12, location=point)
    scene.render.film_transparent = True
    use_camera(scene, make_cameras([Frame(name, tmp_path, camera)], scene.collection)[0])
    alpha = shoot(camera.width, camera.height, 64)[..., 3].ravel()
    if isinstance(camera.lens, Cropped):  # black there, and opaque
        centres = (camera.pixel_centres() - (camera.cx, camera.cy)) / (camera.fx, camera.fy)
        alpha = alpha * (np.hypot(*centres.T) < camera.lens.across - 0.05)
    alpha = alpha * camera.rays(camera.pixel_centres())[1]  # beyond the lens's circle Blender may show anything
    assert alpha.sum() > 1
    got = camera.pixel_centres().T @ alpha / alpha.sum()
    np.testing.assert_allclose(got, pixel[0], atol=0.15 + off)


def test_partial_panoramas(scene, shoot, tmp_path):
    camera = Camera(160, 80, 60.0, 55.0, 70.0, 30.0, POSE, Equirectangular())
    point = POSE[:3, :3] @ [1.5, 0.35, -1.0] + POSE[:3, 3]
    bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=3, radius=0.06, location=point)
    scene.render.film_transparent = True
    use_camera(scene, make_cameras([Frame("part", tmp_path, camera)], scene.collection)[0])
    alpha = shoot(camera.width, camera.height, 64)[..., 3].ravel()
    got = camera.pixel_centres().T @ alpha / alpha.sum()
    np.testing.assert_allclose(got, camera.project(point[None])[0][0], atol=0.15)


def test_lenses_that_blender_lacks_are_told(scene, tmp_path):
    lens = polynomial("SIMPLE_RADIAL", numerator=(-0.1,))
    camera = Camera(640, 480, 500, 500, 320, 240, POSE, lens)
    # In the corner r^2 = 0.64 and r = 0.8 before distortion as Blender shows it: 0.1 * 0.8^3 * 500.
    assert max_pixel_error(camera) == pytest.approx(25.6, abs=0.01)
    sentence = lens_warning([Frame("a", tmp_path, camera), Frame("b", tmp_path, CAMERAS["plain"])])
    assert "SIMPLE_RADIAL" in sentence and "25.6 pixels" in sentence
    thing = make_cameras([Frame("a", tmp_path, camera)], scene.collection)[0]
    assert thing.data.type == "PERSP" and thing.data.lens == pytest.approx(500 * 36 / 640)
    assert lens_warning([Frame("b", tmp_path, CAMERAS["plain"])]) == ""
    prism = polynomial("THIN_PRISM_FISHEYE", fisheye=True, tangential=(0.01, 0.0))
    bent = Camera(640, 480, 250, 250, 320, 240, POSE, prism)
    assert 5 < max_pixel_error(bent) < 100 and "THIN_PRISM" in lens_warning([Frame("c", tmp_path, bent)])
    assert make_cameras([Frame("c", tmp_path, bent)], scene.collection)[0].data.type == "PANO"


def test_a_crop_is_black_in_blender(scene, shoot, tmp_path):
    camera = through("cropped")
    scene.world = bpy.data.worlds.new("grey")
    scene.world.color = 0.5, 0.5, 0.5
    use_camera(scene, make_cameras([Frame("cropped", tmp_path, camera)], scene.collection)[0])
    grey = shoot(camera.width, camera.height, 16)[..., 0]
    y, x = np.mgrid[0.5 : camera.height, 0.5 : camera.width]
    radius = np.hypot((x - camera.cx) / camera.fx, (y - camera.cy) / camera.fy)
    assert (grey[radius < 1.55] > 0).all() and (grey[radius > 1.65] == 0).all()


def test_a_room_is_first_seen_through_the_frame_that_shows_most_objects(tmp_path):
    def looking(along) -> Camera:
        """From the origin along a horizontal direction."""
        back, up = -np.float64(along), np.array([0, 0, 1.0])
        pose = np.eye(4)
        pose[:3, :3] = np.stack([np.cross(up, back), up, back], -1)
        return Camera(64, 48, 50, 50, 32, 24, pose)

    middles = np.array([[0, 5, 0], [1, 5, 0.5], [5, 0, 0], [0, -5, 0], [-1, -5, 0.2], [0.5, -4, 0]])
    corners = np.array([[0.1, 0, 0], [-0.1, 0.1, 0], [0, -0.1, 0]])
    mesh = Mesh(
        (middles[:, None] + corners).reshape(-1, 3),
        np.arange(18, dtype=np.int32).reshape(6, 3),
        np.int32([3, 5, 7, 20, 21, 40]),
    )
    ways = {"one": (1, 0, 0), "two": (0, 1, 0), "three": (0, -1, 0), "three again": (0, -1, 0), "none": (-1, 0, 0)}
    frames = [Frame(name, tmp_path, looking(way)) for name, way in ways.items()]
    assert frames[best_view(frames, mesh)].name == "three"
    assert frames[best_view(frames[:2], mesh)].name == "two"
