"""What an artist gives of an object shows at once, is kept, and can be taken back."""

import json

import pytest

bpy = pytest.importorskip("bpy")

from tests.blender.artist.artist_room import bridge  # noqa: E402
from tests.blender.artist.corrected_room import BOARD, LAMP, TABLE, TAP, build, select, sockets  # noqa: E402


@pytest.fixture
def room(ops, tmp_path):
    bridge("corrections.corrections").forget()
    bpy.context.scene.scan_relight_correct.refit_automatically = False
    return build(tmp_path / "result")


@pytest.fixture
def kept(room, tmp_path):
    """What `keep` writes, and the objects that a refit has to do."""

    def keep():
        folder = tmp_path / "result"
        numbers = bridge("corrections.corrections").keep(bpy.context.scene, folder)
        return json.loads((folder / "overrides.json").read_text()), numbers

    return keep


def test_metal_shows_at_once_and_goes_back(room, ops):
    board = room[BOARD]
    before = sockets(board)
    select(board)
    assert ops.this_is(model="metal") == {"FINISHED"}
    shown = sockets(board)
    assert shown["Metallic"] == 1 and shown["Specular IOR Level"] == 0.5 and not shown["linked"]
    assert shown["Base Color"] == pytest.approx((0.4, 0.2, 0.1), abs=1e-4), "its own mean albedo, until a refit"
    assert json.loads(board["scan_relight_given"]) == {"model": "metal"}
    assert ops.take_back() == {"FINISHED"}
    assert sockets(board) == before and json.loads(board["scan_relight_given"]) == {}
    assert "scan_relight_found" not in board


def test_every_selected_object_and_no_other(room, ops):
    select(room[BOARD], room[TABLE])
    tap = sockets(room[TAP])
    ops.this_is(model="specular")
    assert [sockets(room[k])["Specular IOR Level"] for k in (BOARD, TABLE)] == [0.5, 0.5]
    assert sockets(room[TAP]) == tap and "scan_relight_given" not in room[TAP]


def test_values_go_into_sockets(room):
    table = room[TABLE]
    select(table)
    values = table.scan_relight_correct
    assert values.roughness == pytest.approx(0.3) and values.f0 == pytest.approx(0.05)
    values.roughness, values.f0 = 0.6, 0.16
    shown = sockets(table)
    assert shown["Roughness"] == pytest.approx(0.6)
    assert ((shown["IOR"] - 1) / (shown["IOR"] + 1)) ** 2 == pytest.approx(0.16, abs=1e-5), "Fresnel, straight on"
    assert shown["linked"], "the texture stays"


def test_a_textures_colour_is_scaled_by_nodes_of_blenders_own(room):
    """The texture, times given / found, reaches Base Color; so any program that reads the nodes shows it."""
    board = room[BOARD]
    board.scan_relight_correct.colour = (0.2, 0.2, 0.2)
    nodes = board.material_slots[0].material.node_tree.nodes
    mix = next(n for n in nodes if n.type == "MIX")
    factor = next(s for s in mix.inputs if s.type == "RGBA" and not s.links)
    assert mix.blend_type == "MULTIPLY" and factor.default_value[:3] == pytest.approx((0.5, 1.0, 2.0), rel=1e-4)
    bridge("corrections.corrections").take_back(board, "base_color")
    assert not any(n.type == "MIX" for n in nodes) and sockets(board)["linked"]


def test_a_metals_colour_is_its_f0(room):
    tap = room[TAP]
    tap.scan_relight_correct.colour = (0.8, 0.7, 0.2)
    assert sockets(tap)["Base Color"] == pytest.approx((0.8, 0.7, 0.2), abs=1e-4)
    assert "f0" in json.loads(tap["scan_relight_given"])


