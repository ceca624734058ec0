"""Blender's lenses as pixels: the inverse of `addon.bridge.data.cameras`, against Blender's own projection."""

import itertools

import numpy as np
import pytest

from addon.core.errors import BadInputError
from addon.core.io.exr import write_exr
from addon.core.scene.lenses import Cropped, EnhancedUnified, Equirectangular
from addon.core.scene.lenses_colmap import polynomial
from addon.core.scene.model import Camera, Frame

bpy = pytest.importorskip("bpy")

from mathutils import Vector  # noqa: E402

from addon.bridge.data.cameras import make_cameras  # noqa: E402
from addon.bridge.own_scene.cameras import ANIMATION, camera_of, cameras_with_pictures, frame_size, pixel_lens, views  # noqa: E402

POSE = np.array([[0.36, 0.48, -0.8, 1.5], [-0.8, 0.6, 0.0, -0.7], [0.48, 0.64, 0.6, 2.0], [0, 0, 0, 1.0]])
ROUND = {
    "shifted": Camera(640, 480, 500, 500, 290.3, 261.7, POSE),
    "portrait": Camera(480, 640, 700, 700, 250.5, 300.25, POSE),
    "tall pixels": Camera(640, 480, 520, 430, 333.0, 222.0, POSE),
    "large": Camera(6000, 4000, 4321, 4300, 3011.5, 1987.25, POSE),
}


def made(scene, **values):
    thing = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
    scene.collection.objects.link(thing)
    for name, value in values.items():
        setattr(thing.data, name, value)
    return thing


@pytest.mark.parametrize("name", ROUND)
def test_there_and_back(scene, tmp_path, name):
    wanted = ROUND[name]
    [thing] = make_cameras([Frame(name, tmp_path, wanted)], scene.collection)
    bpy.context.view_layer.update()
    found = camera_of(thing, (wanted.width, wanted.height), frame_size(scene, thing))
    for key in ("fx", "fy", "cx", "cy"):
        assert getattr(found, key) == pytest.approx(getattr(wanted, key), abs=1e-3), key
    np.testing.assert_allclose(found.camera_to_world, POSE, atol=1e-6)


@pytest.mark.parametrize("lens", [
    polynomial("RADIAL", numerator=(-0.1, 0.01)), Equirectangular(), EnhancedUnified(0.7, 1.1),
    Cropped(polynomial("OPENCV_FISHEYE", fisheye=True, numerator=(0.02, 0.0)), 1.3, 1.4),
])  # fmt: skip
def test_lenses_there_and_back(scene, tmp_path, lens):
    wanted = Camera(640, 480, 300.5, 310.0, 322.0, 235.0, POSE, lens)
    [thing] = make_cameras([Frame("bent", tmp_path, wanted)], scene.collection)
    bpy.context.view_layer.update()
    found = camera_of(thing, (640, 480), frame_size(scene, thing))
    half = camera_of(thing, (320, 240), frame_size(scene, thing))
    for one, scale in ((found, 1), (half, 0.5)):
        assert one.lens == lens
        got = [one.fx, one.fy, one.cx, one.cy]
        np.testing.assert_allclose(got, np.multiply([300.5, 310, 322, 235], scale), rtol=1e-6)
    if thing.data.type == "PERSP":
        thing.data.lens *= 2  # another lens since: the distortion no longer fits
        assert camera_of(thing, (640, 480), frame_size(scene, thing)).lens is None


@pytest.mark.parametrize(
    "fit, size, aspect",
    list(itertools.product(("AUTO", "HORIZONTAL", "VERTICAL"), ((640, 480), (480, 640)), ((1, 1), (1, 1.5), (2, 1)))),
)
def test_as_blender_projects(scene, fit, size, aspect):
    thing = made(scene, sensor_fit=fit, sensor_width=30, sensor_height=20, lens=27.5, shift_x=0.11, shift_y=-0.07)
    render = scene.render
    render.resolution_x, render.resolution_y = size
    render.pixel_aspect_x, render.pixel_aspect_y = aspect
    matrix = thing.calc_matrix_camera(
        bpy.context.evaluated_depsgraph_get(), x=size[0], y=size[1], scale_x=aspect[0], scale_y=aspect[1]
    )
    fx, fy, cx, cy = pixel_lens(thing.data, *size, aspect[1] / aspect[0])
    for x, y, z in np.random.default_rng(0).uniform((-1, -1, -5), (1, 1, -2), (20, 3)):
        clip = matrix @ Vector((x, y, z, 1))
        pixel = (clip[0] / clip[3] + 1) / 2 * size[0], (1 - clip[1] / clip[3]) / 2 * size[1]
        assert (cx - fx * x / z, cy + fy * y / z) == pytest.approx(pixel, abs=1e-3)


