"""Whole runs over frames of every kind of lens give the albedo that pinholes give; no visible element is dropped."""

import math
from dataclasses import replace

import numpy as np
import pytest

from addon.core.io.exr import write_exr
from addon.core.io.pixels import read_pixels
from addon.core.io.read import read_capture
from addon.core.light.environment import EnvironmentAccumulator
from addon.core.scene.element_groups import ElementGroups
from addon.core.scene.lenses import Cropped, Division, EnhancedUnified, Equirectangular, FieldOfView
from addon.core.scene.lenses_colmap import polynomial
from addon.core.scene.model import Camera, Frame
from addon.core.scene.orientation import seen_sides
from addon.core.scene.visibility import CLEAN, observe, view_frame
from tests.core.on_disk import ALBEDO, EYES
from tests.core.rooms import lit_box, look_at, make_room, picture, pixels_of

AXES = [s * axis for axis in np.eye(3) for s in (1, -1)]
# A lens, its focal length over the width, its size, and where it looks from each eye.
LENSES = {
    "brown": (polynomial("OPENCV", numerator=(-0.25, 0.06), tangential=(0.003, -0.002)), 0.38, (40, 40), AXES),
    "rational": (polynomial("FULL_OPENCV", numerator=(0.2, 0.05, 0.01), denominator=(0.5, 0.1, 0.02)), 0.3, (40, 40),
                 AXES),
    "fov": (FieldOfView(1.2), 0.55, (40, 40), AXES),
    "division": (Division(-0.4), 0.3, (40, 40), AXES),
    "fisheye of 220 degrees": (polynomial("OPENCV_FISHEYE", fisheye=True, numerator=(-0.01, 0.001, 0.0, 0.0)), 0.28,
                               (84, 84), AXES[:2] + AXES[4:]),
    "cropped prism fisheye": (Cropped(polynomial(
        "THIN_PRISM_FISHEYE", fisheye=True, numerator=(0.02, -0.002), tangential=(0.002, 0.001),
        prism=(0.003, 0.0, -0.002, 0.0)), 1.75, 1.75), 0.28, (84, 84), AXES[:2] + AXES[4:]),
    "unified": (EnhancedUnified(0.7, 1.1), 0.3, (72, 72), AXES[:2] + AXES[4:]),
    "panorama": (Equirectangular(), None, (160, 80), AXES[:1]),
}  # fmt: skip


def cameras(name, eyes=EYES):
    lens, f, (width, height), ways = LENSES[name]
    for eye in eyes:
        for way in ways:
            pose = look_at(eye, np.array(eye) + way).camera_to_world
            fx, fy = (width / 2 / math.pi, height / math.pi) if f is None else (f * width, f * width)
            yield Camera(width, height, fx, fy, width / 2, height / 2, pose, lens)


@pytest.fixture(scope="module")
def pinholes(disk, tmp_path_factory):
    return disk.run(tmp_path_factory.mktemp("pinholes"))


@pytest.mark.slow
@pytest.mark.parametrize("name", ["brown", "fisheye of 220 degrees", "cropped prism fisheye", "panorama"])
def test_albedo_is_that_of_pinholes(name, disk, pinholes, tmp_path, few_samples):
    frames = []
    for i, camera in enumerate(cameras(name)):
        frames.append(Frame(f"{i}", tmp_path / f"{i}.exr", camera))
        write_exr(frames[-1].path, picture(disk.room, camera, disk.light).radiance)
    capture = replace(read_capture(disk.root), frames=tuple(frames))
    run = disk.run(tmp_path / "result", capture=capture)
    assert run.lit.seen.mean() > 0.9
    for object_id, truth in ALBEDO.items():
        off, before = (abs(np.median(one.off(object_id, truth))) for one in (run, pinholes))
        print(f"{name}, object {object_id}: {off:.4f}, pinholes {before:.4f}")
        assert off < max(before, 0.005) + 0.005