def test_sliders_go_to_all_selected_by_choice(room):
    select(room[TABLE], room[TAP])
    room[TAP].scan_relight_correct.roughness = 0.5
    assert sockets(room[TABLE])["Roughness"] == 0.5
    bpy.context.scene.scan_relight_correct.all_selected = False
    room[TAP].scan_relight_correct.roughness = 0.1
    assert sockets(room[TABLE])["Roughness"] == 0.5 and sockets(room[TAP])["Roughness"] == pytest.approx(0.1)


def test_the_same_as_follows_the_other(room, ops):
    select(room[BOARD], room[TAP])
    ops.same_as()
    assert json.loads(room[BOARD]["scan_relight_given"]) == {"same_as": TAP}
    assert sockets(room[BOARD])["Metallic"] == 1 and sockets(room[BOARD])["Roughness"] == pytest.approx(0.2)
    room[TAP].scan_relight_correct.roughness = 0.7
    assert sockets(room[BOARD])["Roughness"] == pytest.approx(0.7)


def test_the_same_as_by_choice(room, ops):
    select(room[BOARD])
    assert not ops.same_as.poll()
    bpy.context.scene.scan_relight_correct.like = room[TABLE]
    ops.same_as()
    assert json.loads(room[BOARD]["scan_relight_given"]) == {"same_as": TABLE}
    with pytest.raises(RuntimeError, match="in a circle"):
        select(room[BOARD], room[TABLE])
        bpy.context.view_layer.objects.active = room[BOARD]
        ops.same_as()


def test_a_lamp_that_is_none_goes_dark_and_comes_back(room, ops):
    lamp = room[LAMP]
    before = sockets(lamp)
    select(lamp)
    ops.this_is(model="lambertian")
    assert sockets(lamp)["Emission Strength"] == 0
    ops.take_back(key="model")
    assert sockets(lamp) == before and before["Emission Strength"] == 3


def test_what_is_given_is_written_for_runs(room, ops, kept):
    room[TABLE].scan_relight_correct.roughness = 0.6
    select(room[BOARD])
    ops.this_is(model="metal")
    ops.this_is_white(albedo=(0.8, 0.7, 0.6))
    written, numbers = kept()
    assert written["objects"] == {str(BOARD): {"model": "metal"}, str(TABLE): {"roughness": 0.6}}
    assert written["white"]["object"] == BOARD and written["white"]["albedo"] == pytest.approx([0.8, 0.7, 0.6])
    assert numbers == {BOARD, TABLE}


def test_undone_corrections_leave_the_file_and_foreign_ones_stay(room, kept, tmp_path):
    (tmp_path / "result" / "overrides.json").write_text(json.dumps({"objects": {str(TAP): {"roughness": 0.5}}}))
    room[TABLE].scan_relight_correct.roughness = 0.6
    assert set(kept()[0]["objects"]) == {str(TAP), str(TABLE)}
    del room[TABLE]["scan_relight_given"]  # as undo does
    assert set(kept()[0]["objects"]) == {str(TAP)}


def test_a_known_white_is_one(room, ops):
    for number in (BOARD, TABLE):
        select(room[number])
        ops.this_is_white()
    assert [k for k, thing in room.items() if "scan_relight_white" in thing] == [TABLE]
    ops.white_back()
    assert not any("scan_relight_white" in thing for thing in room.values())


def test_a_spot_scales_its_object(room, ops):
    """The board's spot is 0.9 or on the ramp; what is asked of the object is its mean times known over found."""
    board = room[BOARD]
    corner = board.matrix_world @ board.data.vertices[0].co
    place = corner + (board.matrix_world @ board.data.vertices[2].co - corner) * 0.2
    with pytest.raises(RuntimeError, match="no recovered object at that spot"):
        ops.pick_white(albedo=(0.3,) * 3, origin=(50, 50, 5), direction=(0, 0, -1))
    ops.pick_white(albedo=(0.12, 0.12, 0.12), origin=(*place[:2], 5), direction=(0, 0, -1))
    row = int((0.03 + 0.2 * 0.44) * 64)
    found = 0.2 + 0.4 * row / 63
    wanted = [mean * 0.12 / found for mean in (0.4, 0.2, 0.1)]
    assert list(board["scan_relight_white"]) == pytest.approx(wanted, rel=0.03)


