"""Hard cases of the mesh: size, distance from the origin, slivers, faces upon faces, sheets seen from both sides."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from addon.core.passes.albedo.albedo import MEASURED
from tests.core.rooms import all_round, box_sides, lit_box, make_room, quad
from tests.hard_cases.rooms import (
    CLOSE,
    GREY,
    LAMP,
    NOISY,
    PAPERS,
    QUICK,
    SIZE,
    TEXEL,
    cameras,
    lamp_light,
    lamp_room,
    lit_by,
    sheet_between_rooms,
)


@pytest.mark.parametrize("size", [0.01, 1000.0], ids=["1 cm", "1 km"])
@pytest.mark.parametrize("settings", [QUICK, PAPERS], ids=["default", "paper"])
def test_size_of_the_room(capture, expect, size, settings):
    """Albedo does not depend on the unit of length."""
    room = lamp_room()
    light = lamp_light(room)
    run = capture(room, light, scale=size / SIZE[0]).recover(settings)
    expect("the walls", run.worst(GREY), CLOSE if settings is QUICK else NOISY)
    if settings is QUICK:
        usual = capture(room, light).recover()
        same = usual.lit.tier == run.lit.tier  # a depth edge may fall on another texel
        off = np.abs(run.albedo.rho - usual.albedo.rho)[same]
        expect("albedo of the same room 2 m across, 99 of 100 spots", float(np.percentile(off, 99)), 0.02)
        expect("texels seen alike", float(1 - same.mean()), 0.02)
    assert "captures are in metres" in run.text or size > 10


def test_size_chosen_by_the_frames(capture, expect):
    """1 cm and 1 km, with the texel's size left to the frames' footprint."""
    room = lamp_room()
    light = lamp_light(room)
    runs = [capture(room, light, scale=scale).recover(replace(QUICK, texel_size=0)) for scale in (0.005, 500)]
    texels = [run.figures["texel_metres"] for run in runs]
    expect("texels in proportion", abs(texels[1] / texels[0] / 1e5 - 1), 0.01)
    expect("the walls", max(run.worst(GREY) for run in runs), CLOSE)


@pytest.mark.parametrize("size", [2.0, 0.2], ids=["2 m room", "20 cm room"])
def test_ten_kilometres_from_the_origin(capture, expect, size):
    """There float32 is 1 mm coarse."""
    room = lamp_room()
    light = lamp_light(room)
    run = capture(room, light, scale=size / SIZE[0], shift=(1e4, -1e4, 50)).recover()
    usual = capture(room, light, scale=size / SIZE[0]).recover()
    expect("the walls", run.worst(GREY), CLOSE)
    expect("texels seen", float(np.abs(run.lit.seen.mean() - usual.lit.seen.mean())), 0.01)
    same = usual.lit.tier == run.lit.tier
    off = np.abs(run.albedo.rho - usual.albedo.rho)[same]
    expect("albedo of the same room at the origin, 99 of 100 spots", float(np.percentile(off, 99)), CLOSE)


def slivers(room, thin=(1e-7, 1e-6, 1e-4, 1e-3)):
    """The room's triangles, each cut from one corner into slivers of these widths, relative to its edge, and a rest."""
    vertices, faces, ids, uvs = [], [], [], []
    for corners, uv, object_id in zip(room.mesh.vertices[room.mesh.triangles], room.uv, room.mesh.object_id):
        stops = np.array([0.0, *thin, 0.5, 0.5 + 1e-5, 1.0])
        along = corners[0] + stops[:, None] * (corners[1] - corners[0])
        along_uv = uv[0] + stops[:, None].astype(np.float32) * (uv[1] - uv[0])
        for i in range(len(stops) - 1):
            faces.append(np.arange(3) + len(vertices))
            vertices += [along[i], along[i + 1], corners[2]]
            uvs.append([along_uv[i], along_uv[i + 1], uv[2]])
            ids.append(object_id)
    return np.array(vertices), np.array(faces, np.int32), np.array(ids, np.int32), np.array(uvs, np.float32)


@pytest.mark.parametrize("settings", [QUICK, PAPERS], ids=["default", "paper"])
def test_sliver_triangles(capture, expect, settings):
    """Every triangle cut into slivers down to 1e-7 of its length: the walls are what they were."""
    room = lamp_room()
    run = capture(room, lamp_light(room), triangles=slivers(room)).recover(settings)
    expect("the walls", run.worst(GREY), CLOSE if settings is QUICK else NOISY)
    expect("the lamp is found", abs(len(run.figures["lamps"]) - 1), 0)
    expect("surface lost", abs(float(run.atlas.area.sum()) / (6 * SIZE[0] ** 2) - 1), 0.01)


