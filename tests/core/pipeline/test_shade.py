"""From pictures to albedo in a box whose light is known by radiosity, an estimate that shares no code with ours."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from addon.core.light import over_surface
from addon.core.lit_diffuse.accumulate import accumulate
from addon.core.passes.albedo.albedo import MEASURED, NONE
from addon.core.pipeline import shading as module
from addon.core.pipeline.shading import shade
from addon.core.scene.model import Frame
from addon.core.settings import Settings
from tests.core.on_disk import ALBEDO, EYES, LAMP
from tests.core.pipeline.test_light import measured
from tests.core.rooms import DARK, albedo_in, all_round, lit_box, make_room, picture, radiosity


@pytest.fixture(scope="module")
def lit():
    """A box with a large lamp, and what 24 frames of it give: most elements have enough observations to be believed."""
    room = make_room(lit_box(lamps=(((0.3, 0.7), (0.3, 0.7)),)), 0.1)
    truth = radiosity(room, ALBEDO, {6: LAMP})
    cameras = [c for eye in EYES for c in all_round(eye, 64)]
    frames = [Frame(str(i), Path(str(i)), camera) for i, camera in enumerate(cameras)]
    found = accumulate(
        room.mesh, room.atlas, room.scene, frames, lambda frame: picture(room, frame.camera, truth), threads=2
    )
    return room, truth, found


def test_lit_diffuse_is_what_the_frames_show(lit):
    room, truth, found = lit
    off = np.abs(found.radiance[found.seen] / truth[found.seen] - 1)
    assert found.seen.mean() > 0.99 and np.median(off) < 0.01


HOW = {
    "aimed": Settings(shading_rays=128, emitter_rays=16, threads=2),
    "aimed everywhere": Settings(shading_rays=64, emitter_rays=16, interpolate=False, threads=2),
}


@pytest.mark.slow
@pytest.mark.parametrize("how", HOW)
def test_albedo_comes_back(lit, how):
    room, _, found = lit
    result = shade(room.surface, room.instances, found, DARK, HOW[how])
    assert [lamp.object_id for lamp in result.lamps] == [6]
    assert np.allclose(result.lamps[0].radiance, LAMP, rtol=0.01)
    albedo = albedo_in(room, found, result)
    for object_id, rho in ALBEDO.items():
        own = room.atlas.object_id == object_id
        off = albedo.rho[own] / np.float32(rho) - 1
        assert np.abs(np.median(off, 0)).max() < 0.02, object_id
        assert np.median(np.abs(off)) < (0.03 if how == "aimed" else 0.06), object_id  # noise of single elements
        assert (albedo.origin[own & found.seen] == MEASURED).all()
    assert (albedo.origin[room.atlas.object_id == 6] == NONE).all()
    assert not result.escaped.any() and np.isfinite(result.radiance).all()
    points = {"aimed": (len(room.atlas) // 20, len(room.atlas))}.get(how, (len(room.atlas),) * 2)
    assert points[0] <= result.points <= points[1]


def test_irradiance_agrees_with_radiosity(lit):
    """E = pi L / rho of the truth, element by element; each texel is a point."""
    room, truth, found = lit
    result = shade(room.surface, room.instances, found, DARK, Settings(shading_rays=256, threads=2))
    walls = np.isin(room.atlas.object_id, [0, 2, 3, 4, 5])
    E = np.pi * truth[walls] / room.by_object(ALBEDO, default=1)[walls]
    off = result.irradiance[walls] / E - 1
    assert np.percentile(np.abs(off), 90) < 0.05 and abs(np.median(off)) < 0.005


@pytest.mark.slow
def test_exposure_does_not_matter(lit):
    """Pictures a thousand times as bright: the same albedo."""
    room, _, found = lit
    brighter = {name: getattr(found, name) * 1000 for name in ("radiance", "interquartile_range")}
    bright = replace(found, **brighter)
    how = Settings(shading_rays=32, threads=2)
    one, other = (shade(room.surface, room.instances, ld, DARK, how) for ld in (found, bright))
    dim, glaring = albedo_in(room, found, one).rho, albedo_in(room, bright, other).rho
    assert np.allclose(dim, glaring, rtol=1e-3, atol=1e-5)
    assert np.allclose(one.irradiance * 1000, other.irradiance, rtol=1e-3)


def test_what_was_not_seen_is_filled_in(lit, monkeypatch):
    """Half of the floor unseen: its L_d is guessed, so the walls beside it keep their albedo.

    The guess is gathered 8 times as coarsely as the rest: 16 of this room's texels would be 1.6 m, not the 16 cm of a
    scan with texels of 1 cm.
    """
    monkeypatch.setattr(over_surface, "finest_spacing", lambda atlas: 0.05)
    monkeypatch.setattr(module, "finest_spacing", lambda atlas: 0.05)
    room, truth, found = lit
    gone = (room.atlas.object_id == 0) & (room.atlas.position[:, 0] > 2)
    radiance = np.where(gone[:, None], np.float32(np.nan), found.radiance)
    count = np.where(gone, 0, found.count).astype(np.int32)
    part = replace(found, radiance=radiance, count=count)
    result = shade(room.surface, room.instances, part, DARK, Settings(threads=2))
    off = result.radiance[gone] / truth[gone] - 1  # guessed without the light that it sends itself: too dark
    assert np.median(np.abs(off)) < 0.12
    rho = albedo_in(room, part, result).rho
    assert np.allclose(np.median(rho[gone], 0), ALBEDO[0], rtol=0.05)
    wall = room.atlas.object_id == 3  # it stands on the unseen half
    assert np.allclose(np.median(rho[wall], 0), ALBEDO[3], rtol=0.03)


def test_a_mesh_without_objects_of_which_frames_saw_next_to_nothing_is_shaded():
    """Too few elements to tell of missing light."""
    room = make_room(lit_box(lamps=(((0.3, 0.7), (0.3, 0.7)),)), 0.2)
    found = measured(room, np.ones((len(room.atlas), 3)))
    few = np.arange(len(room.atlas)) < 20
    part = replace(
        found,
        radiance=np.where(few[:, None], found.radiance, np.float32(np.nan)),
        count=np.where(few, found.count, 0).astype(np.int32),
    )
    how, whole = Settings(shading_rays=16, threads=2), room.atlas.object_id
    result = shade(room.surface, room.instances, part, DARK, how, patches=[], whole=whole)
    assert np.isfinite(result.irradiance).all() and result.openings is None
