"""A box of one object, as a fused mesh is: its lamp is clipped in every frame, or hangs in a hole of the mesh."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from scipy.spatial import cKDTree

from addon.core.light.environment import Environment
from addon.core.light.few_elements import from_sun, irradiance_at
from addon.core.light.mirrors import Mirror
from addon.core.light.openings import CELLS, Openings
from addon.core.light.sun import Sun
from addon.core.passes.clipped_lamps.clipped import clipped_objects
from addon.core.passes.clipped_lamps.patches import clipped_patches, measured_patches
from addon.core.passes.missing_light.missing_light import MISSING, _through_cells, find_missing_light, same_lamps
from addon.core.scene.elements import ElementLookup
from addon.core.scene.lit_diffuse import LitDiffuse
from addon.core.scene.patches import Patches
from addon.core.scene.visibility import CLEAN, EDGE
from tests.core.rooms import DARK, Room, around, box_sides, cut, make_room, quad, split

LAMP = np.array([40.0, 36.0, 30.0], np.float32)
CLIPPED = 1.0
AT = (0.4, 0.6), (0.3, 0.5)


@cache
def box(hole: bool = False) -> Room:
    """Object 0 throughout; the lamp's quads are the last, and absent with a `hole`."""
    sides = [replace(one, object_id=0) for one in box_sides()]
    ceiling = sides.pop(1)
    quads = [cell for one in [*sides, *around(ceiling, *AT)] for cell in split(one, 6)]
    return make_room(quads if hole else [*quads, *split(cut(ceiling, *AT), 4)], texel=0.2)


def patches_of(room: Room, lit: LitDiffuse) -> Patches:
    return clipped_patches(room.mesh, room.atlas, ElementLookup(room.mesh, room.atlas), lit)


def in_lamp(room: Room) -> np.ndarray:
    """(n,) bool"""
    return room.atlas.triangle >= len(room.mesh.triangles) - 32


@cache
def lit() -> tuple[np.ndarray, np.ndarray]:
    """Albedo and radiance of the box, by bounces: floor of two paints, walls of a third."""
    room = box()
    rho = np.tile(np.float32([0.6, 0.55, 0.5]), (len(room.atlas), 1))
    x, z = room.atlas.position[:, 0], room.atlas.position[:, 2]
    rho[(z < 0.01) & (x < 1.5)] = 0.2, 0.25, 0.3
    rho[(z < 0.01) & (x >= 1.5)] = 0.4, 0.2, 0.1
    lamp = in_lamp(room)
    radiance = np.where(lamp[:, None], LAMP, np.float32(0))
    for bounce in range(6):
        E = irradiance_at(room.field(radiance), np.arange(len(room.atlas)), bounce)
        radiance = np.where(lamp[:, None], LAMP, rho * E / np.pi).astype(np.float32)
    return rho, radiance


def seen(radiance: np.ndarray, clipped: np.ndarray) -> LitDiffuse:
    n = len(radiance)
    none = np.zeros_like(radiance)
    return LitDiffuse(radiance, none, np.full(n, 9, np.int32), np.full(n, CLEAN, np.int8), clipped.astype(np.float32))


def off(found: np.ndarray, true: np.ndarray) -> float:
    """Median relative error."""
    return float(np.median(np.abs(found / true - 1)))


def test_a_patch_is_what_nearly_all_frames_clip():
    room = box()
    window = (room.atlas.position[:, 0] < 0.01) & (room.atlas.position[:, 2] > 1)
    share = np.where(in_lamp(room), 0.85, np.where(window, 0.3, 0.0))
    share[np.flatnonzero(in_lamp(room))[::3]] = 1.0
    found = patches_of(room, seen(lit()[1], share))
    assert sorted(found.triangle) == list(range(len(room.mesh.triangles) - 32, len(room.mesh.triangles)))
    assert found.objects == [1]


