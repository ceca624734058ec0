"""A statement fits its objects again and brings them into the scene; the rest of the room stays as it is."""

import json
import shutil

import pytest

bpy = pytest.importorskip("bpy")

from tests.blender.artist.artist_room import bridge  # noqa: E402
from tests.blender.artist.corrected_room import select, sockets  # noqa: E402
from tests.blender.relight.conftest import result  # noqa: E402, F401


@pytest.fixture
def room(ops, result, tmp_path):  # noqa: F811
    """The demo's room, recovered, in a folder of its own and opened; its objects by name of their class."""
    bridge("corrections.corrections").forget()
    folder = shutil.copytree(result, tmp_path / "result")
    bpy.ops.wm.open_mainfile(filepath=str(folder / "scene.blend"), load_ui=False)
    things = {thing.name.rpartition(" ")[0]: thing for thing in bpy.context.scene.objects if "object_id" in thing}
    for thing in (*things.values(), *bpy.data.collections):
        if "scan_relight_result" in thing:
            thing["scan_relight_result"] = str(folder)
    return folder, things


def entries(folder):
    return {one["object_id"]: one for one in json.loads((folder / "materials.json").read_text())["objects"]}


def plain(thing):
    """All that a material's nodes hold."""
    tree = thing.material_slots[0].material.node_tree
    return sorted(
        (
            node.name,
            socket.identifier,
            bool(socket.links),
            str(
                getattr(socket, "default_value", None)
                and (tuple(socket.default_value) if hasattr(socket.default_value, "__len__") else socket.default_value)
            ),
        )
        for node in tree.nodes
        for socket in node.inputs
    )


@pytest.mark.slow
def test_this_is_metal_refits_that_object_alone(room, ops):
    folder, things = room
    sofa, others = things["sofa"], {name: plain(thing) for name, thing in things.items() if name != "sofa"}
    before, material = entries(folder), sofa.material_slots[0].material
    run = sofa["scan_relight_run"]
    select(sofa)
    assert ops.this_is(model="metal") == {"FINISHED"}
    after = entries(folder)
    changed = [number for number in after if after[number].get("model") != before[number].get("model")]
    assert changed == [sofa["object_id"]] and after[sofa["object_id"]]["given"] == {"model": "metal"}
    fitted, shown = after[sofa["object_id"]], sockets(sofa)
    assert shown["Metallic"] == 1 and shown["Roughness"] == pytest.approx(fitted["alpha"] ** 0.5, abs=1e-5)
    assert shown["Base Color"] == pytest.approx(fitted["f0"], abs=1e-3)
    assert sofa.material_slots[0].material == material, "whoever refers to it still does"
    assert {name: plain(thing) for name, thing in things.items() if name != "sofa"} == others
    runs = {thing["scan_relight_run"] for thing in things.values()}
    assert (
        len(runs) == 1
        and runs != {run}
        and bridge("corrections.corrections").entry(sofa)["given"] == {"model": "metal"}
    )
    assert json.loads((folder / "overrides.json").read_text())["objects"] == {
        str(sofa["object_id"]): {"model": "metal"}
    }


@pytest.mark.slow
@pytest.mark.once
def test_taken_back_it_is_found_again(room, ops):
    folder, things = room
    sofa = things["sofa"]
    before, shown = entries(folder)[sofa["object_id"]], sockets(sofa)
    select(sofa)
    ops.this_is(model="metal")
    bpy.context.scene.scan_relight_correct.refit_automatically = False
    ops.take_back()
    assert sockets(sofa)["Metallic"] == shown["Metallic"], "what was found shows before it is fitted"
    ops.refit()
    after = entries(folder)[sofa["object_id"]]
    assert after["model"] == before["model"] and not after.get("given")
    for name, value in shown.items():
        assert sockets(sofa)[name] == pytest.approx(value, abs=0.02), name
    assert "scan_relight_found" not in sofa


@pytest.mark.slow
@pytest.mark.once
def test_values_that_were_set_by_hand_stay_and_the_rest_is_fitted(room, ops):
    folder, things = room
    ball = things["ball"]
    select(ball)
    ball.scan_relight_correct.roughness = 0.7
    ops.refit()
    one = entries(folder)[ball["object_id"]]
    assert one["alpha"] == pytest.approx(0.49, abs=1e-4) and sockets(ball)["Roughness"] == pytest.approx(0.7, abs=1e-4)
    assert ball.scan_relight_correct.roughness == pytest.approx(0.7, abs=1e-4)


