"""The sun: found by its patch, taken out of the map of the sky and put into it, its shadows."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial import cKDTree

from addon.core.light.environment import Environment
from addon.core.light.few_elements import irradiance_at, mostly_lit
from addon.core.light.field import LightField
from addon.core.light.over_surface import sun_irradiance
from addon.core.light.sun import RADIUS, Sun, extract_sun, insert_sun, sunlight
from addon.core.luminance import LUMINANCE
from addon.core.passes.sun.clipped_sunlight import with_clipped_sunlight
from addon.core.passes.sun.sun_fit import GRID, _reaching_most, _within_cell, find_sun
from addon.core.passes.sun.sun_spots import Guess, Spots, ring
from addon.core.passes.sun.sun_strength import strength_without_gloss
from addon.core.pipeline.shading import lit_room, shade
from addon.core.scene.lit_diffuse import LitDiffuse
from addon.core.settings import Settings
from tests.core import sunny
from tests.core.rooms import albedo_in, make_room, quad


def measured(room, radiance, noise=0.03, texture=0.15, seed=0) -> LitDiffuse:
    """L_d as frames would give it. `texture`: spread of log albedo between patches of 20 cm."""
    rng = np.random.default_rng(seed)
    cells = np.floor(room.atlas.position * 5).astype(int) @ [1, 31, 977]
    patch = rng.normal(0, texture, cells.max() - cells.min() + 1)[cells - cells.min()][:, None]
    n = len(room.atlas)
    L = (radiance * np.exp(rng.normal(0, noise, (n, 3)) + patch)).astype(np.float32)
    return LitDiffuse(L, np.zeros_like(L), np.full(n, 9, np.int32), np.zeros(n, np.int8), np.zeros(n, np.float32))


def sky_map(seen=None) -> Environment:
    """A sky of the room's radiance, seen all over the window but where the sun stands; or where `seen` says so."""
    radiance = np.broadcast_to(np.float32(sunny.SKY), (64, 128, 3)).copy()
    count = np.zeros((64, 128), np.int32)
    count[20:40] = 1  # below 22 degrees: the sun stands higher
    return Environment(radiance, count if seen is None else seen)


def no_bounds(room) -> np.ndarray:
    return np.zeros((len(room.atlas), 3), bool)


def under_the_sun(room, radiance) -> LightField:
    field = LightField(room.mesh, room.atlas, room.scene, radiance, Environment.dark())
    return field.with_sun(Sun(np.float32(sunny.TOWARDS), np.float32(sunny.SUN), sunny.RADIUS))


def run(room, radiance, environment=None, **more):
    environment = environment or sky_map()
    settings = Settings(shading_rays=64, emitter_rays=16, threads=2)
    return shade(room.surface, room.instances, measured(room, radiance, **more), environment, settings)


@pytest.fixture(scope="module")
def room():
    return sunny.sunny_room()


def angle(a, b) -> float:
    return float(np.degrees(np.arccos(np.clip(np.dot(a, b), -1, 1))))


@pytest.mark.parametrize("side", range(4))
def test_bars_of_a_window_do_not_hold_the_search(side):
    """Beside the sun their shadows fall on one another again: less alike, over a wider range."""
    sun = np.array(sunny.TOWARDS, np.float32) / np.linalg.norm(sunny.TOWARDS)
    beside = ring(sun, np.radians(3.0), 4)[side]

    def cost(direction: np.ndarray) -> Guess:
        there, here = (angle(direction, minimum) for minimum in (sun, beside))
        return Guess(direction, -max(1 - there / 1.2, 0.6 - here / 4, 0))

    assert angle(_within_cell(cost, cost(beside)).direction, sun) < 0.6