def test_a_lamp_that_no_frame_clips_is_a_patch_whose_radiance_is_told():
    room, (_, radiance) = box(), lit()
    shown = seen(radiance, np.zeros(len(room.atlas)))
    patches = patches_of(room, shown)
    assert sorted(patches.triangle) == list(range(len(room.mesh.triangles) - 32, len(room.mesh.triangles)))
    apart = replace(room.atlas, object_id=patches.mesh(room.mesh).object_id[room.atlas.triangle])
    assert measured_patches(patches.objects, apart, shown) == patches.objects
    assert measured_patches(patches.objects, apart, seen(radiance, in_lamp(room).astype(float))) == []


def test_sunlight_on_the_floor_is_no_patch():
    """Twenty times as bright as the room, and not clipped."""
    room, (_, radiance) = box(), lit()
    dim = np.where(in_lamp(room)[:, None], np.float32(0.1), radiance)
    spot = (room.atlas.position[:, 2] < 0.01) & (np.abs(room.atlas.position[:, 0] - 2) < 0.4)
    dim[spot] = 20 * np.median(dim, 0)
    assert not len(patches_of(room, seen(dim, np.zeros(len(room.atlas)))))


@pytest.mark.parametrize("far_off", [0.3, 1.0])
def test_what_fades_out_is_lit_and_no_patch(far_off):
    """A lamp so many metres off a wall lights it; the sensor clips the brightest of that, or a lamp in the wall."""
    room = make_room(split(quad((0, 0, 0), (4, 0, 0), (0, 4, 0), 0), 80), texel=0.02)
    from_middle = np.linalg.norm(room.atlas.position[:, :2] - 2, axis=1)
    light = 0.1 + 3 * (1 + (from_middle / far_off) ** 2) ** -1.5
    clipped = light > 1.5
    dark = np.where(clipped, 1.5, 0.3 * light)
    for shown, patches in ((np.minimum(light, 1.5), 0), (dark, 1)):
        radiance = np.repeat(shown[:, None], 3, 1).astype(np.float32)
        assert len(patches_of(room, seen(radiance, clipped.astype(float))).objects) == patches


@pytest.mark.parametrize("seen_around", [0.1, 1.0])
def test_a_few_elements_of_its_frame_do_not_tell_a_window_from_what_is_lit(seen_around):
    """A pane lights its frame; in a recess frames see little else beside it."""
    pane = split(quad((0, 0, 0), (2, 0, 0), (0, 2, 0), 0), 40)
    beside = around(quad((-0.2, -0.2, 0), (2.4, 0, 0), (0, 2.4, 0), 0), (1 / 12, 11 / 12), (1 / 12, 11 / 12))
    room = make_room([*pane, *beside], texel=0.02)
    shown = seen(np.full((len(room.atlas), 3), 0.7, np.float32), np.zeros(len(room.atlas)))
    in_pane = room.atlas.triangle < 2 * len(pane)
    shown.radiance[in_pane], shown.clipped[in_pane] = CLIPPED, 1
    hidden = ~in_pane & (np.abs(room.atlas.position[:, 1] - 1) > seen_around)
    shown.radiance[hidden], shown.tier[hidden], shown.count[hidden] = np.nan, -1, 0
    assert len(patches_of(room, shown).objects) == (0 if seen_around == 1 else 1)


def test_a_table_by_a_window_is_no_part_of_it():
    """The mesh is of one piece, and the sensor clips both."""
    room = make_room(
        [*split(quad((0, 0, 0), (1, 0, 0), (0, 0, 1), 0), 10), *split(quad((0, 0, 0), (0, 1, 0), (1, 0, 0), 1), 10)],
        texel=0.02,
    )
    shown = seen(np.full((len(room.atlas), 3), CLIPPED, np.float32), np.ones(len(room.atlas)))
    patches = patches_of(room, shown)
    assert len(patches.objects) == 2
    assert len(np.unique(np.stack([patches.object_id, room.mesh.object_id[patches.triangle]]), axis=1).T) == 2


