"""An object with a part in a material slot of its own: what is listed, given and fitted of either."""

import importlib
import json

import pytest

bpy = pytest.importorskip("bpy")

from tests.blender.artist.artist_room import bridge  # noqa: E402
from tests.blender.artist.corrected_room import BOARD, ENTRIES, LAMP, TABLE, TAP, build, select, write_result  # noqa: E402


@pytest.fixture
def room(ops, tmp_path):
    """The table is a part of the board: a square of it in the board's second slot."""
    bridge("corrections.corrections").forget()
    bpy.context.scene.scan_relight_correct.refit_automatically = False
    return build(tmp_path / "result", {TABLE: BOARD})


@pytest.fixture
def board(room):
    select(room[BOARD])
    return room[BOARD]


def values(obj, slot):
    """Metallic, roughness and whether a texture is shown, of a slot."""
    nodes = obj.material_slots[slot].material.node_tree.nodes
    inputs = next(node for node in nodes if node.type == "BSDF_PRINCIPLED").inputs
    linked = bool(inputs["Base Color"].links)
    return inputs["Metallic"].default_value, round(inputs["Roughness"].default_value, 4), linked


def test_the_active_slot_tells_which_instance_is_meant(board):
    instances = bridge("data.instances")
    assert instances.slots_of(board) == {BOARD: [0], TABLE: [1]} and instances.chosen_in(board) == BOARD
    board.active_material_index = 1
    assert instances.chosen_in(board) == TABLE and instances.name_of(board) == board.material_slots[1].material.name


def test_every_part_is_listed_with_its_own_values(board, room):
    panel = importlib.import_module("scan_relight.operators.results.panel")
    rows = panel.file.rows_of_parts(bpy.context.scene.objects)
    assert {obj.name: sorted(parts) for obj, parts in rows.items()} == {
        board.name: [BOARD, TABLE],
        room[TAP].name: [TAP],
        room[LAMP].name: [LAMP],
    }
    assert rows[board][TABLE]["alpha"] == 0.09 and "alpha" not in rows[board][BOARD]
    assert panel.least_sure(rows[board].values(), "specular") == rows[board][TABLE]
    assert panel.least_sure(rows[board].values(), "metal") is None


def test_selecting_a_part_makes_its_slot_active(ops, board, room):
    select(room[TAP])
    assert ops.select_result_object(object_id=TABLE) == {"FINISHED"}
    assert bpy.context.view_layer.objects.active == board and board.active_material_index == 1
    assert ops.select_result_object(object_id=BOARD) == {"FINISHED"} and board.active_material_index == 0


def test_a_statement_is_about_the_active_slot_alone(ops, board):
    before = values(board, 0)
    board.active_material_index = 1
    assert board.scan_relight_correct.roughness == pytest.approx(0.3)
    assert ops.this_is(model="metal") == {"FINISHED"}
    assert values(board, 1)[0] == 1 and values(board, 0) == before
    board.scan_relight_correct.roughness = 0.6
    assert values(board, 1)[1] == 0.6 and values(board, 0) == before
    corrections = bridge("corrections.corrections")
    assert corrections.given(board) == {"model": "metal", "roughness": 0.6} and corrections.given(board, BOARD) == {}
    board.active_material_index = 0
    assert board.scan_relight_correct.model == "lambertian"
    board.active_material_index = 1
    assert ops.take_back() == {"FINISHED"}
    assert values(board, 1) == (0, pytest.approx(0.3), True)


def test_what_is_given_is_kept_by_instance(board, tmp_path):
    corrections = bridge("corrections.corrections")
    corrections.give(board, TABLE, roughness=0.6)
    corrections.give(board, BOARD, model="metal")
    board.active_material_index = 1
    corrections.say_white(board, 0.8)
    assert corrections.keep(bpy.context.scene, tmp_path / "result") == {BOARD, TABLE}
    stored = json.loads((tmp_path / "result" / "overrides.json").read_text())
    assert stored["objects"] == {str(BOARD): {"model": "metal"}, str(TABLE): {"roughness": 0.6}}
    assert stored["white"]["object"] == TABLE
    corrections.take_white_back(board)
    assert corrections.white_of(board) is None