@pytest.mark.slow
@pytest.mark.once
def test_a_failed_refit_is_a_sentence_and_what_was_said_stays(room, ops):
    folder, things = room
    shutil.rmtree(folder / "stages")
    select(things["sofa"])
    with pytest.raises(RuntimeError, match="run recover again"):
        ops.refit()
    with pytest.raises(RuntimeError, match="run recover again"):
        ops.this_is(model="metal")
    assert sockets(things["sofa"])["Metallic"] == 1


def test_a_later_run_brings_the_room_and_what_the_artist_did_stays(ops, result, tmp_path):  # noqa: F811
    """The material is the new run's, under what is given; painted image and smooth shading come back."""
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    bridge("corrections.corrections").forget()
    folder = shutil.copytree(result, tmp_path / "result")
    bringing, whole = bridge("room.bring").bringing, bridge("slices").whole
    scene = whole(bringing(folder)).scene
    bpy.context.window.scene = scene
    scene.scan_relight_correct.refit_automatically = False
    things = {thing.name.rpartition(" ")[0]: thing for thing in scene.objects if "object_id" in thing}
    sofa, wall = things["sofa"], things["papered wall"]
    select(sofa)
    ops.this_is(model="metal")
    sofa.scan_relight_correct.roughness = 0.33
    ops.smooth_by_angle(angle=0.5)
    image = bridge("corrections.unseen").own_image(wall)
    materials = json.loads((folder / "materials.json").read_text())
    materials["run"] = "f" * 16
    (folder / "materials.json").write_text(json.dumps(materials))
    again = whole(bringing(folder))
    assert again.scene == scene and not [said for said in again.warnings if "corrected" in said]
    assert sockets(sofa)["Metallic"] == 1 and sockets(sofa)["Roughness"] == pytest.approx(0.33)
    assert bridge("corrections.unseen").texture_node(wall).image == image
    assert any(polygon.use_smooth for polygon in sofa.data.polygons)
    assert sofa["scan_relight_run"] == "f" * 16
    select(sofa, wall)
    ops.take_back()
    ops.restore_painted()
    assert sockets(sofa)["Metallic"] == 0 and bridge("corrections.unseen").texture_node(wall).image != image


@pytest.mark.slow
def test_nodes_that_were_edited_by_hand_stay(ops, result, tmp_path):  # noqa: F811
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    folder = shutil.copytree(result, tmp_path / "result")
    scene = bridge("slices").whole(bridge("room.bring").bringing(folder)).scene
    bpy.context.window.scene = scene
    sofa = next(thing for thing in scene.objects if thing.name.startswith("sofa"))
    node = bridge("data.materials").principled(sofa.material_slots[0].material)
    node.inputs["Sheen Weight"].default_value = 0.7
    select(sofa)
    ops.this_is(model="metal")
    assert node.inputs["Sheen Weight"].default_value == pytest.approx(0.7)
    assert node.inputs["Metallic"].default_value == 1
    assert entries(folder)[sofa["object_id"]]["model"] == "metal"


@pytest.mark.slow
@pytest.mark.once
def test_a_known_white_scales_the_room_in_the_scene(room, ops):
    """Albedo of all objects by the given over the found; lamps the other way."""
    folder, things = room
    wall = things["wall"]
    found = entries(folder)[wall["object_id"]]["evidence"]["albedo"]
    before = {name: plain(thing) for name, thing in things.items()}
    select(wall)
    ops.this_is_white(albedo=[0.9 * part for part in found])
    after = entries(folder)
    assert after[wall["object_id"]]["evidence"]["albedo"] == pytest.approx([0.9 * part for part in found], rel=0.05)
    assert json.loads((folder / "overrides.json").read_text())["white"]["object"] == wall["object_id"]
    lamps = [name for name, thing in things.items() if after[thing["object_id"]]["model"] == "emitter"]
    assert lamps and all(plain(things[name]) != before[name] for name in lamps)
    assert bridge("corrections.corrections").entry(wall)