def test_an_object_is_clipped_if_most_frames_show_most_of_it_clipped():
    """Whatever a few pixels of its edge say where poses are off; not if half of its frames tell its radiance."""
    room, (_, radiance) = box(), lit()
    apart = replace(room.atlas, object_id=np.where(in_lamp(room), 1, 0).astype(np.int32))
    shown = replace(
        seen(np.where(in_lamp(room)[:, None], np.float32(CLIPPED), radiance), np.where(in_lamp(room), 0.9, 0)),
        tier=np.where(in_lamp(room), EDGE, CLEAN).astype(np.int8),
    )
    assert clipped_objects(shown, apart) == {1: pytest.approx(CLIPPED)}
    assert clipped_objects(shown, apart, but=[1]) == {}
    assert clipped_objects(replace(shown, clipped=shown.clipped / 2), apart) == {}


@pytest.mark.parametrize("seed", [0, 1])
def test_a_clipped_lamp_of_the_same_object_gets_its_radiance(seed):
    room, (rho, radiance) = box(), lit()
    measured = np.where(in_lamp(room)[:, None], np.float32(CLIPPED), radiance)
    patches = patches_of(room, seen(measured, in_lamp(room).astype(float)))
    mesh = patches.mesh(room.mesh)
    apart = replace(room, mesh=mesh)
    field, good = apart.field(measured), np.ones(len(room.atlas), bool)
    found = find_missing_light(field, good, patches.objects, seed)
    assert found.believed
    assert [lamp.object_id for lamp in found.lamps] == [1]
    assert found.lamps[0].clipped and not found.lamps[0].seen
    assert found.lamps[0].radiance == pytest.approx(LAMP, rel=0.3)
    everything = np.where(in_lamp(room)[:, None], found.lamps[0].radiance, measured)
    E = irradiance_at(apart.field(everything), np.flatnonzero(~in_lamp(room)), seed)
    albedo = np.pi * measured[~in_lamp(room)] / E
    assert off(albedo, rho[~in_lamp(room)]) < 0.2
    assert (albedo > 1).mean() < 0.03


def test_patches_of_about_one_area_in_one_plane_are_the_same_lamp():
    """Each gives as much light, so the smaller is the brighter; what lies elsewhere is another lamp."""
    room = box()
    atlas, x = room.atlas, room.atlas.position[:, 0]
    floor = (atlas.position[:, 2] < 0.01) & (np.abs(x - 2) < 0.4)
    large, small = (in_lamp(room) & way for way in ((x > 1.4) & (x < 1.8), x < 1.4))
    radiance = same_lamps(atlas, [small, floor, large])
    light = radiance * np.array([[atlas.area[own].sum()] for own in (small, floor, large)])
    assert radiance.shape == (3, 2)
    (together,) = np.flatnonzero(radiance[0] > 0)
    assert light[0, together] == pytest.approx(light[2, together]) and not radiance[1, together]
    assert radiance[1, 1 - together] == pytest.approx(1) and not radiance[[0, 2], 1 - together].any()
    assert same_lamps(atlas, []).shape == (0, 0)


def test_a_patch_that_is_as_bright_as_it_was_measured_is_no_lamp():
    """White paint on a dark floor."""
    room, (_, radiance) = box(), lit()
    floor = (room.atlas.position[:, 2] < 0.01) & (np.abs(room.atlas.position[:, 0] - 2) < 0.4)
    radiance = np.where(floor[:, None], 3 * radiance, radiance)
    shown = seen(radiance, floor.astype(float))
    patches = patches_of(room, shown)
    mesh = patches.mesh(room.mesh)
    measured = measured_patches(
        patches.objects, replace(room.atlas, object_id=mesh.object_id[room.atlas.triangle]), shown
    )
    (clipped,) = set(patches.objects) - set(measured)
    found = find_missing_light(replace(room, mesh=mesh).field(radiance), ~in_lamp(room), [clipped], 0)
    assert not found.lamps


def test_nothing_is_missing_where_all_light_was_measured():
    room, (_, radiance) = box(), lit()
    assert not find_missing_light(room.field(radiance), ~in_lamp(room), [], 0).believed


