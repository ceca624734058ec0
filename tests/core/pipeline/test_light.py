"""Lamps, seen and unseen, in rooms whose light is known by radiosity."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial import cKDTree

from addon.core.light.emitters import bright_triangles
from addon.core.light.environment import Environment
from addon.core.light.few_elements import irradiance_at
from addon.core.light.lamps import Lamp, find_seen
from addon.core.light.mirrors import Mirror
from addon.core.luminance import LUMINANCE
from addon.core.passes.unseen_light.unseen_light import bright_all_over
from addon.core.pipeline.shading import shade
from addon.core.scene.lit_diffuse import LitDiffuse
from addon.core.scene.visibility import EDGE
from addon.core.settings import Settings
from tests.core.on_disk import ALBEDO
from tests.core.rooms import DARK, Quad, albedo_in, around, box_sides, cut, lit_box, make_room, quad, radiosity, split

TWO = (((0.3, 0.7), (0.2, 0.3)), ((0.3, 0.7), (0.7, 0.8)))


def measured(room, radiance, hidden=(), noise=0.03, texture=0.0, seed=0) -> LitDiffuse:
    """L_d as frames would give it, but for objects `hidden`. `texture`: spread of log albedo within objects."""
    rng = np.random.default_rng(seed)
    n = len(room.atlas)
    cells = np.floor(room.atlas.position * 2.5).astype(int) @ [1, 31, 977]  # patches of 40 cm
    patch = rng.normal(0, texture, cells.max() + 1)[cells][:, None] if texture else 0
    L = (radiance * np.exp(rng.normal(0, noise, (n, 3)) + patch)).astype(np.float32)
    seen = ~np.isin(room.atlas.object_id, list(hidden))
    L[~seen] = np.nan
    count, tier = np.where(seen, 9, 0).astype(np.int32), np.where(seen, 0, -1).astype(np.int8)
    return LitDiffuse(L, np.zeros_like(L), count, tier, np.zeros(len(L), np.float32))


def run(room, lit, rays=64, **options):
    settings = Settings(shading_rays=rays, emitter_rays=16, threads=2)
    return shade(room.surface, room.instances, lit, DARK, settings, **options)


@pytest.fixture(scope="module")
def two_lamps():
    """Object 6 at (10, 9, 8), object 7 at (20, 18, 16)."""
    room = make_room(lit_box(lamps=TWO), 0.2)
    return room, radiosity(room, ALBEDO, {6: (10, 9, 8), 7: (20, 18, 16)})


def test_lamps_that_are_seen_are_found(two_lamps):
    room, L = two_lamps
    found = {lamp.object_id: lamp for lamp in run(room, measured(room, L)).lamps}
    assert set(found) == {6, 7} and all(lamp.seen for lamp in found.values())
    assert np.allclose(found[6].radiance, (10, 9, 8), rtol=0.03)
    assert np.allclose(found[7].radiance, (20, 18, 16), rtol=0.03)


@pytest.mark.parametrize(("hidden", "radiance"), [(6, (10, 9, 8)), (7, (20, 18, 16))])
def test_a_lamp_that_no_frame_sees_is_solved_for(two_lamps, hidden, radiance):
    """In a room with texture (15 %) and noise; its radiance to 15 %, and albedo comes out right with it."""
    room, L = two_lamps
    lit = measured(room, L, {hidden}, texture=0.15)
    result = run(room, lit)
    found = {lamp.object_id: lamp for lamp in result.lamps}
    assert set(found) == {6, 7} and not found[hidden].seen and found[13 - hidden].seen
    off = found[hidden].radiance @ LUMINANCE / (np.float32(radiance) @ LUMINANCE)
    assert off == pytest.approx(1, abs=0.15)
    before, after = found[hidden].spread
    assert after < before and found[hidden].note({}).startswith("No frame sees it; solved from the light it throws")
    albedo = albedo_in(room, lit, result)
    for object_id, rho in ALBEDO.items():
        own = room.atlas.object_id == object_id
        assert np.allclose(np.median(albedo.rho[own], 0), rho, rtol=0.15)


@pytest.fixture(scope="module")
def strips():
    """Object 6 is large; 7 and 8 are the same small strip, of another radiance. All are told to be of one class."""
    sides = box_sides()
    ceiling = sides.pop(1)
    for i, at in enumerate(((0.3, 0.7), (0.4, 0.5), (0.4, 0.5))):
        third = cut(ceiling, (i / 3, (i + 1) / 3), (0, 1))
        lamp = cut(third, at, (0.3, 0.7))
        sides += [*around(third, at, (0.3, 0.7)), quad(lamp.corner, lamp.edge_u, lamp.edge_v, 6 + i)]
    room = make_room(sides, 0.1)
    instances = tuple(replace(one, class_name="lamp" if one.object_id > 5 else "side") for one in room.instances)
    room = replace(room, instances=instances)
    return room, radiosity(room, ALBEDO, {6: (10, 9, 8), 7: (20, 18, 16), 8: (20, 18, 16)})


def test_a_lamp_smaller_than_a_pixel_is_solved_for_with_its_like(strips):
    """One strip is seen at its edges alone, mixed with the dark beside it; no frame sees the other."""
    room, L = strips
    lit = measured(room, L, {8}, texture=0.1)
    mixed = room.atlas.object_id == 7
    lit.radiance[mixed] *= 0.5
    lit.tier[mixed], lit.count[mixed] = EDGE, 1
    found = {lamp.object_id: lamp for lamp in run(room, lit).lamps}
    assert set(found) == {6, 7, 8} and found[6].seen and not found[7].seen
    assert np.array_equal(found[7].radiance, found[8].radiance)
    assert found[7].note({}).startswith("Frames show it only mixed") and found[8].note({}).startswith(
        "No frame sees it"
    )
    assert found[7].radiance @ LUMINANCE == pytest.approx(np.float32([20, 18, 16]) @ LUMINANCE, rel=0.2)


def test_what_stands_beside_a_lamp_is_none(strips):
    """A strip that only reflects shows the lamp's light in each of its pixels, but throws none."""
    room, _ = strips
    room = replace(room, instances=tuple(replace(one, class_name="") for one in room.instances))
    lit = measured(room, radiosity(room, ALBEDO | {7: ALBEDO[0], 8: ALBEDO[0]}, {6: (10, 9, 8)}), set(), texture=0.1)
    mixed = room.atlas.object_id == 7
    lit.radiance[mixed] = (5, 4.5, 4)
    lit.tier[mixed], lit.count[mixed] = EDGE, 1
    assert {lamp.object_id for lamp in run(room, lit).lamps} == {6}


