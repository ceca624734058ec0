"""The light from outside: off, stronger, turned, another picture, and back."""

import math

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from addon.bridge.light import outside as outside  # noqa: E402
from addon.core.errors import BadInputError  # noqa: E402
from addon.core.io.exr import write_exr  # noqa: E402
from tests.blender.conftest import set_world  # noqa: E402
from tests.blender.relight.sheets import sheet  # noqa: E402


@pytest.fixture
def towards_x(tmp_path):
    """A picture that is bright around +X only, dim elsewhere: u = 0.5 is its middle column."""
    pixels = np.full((32, 64, 3), 0.01, np.float32)
    pixels[12:20, 30:34] = 8
    write_exr(tmp_path / "x.exr", pixels)
    return tmp_path / "x.exr"


def brightest(scene, shoot):
    """Azimuth in degrees of the brightest of 36 directions on the horizon."""
    data = bpy.data.cameras.new("around")
    data.type, data.panorama_type = "PANO", "EQUIRECTANGULAR"
    scene.camera = bpy.data.objects.new("around", data)
    scene.camera.rotation_euler = (math.pi / 2, 0, 0)  # looks along +Y, so the middle column is azimuth 90
    scene.collection.objects.link(scene.camera)
    picture = shoot(scene, 72, 36, 1).sum(2)
    column = np.average(np.arange(72) + 0.5, weights=picture.max(0) > 4)
    return 90 - (column / 72 - 0.5) * 360, picture


@pytest.mark.slow
@pytest.mark.parametrize("angle", [0, 40, -70])
def test_rotation_turns_it_anticlockwise(scene, shoot, towards_x, angle):
    world = set_world(scene, towards_x)
    outside.set_rotation(world, math.radians(angle))
    assert brightest(scene, shoot)[0] == pytest.approx(angle, abs=3)
    assert outside.rotation(world) == pytest.approx(math.radians(angle))


@pytest.mark.slow
def test_factor_and_off(scene, shoot, towards_x):
    world = set_world(scene, towards_x)
    _, one = brightest(scene, shoot)
    outside.set_factor(world, 2)
    _, two = brightest(scene, shoot)
    assert two.sum() / one.sum() == pytest.approx(2, rel=1e-3)
    outside.set_on(world, False)
    assert brightest_sum(scene, shoot) == 0 and outside.factor(world) == 2
    outside.set_on(world, True)
    assert brightest_sum(scene, shoot) == pytest.approx(two.sum(), rel=1e-3)


def brightest_sum(scene, shoot):
    return shoot(scene, 72, 36, 1).sum()


def state(world):
    tree = world.node_tree
    return (
        sorted(n.bl_idname for n in tree.nodes),
        len(tree.links),
        list(world.keys()),
        next(n for n in tree.nodes if n.type == "BACKGROUND").inputs["Strength"].default_value,
    )


def test_restored_is_exact(scene, towards_x, tmp_path):
    world = set_world(scene, towards_x, 0.7)
    before = state(world)
    outside.set_rotation(world, 1)
    outside.set_factor(world, 3)
    outside.set_on(world, False)
    write_exr(tmp_path / "other.exr", np.ones((4, 8, 3), np.float32))
    outside.use_hdri(scene, tmp_path / "other.exr")
    outside.use_hdri(scene, tmp_path / "other.exr")  # a second one does not take the first for the recovered
    outside.set_rotation(scene.world, 2)
    assert scene.world != world and outside.is_changed(scene) and outside.recovered_world(scene) == world
    outside.restore(scene)
    assert scene.world == world and state(world) == before and not outside.is_changed(scene)


@pytest.mark.slow
def test_a_picture_is_scaled_to_a_mean(scene, shoot, tmp_path):
    write_exr(tmp_path / "grey.exr", np.full((16, 32, 3), 5.0, np.float32))
    outside.use_hdri(scene, tmp_path / "grey.exr", mean=0.5)
    assert brightest_of(scene, shoot) == pytest.approx(0.5, rel=1e-3)


def brightest_of(scene, shoot):
    data = bpy.data.cameras.new("any")
    scene.camera = bpy.data.objects.new("any", data)
    scene.collection.objects.link(scene.camera)
    return shoot(scene, 4, 4, 1).mean()


@pytest.mark.parametrize("content", [None, b"no picture"])
def test_a_bad_picture_is_told_and_changes_nothing(scene, tmp_path, content):
    path = tmp_path / "sky.hdr"
    if content is not None:
        path.write_bytes(content)
    world, images = scene.world, len(bpy.data.images)
    with pytest.raises(BadInputError, match="sky.hdr"):
        outside.use_hdri(scene, path)
    assert scene.world == world and len(bpy.data.images) == images


def test_a_closed_room_is_told_from_an_open_one(scene):
    for name, place, turn in (
        ("floor", (0, 0, 0), (0, 0, 0)),
        ("ceiling", (0, 0, 2), (0, 0, 0)),
        ("a", (1, 0, 1), (0, math.pi / 2, 0)),
        ("b", (-1, 0, 1), (0, math.pi / 2, 0)),
        ("c", (0, 1, 1), (math.pi / 2, 0, 0)),
        ("d", (0, -1, 1), (math.pi / 2, 0, 0)),
    ):
        wall = sheet(scene, name, 2.0, place, turn)
    assert not outside.is_open(scene)
    shader = next(n for n in wall.data.materials[0].node_tree.nodes if n.type == "BSDF_PRINCIPLED")
    shader.inputs["Alpha"].default_value = 0.1  # a pane
    assert outside.is_open(scene)
    shader.inputs["Alpha"].default_value = 0.8
    assert not outside.is_open(scene)
    bpy.data.objects.remove(wall)
    assert outside.is_open(scene)


def test_blenders_own_pictures():
    for path in outside.studio_lights():
        assert path.suffix == ".exr" and path.is_file()