@pytest.mark.parametrize("seed", [0, 1])
def test_where_the_lamp_was_measured_what_closes_a_wall_gives_no_more_than_the_wall(seed):
    whole, (_, radiance) = box(), lit()
    room = replace(whole, mesh=replace(whole.mesh, closed=np.arange(72, 108, dtype=np.int32)))
    closing = (room.atlas.triangle >= 72) & (room.atlas.triangle < 108)
    field = room.field(np.where(closing[:, None], np.float32(0), radiance))
    found = find_missing_light(field, ~in_lamp(room), [], seed)
    place, normal = (getattr(room.atlas, name)[closing] for name in ("position", "normal"))
    solved = field.radiance.copy()
    solved[closing] = found.openings.radiance[found.openings.behind(place, normal)]
    others = np.flatnonzero(~closing & ~in_lamp(room))
    E = irradiance_at(field.with_light(solved), others, seed)
    assert off(E, irradiance_at(room.field(radiance), others, seed)) < 0.1
    assert not found.lamps


def test_light_through_a_hole_that_no_frame_saw_is_told_from_what_it_throws():
    whole, (_, radiance) = box(), lit()
    room = box(hole=True)
    same = cKDTree(whole.atlas.place(np.arange(len(whole.atlas)))).query(room.atlas.place(np.arange(len(room.atlas))))[
        1
    ]
    field, good = room.field(radiance[same]), np.ones(len(room.atlas), bool)
    found = find_missing_light(field, good, [], 0)
    assert found.believed
    everything = np.arange(len(room.atlas))
    E = irradiance_at(field.with_openings(found.openings), everything, 0)
    true = irradiance_at(whole.field(radiance), same, 0)
    assert off(E, true) < 0.25
    assert off(irradiance_at(field, everything, 0), true) > 0.5
    assert field.environment is DARK
    assert "openings" in found.notes[0]


def test_a_sky_that_every_frame_clips_is_told_from_what_it_throws():
    """The hole shows the sky, as bright as the lamp; what frames see unclipped stays."""
    whole, (_, radiance) = box(), lit()
    room = box(hole=True)
    same = cKDTree(whole.atlas.place(np.arange(len(whole.atlas)))).query(room.atlas.place(np.arange(len(room.atlas))))[
        1
    ]
    up = np.repeat(np.arange(32) >= 16, 64).reshape(32, 64)
    shown = np.where(up[..., None], np.float32(CLIPPED), np.float32(0.2)) * np.ones(3, np.float32)
    sky = Environment(shown, np.ones((32, 64), np.int32), up)
    field = room.field(radiance[same]).with_light(radiance[same], sky)
    found = find_missing_light(field, np.ones(len(room.atlas), bool), [], 0)
    assert found.believed
    assert (found.environment.radiance[~up] == shown[~up]).all()
    everything = np.arange(len(room.atlas))
    E = irradiance_at(field.with_openings(found.openings).with_light(radiance[same], found.environment), everything, 0)
    true = irradiance_at(whole.field(radiance), same, 0)
    assert off(E, true) < 0.35
    assert off(irradiance_at(field, everything, 0), true) > 0.45


def test_a_lamp_behind_faces_that_closed_a_hole_is_told_like_one_in_the_hole():
    """No frame saw the faces: what they send is unknown, and solved for."""
    whole, (rho, radiance) = box(), lit()
    faces = np.arange(len(whole.mesh.triangles) - 32, len(whole.mesh.triangles), dtype=np.int32)
    room = replace(whole, mesh=replace(whole.mesh, closed=faces))
    field = room.field(np.where(in_lamp(room)[:, None], np.float32(0), radiance))
    found = find_missing_light(field, ~in_lamp(room), [], 0)
    assert np.array_equal(found.shut, in_lamp(room))
    place, normal = (getattr(room.atlas, name)[found.shut] for name in ("position", "normal"))
    solved = field.radiance.copy()
    solved[found.shut] = found.openings.radiance[found.openings.behind(place, normal)]
    others = np.flatnonzero(~found.shut)
    E = irradiance_at(field.with_light(solved), others, 0)
    assert off(np.pi * radiance[others] / E, rho[others]) < 0.25
    # In the scene it hangs before those faces.
    panels = found.openings.panels(room.mesh.vertices[room.mesh.triangles[faces]])
    assert panels
    for panel in panels:
        assert panel.corners[..., 2].max() < place[:, 2].min()