def test_a_wide_opening_does_not_hide_the_window_of_the_sun():
    """By it many directions reach all that stands out, of which the sun's patch is a part."""
    walls = [q for q in sunny.sides()[0] if q.corner[0] or q.edge_u[0] or q.edge_v[0]]
    room = make_room(walls, 0.05)
    patch = sunny.sun_on(room) > 0.5 * sunny.TOWARDS[2]
    chosen = patch | (np.random.default_rng(0).random(len(patch)) < 2 * patch.mean())
    field = LightField(room.mesh, room.atlas, room.scene, np.ones((len(patch), 3), np.float32), Environment.dark())
    spots = Spots(field, np.arange(len(patch)), np.ones((len(patch), 3)), room.atlas.object_id, no_bounds(room))
    assert min(angle(d, sunny.TOWARDS) for d in _reaching_most(spots, chosen)) < np.degrees(GRID)


def test_a_sun_that_no_frame_sees_is_found_by_its_patch(room):
    light = sunny.light(room)
    found = run(room, light)
    assert found.sun is not None and not found.sun.seen
    assert angle(found.sun.direction, sunny.TOWARDS) < 0.6
    assert np.allclose(found.sun.irradiance, sunny.SUN, rtol=0.15)
    assert "sun" in found.sun.note and "azimuth" in found.sun.note
    patch = sunny.sun_on(room) > 0.9 * sunny.TOWARDS[2]
    floor = patch & (room.atlas.object_id == 0)
    assert floor.sum() > 100
    rho = albedo_in(room, measured(room, light), found).rho[floor]
    assert np.allclose(np.median(rho, 0), sunny.ALBEDO[0], rtol=0.15)


def test_gloss_in_shade_no_longer_makes_the_sun_weak(room):
    """A floor whose blue is no more than what its varnish reflects of the sky, in light and shade."""
    albedo = sunny.ALBEDO | {0: (0.3, 0.15, 0.04)}
    lit = measured(room, sunny.light(room, albedo))
    in_shade = np.pi * sunny.light(room, albedo, sun=np.zeros(3)) / room.by_object(albedo)
    gloss = np.where(room.atlas.object_id[:, None] == 0, 0.05 / np.pi * in_shade, 0).astype(np.float32)
    found = shade(
        room.surface, room.instances, replace(lit, radiance=lit.radiance + gloss), sky_map(),
        Settings(shading_rays=64, emitter_rays=16, threads=2),
    )  # fmt: skip
    assert found.sun is not None and found.sun.irradiance[2] < 0.8 * sunny.SUN[2]
    field, everything = lit_room(room.surface, found), np.arange(len(room.atlas))
    sunlight = sun_irradiance(field, everything, found.irradiance.mean(1), 2, 0)
    again = strength_without_gloss(field, lit.radiance, found.irradiance - sunlight, lit.seen, lit.clipped > 0.5)
    assert again is not None and np.array_equal(again.direction, found.sun.direction)
    assert np.allclose(again.irradiance, sunny.SUN, rtol=0.15)
    # Of most that it lights no more than a lower bound is known: the edges have nothing to add.
    clipped = (sunny.sun_on(room) > 0) & (np.arange(len(room.atlas)) % 4 > 0)
    assert strength_without_gloss(field, lit.radiance, found.irradiance - sunlight, lit.seen, clipped) is None


@pytest.mark.slow
@pytest.mark.parametrize("sun", [sunny.SUN, np.zeros(3)])
def test_a_chequered_floor_neither_hides_a_sun_nor_makes_one(room, sun):
    """Dark tiles in the sun are as bright as white ones in shade, so an object's spread of albedo tells nothing."""
    L = sunny.light(room, sun=np.asarray(sun))
    tile = np.floor(room.atlas.position[:, :2] / 0.3).astype(int).sum(1) % 2
    floor = room.atlas.object_id == 0
    L[floor] *= np.where(tile[floor] == 0, 0.15, 1.4)[:, None]
    found = run(room, L)
    if not np.any(sun):
        assert found.sun is None
    else:
        assert found.sun is not None and angle(found.sun.direction, sunny.TOWARDS) < 0.6
        assert found.sun.irradiance @ LUMINANCE == pytest.approx(sunny.SUN @ LUMINANCE, rel=0.3)


@pytest.mark.slow
def test_without_a_sun_none_is_made_up(room):
    found = run(room, sunny.light(room, sun=np.zeros(3)))
    assert found.sun is None and not any("sun" in note for note in found.notes)


