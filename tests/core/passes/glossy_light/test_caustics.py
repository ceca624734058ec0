"""Light of lamps by way of glossy things, against sums that send no photons."""

from __future__ import annotations

import numpy as np
import pytest

from addon.core.light.emitters import bright_triangles
from addon.core.passes.glossy_light.caustics import Gloss, caustics
from tests.core.glossy_box import SIZE, Box
from tests.core.passes.glossy_light.test_glossy_light import PSI, over_the_floor
from tests.core.rooms import Quad, polygon_irradiance

MANY = 1 << 20
"""Photons that leave little noise: 262,144 leave 12 % of what the floor throws, here next to nothing of E."""


@pytest.fixture(scope="module")
def dark():
    """The box with black walls: all light is the lamp's."""
    return Box(walls=np.zeros((6, 3)))


def on_the_floor(box: Box, phi: float, psi: float = PSI) -> Gloss:
    n, floor = len(box.room.atlas), box.room.atlas.object_id == 0
    f0 = np.zeros((n, 3), np.float32)
    f0[floor] = psi
    return Gloss(np.where(floor, np.float32(phi), np.float32(0)), f0, np.zeros((n, 3), np.float32))


def above(box: Box) -> np.ndarray:
    return np.flatnonzero((box.room.atlas.object_id > 0) & (box.room.atlas.object_id < 6))


def test_a_lamp_over_a_polished_floor(dark):
    """It comes back as from a lamp below the floor, with its outline."""
    found = caustics(dark.field, dark.bright, on_the_floor(dark, 0.01), photons=MANY)
    some = np.random.default_rng(0).choice(above(dark), 150, replace=False)
    truth = over_the_floor(dark, some, PSI, 250)
    assert found[some].mean(0) == pytest.approx(truth.mean(0), rel=0.03)
    assert np.corrcoef(found[some].mean(1), truth.mean(1))[0, 1] > 0.97


def test_few_photons_leave_no_stains(dark):
    """In cells of one size single photons stood out as twice the brightest place."""
    lobes, at = on_the_floor(dark, 0.4), above(dark)
    few, many = (caustics(dark.field, dark.bright, lobes, photons=photons) for photons in (MANY >> 6, MANY))
    area = dark.room.atlas.area[at]
    assert np.average(few[at], 0, area) == pytest.approx(np.average(many[at], 0, area), rel=0.02)
    assert few[at].max() < 1.1 * many[at].max()
    assert np.sqrt(((few - many)[at] ** 2).mean()) < 0.5 * many[at].mean()


@pytest.mark.slow
@pytest.mark.parametrize("phi", [0.1, 0.4])
def test_a_rough_floor(dark, phi):
    """Every element of the floor sends its lobe to a place: summed up, E there."""
    atlas = dark.room.atlas
    found = caustics(dark.field, dark.bright, on_the_floor(dark, phi), photons=MANY)
    floor = np.flatnonzero(atlas.object_id == 0)[::3]
    area = atlas.area[atlas.object_id == 0].sum() / len(floor)
    for place in ([1.2, 2.6, 2.5], [4.0, 1.5, 1.2]):
        at = np.argmin(((atlas.position - place) ** 2).sum(1))
        way = atlas.position[at] - atlas.position[floor]
        distance = np.linalg.norm(way, axis=1)
        way = (way / distance[:, None]).astype(np.float32)
        A, B = dark.lobe(floor, way, phi, 60)
        here, there = np.abs(way @ atlas.normal[at]), way[:, 2]
        truth = ((PSI * A + B) * (here * there / distance**2)[:, None]).sum(0) * area
        near = ((atlas.position - atlas.position[at]) ** 2).sum(1) < 0.15**2
        near &= atlas.object_id == atlas.object_id[at]
        assert found[near].mean(0) == pytest.approx(truth, rel=0.08)


