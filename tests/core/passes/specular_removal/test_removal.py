"""Specular removal: a painted floor that mirrors a lamp, its lobe summed up by brute force, against the paint."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from addon.core.brdf.dielectric import DIELECTRIC
from addon.core.brdf.material import ObjectMaterial
from addon.core.errors import InterruptedRun
from addon.core.light.lobes import highlight
from addon.core.passes.albedo.neighbourhood import relative_error
from addon.core.passes.specular_removal.removal import REMOVAL, SpecularPart, one_of_each_cell, without_specular
from addon.core.progress import Progress
from addon.core.scene.visibility import CLEAN, SATURATED
from tests.core.glossy_box import Box
from tests.core.lit_diffuse.test_accumulate import frames_of, run
from tests.core.rooms import look_at, pixels_of

ALPHA, F0, FLOOR = 0.1, 0.04, 0
EYES = [(0.5 + 0.02 * i, 1.4 + 0.03 * (i % 3), 1.5 + 0.02 * (i % 4)) for i in range(7)]
"""Close together: most of them see the lamp mirrored at the same place."""


def paint(where: np.ndarray) -> np.ndarray:
    """L_d of the floor, (m, 3): boards of two reddish colours."""
    level = np.where((where[:, 1] % 0.5) < 0.25, 0.4, 0.7)
    return level[:, None] * np.array([1.0, 0.6, 0.3])


class Floor:
    """A box whose floor has a lobe, and the pictures that frames take of it."""

    def __init__(self, glow: float, shade: float = 1.0, eyes=EYES):
        self.shade = shade
        self.box = Box(glow=np.full(3, glow))
        self.cameras = [look_at(eye, (1.6, 1.4, 0), 28, 21, 70) for eye in eyes]
        self.pictures = [pixels_of(self.picture(camera)) for camera in self.cameras]
        self.lit = run(self.box.room, self.cameras, self.pictures)
        self.own = self.box.room.atlas.object_id == FLOOR
        self.truth = shade * paint(self.box.room.atlas.position)

    def picture(self, camera) -> np.ndarray:
        directions = camera.directions(camera.pixel_centres())
        origins = np.broadcast_to(camera.centre.astype(np.float32), directions.shape)
        hits = self.box.room.scene.intersect(origins, directions)
        element = self.box.field.elements(hits)
        seen = self.box.arriving(origins.astype(float), directions.astype(float))
        floor = np.flatnonzero(self.box.room.atlas.object_id[element] == FLOOR)
        where = origins[floor] + hits.distance[floor, None] * directions[floor]
        A, B = self.box.lobe(element[floor], -directions[floor], ALPHA, 12)
        seen[floor] = self.shade * paint(where) + F0 * A + B
        return seen.reshape(camera.height, camera.width, 3)

    def removed(self, f0: float = F0, **how):
        material = ObjectMaterial(FLOOR, "floor", DIELECTRIC, alpha=ALPHA, f0=f0)
        part = SpecularPart(self.box.field, [material])
        read = lambda frame: self.pictures[int(frame.name)]  # noqa: E731
        frames = frames_of(self.cameras)
        return without_specular(part, self.box.field, self.lit, self.own, frames, read, threads=2, **how)


@pytest.fixture(scope="module")
def floor():
    return Floor(60.0)


def test_a_lamps_mirror_image_leaves_the_floor(floor):
    found = floor.removed()
    bright = floor.own & (floor.lit.count >= 4) & (floor.lit.radiance[:, 2] > 1.5 * floor.truth[:, 2])
    assert bright.sum() > 10
    left = floor.lit.radiance - found.specular
    before = np.abs(floor.lit.radiance - floor.truth)[bright].mean()
    assert np.abs(left - floor.truth)[bright].mean() < 0.3 * before
    hue = left[bright] / left[bright].sum(1, keepdims=True)
    assert np.allclose(np.median(hue, 0), [1 / 1.9, 0.6 / 1.9, 0.3 / 1.9], atol=0.03)
    assert not found.specular[~floor.own].any()
    for name in ("interquartile_range", "count", "tier"):
        assert np.array_equal(getattr(found.rest, name)[~floor.own], getattr(floor.lit, name)[~floor.own])


def test_how_sure_the_paint_is_goes_by_what_is_left_not_by_the_highlight():
    """A lamp's mirror image moves about on the floor from view to view; the paint under it does not."""
    floor = Floor(60.0, eyes=[(0.3 + 0.12 * i, 1.3 + 0.1 * (i % 3), 1.5) for i in range(7)])
    found = floor.removed()
    moving = floor.own & (floor.lit.count >= 4) & (floor.lit.tier == CLEAN) & (found.rest.tier == CLEAN)
    moving &= floor.lit.interquartile_range[:, 2] > 0.3 * floor.lit.radiance[:, 2]
    assert moving.sum() > 10
    spreads = [np.median((lit.interquartile_range / lit.radiance)[moving]) for lit in (floor.lit, found.rest)]
    assert spreads[1] < 0.5 * spreads[0]
    off = np.abs(found.rest.radiance / floor.truth - 1).mean(1)[moving]
    assert np.median(off) < 2 * np.median(relative_error(found.rest, floor.box.room.atlas.object_id)[moving])