def poster(points, low, high):
    return ((points > low) & (points < high)).all(1)


@pytest.mark.slow
def test_paper_and_posters_are_no_sun(room):
    """A sheet of albedo 0.9 on a floor of 0.06, and a bright poster on a dark wall, opposite the window."""
    L = sunny.light(room, sunny.ALBEDO | {0: 0.06, 2: 0.08}, sun=np.zeros(3))
    at = room.atlas.position
    sheet = (room.atlas.object_id == 0) & poster(at[:, :2], (0.8, 0.6), (1.4, 1.2))
    hung = (room.atlas.object_id == 2) & poster(at[:, 1:], (0.5, 0.6), (1.3, 1.4))
    L[sheet] *= 0.9 / 0.06
    L[hung] *= 0.9 / 0.08
    assert run(room, L, texture=0.1).sun is None


@pytest.mark.slow
def test_what_a_lamp_lights_is_no_sun(room):
    """A spotlight that the mesh lacks throws a round spot on the floor, brighter than all else."""

    def spot(points, normals):
        off = np.linalg.norm(points - (1.1, 1.0, 0.0), axis=1)
        return (np.float64([12, 11, 9]) * np.clip((0.4 - off) / 0.05, 0, 1)[:, None]) * (normals[:, 2:] > 0.9)

    found = run(room, sunny.light(room, sun=np.zeros(3), extra=spot), texture=0.1)
    assert found.sun is None


@pytest.mark.slow
def test_what_copper_throws_is_no_sun(room):
    """A patch through the window whose light is redder than any sun's: a shade of copper throws such onto a table."""
    found = run(room, sunny.light(room, sun=np.array([24.0, 12.0, 5.0])))
    assert found.sun is None


@pytest.mark.slow
def test_what_shines_from_below_the_horizon_is_no_sun(room):
    """A patch high up opposite the window, as a lamp in the street throws it; the same from above is a sun."""
    below = np.array([0.93, -0.2, -0.3]) / np.linalg.norm([0.93, -0.2, -0.3])
    nothing_known = sky_map(np.zeros((64, 128), np.int32))
    assert run(room, sunny.light(room, towards=below), nothing_known).sun is None
    assert run(room, sunny.light(room), nothing_known).sun is not None


@pytest.mark.slow
def test_a_sun_is_found_where_frames_show_a_sky_without_it(room):
    """No camera sees a renderer's sun."""
    found = run(room, sunny.light(room), sky_map(np.ones((64, 128), np.int32)))
    assert angle(found.sun.direction, sunny.TOWARDS) < 0.6
    assert np.allclose(found.sun.irradiance, sunny.SUN, rtol=0.15)


def with_disc(direction, irradiance, rows=256, sky=1.0):
    blank = Environment(np.full((rows, 2 * rows, 3), sky, np.float32), np.ones((rows, 2 * rows), np.int32))
    sun = Sun(np.float32(direction), np.float32(irradiance))
    radiance = insert_sun(blank, sun)
    return Environment(radiance, np.ones(radiance.shape[:2], np.int32)), sun


def irradiance_of(radiance, direction):
    """E of a facing surface, from all texels of a map."""
    height = len(radiance)
    v, u = (np.indices(radiance.shape[:2]).T + 0.5).T / [[[height]], [[2 * height]]]
    latitude, longitude = (v - 0.5) * np.pi, (0.5 - u) * 2 * np.pi
    way = np.stack([np.cos(latitude) * np.cos(longitude), np.cos(latitude) * np.sin(longitude), np.sin(latitude)], -1)
    solid = np.cos(latitude) * (np.pi / height) ** 2
    cosine = np.maximum(way @ direction, 0)
    return np.einsum("hwc,hw->c", radiance.astype(float), solid * cosine), way, solid


