"""A bright patch of the environment image appears in the direction that docs/architecture.md states."""

import numpy as np
import pytest

from addon.core.capture.exr import write_exr
from addon.core.capture.model import Camera, Frame
from addon.core.errors import BadInputError

bpy = pytest.importorskip("bpy")

from addon.bridge.cameras import make_cameras, use_camera  # noqa: E402
from addon.bridge.world import set_world  # noqa: E402


def looking(direction):
    """A 64 x 48 camera at the origin, 90 degrees wide, that looks along `direction`, twisted a little."""
    back = -np.asarray(direction, float) / np.linalg.norm(direction)
    right = np.cross([0.2, 0.1, 1.0], back)
    right /= np.linalg.norm(right)
    pose = np.eye(4)
    pose[:3, :3] = np.stack([right, np.cross(back, right), back], -1)
    return Camera(64, 48, 32, 32, 30, 22, pose)


@pytest.mark.parametrize("direction", [(1, 0.3, 0.2), (-0.4, 1, -0.5), (-1, -0.2, 0.6), (0.3, -0.5, -1)])
def test_a_patch_appears_in_its_direction(scene, shoot, tmp_path, direction):
    x, y, z = np.array(direction) / np.linalg.norm(direction)
    row, column = int((0.5 + np.arcsin(z) / np.pi) * 64), int((0.5 - np.arctan2(y, x) / (2 * np.pi)) * 128)
    picture = np.full((64, 128, 3), 0.01, np.float32)
    picture[row, column] = 5, 3, 1
    write_exr(tmp_path / "environment.exr", picture[::-1])
    set_world(scene, tmp_path / "environment.exr")
    longitude, latitude = (0.5 - (column + 0.5) / 128) * 2 * np.pi, ((row + 0.5) / 64 - 0.5) * np.pi
    exact = np.array([[np.cos(latitude) * np.cos(longitude), np.cos(latitude) * np.sin(longitude), np.sin(latitude)]])
    camera = looking((x + 0.3, y - 0.2, z + 0.25))
    use_camera(scene, make_cameras([Frame("eye", tmp_path, camera)], scene.collection)[0])
    got = shoot(64, 48, 64)
    weight = np.maximum(got[..., 0] - 0.02, 0).ravel()
    assert weight.sum() > 5
    np.testing.assert_allclose(camera.pixel_centres().T @ weight / weight.sum(), camera.project(exact)[0][0], atol=0.2)
    brightest = got.reshape(-1, 4)[weight.argmax(), :3]
    np.testing.assert_allclose(brightest / brightest[0], [1, 0.6, 0.2], atol=0.01)


def test_a_constant_world_has_its_radiance(scene, shoot, look, tmp_path):
    write_exr(tmp_path / "environment.exr", np.broadcast_to(np.float32([0.5, 20.0, 0.25]), (8, 16, 3)))
    set_world(scene, tmp_path / "environment.exr")
    look((0, 0, 0))
    np.testing.assert_allclose(shoot(4, 4, 1)[0, 0, :3], [0.5, 20.0, 0.25], rtol=1e-3)


def test_no_environment_is_black(scene, shoot, look):
    set_world(scene, None)
    look((0, 0, 0))
    assert shoot(4, 4, 1)[..., :3].max() == 0


def test_a_missing_file_is_told(scene, tmp_path):
    with pytest.raises(BadInputError, match="environment.exr can't be opened"):
        set_world(scene, tmp_path / "environment.exr")
    assert scene.world is None