def test_a_larger_picture_of_the_same_view(scene):
    thing = made(scene, lens=27.5, shift_x=0.11, shift_y=-0.07)
    small, large = camera_of(thing, (64, 48), (64, 48, 1.0)), camera_of(thing, (640, 480), (64, 48, 1.0))
    for key in ("fx", "fy", "cx", "cy"):
        assert getattr(large, key) == pytest.approx(10 * getattr(small, key))


@pytest.mark.parametrize("method, fx, fy", [("STRETCH", 0.5, 1), ("FIT", 1, 1), ("CROP", 0.5, 0.5)])
def test_pictures_of_another_shape(scene, method, fx, fy):
    thing = made(scene)
    own = camera_of(thing, (640, 480), (640, 480, 1.0))
    found = camera_of(thing, (320, 480), (640, 480, 1.0), method)
    assert (found.fx / own.fx, found.fy / own.fy) == pytest.approx((fx, fy))
    assert (found.cx, found.cy) == pytest.approx((160, 240))


def test_scaled_cameras_keep_a_rigid_pose(scene):
    thing = made(scene)
    thing.scale, thing.rotation_euler = (0.3, 0.3, 0.3), (1, 0.5, 2)
    bpy.context.view_layer.update()
    rotation = camera_of(thing, (64, 48), (64, 48, 1.0)).camera_to_world[:3, :3]
    np.testing.assert_allclose(rotation @ rotation.T, np.eye(3), atol=1e-6)


def test_orthographic_is_told(scene):
    with pytest.raises(BadInputError, match="ortho; frames need perspective"):
        camera_of(made(scene, type="ORTHO"), (64, 48), (64, 48, 1.0))


@pytest.fixture
def animated(scene, tmp_path):
    for k in range(7, 12):
        write_exr(tmp_path / f"shot.{k:04d}.exr", np.full((4, 6, 3), k, np.float32))
    thing = made(scene)
    back = thing.data.background_images.new()
    back.image = bpy.data.images.load(str(tmp_path / "shot.0007.exr"))
    back.image.source = "SEQUENCE"
    back.image_user.frame_start, back.image_user.frame_duration, back.image_user.frame_offset = 1, 5, 6
    for frame, x in ((1, 0.0), (5, 4.0)):
        thing.location.x = x
        thing.keyframe_insert("location", frame=frame)
    for strip in thing.animation_data.action.layers[0].strips if hasattr(thing.animation_data.action, "layers") else ():
        for curve in strip.channelbags[0].fcurves:
            for key in curve.keyframe_points:
                key.interpolation = "LINEAR"
    scene.frame_start, scene.frame_end, scene.camera = 1, 5, thing
    scene.render.resolution_x, scene.render.resolution_y = 60, 40
    return thing


def test_an_animation_with_a_sequence(scene, animated, tmp_path):
    problems = []
    found = list(views(scene, bpy.context.evaluated_depsgraph_get(), cameras_with_pictures(scene), problems=problems))
    assert [view.path.name for view in found] == [f"shot.{k:04d}.exr" for k in range(7, 12)] and not problems
    assert [view.name for view in found] == [f"camera_{k:04d}" for k in range(1, 6)]
    np.testing.assert_allclose([view.camera.centre[0] for view in found], range(5), atol=1e-5)
    back = animated.data.background_images[0]
    for view, frame in zip(found, range(1, 6)):  # what Blender itself shows
        scene.frame_set(frame)
        bpy.context.view_layer.update()
        assert back.image.filepath_from_user(image_user=back.image_user).endswith(view.path.name)


def test_frames_beyond_the_sequence_are_told(scene, animated):
    problems = []
    found = list(views(scene, bpy.context.evaluated_depsgraph_get(), [animated], problems, ANIMATION, 4, 7))
    assert len(found) == 2 and problems == [
        "Camera 'camera' has no picture at frame 6.",
        "Camera 'camera' has no picture at frame 7.",
    ]


@pytest.mark.parametrize(
    "change, sentence",
    [
        (lambda thing, back, folder: setattr(back, "scale", 2.0), "is moved, scaled, turned or flipped"),
        (lambda thing, back, folder: setattr(back, "use_flip_x", True), "is moved, scaled, turned or flipped"),
        (lambda thing, back, folder: setattr(back.image, "filepath", str(folder / "photo.jpg")), "is no EXR"),
        (
            lambda thing, back, folder: setattr(back.image, "filepath", str(folder / "gone.exr")),
            "gone.exr' behind camera",
        ),
        (lambda thing, back, folder: setattr(thing.data, "type", "PANO"), "frames need perspective"),
    ],
)
def test_pictures_that_cant_be_used_are_told(scene, tmp_path, change, sentence):
    write_exr(tmp_path / "one.exr", np.ones((4, 6, 3), np.float32))
    thing = made(scene)
    back = thing.data.background_images.new()
    back.image = bpy.data.images.load(str(tmp_path / "one.exr"))
    change(thing, back, tmp_path)
    problems = []
    assert not list(views(scene, bpy.context.evaluated_depsgraph_get(), [thing], problems=problems))
    assert len(problems) == 1 and sentence in problems[0]