@pytest.mark.parametrize("rows", [1, 64, 512])
@pytest.mark.parametrize("direction", [(0.6, 0.0, 0.8), (-0.9999, 0.001, 0.01), (-0.8, -0.0005, -0.6)])
def test_a_sun_in_the_map_gives_its_irradiance_from_its_place(rows, direction):
    direction = np.array(direction) / np.linalg.norm(direction)
    dark = Environment(np.zeros((rows, 2 * rows, 3), np.float32), np.zeros((rows, 2 * rows), np.int32))
    radiance = insert_sun(dark, Sun(np.float32(direction), np.float32([30, 20, 10]), RADIUS))
    assert len(radiance) >= 512
    E, way, solid = irradiance_of(radiance, direction)
    assert np.allclose(E, [30, 20, 10], rtol=1e-3)
    middle = np.einsum("hwj,hw->j", way, radiance[..., 0] * solid)
    assert angle(middle / np.linalg.norm(middle), direction) < 0.05


def test_a_seen_sun_comes_out_of_the_map_and_goes_back_in():
    direction = np.array([0.5, 0.3, 0.6]) / np.linalg.norm([0.5, 0.3, 0.6])
    shown, sun = with_disc(direction, (40, 30, 20))
    left, found = extract_sun(shown)
    assert found.seen and angle(found.direction, direction) < 0.1
    assert np.allclose(found.irradiance, sun.irradiance, rtol=0.02)
    assert np.allclose(left.radiance, 1.0, atol=1e-4)
    whole, _, _ = irradiance_of(insert_sun(left, found), direction)
    assert np.allclose(whole, irradiance_of(shown.radiance, direction)[0], rtol=0.01)


def test_what_is_no_sun_stays_in_the_map():
    plain = Environment(np.random.default_rng(0).uniform(0.5, 5, (64, 128, 3)).astype(np.float32),
                        np.ones((64, 128), np.int32))  # fmt: skip
    assert extract_sun(plain) == (plain, None)
    two, _ = with_disc((0.6, 0, 0.8), (40, 30, 20))
    other, _ = with_disc((0, 0.8, 0.6), (40, 30, 20))
    both = Environment(two.radiance + other.radiance, two.observations)
    assert extract_sun(both)[1] is None
    clipped = two.radiance[..., 0] > 10
    assert extract_sun(Environment(two.radiance, two.observations, clipped))[1] is None
    faint, _ = with_disc((0.6, 0, 0.8), (0.01, 0.01, 0.01))
    assert extract_sun(faint)[1] is None
    assert extract_sun(Environment.dark())[1] is None


@pytest.mark.slow
def test_a_seen_sun_lights_the_room_without_noise(room):
    """E in the patch is that of sun and sky, though the sun is half a texel of the map."""
    blank = sky_map(np.ones((64, 128), np.int32))
    shown = Environment(
        insert_sun(blank, Sun(np.float32(sunny.TOWARDS), np.float32(sunny.SUN))), np.ones((512, 1024), int)
    )
    light = sunny.light(room)
    found = run(room, light, shown, texture=0.0)
    assert found.sun.seen and np.allclose(found.sun.irradiance, sunny.SUN, rtol=0.03)
    patch = (sunny.sun_on(room) > 0.99 * sunny.TOWARDS[2]) & (room.atlas.object_id == 0)
    rho = albedo_in(room, measured(room, light, texture=0.0), found).rho[patch]
    assert np.allclose(np.median(rho, 0), sunny.ALBEDO[0], rtol=0.05)
    assert np.percentile(np.abs(rho / np.float32(sunny.ALBEDO[0]) - 1), 95) < 0.15


def test_the_edge_of_a_shadow_is_in_doubt():
    floor = make_room([quad((0, 0, 0), (1, 0, 0), (0, 1, 0), 0), quad((-1, -1, 1), (1.5, 0, 0), (0, 3, 0), 1)], 0.02)
    sun = Sun(np.float32([0, 0, 1]), np.float32([3, 2, 1]))
    own = floor.atlas.object_id == 0
    x = floor.atlas.position[own, 0]
    found = sunlight(floor.scene, sun, floor.atlas.position[own], floor.atlas.normal[own], 0.02)
    assert np.allclose(found[x > 0.53], [3, 2, 1, 0]) and (found[x < 0.47] == 0).all()
    edge = np.abs(x - 0.5) < 0.012
    assert edge.any() and (found[edge, 3] > 0.3).mean() > 0.5
    assert found[:, :3] @ LUMINANCE == pytest.approx(found[:, 0] / 3 * float(sun.irradiance @ LUMINANCE), abs=1e-5)