def test_a_part_like_another_object_and_like_its_own_whole(ops, board, room):
    board.active_material_index = 1
    select(board, room[TAP])
    assert ops.same_as() == {"FINISHED"}
    assert values(board, 1)[:2] == (1, pytest.approx(0.2)) and values(board, 0)[0] == 0
    room[TAP].scan_relight_correct.roughness = 0.7
    assert values(board, 1)[1] == pytest.approx(0.7), "it follows"
    bpy.context.scene.scan_relight_correct.like = room[TAP]  # what the panel has chosen; a script says it by number
    select(board)
    assert ops.same_as(object_id=BOARD) == {"FINISHED"}
    assert values(board, 1)[0] == 0
    with pytest.raises(RuntimeError, match="is the other object itself"):
        ops.same_as(object_id=TABLE)


def test_a_refit_changes_the_part_that_it_changed(board, tmp_path):
    refitted, folder = bridge("corrections.refitted"), tmp_path / "result"
    board.active_material_index = 1
    _, words, before = refitted.words(bpy.context.scene, [board])
    assert words[2:] == ["--object", str(TABLE)]
    first = board.material_slots[0].material["scan_relight_model"]
    write_result(folder, [entry | {"alpha": 0.64} if entry["object_id"] == TABLE else entry for entry in ENTRIES])
    bridge("results.file").forget()
    warnings = bridge("slices").whole(refitted.bringing(bpy.context.scene, folder, before, refitted.fitted(folder)))
    assert warnings == () and values(board, 1)[1] == pytest.approx(0.8)
    assert board.material_slots[0].material["scan_relight_model"] == first
    assert board.material_slots[1].material["object_id"] == TABLE


def test_paint_goes_onto_all_parts_that_share_the_image(board):
    unseen = bridge("corrections.unseen")
    image = unseen.own_image(board)
    assert [unseen.texture_node(board, i).image for i in (BOARD, TABLE)] == [image, image]
    assert unseen.restore([board]) == 1
    assert image not in [unseen.texture_node(board, i).image for i in (BOARD, TABLE)]


def test_the_spot_that_is_hit_tells_the_part(board):
    from mathutils import Vector

    room = bridge("light.room")
    # The board is a square at x = 0...2, its part one at x = 6...8.
    assert room.cast(bpy.context.scene, Vector((1, 1, 3)), Vector((0, 0, -1))).slot == 0
    hits = [room.cast(bpy.context.scene, Vector((x, y, 3)), Vector((0, 0, -1))) for x in (7, 9) for y in (1, 3)]
    assert {hit.slot for hit in hits if hit is not None and hit.obj.name == board.name} == {1}


def test_undo_takes_back_what_was_said_of_a_part(ops, board):
    name, before = board.name, values(board, 1)
    board.active_material_index = 1
    bpy.ops.ed.undo_push(message="before")
    ops.this_is(model="metal")
    bpy.ops.ed.undo_push(message="after")
    bpy.ops.ed.undo()
    board = bpy.data.objects[name]
    assert values(board, 1) == before and bridge("corrections.corrections").given(board, TABLE) == {}


def test_the_panel_shows_the_parts_and_the_values_of_the_active_slot(board):
    from types import SimpleNamespace

    from tests.blender.panel.conftest import Layout

    class Listing(Layout):
        lists: list = []

        def template_list(self, *arguments, **_):
            self.lists.append(arguments)

    panels = importlib.import_module("scan_relight.operators.results.panel")

    def drawn():
        layout, cls = Listing(), panels.SCAN_RELIGHT_PT_results
        layout.lists.clear()
        panel = SimpleNamespace(layout=layout, say=cls.say)
        panel.details = cls.details.__get__(panel)
        cls.draw(panel, SimpleNamespace(scene=bpy.context.scene, preferences=bpy.context.preferences, region=None))
        return layout

    layout = drawn()
    assert layout.lists[1][0] == "SCAN_RELIGHT_UL_parts"
    assert layout.lists[1][2:] == (board, "material_slots", board, "active_material_index")
    assert "Diffuse" in layout.text and "Glossy" not in layout.text
    board.active_material_index = 1
    assert "Glossy" in drawn().text and board.material_slots[1].material.name in drawn().text