def test_a_lamp_whose_pixels_are_hardly_mixed_is_as_bright_as_they_are(strips):
    room, L = strips
    lit = measured(room, L, {8}, texture=0.1)
    mixed = room.atlas.object_id == 7
    lit.tier[mixed], lit.count[mixed] = EDGE, 1
    found = {lamp.object_id: lamp for lamp in run(room, lit).lamps}
    assert found[7].seen and np.allclose(found[7].radiance, np.median(lit.radiance[mixed], 0))


def test_a_lamp_that_one_frame_shows_unmixed_is_as_bright_as_it_shows(strips):
    """Elsewhere its pixels are mixed with the dark beside it."""
    room, L = strips
    lit = measured(room, L, {8}, texture=0.1)
    own = np.flatnonzero(room.atlas.object_id == 7)
    lit.count[own] = 1
    lit.radiance[own[1:]] *= 0.5
    lit.tier[own[1:]] = EDGE
    found = {lamp.object_id: lamp for lamp in run(room, lit).lamps}
    assert found[7].seen and np.allclose(found[7].radiance, lit.radiance[own[0]])


@pytest.mark.slow
def test_an_unseen_lamp_is_found_among_many_unseen_things():
    """A corner of the floor is in 100 pieces that no frame sees, each a thing of its own; so is the only lamp."""
    floor, *others = lit_box()
    corner = (0.0, 0.2)
    pieces = split(cut(floor, corner, corner), 10)
    pieces = [replace(one, object_id=7 + i) for i, one in enumerate(pieces)]
    room = make_room([*around(floor, corner, corner), *others, *pieces], 0.05)
    named = tuple(replace(one, class_name=f"thing {one.object_id}") for one in room.instances)
    room = replace(room, instances=named)
    L = radiosity(room, ALBEDO | {one.object_id: ALBEDO[0] for one in pieces}, {6: (10, 9, 8)}, parts=1)
    lamps = run(room, measured(room, L, {6, *(one.object_id for one in pieces)}, texture=0.1)).lamps
    assert len(pieces) == 100 and [lamp.object_id for lamp in lamps] == [6]