@pytest.mark.parametrize("name", LENSES)
def test_groups_drop_no_visible_element(name):
    room = make_room(lit_box(), 0.1)
    groups = ElementGroups(room.atlas)
    dropped = 0
    for camera in cameras(name, EYES[:2]):
        view = view_frame(camera, room.mesh, room.scene)
        pixels = pixels_of(np.ones((camera.height, camera.width, 3)))
        everything = observe(view, pixels, room.atlas, room.scene)
        candidates = groups.candidates(view)
        few = observe(view, pixels, room.atlas, room.scene, candidates)
        assert np.array_equal(everything.element, few.element)
        assert len(few.element) > 50
        dropped += len(room.atlas) - len(candidates)
    assert dropped > 0 or name == "panorama"


@pytest.mark.parametrize("name", LENSES)
def test_elements_show_what_lies_at_their_place(name):
    """Each object another radiance: whatever is observed is that of the element's own object."""
    room = make_room(lit_box(), 0.1)
    radiance = room.by_object({i: 1.0 + i for i in range(7)})
    tiers = []
    for camera in cameras(name, EYES[:1]):
        view = view_frame(camera, room.mesh, room.scene)
        seen = observe(view, picture(room, camera, radiance), room.atlas, room.scene)
        clean = seen.tier == CLEAN
        np.testing.assert_allclose(seen.radiance[clean], radiance[seen.element[clean]], rtol=1e-5)
        tiers.append(clean.mean())
        towards = camera.centre - room.atlas.position[seen.element]
        towards /= np.linalg.norm(towards, axis=1, keepdims=True)
        np.testing.assert_allclose(seen.direction, towards, atol=1e-4)
    assert np.mean(tiers) > 0.3


def test_a_gradient_is_met_to_a_fraction_of_a_pixel():
    """Sampled positions are right: a wall whose radiance rises along x, seen through a fisheye."""
    room = make_room(lit_box(), 0.05)
    for camera in cameras("fisheye of 220 degrees", EYES[:1]):
        directions, seen = camera.rays(camera.pixel_centres())
        hits = room.scene.intersect(np.broadcast_to(camera.centre.astype(np.float32), directions.shape), directions)
        where = camera.centre + np.maximum(hits.distance, 0)[:, None] * directions
        where[hits.triangle < 0] = 0
        view = view_frame(camera, room.mesh, room.scene)
        got = observe(view, pixels_of(where.reshape(camera.height, camera.width, 3) + 10), room.atlas, room.scene)
        clean = got.tier == CLEAN
        off = np.linalg.norm(got.radiance[clean] - 10 - room.atlas.position[got.element[clean]], axis=1)
        assert np.median(off) < 0.01  # a pixel covers 0.1 m and more


def test_pixels_without_rays_say_nothing(tmp_path):
    lens = polynomial("FISHEYE", fisheye=True)
    camera = replace(look_at((1, 1, 1), (2, 1, 1), 60, 60), lens=Cropped(lens, 1.0, 1.0), fx=20.0, fy=20.0)
    write_exr(tmp_path / "a.exr", np.ones((60, 60, 3), np.float32))
    pixels = read_pixels(Frame("a", tmp_path / "a.exr", camera))
    y, x = np.mgrid[-29.5:30, -29.5:30]
    assert np.array_equal(pixels.valid, np.hypot(x, y) <= 20)
    assert (pixels.radiance[~pixels.valid] == 0).all()

    room = make_room(lit_box()[:4], 0.2)  # two sides are open
    view = view_frame(camera, room.mesh, room.scene)
    assert (view.triangle[~pixels.valid] == -1).all() and not view.clean[~pixels.valid].any()
    sky = EnvironmentAccumulator(camera.pixel_angle)
    blind = replace(pixels, valid=~pixels.valid)  # even where nobody marked them
    sky.add(view, blind)
    assert not sky.result().seen


def test_footprint_is_that_of_the_pixels():
    """A fisheye's and a pinhole's pixels of one angle cover as much of the wall ahead."""
    room = make_room(lit_box(), 0.1)
    pinhole = look_at((2, 1.5, 1.2), (2, 3, 1.2), 64, 64, 20)
    fisheye = replace(pinhole, lens=polynomial("FISHEYE", fisheye=True))
    plain, bent = (seen_sides(room.mesh, [c]) for c in (pinhole, fisheye))
    assert bent.footprint == pytest.approx(plain.footprint, rel=0.03)
    around = next(cameras("panorama", EYES[:1]))
    far = seen_sides(room.mesh, [around])
    assert 0.3 < far.footprint / (math.radians(360 / 160) * 1.2) < 2