def clipped_at(lit: LitDiffuse, level: float) -> LitDiffuse:
    """The same as a sensor shows it that holds no more than a level in any channel."""
    over = (lit.radiance > level).any(1)
    return replace(lit, radiance=np.minimum(lit.radiance, np.float32(level)), clipped=over.astype(np.float32))


def sun_by(room, lit: LitDiffuse) -> Sun | None:
    """What is found in a room all of whose other light is known."""
    field = room.field(lit.radiance, sky_map())

    def irradiance(element):
        return irradiance_at(field, element, 0)

    element = np.sort(np.random.default_rng(0).choice(len(room.atlas), 8000, replace=False))
    lower = lit.lower_bounds(np.ones(3))
    found = find_sun(field, element, irradiance(element), lit.seen, irradiance, room.atlas.object_id, lower)
    return found and found.sun


DARK_FLOOR = sunny.ALBEDO | {0: (0.35, 0.25, 0.15)}


@pytest.mark.parametrize("seed", range(3))
def test_a_sun_is_found_by_a_patch_nearly_all_of_which_is_clipped(room, seed):
    """Few elements tell how bright it is, and by their red alone it would be none."""
    lit = measured(room, sunny.light(room, DARK_FLOOR), noise=0.1, texture=0.3, seed=seed)
    patch = sunny.sun_on(room) > 0.9 * sunny.TOWARDS[2]
    lit = clipped_at(lit, float(np.quantile(lit.radiance[patch].max(1), 0.05)))
    assert lit.clipped[patch].mean() > 0.9
    found = sun_by(room, lit)
    assert found is not None and angle(found.direction, sunny.TOWARDS) < 1.5
    assert 0.4 < found.irradiance @ LUMINANCE / (sunny.SUN @ LUMINANCE) < 2


@pytest.mark.parametrize("albedo", [sunny.ALBEDO, DARK_FLOOR])
def test_a_sun_is_found_by_a_patch_most_of_which_is_clipped(room, albedo):
    lit = measured(room, sunny.light(room, albedo), texture=0.3)
    patch = sunny.sun_on(room) > 0.9 * sunny.TOWARDS[2]
    lit = clipped_at(lit, float(np.quantile(lit.radiance[patch].max(1), 0.4)))
    assert lit.clipped[patch].mean() > 0.55
    found = sun_by(room, lit)
    assert found is not None and angle(found.direction, sunny.TOWARDS) < 1.5
    assert found.irradiance @ LUMINANCE == pytest.approx(sunny.SUN @ LUMINANCE, rel=0.4)
    assert any("sun" in word for word in found.note.split())


@pytest.mark.slow
@pytest.mark.parametrize("off, seed", [(0.045, 2), (0.07, 0)])
def test_a_sun_is_found_by_shadows_that_lie_a_little_off(off, seed):
    """As those of a fused mesh do, by more than neighbours lie apart: across the edge they are hardly more alike."""
    room = sunny.sunny_room(0.02)
    rng, at = np.random.default_rng(seed), room.atlas.position
    waves = np.sin(at @ rng.normal(0, 4, (6, 3)).T + rng.uniform(0, 2 * np.pi, 6))
    beside = off * waves @ rng.normal(0, 6**-0.5, (6, 3))
    place = np.concatenate([at, room.atlas.normal, 100 * room.atlas.object_id[:, None]], 1)
    _, shown = cKDTree(place).query(place + np.pad(beside, ((0, 0), (0, 4))))
    lit = measured(room, sunny.light(room, DARK_FLOOR)[shown], noise=0.1, texture=0.3, seed=seed)
    patch = sunny.sun_on(room) > 0.9 * sunny.TOWARDS[2]
    found = sun_by(room, clipped_at(lit, float(np.quantile(lit.radiance[patch].max(1), 0.2))))
    assert found is not None and angle(found.direction, sunny.TOWARDS) < 2
    assert 0.5 < found.irradiance @ LUMINANCE / (sunny.SUN @ LUMINANCE) < 2