def test_an_unlit_lamp_of_a_class_that_shines_stays_dark(strips):
    room, _ = strips
    L = radiosity(room, ALBEDO | {7: 0.5, 8: 0.5}, {6: (10, 9, 8)})
    bright = {lamp.object_id for lamp in run(room, measured(room, L, {7, 8}, texture=0.1)).lamps}
    assert 6 in bright
    assert {7, 8} & bright == set()


def test_the_only_lamp_may_be_unseen():
    room = make_room(lit_box(), 0.2)
    L = radiosity(room, ALBEDO, {6: (10, 10, 10)})
    # What the texture happens to be moves a single answer by 10 %.
    solved = []
    for seed in range(4):
        found = run(room, measured(room, L, {6}, texture=0.15, seed=seed), rays=32).lamps
        assert [lamp.object_id for lamp in found] == [6] and not found[0].seen
        solved.append(float(found[0].radiance @ LUMINANCE))
    assert np.mean(solved) == pytest.approx(10, rel=0.15)
    assert np.allclose(solved, 10, rtol=0.25)


def test_light_over_a_mirror_is_not_the_lamps():
    """The wall at x = 0 is a mirror, so the room is half of one of twice the length, whose light radiosity knows."""
    X, Y, Z = 4.0, 3.0, 2.5

    def ceiling(sign: float, lamp_id: int) -> list[Quad]:
        half = quad((0 if sign > 0 else -X, 0, Z), (0, Y, 0), (X, 0, 0), 1)
        lamp = (0.05, 0.2) if sign > 0 else (0.8, 0.95)
        glow = cut(half, (0.4, 0.6), lamp)
        return [*around(half, (0.4, 0.6), lamp), quad(glow.corner, glow.edge_u, glow.edge_v, lamp_id)]

    floor, _, mirror, far, left, right = box_sides((X, Y, Z))
    one = make_room([floor, mirror, far, left, right, *ceiling(1, 6)], 0.2)
    image = [quad((-X, 0, 0), (X, 0, 0), (0, Y, 0), 0), quad((-X, 0, 0), (0, Y, 0), (0, 0, Z), 3),
             quad((-X, 0, 0), (0, 0, Z), (X, 0, 0), 4), quad((-X, Y, 0), (X, 0, 0), (0, 0, Z), 5)]  # fmt: skip
    whole = make_room([floor, far, left, right, *ceiling(1, 6), *image, *ceiling(-1, 8)], 0.2)
    L = radiosity(whole, ALBEDO, {6: (10, 9, 8), 8: (10, 9, 8)})
    place = [np.c_[room.atlas.position, 100 * room.atlas.object_id] for room in (one, whole)]
    L = L[cKDTree(place[1]).query(place[0])[1]]
    L[one.atlas.object_id == 2] = 0.5  # whatever frames made of it
    lit = measured(one, L, {6}, texture=0.1)
    glass = Mirror(2, np.float32([0, 0, 0]), np.float32([1, 0, 0]), np.ones(3, np.float32))

    (lamp,) = run(one, lit, find_mirrors=lambda field, lamps: (glass,)).lamps
    assert lamp.object_id == 6 and not lamp.seen
    assert lamp.radiance @ LUMINANCE == pytest.approx(np.float32([10, 9, 8]) @ LUMINANCE, rel=0.12)
    # Told of only once the lamps are known, what it throws passes for another lamp.
    assert len(run(one, lit, find_mirrors=lambda field, lamps: () if lamps is None else (glass,)).lamps) > 1