@pytest.mark.parametrize("told", [0.33, 2.5])
def test_a_sun_of_which_frames_show_a_lower_bound_is_told_from_what_it_throws(told):
    """It falls through the hole onto the floor; its irradiance is told wrong by a factor, which counts as well."""
    room = box(hole=True)
    everything, irradiance = np.arange(len(room.atlas)), np.float32([60, 55, 45])
    sun = Sun(np.float32([0.1, 0.2, 0.97]) / np.linalg.norm([0.1, 0.2, 0.97]), irradiance, 0.005)
    rho = np.tile(np.float32([0.5, 0.45, 0.4]), (len(room.atlas), 1))
    radiance = np.zeros((len(room.atlas), 3), np.float32)
    for bounce in range(6):
        radiance = rho * irradiance_at(room.field(radiance).with_sun(sun), everything, bounce) / np.pi
        radiance = radiance.astype(np.float32)
    sunlit = from_sun(room.field(radiance).with_sun(sun), everything).any(1)
    assert 2 < sunlit.sum() < len(sunlit) / 10
    shown = np.where(sunlit[:, None], told * radiance, radiance).astype(np.float32)
    field = room.field(shown).with_sun(replace(sun, irradiance=told * irradiance))
    found = find_missing_light(field, ~sunlit, [], 0, sunlit=sunlit)
    assert (np.abs(np.log(told * found.sun)) < 0.8 * np.abs(np.log(told))).all()
    assert find_missing_light(field, ~sunlit, [], 0).sun == pytest.approx(np.ones(3))


def test_light_by_a_hole_that_a_mirror_shows_counts():
    """The ceiling sees the hole in it over a mirror on the floor alone."""
    sides = box_sides()
    room = make_room([sides[0], *around(sides[1], *AT), *sides[2:]], texel=0.2)
    atlas = room.atlas
    field = room.field(np.zeros((len(atlas), 3), np.float32)).with_light(
        np.full((len(atlas), 3), 0.01, np.float32) * (atlas.object_id != 0)[:, None], Environment.dark()
    )
    mirror = Mirror(0, np.zeros(3, np.float32), np.float32([0, 0, 1]), np.full(3, 0.9, np.float32))
    ceiling = np.flatnonzero(atlas.object_id == 1)
    low, size = field.outer_box
    bright = field.with_openings(Openings(low, size, np.ones((CELLS, 3), np.float32), 1.0))
    for one, seen in ((bright.with_mirrors((mirror,)), True), (bright, False)):
        through = _through_cells(
            one,
            one.environment.clipped_parts(MISSING.sky),
            np.zeros(len(atlas), bool),
            np.zeros(CELLS, bool),
            ceiling,
            0,
        )[1].sum(1)
        dark = one.with_light(np.zeros_like(one.radiance))
        assert through.mean() == pytest.approx(irradiance_at(dark, ceiling, 0)[:, 0].mean(), rel=0.1)
        assert (through.mean() > 0.01) == seen


def test_patches_in_one_plane_are_one_lamp_though_the_normal_of_one_is_off():
    tilted = np.deg2rad(6.0)
    normal = np.repeat(np.float32([[np.sin(tilted), 0, -np.cos(tilted)], [0, 0, -1], [0, 0, -1]]), 4, 0)
    at = np.repeat(np.float32([[0, 0, 2.4], [2, 0, 2.4], [1, 0, 1.9]]), 4, 0)
    atlas = replace(box().atlas, position=at, normal=normal, area=np.float32([1.1] * 4 + [1.0] * 8))
    same = same_lamps(atlas, [np.arange(12) // 4 == k for k in range(3)])
    assert (same > 0).astype(int).tolist() in ([[1, 0], [1, 0], [0, 1]], [[0, 1], [0, 1], [1, 0]])