def test_how_much_a_sun_raises_the_light_is_told_where_it_falls(room):
    """Three elements of ten get three times as much by it."""
    field, element = room.field(np.ones((len(room.atlas), 3), np.float32), sky_map()), np.arange(10)
    spots = Spots(field, element, np.full((10, 3), 0.5), room.atlas.object_id, no_bounds(room))
    assert spots.raised(np.where(element < 3, 0.25, 0), 4.0) == pytest.approx(np.log(3))
    assert spots.raised(np.zeros(10), 4.0) == 0


@pytest.mark.slow
@pytest.mark.parametrize("share, is_sun", [(0.08, True), (0.02, False)])
def test_what_hardly_raises_the_light_is_no_sun(room, share, is_sun):
    """Paper stands out; a sun behind clouds makes its patch twice as bright as what lies around it, a glow a fifth."""
    L = sunny.light(room, sunny.ALBEDO | {0: 0.06}, sun=share * sunny.SUN)
    sheet = (room.atlas.object_id == 0) & poster(room.atlas.position[:, :2], (0.2, 1.5), (0.6, 1.9))
    L[sheet] *= 0.9 / 0.06
    assert (run(room, L, texture=0.02).sun is not None) == is_sun


def test_without_a_sun_what_is_clipped_is_none(room):
    lit = measured(room, sunny.light(room, sun=np.zeros(3)), texture=0.3)
    level = float(np.quantile(lit.radiance.max(1), 0.95))
    assert sun_by(room, clipped_at(lit, level)) is None


def test_a_clipped_patch_sends_what_it_reflects_of_the_sun(room):
    """Its level is a fifth of what it sends: so much less than it does it would light the room."""
    true = sunny.light(room)
    E = np.pi * true / room.by_object(sunny.ALBEDO)
    sun_E = sunny.sun_on(room)[:, None] * sunny.SUN
    patch = (sunny.sun_on(room) > 0.9 * sunny.TOWARDS[2]) & (room.atlas.object_id == 0)
    level = 0.2 * float(np.median(true[patch].max(1)))
    lit = clipped_at(measured(room, true, noise=0, texture=0), level)
    clipped, element = lit.clipped > 0.5, np.arange(0, len(true), 3)
    field = under_the_sun(room, lit.radiance)
    found = with_clipped_sunlight(field, clipped, element, (E - sun_E)[element], room.atlas.object_id)
    assert clipped[patch].all() and np.median(lit.radiance[patch] / true[patch]) < 0.4
    assert np.allclose(np.median(found[patch] / true[patch], 0), 1, atol=0.15)
    assert np.array_equal(found[~clipped], lit.radiance[~clipped]) and (found >= lit.radiance).all()
    element = element[room.atlas.object_id[element] != 0]  # nothing tells the floor's albedo
    bound = with_clipped_sunlight(field, clipped, element, (E - sun_E)[element], room.atlas.object_id)
    assert np.array_equal(bound[patch], lit.radiance[patch])


def test_of_a_striped_floor_the_sun_lights_all_stripes(room):
    """Frames clip the bright ones first: what is left unclipped around the patch tells of the dark ones alone."""
    true = sunny.light(room)
    E = np.pi * true / room.by_object(sunny.ALBEDO)
    sun_E = sunny.sun_on(room)[:, None] * sunny.SUN
    floor = room.atlas.object_id == 0
    patch = (sunny.sun_on(room) > 0.9 * sunny.TOWARDS[2]) & floor
    stripe = floor & (np.floor(room.atlas.position[:, 0] / 0.1) % 4 == 0)
    true = np.where(stripe[:, None], 2.5 * true, true).astype(np.float32)
    bound = np.where(patch[:, None], 0.2 * true, true).astype(np.float32)
    field = under_the_sun(room, bound)
    element = np.arange(0, len(true), 3)
    found = with_clipped_sunlight(field, patch, element, (E - sun_E)[element], room.atlas.object_id)
    assert found[patch].mean() == pytest.approx(true[patch].mean(), rel=0.1)