def test_what_a_bright_metal_was_taken_to_send_goes(dark):
    """A lamp-bright element whose L_d is all reflection lights nothing by itself."""
    atlas = dark.room.atlas
    own = atlas.object_id == 6
    inside = np.where(own[:, None], np.float32(dark.glow), np.float32(0))
    lobes = Gloss(np.where(own, np.float32(0.3), np.float32(0)), np.zeros((len(atlas), 3), np.float32), inside)
    found = caustics(dark.field, dark.bright, lobes)
    lamp = [quad for quad in dark.room.quads if quad.object_id == 6]
    at = np.flatnonzero(atlas.object_id < 6)[::20]
    contribution = polygon_irradiance(atlas.position[at].astype(float), atlas.normal[at].astype(float), lamp)
    truth = contribution.sum(1)[:, None] * dark.glow
    assert found[at].mean(0) == pytest.approx(-truth.mean(0), rel=0.03)
    assert np.corrcoef(found[at].mean(1), truth.mean(1))[0, 1] < -0.98


def test_two_mirrors_in_a_corner(dark):
    """The lamp comes back as three images: beneath the floor, behind the wall, and across the corner by way of both."""
    atlas = dark.room.atlas
    mirrors = np.isin(atlas.object_id, (0, 2))
    f0 = np.where(mirrors[:, None], np.float32(1), np.float32(0)).repeat(3, 1)
    lobes = Gloss(np.where(mirrors, np.float32(0.01), np.float32(0)), f0, np.zeros((len(atlas), 3), np.float32))
    found = caustics(dark.field, dark.bright, lobes, photons=MANY)
    (lamp,) = (quad for quad in dark.room.quads if quad.object_id == 6)
    images = [
        Quad(lamp.corner * turn, lamp.edge_u * turn, lamp.edge_v * turn, 6)
        for turn in np.array([(1, 1, -1), (-1, 1, 1), (-1, 1, -1)])
    ]
    middle = ((atlas.position > 0.2) & (atlas.position < np.array(SIZE) - 0.2))[:, 1:].all(1)  # cells end at edges
    at = np.flatnonzero((atlas.object_id == 3) & middle)
    contribution = polygon_irradiance(atlas.position[at].astype(float), atlas.normal[at].astype(float), images)
    assert contribution[:, 2].mean() > 0.2 * contribution.sum(1).mean()
    truth = contribution.sum(1)[:, None] * dark.glow
    assert found[at].mean(0) == pytest.approx(truth.mean(0), rel=0.02)
    again = caustics(dark.field, dark.bright, lobes, seed=1, photons=MANY)
    noise = (found - again)[at].std() / np.sqrt(2)
    assert (found[at] - truth).std() < 1.2 * noise


def test_what_a_bright_metal_was_taken_to_send_is_not_reflected(dark):
    """What it does send is followed from where that starts."""
    lobes, lamp = on_the_floor(dark, 0.3, 1.0), dark.room.atlas.object_id == 6
    taken = np.where(lamp[:, None], np.float32(dark.glow), np.float32(0))
    metal = Gloss(np.where(lamp, np.float32(0.3), np.float32(0)), np.zeros_like(lobes.f0), taken)
    alone = caustics(dark.field, dark.bright, metal)
    with_floor = caustics(dark.field, dark.bright, Gloss(lobes.alpha, lobes.f0, taken))
    assert alone.any() and with_floor == pytest.approx(alone)
    assert caustics(dark.field, dark.bright, lobes)[above(dark)].mean() > 0.1


def test_nothing_glossy_or_nothing_bright(dark):
    n = len(dark.room.atlas)
    diffuse = Gloss(np.zeros(n, np.float32), np.zeros((n, 3), np.float32), np.zeros((n, 3), np.float32))
    assert not caustics(dark.field, dark.bright, diffuse).any()
    even = dark.field.with_light(np.ones((n, 3), np.float32))
    assert not caustics(even, bright_triangles(even), on_the_floor(dark, 0.1)).any()
