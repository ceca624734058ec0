"""Frames against the mesh: right poses are told from wrong ones, and the convention that mends them is found."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from addon.core.agreement.edges import mesh_view
from addon.core.agreement.look import look
from addon.core.agreement.overlay import LINE, overlay
from addon.core.agreement.params import AGREEMENT
from addon.core.errors import BadInputError
from addon.core.io.conventions import Convention, matrix, parse
from addon.core.scene.model import AUTO, Capture, Instance, Pixels
from addon.core.scene.rays import RayScene
from tests.core.synthetic import synthetic_capture

MENDS = ["opencv", "world-to-camera", "camera:+x-y-z,world:+x+z-y", "scale:100"]
WIDTH, HEIGHT = 96, 72


def painted(made, frame) -> Pixels:
    """Walls and boxes, each in its own colour with a pattern on it."""
    camera = frame.camera
    directions = camera.directions(camera.pixel_centres())
    centre = np.float32(camera.centre)
    hits = made.rays.intersect(np.broadcast_to(centre, directions.shape), directions)
    where = centre + hits.distance[:, None] * directions
    paint = np.random.default_rng(5).uniform(0.1, 0.9, (int(made.mesh.object_id.max()) + 1, 3))
    pattern = 1 + 0.3 * np.sin(5 * where).prod(1)
    colour = paint[made.mesh.object_id[hits.triangle]] * pattern[:, None]
    shape = camera.height, camera.width
    return Pixels(np.float32(colour).reshape(*shape, 3), np.ones(shape, bool), np.zeros(shape, bool))


def seen(count: int):
    """The first twelve of `count` frames on the way round the room."""
    made = synthetic_capture(count, (WIDTH, HEIGHT), 5000, seed=1)
    capture = Capture(Path("."), made.mesh, (Instance(0, "room"),), made.frames[:12])
    pictures = {frame.name: painted(made, frame) for frame in capture.frames}
    return capture, lambda frame: pictures[frame.name]


@pytest.fixture(scope="module")
def room():
    return seen(12)


def spoilt(capture: Capture, convention: Convention) -> Capture:
    """The capture as it would be read if `convention` were needed to mend it."""

    def undo(pose):
        pose = pose.copy()
        world = matrix(convention.world)
        pose[:3, :3] = world.T @ pose[:3, :3] @ matrix(convention.camera)
        pose[:3, 3] = world.T @ pose[:3, 3] / convention.scale
        return np.linalg.inv(pose) if convention.world_to_camera else pose

    frames = [replace(f, camera=replace(f.camera, camera_to_world=undo(f.camera.camera_to_world)))
              for f in capture.frames]  # fmt: skip
    return replace(capture, frames=tuple(frames))


def test_right_poses_are_left_alone(room):
    found = look(*room)
    assert found.fits and not found.searched and found.best is None and found.as_read.quality > AGREEMENT.agree + 0.02
    assert found.up == "+z" and len(found.sentences()) == 1 and "fit the mesh" in found.sentence()
    assert np.median(found.misaligned) < 0.15


def test_frames_whose_exposure_nobody_told_fit_too(room):
    """Automatic exposure and white balance differ from frame to frame as much as what two spots show."""
    capture, read = room
    rng = np.random.default_rng(3)
    gain = {frame.name: np.exp2(rng.normal(0, 1.5) + rng.normal(0, 0.3, 3)) for frame in capture.frames}

    def exposed(frame):
        pixels = read(frame)
        return replace(pixels, radiance=np.float32(pixels.radiance * gain[frame.name]))

    untold = replace(capture, frames=tuple(replace(frame, transfer=AUTO) for frame in capture.frames))
    assert not look(capture, exposed, search=False).fits
    assert look(untold, exposed, search=False).fits
    wrong = spoilt(untold, parse("camera:+x-y-z,world:+x+z-y"))
    assert not look(wrong, exposed, search=False).fits


def test_bends_of_a_fused_mesh_are_no_edges(room):
    """Noise of depth turns most of its triangles; what steps in depth is an edge still."""
    capture, _ = room
    noise = 0.01 * np.sin(100 * capture.mesh.vertices.sum(1))[:, None]  # alike where vertices meet
    rough = replace(capture.mesh, vertices=np.float32(capture.mesh.vertices + noise))
    camera = capture.frames[0].camera

    def edges(mesh, bends):
        return mesh_view(camera, mesh, RayScene(mesh.vertices, mesh.triangles), bends).edge

    assert edges(rough, True).mean() > 1.3 * edges(capture.mesh, True).mean()
    steps = edges(capture.mesh, False)
    assert steps.any() and edges(rough, False).mean() < 1.1 * steps.mean()


@pytest.mark.slow
@pytest.mark.parametrize("text", MENDS)
def test_the_convention_that_mends_is_found(room, text):
    capture, read = room
    found = look(spoilt(capture, parse(text)), read)
    assert not found.fits and found.best is not None
    assert found.best.convention == parse(text), found.sentence()
    assert f"--convention {parse(text)}" in found.sentence()
    mended = found.best.convention.frames(spoilt(capture, parse(text)).frames)
    for frame, right in zip(mended, capture.frames, strict=True):
        assert np.allclose(frame.camera.camera_to_world, right.camera.camera_to_world)


@pytest.mark.slow
def test_nothing_is_proposed_where_nothing_fits(room):
    capture, read = room
    names = [frame.name for frame in capture.frames]
    shuffled = tuple(replace(f, name=n) for f, n in zip(capture.frames, names[5:] + names[:5], strict=True))
    found = look(replace(capture, frames=shuffled), read)
    assert found.searched and found.best is None and not found.fits and "no usual convention" in found.sentence()


def test_a_capture_on_its_side_is_told(room):
    capture, read = room
    turn = Convention(up="-y")
    lying = replace(capture, mesh=replace(capture.mesh, vertices=capture.mesh.vertices @ matrix("+x-z+y").T))
    frames = [replace(f, camera=replace(f.camera, camera_to_world=np.vstack(
        [matrix("+x-z+y") @ f.camera.camera_to_world[:3], [[0, 0, 0, 1]]]))) for f in capture.frames]  # fmt: skip
    found = look(replace(lying, frames=tuple(frames)), read)
    assert found.fits and found.up == "-y" and f"--convention {turn}" in found.sentences()[1]
    assert np.allclose(turn.mesh(lying.mesh).vertices, capture.mesh.vertices)
    assert np.allclose(turn.frames(frames)[3].camera.camera_to_world, capture.frames[3].camera.camera_to_world)


@pytest.mark.parametrize("pixels", [1.0, 2.0])
def test_a_shift_is_measured_in_pixels(pixels):
    capture, read = seen(60)
    frames = list(capture.frames)
    frames[7] = replace(frames[7], camera=replace(frames[7].camera, cx=frames[7].camera.cx + pixels))
    found = look(replace(capture, frames=tuple(frames)), read)
    assert found.fits and len(found.misaligned) >= len(frames) // 2, found.sentence()
    assert found.misaligned.max() == pytest.approx(pixels, rel=0.25)
    assert np.median(found.misaligned) < 0.15


def test_a_single_frame_and_blank_ones(room):
    capture, read = room
    alone = look(replace(capture, frames=capture.frames[:1]), read)
    assert alone.fits and not len(alone.misaligned) and np.isnan(alone.as_read.colour)  # by its edges
    for said in ({"valid": np.zeros((HEIGHT, WIDTH), bool)}, {"radiance": np.zeros((HEIGHT, WIDTH, 3), np.float32)}):
        blank = look(capture, lambda frame, said=said: replace(read(frame), **said))
        assert blank.unknown and not blank.searched and "Too few" in blank.sentence()


def test_unreadable_frames_are_passed_over(room):
    capture, read = room

    def some(frame) -> Pixels:
        if frame.name == "3":
            raise BadInputError("damaged.")
        return read(frame)

    assert look(capture, some).fits


def test_the_overlay_draws_the_edges_of_each_convention(room):
    capture, read = room
    image = overlay(capture, read, [Convention(), parse("opencv")])
    assert image.dtype == np.uint8 and image.shape == (3 * HEIGHT + 16, 2 * WIDTH + 8, 3)
    drawn = (image == LINE).all(-1)
    assert drawn[:, :WIDTH].mean() > 0.01 and (drawn[:, :WIDTH] != drawn[:, WIDTH + 8 :]).any()