def test_a_furnace_has_no_lamps():
    room = make_room(box_sides(), 0.25)
    lit = measured(room, room.by_object({}, default=1.0))
    result = run(room, lit)
    assert result.lamps == ()
    assert np.median(albedo_in(room, lit, result).rho) == pytest.approx(1, abs=0.02)


def test_what_no_frame_sees_need_not_be_a_lamp():
    """A piece of a wall that nobody looked at, with the albedo of the rest, in a room with one seen lamp."""
    sides = lit_box()
    wall = sides[2]
    assert isinstance(wall, Quad) and wall.object_id == 3
    halves = [cut(wall, (0, 1), (0, 0.7)), cut(wall, (0, 1), (0.7, 1))]
    sides[2:3] = [halves[0], quad(halves[1].corner, halves[1].edge_u, halves[1].edge_v, 7)]
    room = make_room(sides, 0.2)
    albedo = ALBEDO | {7: ALBEDO[3]}
    L = radiosity(room, albedo, {6: (10, 10, 10)})
    result = run(room, measured(room, L, {7}, texture=0.1))
    assert [lamp.object_id for lamp in result.lamps] == [6]
    # what it reflects is guessed from the room, so that its neighbours are not found too bright
    assert np.isfinite(result.radiance).all() and (result.radiance[room.atlas.object_id == 7] > 0).all()


def test_bright_surfaces_under_bright_light_are_no_lamps():
    """Only an albedo above the limit counts, not brightness."""
    ids = np.repeat([3, 4, 5], 20)
    radiance = np.repeat(np.float32([[300], [1], [0.01]]), 20, 0).repeat(3, 1)
    needed = np.repeat([0.95, 2.5, 0.1], 20)[:, None]
    lamps = find_seen(ids, radiance, np.pi * radiance / needed)
    assert [lamp.object_id for lamp in lamps] == [4]
    assert lamps[0].seen and lamps[0].radiance.tolist() == [1, 1, 1]


def test_a_metal_that_shows_a_highlight_to_some_is_no_lamp():
    """The few elements that were seen unmixed are as bright as a lamp's; most of the object is not."""
    things = [quad((1, 1, 2), (0, 0.5, 0), (0.5, 0, 0), 1), quad((3, 1, 2), (0, 0.5, 0), (0.5, 0, 0), 2)]
    room = make_room([quad((0, 0, 0), (4, 0, 0), (0, 3, 0), 0), *things], 0.1)
    radiance = room.by_object({0: 0.1, 1: 50.0, 2: 50.0})
    metal, lamp = room.atlas.elements_of(2), room.atlas.elements_of(1)
    radiance[metal[4:]] = 0.05
    element = np.concatenate([room.atlas.elements_of(0), lamp[:4], metal[:4]])
    E = np.full((len(element), 3), 0.5)
    found = bright_all_over(room.field(radiance), element, E)
    assert [one.object_id for one in found] == [1] and found[0].radiance.tolist() == [50, 50, 50]
    radiance[lamp[4:]] = 0  # no frame saw these
    assert [
        one.object_id for one in bright_all_over(room.field(radiance), element, np.full((len(element), 3), 0.5))
    ] == [1]