def test_what_the_sun_lights_is_told_from_what_shines_in_shade(room):
    field = under_the_sun(room, sunny.light(room))
    on, floor = sunny.sun_on(room), room.atlas.object_id == 0
    assert mostly_lit(field, (on > 0.9 * sunny.TOWARDS[2]) & floor) and not mostly_lit(field, (on == 0) & floor)


def test_a_sun_whose_patch_is_clipped_is_as_strong_as_what_the_patch_reflects_into_the_room_tells(room):
    """Its level, a fifth of what it sends, tells only as much of the sun; the room's other objects are known."""
    true = sunny.light(room, DARK_FLOOR)
    patch = (sunny.sun_on(room) > 0.9 * sunny.TOWARDS[2]) & (room.atlas.object_id == 0)
    level = 0.2 * float(np.median(true[patch].max(1)))
    settings = Settings(shading_rays=64, emitter_rays=16, threads=2)

    def shaded(seed: int, without: tuple[str, ...] = ()):
        lit = clipped_at(measured(room, true, seed=seed), level)
        return shade(room.surface, room.instances, lit, sky_map(), replace(settings, without=without))

    by_bound, found = shaded(0, ("clipped-sunlight",)), [shaded(seed) for seed in range(3)]
    E, shade_of_all = np.pi * true / room.by_object(DARK_FLOOR), sunny.sun_on(room) == 0
    assert by_bound.sun.irradiance @ LUMINANCE < 0.75 * sunny.SUN @ LUMINANCE
    suns = [shading.sun.irradiance @ LUMINANCE for shading in found]
    assert np.median(suns) == pytest.approx(sunny.SUN @ LUMINANCE, rel=0.15)
    off_by_bound, *off = (
        np.abs(np.median(shading.irradiance[shade_of_all] / E[shade_of_all], 0) @ LUMINANCE - 1)
        for shading in (by_bound, *found)
    )
    assert max(off) < min(0.06, off_by_bound)


@pytest.mark.parametrize("seed", range(3))
def test_a_sun_is_as_strong_as_the_channels_tell_that_no_frame_clips(room, seed):
    """All of the patch is clipped in red, where its level is half of what a brown floor sends; none in blue."""
    true = sunny.light(room, DARK_FLOOR)
    patch = (sunny.sun_on(room) > 0.9 * sunny.TOWARDS[2]) & (room.atlas.object_id == 0)
    lit = measured(room, true, texture=0.05, seed=seed)
    lit = clipped_at(lit, 0.5 * float(np.median(true[patch].max(1))))
    lower = lit.lower_bounds(np.ones(3))
    assert lower[patch, 0].mean() > 0.95 and not lower[patch, 2].any()
    found = sun_by(room, lit)
    assert found.irradiance[2] == pytest.approx(sunny.SUN[2], rel=0.15)
    # Of the others it is known that a sun is about white.
    assert 0.7 < found.irradiance @ LUMINANCE / (sunny.SUN @ LUMINANCE) < 1.2


def test_which_channels_are_lower_bounds_goes_by_the_colour_at_which_frames_clip():
    """A camera that takes yellow light for white holds twice as much blue."""
    radiance = np.float32([[1, 1, 2], [1, 1, 0.9], [0.2, 1, 2], [1, 1, 2], [1, np.nan, 1]])
    share = np.float32([1, 1, 0.6, 0.4, 1])
    lit = LitDiffuse(radiance, np.zeros((5, 3)), np.ones(5, np.int32), np.zeros(5, np.int8), share)
    bounds = lit.lower_bounds(np.array([0.5, 0.5, 1]))
    assert bounds[:3].tolist() == [[True, True, True], [True, True, False], [False, True, True]]
    assert not bounds[3].any()
