"""Which pieces of an object are taken for another material."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from addon.core.passes.material_parts.material_parts import seen_pieces, unlike_pieces
from addon.core.scene.lit_diffuse import LitDiffuse
from addon.core.scene.model import Capture, Instance
from addon.core.scene.patches import Patches
from tests.core.rooms import make_room, quad

WHOLE, OTHER = 3, 5


def panel(x: float, width: float = 1.0, object_id: int = WHOLE):
    return quad((x, 0, 0), (width, 0, 0), (0, 1, 0), object_id)


@pytest.fixture(scope="module")
def room():
    """A door of three panels with a handle, which touch nothing; and a wall of one piece."""
    return make_room([panel(0, 1.4), panel(2), panel(4), panel(6, 0.4), panel(8, 1, OTHER)])


def lit(room, albedo, noise=0.02, seen=None):
    """L_d under E = 2 of panels with albedos by their x, and what frames show of it."""
    rng, count = np.random.default_rng(0), len(room.atlas)
    rho = np.array(albedo)[(room.atlas.position[:, 0] // 2).astype(int)]
    radiance = (rho * 2 / np.pi * rng.lognormal(0, noise, count))[:, None] * np.ones(3)
    seen = np.ones(count, bool) if seen is None else seen
    radiance[~seen] = np.nan
    zeros = np.zeros((count, 3), np.float32)
    return LitDiffuse(radiance.astype(np.float32), zeros, seen * np.int32(9), zeros[:, 0].astype(np.int8), zeros[:, 0])


def groups(room, albedo, noise=0.02, seen=None, sources=()):
    """The left edges in metres of the panels in each group that stays apart."""
    lit_diffuse = lit(room, albedo, noise, seen)
    pieces = seen_pieces(room.mesh, room.atlas, lit_diffuse.seen)
    apart = pieces.surface(room.surface)
    irradiance = np.full((len(room.atlas), 3), 2, np.float32)
    found = unlike_pieces(pieces, room.atlas.object_id, apart.atlas, lit_diffuse, irradiance, sources)
    left = {
        int(i): room.mesh.vertices[room.mesh.triangles[apart.mesh.object_id == i]][..., 0].min() for i in pieces.parts
    }
    return sorted(sorted(float(left[i]) for i in group) for group in found)


def test_the_handle_of_another_colour_is_set_apart(room):
    assert groups(room, (0.6, 0.6, 0.6, 0.2, 0.5)) == [[6.0]]


def test_pieces_of_one_colour_stay_together(room):
    assert groups(room, (0.6, 0.6, 0.62, 0.58, 0.1)) == []


def test_pieces_that_are_alike_are_one_part(room):
    assert groups(room, (0.6, 0.2, 0.6, 0.2, 0.5)) == [[2.0, 6.0]]
    assert groups(room, (0.6, 0.2, 0.05, 0.2, 0.5)) == [[2.0, 6.0], [4.0]]


def test_texture_is_no_other_material(room):
    """What varies within pieces by as much as between them tells nothing."""
    assert groups(room, (0.5, 0.6, 0.42, 0.45, 0.5), noise=0.4) == []


def test_a_lamp_stays_by_itself(room):
    """Here the second panel shines, and the others are alike but for the fourth, which is alike to the lamp."""
    lit_diffuse = lit(room, (0.6, 0.2, 0.6, 0.2, 0.5))
    lamp = seen_pieces(room.mesh, room.atlas, lit_diffuse.seen).objects[0]
    assert groups(room, (0.6, 0.2, 0.6, 0.2, 0.5), sources={lamp}) == [[2.0], [6.0]]


def test_what_no_frame_saw_stays_with_the_rest(room):
    seen = room.atlas.position[:, 0] < 5
    assert groups(room, (0.6, 0.2, 0.6, 0.2, 0.5), seen=seen) == [[2.0]]
    assert groups(room, (0.6, 0.2, 0.6, 0.2, 0.5), seen=np.zeros(len(seen), bool)) == []


def test_the_two_sheets_of_a_pane_are_one_thing():
    """What is behind it shows on either, so that they look unlike."""
    for apart, expected in ((0.1, 0), (0.5, 1)):
        sheets = [panel(0), quad((0, 0, -apart), (0, 1, 0), (1, 0, 0), WHOLE)]
        room = make_room(sheets)
        lit_diffuse = lit(room, (0.6,))
        lit_diffuse.radiance[room.atlas.position[:, 2] < 0] /= 3
        pieces = seen_pieces(room.mesh, room.atlas, lit_diffuse.seen)
        irradiance = np.full((len(room.atlas), 3), 2, np.float32)
        atlas = pieces.surface(room.surface).atlas
        assert len(unlike_pieces(pieces, room.atlas.object_id, atlas, lit_diffuse, irradiance, ())) == expected


def test_parts_become_instances_of_what_they_are_part_of(room, tmp_path):
    pieces = seen_pieces(room.mesh, room.atlas, np.ones(len(room.atlas), bool))
    first, second, third = pieces.objects
    chosen, number = pieces.grouped([[first, third], [second]])
    assert number == {first: 6, third: 6, second: 7}
    capture = Capture(tmp_path, room.mesh, (Instance(WHOLE, "door"), Instance(OTHER, "wall")), ())
    apart = chosen.capture(capture)
    parts = [instance for instance in apart.instances if instance.part_of is not None]
    assert [(part.object_id, part.class_name, part.part_of) for part in parts] == [
        (6, "door part 2", WHOLE),
        (7, "door part 3", WHOLE),
    ]
    assert np.bincount(apart.mesh.object_id).tolist() == [0, 0, 0, 2, 0, 2, 4, 2]
    assert chosen.capture(apart) is apart  # they are there already
    guessed = replace(capture, instances=(Instance(WHOLE, "door", guess=True), Instance(OTHER, "wall")))
    assert all(part.guess for part in chosen.capture(guessed).instances if part.part_of is not None)


def test_a_part_of_a_part_is_one_of_the_whole(room, tmp_path):
    """The capture may name parts itself."""
    capture = Capture(tmp_path, room.mesh, (Instance(WHOLE, "door: wood", part_of=OTHER), Instance(OTHER, "door")), ())
    part = Patches(np.array([0, 1], np.int32), np.array([6, 6], np.int32), parts=np.array([6], np.int32))
    assert part.capture(capture).instances[-1].part_of == OTHER