def test_a_finely_meshed_lamp_is_aimed_at_as_a_whole():
    """A bulb's triangles are smaller than a texel: those without elements of their own shine like their neighbours."""
    bulb = quad((1, 1, 2), (0, 0.2, 0), (0.2, 0, 0), 1)
    room = make_room([quad((0, 0, 0), (2, 0, 0), (0, 2, 0), 0), *split(bulb, 8)], 0.1)
    bare = np.bincount(room.atlas.triangle, minlength=len(room.mesh.triangles)) == 0
    assert bare[2:].sum() > 30
    bright = bright_triangles(room.field(room.by_object({0: 0.1, 1: 50})))
    assert np.flatnonzero(bright.density > 0).tolist() == list(range(2, 2 + 128))
    assert np.allclose(np.diff(bright.reached, prepend=0), 1 / 128, rtol=1e-3)


def test_a_lamp_says_how_it_was_found():
    names, radiance = {3: "lamp 3"}, np.ones(3, np.float32)
    told = {
        "": Lamp(1, radiance, True),
        "Clipped in every frame; its radiance is a lower bound.": Lamp(1, radiance, True, clipped=True),
        "No frame sees it; solved from the light it throws (spread of log albedo 0.500 to 0.400).": Lamp(
            1, radiance, False, spread=(0.5, 0.4)
        ),
        "Clipped in every frame; solved from the light it throws (spread of log albedo 0.500 to 0.400).": Lamp(
            1, radiance, False, clipped=True, spread=(0.5, 0.4)
        ),
        "No frame sees it; solved from the light it throws (spread of log albedo 0.500 to 0.400): 2.5; that of the "
        "seen 'lamp 3' explains it nearly as well, and is taken.": Lamp(
            1, radiance, False, spread=(0.5, 0.4), twin=3, solved=2.5
        ),
    }
    assert all(lamp.note(names) == sentence for sentence, lamp in told.items())


@pytest.mark.parametrize(("zenith", "horizon"), [(8, 24), (18, 6), (10, 10)])
def test_a_clipped_sky_lights_the_room_as_it_does_whether_it_is_clear_or_overcast(zenith, horizon):
    """Low light reaches deep into a room that is open at one end; frames clip all of it."""
    size, seed = 32, 0
    room = make_room([side for side in box_sides((5.0, 3.0, 2.5)) if side.object_id != 3], 0.2)
    elevation = np.degrees(((np.arange(size) + 0.5) / size - 0.5) * np.pi)
    level = np.where(elevation < 0, 2.0, zenith + (horizon - zenith) * np.exp(-elevation / 15))
    sky = np.broadcast_to(level[:, None, None], (size, 2 * size, 3)).astype(np.float32)
    frames = np.ones((size, 2 * size), np.int32)
    shining, every = Environment(sky, frames), np.arange(len(room.atlas))
    rho = np.array([ALBEDO[i] * np.ones(3) for i in range(6)])[room.atlas.object_id]
    L = np.zeros((len(every), 3), np.float32)
    for _ in range(6):
        E = irradiance_at(room.field(L).with_light(L, shining), every, 9, 4)
        L = (rho * E / np.pi).astype(np.float32)
    clipped = np.broadcast_to(elevation[:, None] > 0, frames.shape)
    bound = Environment(np.where(clipped[..., None], np.float32(3), sky), frames, clipped)
    settings = Settings(shading_rays=256, emitter_rays=16, threads=2, seed=seed)
    found = shade(room.surface, room.instances, measured(room, L, texture=0.1, seed=seed), bound, settings)
    ratio = (found.irradiance @ LUMINANCE) / (E @ LUMINANCE)
    deep = room.atlas.position[:, 0] < 2
    assert np.median(ratio[deep]) / np.median(ratio[~deep]) == pytest.approx(1, abs=0.06)
    assert np.quantile(np.abs(np.log(ratio / np.median(ratio))), 0.9) < 0.15