def test_an_unseen_spot_says_nothing(room, ops):
    board = room[BOARD]
    corner = board.matrix_world @ board.data.vertices[0].co
    diagonal = board.matrix_world @ board.data.vertices[2].co - corner
    place = corner + diagonal * ((13 / 64 - 0.03) / 0.44)
    with pytest.raises(RuntimeError, match="not measured"):
        ops.pick_white(albedo=(0.1,) * 3, origin=(*place[:2], 5), direction=(0, 0, -1))


def test_it_survives_saving_without_the_add_on(room, tmp_path, package):
    """The sockets are in the file; so is what is given, and the way back."""
    name = room[BOARD].name
    bpy.context.scene.scan_relight_correct.refit_automatically = False
    bridge("corrections.corrections").give(room[BOARD], model="metal", roughness=0.15)
    package.unregister()
    try:
        bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "room.blend"))
        bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "room.blend"))
        shown = sockets(bpy.data.objects[name])
        assert shown["Metallic"] == 1 and shown["Roughness"] == pytest.approx(0.15)
    finally:
        package.register()
    bridge("corrections.corrections").take_back(bpy.data.objects[name])
    assert sockets(bpy.data.objects[name])["Metallic"] == 0 and sockets(bpy.data.objects[name])["linked"]


def test_smooth_stays_when_the_mesh_is_new(room, ops):
    table = room[TABLE]
    table.data.vertices[3].co.z += 2  # a fold of more than 30 degrees
    select(table)
    ops.smooth_by_angle(angle=0.5236)
    fresh = table.data.copy()

    def state(data):
        smooth = [polygon.use_smooth for polygon in data.polygons]
        return smooth, sum(edge.use_edge_sharp for edge in data.edges)

    assert state(table.data) == ([True, True], 1)
    fresh.shade_flat()
    for edge in fresh.edges:
        edge.use_edge_sharp = False
    table.data = fresh
    bridge("corrections.corrections").reapply(table)
    assert state(table.data) == ([True, True], 1)
    ops.smooth_by_angle(angle=0.0)
    assert state(table.data) == ([False, False], 0) and "scan_relight_smooth" not in table


def test_polls_say_what_is_missing(room, ops):
    bpy.ops.object.select_all(action="DESELECT")
    bpy.context.view_layer.objects.active = None
    for name in ("refit", "this_is", "this_is_white", "take_back", "paint_unseen", "fill_unseen"):
        assert not getattr(ops, name).poll(), name


def test_undo_takes_a_statement_back(room, ops):
    name = room[TABLE].name
    before = sockets(room[TABLE])
    select(room[TABLE])
    bpy.ops.ed.undo_push(message="before")
    ops.this_is(model="metal")
    bpy.ops.ed.undo_push(message="after")
    bpy.ops.ed.undo()
    table = bpy.data.objects[name]
    assert sockets(table) == before and "scan_relight_given" not in table
    bpy.ops.ed.redo()
    assert sockets(bpy.data.objects[name])["Metallic"] == 1


def test_a_run_from_the_panel_heeds_what_is_given(room, tmp_path):
    """Also where it goes to another folder than the one that the room came from."""
    corrections = bridge("corrections.corrections")
    for thing in room.values():
        thing["scan_relight_capture"] = str(tmp_path / "capture")
    corrections.give(room[TABLE], roughness=0.6)
    corrections.keep_for_run(bpy.context.scene, tmp_path / "new", tmp_path / "capture")
    assert json.loads((tmp_path / "new" / "overrides.json").read_text())["objects"] == {str(TABLE): {"roughness": 0.6}}
    assert (tmp_path / "new" / "capture.json").is_file(), "so that nobody else takes the folder"
    corrections.keep_for_run(bpy.context.scene, tmp_path / "another", tmp_path / "another capture")
    assert not (tmp_path / "another").exists()