@pytest.mark.slow
def test_what_every_view_hides_is_marked():
    """A lamp so bright that its mirror image is many times the paint: an error of a tenth is more than that."""
    floor = Floor(3000.0)
    found = floor.removed(1.1 * F0)
    drowned = floor.own & (floor.lit.count >= 4) & (floor.lit.radiance[:, 0] > 12 * floor.truth[:, 0])
    clear = floor.own & (floor.lit.count >= 4) & (floor.lit.radiance[:, 0] < 1.3 * floor.truth[:, 0])
    assert drowned.sum() > 5 and clear.sum() > 5
    hidden = found.rest.tier == SATURATED
    assert hidden[drowned].mean() > 0.9 and hidden[clear].mean() < 0.1


def test_no_channel_is_driven_below_black(floor):
    found = floor.removed(3 * F0)
    assert (floor.lit.radiance - found.specular)[floor.own & floor.lit.seen].min() >= 0


@pytest.mark.slow
def test_a_black_floor_is_not_hidden():
    """What reflects next to nothing of its own does so in every view, all over."""
    floor = Floor(60.0, shade=0.01)
    found = floor.removed()
    own = floor.own & (floor.lit.count >= 4)
    assert not (found.rest.tier == SATURATED).any()
    left = np.abs((floor.lit.radiance - found.specular - floor.truth)[own]).mean()
    assert left < 0.5 * np.abs((floor.lit.radiance - floor.truth)[own]).mean()


def test_large_pictures_lose_a_mirror_image_by_no_more_rays(floor, monkeypatch):
    """A picture of three times the edge, of which as many pixels are traced, shows the same highlight."""
    from addon.core.passes.specular_removal import removal
    from addon.core.scene.visibility import view_frame

    room, small = floor.box.room, floor.cameras[0]
    large = replace(small, width=84, height=63, fx=3 * small.fx, fy=3 * small.fy, cx=3 * small.cx, cy=3 * small.cy)
    material = ObjectMaterial(FLOOR, "floor", DIELECTRIC, alpha=ALPHA, f0=F0)
    traced = []

    def counted(field, bright, element, *more, **how):
        traced.append(len(element))
        return highlight(field, bright, element, *more, **how)

    monkeypatch.setattr(removal, "highlight", counted)
    monkeypatch.setattr(removal, "REMOVAL", replace(REMOVAL, pixels=28 * 21))
    part = SpecularPart(floor.box.field, [material], rays=128)
    shown = [part(view_frame(camera, room.mesh, room.scene), 0) for camera in (small, large)]
    assert traced[1] < 1.1 * traced[0]
    means = shown[1].reshape(21, 3, 28, 3, 3).mean((1, 3))
    assert np.abs(means - shown[0]).mean() < 0.1 * shown[0].mean()


@pytest.mark.parametrize("step", [1, 3])
def test_each_cell_has_one_pixel_the_middle_one_if_it_may(step):
    rng = np.random.default_rng(0)
    place = np.stack(np.nonzero(rng.random((20, 31)) < 0.6))
    index, cell = one_of_each_cell(place, step)
    assert (place[:, index] // step == cell).all()
    assert np.array_equal(cell, np.unique(place // step, axis=1))
    middle = {tuple(one) for one in (place[:, ((place % step) == step // 2).all(0)] // step).T}
    assert middle <= {tuple(c) for c, p in zip(cell.T, place[:, index].T) if (p % step == step // 2).all()}


def test_it_can_be_stopped(floor):
    with pytest.raises(InterruptedRun):
        floor.removed(progress=Progress(should_stop=lambda: True))