def doubled(turn: bool, object_id: int | None, apart: float = 0.0):
    """An ordinary room whose wall 2 is there twice."""
    quads = lit_box(SIZE, (LAMP,))
    wall = next(q for q in quads if q.object_id == 2)
    corner = wall.corner - np.array([apart, 0, 0])
    again = quad(corner, wall.edge_v, wall.edge_u, 2) if turn else quad(corner, wall.edge_u, wall.edge_v, 2)
    room = make_room([*quads, replace(again, object_id=2 if object_id is None else object_id)], TEXEL)
    return room, quads


@pytest.mark.parametrize("turn", [False, True], ids=["same side", "other side"])
@pytest.mark.parametrize("object_id", [None, 7], ids=["same object", "other object"])
def test_coplanar_walls(capture, expect, turn, object_id):
    """A wall that is there twice, at the very same place: measured rightly or not at all."""
    room, quads = doubled(turn, object_id)
    albedo = GREY | ({} if object_id is None else {7: GREY[2]})
    light = lit_by(room, quads, albedo, {6: (10, 9, 8)})
    run = capture(room, light).recover()
    expect("the other walls", run.worst({i: GREY[i] for i in (0, 1, 3, 4, 5)}), CLOSE)
    both = [i for i in (2, object_id) if i is not None and run.measured(i).any()]
    assert both, "neither was measured"
    expect("the doubled wall, where it counts as measured", max(run.off(i, GREY[2]) for i in both), CLOSE)


def test_wall_of_two_faces_between_two_rooms(capture, expect):
    """Two rooms back to back: the wall between them is one object with a face to either side, 1 mm apart."""
    left = [q for q in lit_box(SIZE, (LAMP,)) if q.object_id != 3]
    right = [replace(q, corner=q.corner + np.array([2.001, 0, 0]), object_id=q.object_id + 10)
             for q in lit_box(SIZE, (LAMP,)) if q.object_id != 2]  # fmt: skip
    sides = box_sides(SIZE)
    facing_left = replace(sides[3], object_id=8)
    facing_right = replace(sides[2], corner=sides[2].corner + np.array([2.001, 0, 0]), object_id=8)
    room = make_room([*left, facing_left, *right, facing_right], TEXEL)
    near, far = {0: 0.5, 1: 0.7, 2: 0.3, 4: 0.5, 5: 0.6, 8: 0.4}, {10: 0.5, 11: 0.7, 13: 0.3, 14: 0.5, 15: 0.6, 8: 0.4}
    light = np.where(
        room.atlas.position[:, :1] < 2.0005,
        lit_by(room, [*left, facing_left], near, {6: (10, 10, 10)}),
        lit_by(room, [*right, facing_right], far, {16: (10, 10, 10)}),
    )
    eyes = (0.8, 0.9, 0.7), (1.3, 1.1, 1.2), (0.7, 1.3, 1.4)
    run = capture(room, light, views=cameras([*eyes, *[(x + 2.001, y, z) for x, y, z in eyes]])).recover()
    expect("both rooms and the wall between them", run.worst(near | far), CLOSE)


def test_sheet_seen_from_both_sides(capture, expect):
    """One quad between a bright and a dim room, of another colour on either side: each side has its own."""
    case = sheet_between_rooms()
    run = capture(case.room, case.shown, views=case.views).recover()
    expect("the bright room", run.worst({i: case.near[i] for i in case.near if i != 8}), CLOSE)
    expect("the dim room", run.worst({i: case.far[i] for i in case.far if i != 8}), CLOSE)
    own = run.measured(8)
    for name, x, rho in (("bright", -1, case.near[8]), ("dim", 1, case.far[8])):
        side = own & (x * run.atlas.normal[:, 0] > 0.9)
        assert side.sum() > 100
        expect(f"the sheet's {name} side", float(np.abs(np.median(run.albedo.rho[side], 0) / rho - 1).max()), CLOSE)


def test_cupboard_that_no_frame_looks_into(capture, expect):
    """A closed cavity within the mesh: nothing is measured in it, nothing is made up beyond a marked guess."""
    quads = lit_box(SIZE, (LAMP,))
    inner = [replace(q, corner=q.corner + np.array([0.0, 0, 3]), object_id=7) for q in box_sides((0.4, 0.4, 0.4))]
    room = make_room([*quads, *inner], TEXEL)
    light = lit_by(room, quads, GREY, {6: (10, 9, 8)})
    run = capture(room, light, views=cameras() + all_round((1, 1, 0.5), 28)).recover()
    expect("the room", run.worst(GREY), CLOSE)
    expect("measured elements in the cupboard", int((run.albedo.origin[run.of(7)] == MEASURED).sum()), 0)
    assert "No frame sees thing 7" in run.text and run.materials[7].note
