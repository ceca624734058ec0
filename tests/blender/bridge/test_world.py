"""A bright patch of the environment image appears in the direction that docs/architecture.md states."""

import numpy as np
import pytest

from addon.core.errors import BadInputError
from addon.core.io.exr import write_exr
from addon.core.light.environment import Environment
from addon.core.light.sun import Sun, insert_sun
from addon.core.scene.model import Camera, Frame

bpy = pytest.importorskip("bpy")

from addon.bridge.data.cameras import make_cameras, use_camera  # noqa: E402
from tests.blender.conftest import set_world  # noqa: E402


def looking(direction):
    """A 64 x 48 camera at the origin, 90 degrees wide, that looks along `direction`, twisted a little."""
    back = -np.asarray(direction, float) / np.linalg.norm(direction)
    right = np.cross([0.2, 0.1, 1.0], back)
    right /= np.linalg.norm(right)
    pose = np.eye(4)
    pose[:3, :3] = np.stack([right, np.cross(back, right), back], -1)
    return Camera(64, 48, 32, 32, 30, 22, pose)


@pytest.mark.slow
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


@pytest.mark.slow
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


@pytest.mark.slow
@pytest.mark.parametrize("rows", [64, 512])
def test_a_sun_lights_a_plane_and_throws_its_shadow(scene, shoot, look, tmp_path, rows):
    """A white floor under the written sun and a dim sky: E / pi in the light, the sky alone under a board."""
    direction = np.array([0.48, -0.3, 0.7]) / np.linalg.norm([0.48, -0.3, 0.7])
    sun = Sun(np.float32(direction), np.float32([12, 9, 6]))
    sky = Environment(np.full((rows, 2 * rows, 3), 0.1, np.float32), np.ones((rows, 2 * rows), np.int32))
    write_exr(tmp_path / "environment.exr", insert_sun(sky, sun)[::-1])
    set_world(scene, tmp_path / "environment.exr")
    material = bpy.data.materials.new("white")
    if material.node_tree is None:
        material.use_nodes = True
    nodes = material.node_tree.nodes
    nodes.clear()
    white, output = nodes.new("ShaderNodeBsdfDiffuse"), nodes.new("ShaderNodeOutputMaterial")
    white.inputs["Color"].default_value = (1, 1, 1, 1)
    material.node_tree.links.new(white.outputs[0], output.inputs["Surface"])
    board = 1.5 * direction
    for name, middle, half in (("floor", (0, 0, 0), 1.0), ("board", board, 0.1)):
        corners = [np.add(middle, (half * x, half * y, 0)).tolist() for x, y in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
        mesh = bpy.data.meshes.new(name)
        mesh.from_pydata(corners, [], [(0, 1, 2, 3)])
        mesh.materials.append(material)
        scene.collection.objects.link(bpy.data.objects.new(name, mesh))
    scene.cycles.max_bounces = 0
    look((0, 0, 1.0), width=1.0)  # below the board, straight down
    got = shoot(40, 40, 128)[..., :3]
    lit = np.median(got[2:8].reshape(-1, 3), 0)
    np.testing.assert_allclose(lit, 0.1 + sun.irradiance * direction[2] / np.pi, rtol=0.03)
    np.testing.assert_allclose(got[18:22, 18:22].mean((0, 1)), 0.1, atol=0.02)
