"""S by uniform rays and the albedo: furnaces, form factors, noise as it must be."""

from __future__ import annotations

import numpy as np
import pytest

from addon.core.paper.albedo import albedo
from addon.core.paper.captured_light import CapturedLight
from addon.core.paper.irradiance import irradiance
from tests.core.rooms import box_sides, lit_box, make_room, polygon_irradiance, quad, radiosity


def captured(room, radiance, outside=None) -> CapturedLight:
    return CapturedLight(room.mesh, room.atlas, room.scene, radiance, outside)


def of(light, rays, seed=0, chosen=slice(None)):
    atlas = light.atlas
    return irradiance(light, atlas.position[chosen], atlas.normal[chosen], rays, threads=2, seed=seed)


def test_white_furnace():
    """Under constant radiance L every place has S = pi L, and what sends L has albedo 1."""
    room = make_room(box_sides(), 0.25)
    L_d = room.by_object({}, default=(1, 2, 3))
    S, escaped = of(captured(room, L_d), 2000)
    assert not escaped.any()
    assert np.allclose(S.mean(0), np.pi * np.float32([1, 2, 3]), rtol=2e-3)
    assert np.allclose(albedo(L_d, S), 1, atol=0.08) and np.median(albedo(L_d, S)) == pytest.approx(1, abs=0.003)


def test_a_lamp_over_a_floor():
    """Against the analytic irradiance of a polygon; the error falls with the root of N."""
    lamp = quad((-0.5, -0.5, 1), (0, 1, 0), (1, 0, 0), 1)
    room = make_room([quad((-2, -2, 0), (4, 0, 0), (0, 4, 0), 0), lamp], 0.4)
    floor = np.flatnonzero(room.atlas.object_id == 0)
    light = captured(room, room.by_object({1: (10, 20, 30)}))
    position, normal = room.atlas.position[floor].astype(float), room.atlas.normal[floor].astype(float)
    true = polygon_irradiance(position, normal, [lamp])[:, :1] * [10, 20, 30]
    off = {n: float(np.sqrt(np.mean((of(light, n, n, floor)[0] - true) ** 2))) for n in (100, 10_000)}
    assert off[10_000] < 0.08 * true.mean() and off[100] / off[10_000] == pytest.approx(10, rel=0.3)


def test_outside_is_what_is_told_and_dark_else():
    room = make_room([quad((0, 0, 0), (1, 0, 0), (0, 1, 0), 0)], 0.25)
    nothing = room.by_object({})
    dark, escaped = of(captured(room, nothing), 50)
    assert not dark.any() and (escaped == 1).all()
    sky, _ = of(captured(room, nothing, lambda way: np.full((len(way), 3), 2.0, np.float32)), 2000)
    assert np.allclose(sky, 2 * np.pi, rtol=0.1)


def test_what_nobody_saw_is_dark_and_has_no_albedo():
    room = make_room(box_sides(), 0.5)
    L_d = room.by_object({}, default=(1, 1, 1))
    unseen = room.atlas.object_id == 1
    L_d[unseen] = np.nan
    S, _ = of(captured(room, L_d), 400)
    rho = albedo(L_d, S)
    assert np.isfinite(S).all() and np.isnan(rho[unseen]).all() and np.isfinite(rho[~unseen]).all()
    assert (rho[~unseen] > 1).mean() > 0.5, "light that is missing makes albedo too bright"
    assert np.isnan(albedo(np.ones((1, 3), np.float32), np.zeros((1, 3), np.float32))).all()


def test_albedo_of_a_lit_room():
    """Interreflections are in L_d: one ray stands for all bounces."""
    room = make_room(lit_box(lamps=(((0.3, 0.7), (0.3, 0.7)),)), 0.25)
    known = {0: (0.6, 0.4, 0.2), 1: 0.8, 2: (0.7, 0.2, 0.2), 3: (0.2, 0.7, 0.2), 4: 0.5, 5: 0.3}
    L_d = radiosity(room, known, {6: (10, 9, 8)})
    rho = albedo(L_d, of(captured(room, L_d), 2000)[0])
    for object_id, true in known.items():
        assert np.allclose(np.median(rho[room.atlas.object_id == object_id], 0), true, rtol=0.05)
