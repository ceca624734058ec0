"""The scene's camera as a frame's: reprojection, size, picture behind."""

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from bpy_extras.object_utils import world_to_camera_view  # noqa: E402
from mathutils import Vector  # noqa: E402

from addon.bridge.data.cameras import make_cameras  # noqa: E402
from addon.bridge.data.images import image_array  # noqa: E402
from addon.bridge.relight.match_frame import current, match_frame  # noqa: E402
from addon.core.io.exr import write_exr  # noqa: E402
from addon.core.scene.model import Camera, Frame  # noqa: E402


@pytest.fixture
def frames(tmp_path):
    """Two frames with different sizes, pixel shapes and principal points."""
    made = []
    for k, (width, height, fx, fy, cx, cy) in enumerate([(64, 48, 60, 60, 32, 24), (90, 40, 55, 70, 41.3, 22.9)]):
        pose = np.eye(4)
        pose[:3, :3] = np.linalg.qr(np.random.default_rng(k).normal(size=(3, 3)))[0]
        pose[:3, 0] *= np.sign(np.linalg.det(pose[:3, :3]))
        pose[:3, 3] = (k, 2, 1)
        path = tmp_path / "images" / f"frame {k}.exr"
        path.parent.mkdir(exist_ok=True)
        write_exr(path, np.full((height, width, 3), 0.25 + k, np.float32))
        made.append(Frame(f"frame {k}", path, Camera(width, height, fx, fy, cx, cy, pose), exposure=1.0 + k))
    return made


@pytest.mark.parametrize("index", [0, 1])
def test_it_reprojects_to_a_thousandth_of_a_pixel(scene, frames, index):
    make_cameras(frames, scene.collection)
    match_frame(scene, index, size=True)
    camera = frames[index].camera
    assert (scene.render.resolution_x, scene.render.resolution_y) == (camera.width, camera.height)
    local = np.random.default_rng(5).uniform((-1, -1, -5), (1, 1, -2), (50, 3))
    world = local @ camera.camera_to_world[:3, :3].T + camera.centre
    expected, _ = camera.project(world)
    bpy.context.view_layer.update()
    found = np.array([world_to_camera_view(scene, scene.camera, Vector(p))[:2] for p in world])
    found = np.stack([found[:, 0] * camera.width, (1 - found[:, 1]) * camera.height], -1)
    assert np.abs(found - expected).max() < 1e-3


def test_the_frame_stands_behind_as_bright_as_the_scene(scene, frames):
    make_cameras(frames, scene.collection)
    assert match_frame(scene, 0, alpha=0.6, front=True, size=True) == "" and current(scene) == 0
    (shown,) = scene.camera.data.background_images
    assert scene.camera.data.show_background_images and shown.image.size[:] == (64, 48)
    assert shown.image.colorspace_settings.name == "Linear Rec.709" and shown.image.use_view_as_render
    assert shown.alpha == pytest.approx(0.6) and shown.display_depth == "FRONT" and shown.frame_method == "STRETCH"
    match_frame(scene, 0, background=False)
    assert not scene.camera.data.show_background_images
    assert "2 times as bright" in match_frame(scene, 7) and current(scene) == 1


def test_a_picture_that_moved_is_found_in_the_captures_folder(scene, frames, tmp_path):
    make_cameras(frames, scene.collection)
    (tmp_path / "images").rename(tmp_path / "elsewhere")
    assert "not where the capture had it" in match_frame(scene, 0)
    (tmp_path / "moved").mkdir()
    (tmp_path / "elsewhere").rename(tmp_path / "moved" / "images")
    assert match_frame(scene, 0, capture_folder=str(tmp_path / "moved"), size=True) == ""
    assert len(scene.camera.data.background_images) == 1


def test_a_turned_picture_is_shown_turned(scene, tmp_path):
    image = pytest.importorskip("PIL.Image")
    codes = np.random.default_rng(0).integers(0, 256, (6, 8, 3), np.uint8)
    exif = image.Exif()
    exif[0x112] = 6
    image.fromarray(codes).save(tmp_path / "a.png", exif=exif)
    camera = Camera(6, 8, 6, 6, 3, 4, np.eye(4))
    make_cameras([Frame("a", tmp_path / "a.png", camera, turned=True)], scene.collection)
    assert match_frame(scene, 0, size=True) == ""
    shown = scene.camera.data.background_images[0].image
    assert shown.size[:] == (6, 8) and shown.packed_file
    np.testing.assert_allclose(image_array(shown)[::-1, :, :3], np.rot90(codes, -1) / 255, atol=1e-3)


def test_without_cameras_it_is_told(scene):
    assert "no camera of a capture" in match_frame(scene, 0) and current(scene) == -1
