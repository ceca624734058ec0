"""Objects of several materials: an instance for each used slot or face set, and back onto the same slots."""

import json

import numpy as np
import pytest

from addon.core.brdf.dielectric import DIELECTRIC
from addon.core.brdf.lambertian import LAMBERTIAN
from addon.core.brdf.material import ObjectMaterial
from addon.core.io.read import read_capture

bpy = pytest.importorskip("bpy")

from addon.bridge.own_scene.capture import capture_scene, sources  # noqa: E402
from addon.bridge.own_scene.restore import restore  # noqa: E402
from addon.bridge.own_scene.write_back import writing_back  # noqa: E402
from addon.bridge.slices import whole  # noqa: E402
from tests.blender.artist.artist_room import add_cameras, box, mesh_object, paint  # noqa: E402
from tests.blender.artist.test_round_trip import state  # noqa: E402

FACE_SETS = ".sculpt_face_set"


@pytest.fixture
def frames(scene, tmp_path):
    return add_cameras(tmp_path, 2)


@pytest.fixture
def table(frames):
    """A table of wood with one side of steel; the slot between the two is unused, and one is empty and unused."""
    made = mesh_object("Table", *box((0, 0, 0), (1, 1, 1)), [paint("Wood"), paint("Paper"), paint("Steel"), None])
    made.data.polygons.foreach_set("material_index", np.int32([0, 0, 2, 0, 0, 0]))
    bpy.context.view_layer.update()
    return made


@pytest.fixture
def sculpture(frames):
    """A cube of one slot with a face set of two sides."""
    made = mesh_object("Bust", *box((0, 0, 0), (1, 1, 1)), [paint("Clay")])
    set_faces(made, [3, 3, 7, 7, 3, 3])
    bpy.context.view_layer.update()
    return made


def set_faces(obj, numbers):
    layer = obj.data.attributes.new(FACE_SETS, "INT", "FACE")
    layer.data.foreach_set("value", np.int32(numbers))


def captured(folder, *objects):
    capture_scene(bpy.context, folder, objects)
    return read_capture(folder)


def written(scene, capture, folder, copies=False):
    """Write materials of known roughness: a tenth of the object's number."""
    folder.mkdir(exist_ok=True)
    materials = [
        ObjectMaterial(i.object_id, i.class_name, DIELECTRIC, alpha=(i.object_id / 10) ** 2, f0=0.04)
        for i in capture.instances
    ]
    uv = np.zeros((len(capture.mesh.triangles), 3, 2), np.float32)
    return whole(writing_back(scene, capture, uv, materials, folder, copies=copies))


def roughness(material):
    return round(next(n for n in material.node_tree.nodes if n.type == "BSDF_PRINCIPLED").inputs[2].default_value, 4)


def area(capture, object_id):
    a, b, c = (
        capture.mesh.vertices[capture.mesh.triangles[capture.mesh.object_id == object_id][:, k]] for k in range(3)
    )
    return np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2


def shown_by_face(obj):
    """Roughness of the material that each face shows."""
    return [roughness(obj.material_slots[face.material_index].material) for face in obj.data.polygons]


def test_a_used_slot_is_an_instance(table, tmp_path):
    capture = captured(tmp_path / "capture", table)
    assert [(i.class_name, i.part_of) for i in capture.instances] == [("Table: Wood", None), ("Table: Steel", 0)]
    assert area(capture, 0) == pytest.approx(5) and area(capture, 1) == pytest.approx(1)
    assert [(s.slot, s.face_set, s.part_of) for s in sources(capture.root)] == [(0, None, None), (2, None, 0)]


def test_the_larger_part_comes_first_and_an_empty_slot_has_its_number(table, tmp_path):
    table.data.polygons.foreach_set("material_index", np.int32([0, 3, 3, 3, 9, 3]))  # 9 is shown as the last slot
    table.data.update()
    capture = captured(tmp_path / "capture", table)
    assert [(i.class_name, i.part_of) for i in capture.instances] == [("Table: slot 4", None), ("Table: Wood", 0)]
    assert area(capture, 0) == pytest.approx(5)


def test_face_sets_where_there_is_one_slot(sculpture, tmp_path):
    capture = captured(tmp_path / "capture", sculpture)
    names = [(i.class_name, i.part_of) for i in capture.instances]
    assert names == [("Bust: face set 3", None), ("Bust: face set 7", 0)]
    assert area(capture, 1) == pytest.approx(2)
    assert [source.face_set for source in sources(capture.root)] == [3, 7]


def test_slots_win_over_face_sets_and_one_face_set_is_none(table, sculpture, tmp_path):
    set_faces(table, [1, 2, 3, 4, 5, 6])
    sculpture.data.attributes[FACE_SETS].data.foreach_set("value", np.int32([4] * 6))
    capture = captured(tmp_path / "capture", table, sculpture)
    assert [i.class_name for i in capture.instances] == ["Bust", "Table: Wood", "Table: Steel"]


def test_objects_of_one_mesh_share_classes_slot_by_slot(table, tmp_path):
    second = bpy.data.objects.new("Twin", table.data)
    bpy.context.scene.collection.objects.link(second)
    bpy.context.view_layer.update()
    capture = captured(tmp_path / "capture", table, second)
    assert [i.class_name for i in capture.instances] == ["Table: Wood", "Table: Steel"] * 2
    assert [i.part_of for i in capture.instances] == [None, 0, None, 2]
    assert [source.name for source in sources(capture.root)][2:] == ["Twin: Wood", "Twin: Steel"]


def test_each_used_slot_gets_its_own_material_and_all_goes_back(scene, table, tmp_path):
    before = state({"Table": table})
    capture = captured(tmp_path / "capture", table)
    assert written(scene, capture, tmp_path / "result") == ()
    assert shown_by_face(table) == [0, 0, 0.1, 0, 0, 0]
    slots = [slot.material for slot in table.material_slots]
    assert slots[1] == bpy.data.materials["Paper"] and slots[3] is None
    assert slots[2]["object_id"] == 1 and "object_id" not in slots[0] and table["object_id"] == 0
    assert restore([table]) == (1, ())
    assert state({"Table": table}) == before
    assert not [material for material in bpy.data.materials if "scan_relight_model" in material]


def test_an_object_with_one_instance_gets_its_material_in_every_slot(scene, table, tmp_path):
    table.data.polygons.foreach_set("material_index", np.int32([2] * 6))
    capture = captured(tmp_path / "capture", table)
    assert [i.class_name for i in capture.instances] == ["Table"]
    written(scene, capture, tmp_path / "result")
    assert len({slot.material for slot in table.material_slots}) == 1 and len(table.material_slots) == 4


def test_face_sets_become_slots_and_all_goes_back_after_saving(scene, sculpture, tmp_path):
    before = state({"Bust": sculpture})
    capture = captured(tmp_path / "capture", sculpture)
    for _ in range(2):  # written again, what is kept is still the original
        written(scene, capture, tmp_path / "result")
    assert shown_by_face(sculpture) == [0, 0, 0.1, 0.1, 0, 0] and len(sculpture.material_slots) == 2
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "file.blend"))
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "file.blend"))
    opened = bpy.data.objects["Bust"]
    assert restore([opened]) == (1, ())
    assert state({"Bust": opened}) == before


def test_face_sets_on_bare_and_on_shared_meshes_go_back(scene, frames, tmp_path):
    bare = mesh_object("Bare", *box((0, 0, 0), (1, 1, 1)), uv=None)
    set_faces(bare, [1, 2, 2, 1, 1, 1])
    used = mesh_object("Used", *box((2, 0, 0), (3, 1, 1)), [paint("Clay"), paint("Spare")])
    used.data.polygons.foreach_set("material_index", np.int32([1] * 6))
    set_faces(used, [1, 2, 2, 1, 1, 1])
    twin = bpy.data.objects.new("Twin", used.data)
    scene.collection.objects.link(twin)
    bpy.context.view_layer.update()
    things = {"Bare": bare, "Used": used, "Twin": twin}
    before = state(things)
    capture = captured(tmp_path / "capture", *things.values())
    written(scene, capture, tmp_path / "result")
    assert shown_by_face(bare) == [0, 0.1, 0.1, 0, 0, 0]
    assert shown_by_face(twin) == [0.2, 0.3, 0.3, 0.2, 0.2, 0.2] and shown_by_face(used)[:2] == [0.4, 0.5]
    assert restore(things.values()) == (3, ())
    assert state(things) == before


def test_captured_again_while_written_the_parts_are_the_same(scene, table, sculpture, tmp_path):
    first = captured(tmp_path / "capture", table, sculpture)
    written(scene, first, tmp_path / "result")
    again = captured(tmp_path / "capture", table, sculpture)
    assert again.instances == first.instances
    assert (again.mesh.object_id == first.mesh.object_id).all()


def test_copies_of_evaluated_faces_have_the_parts(scene, table, tmp_path):
    table.modifiers.new("round", "SUBSURF").levels = 1
    board = mesh_object("board", *box((3, 0, 0), (4, 1, 1)), [paint("Oak"), paint("Brass")])
    scene.collection.objects.unlink(board)
    group = bpy.data.collections.new("shelf")
    group.objects.link(board)
    shelf = bpy.data.objects.new("shelf", None)
    shelf.instance_type, shelf.instance_collection = "COLLECTION", group
    scene.collection.objects.link(shelf)
    bpy.context.view_layer.update()
    capture = captured(tmp_path / "capture", table, shelf)
    names = [(i.class_name, i.part_of) for i in capture.instances]
    assert names[:2] == [("Table: Wood", None), ("Table: Steel", 0)]
    assert names[2:] == [("shelf/board: Oak", None), ("shelf/board: Brass", 2)]
    before = state({"table": table, "shelf": shelf})
    assert "modifiers" in written(scene, capture, tmp_path / "result")[0]
    assert state({"table": table, "shelf": shelf}) == before
    for _ in range(2):  # made anew
        assert written(scene, capture, tmp_path / "result", copies=True) == ()
    copy = bpy.data.objects["Table (Scan Relight)"]
    assert shown_by_face(copy) == [0] * 8 + [0.1] * 4 + [0] * 12  # four faces of each
    assert shown_by_face(bpy.data.objects["shelf/board (Scan Relight)"]) == [0.2, 0.3] * 3
    assert restore([copy]) == (1, ())
    assert restore([shelf]) == (1, ())
    assert state({"table": table, "shelf": shelf}) == before


def test_parts_that_the_run_found_itself_become_slots(scene, frames, tmp_path):
    """They are in the stored room, and not in the capture."""
    from dataclasses import replace

    from addon.core.scene.model import Instance

    lone = mesh_object("Lone", *box((0, 0, 0), (1, 1, 1)), [paint("Wood")])
    bpy.context.view_layer.update()
    capture = captured(tmp_path / "capture", lone)
    before = state({"Lone": lone})
    ids = capture.mesh.object_id.copy()
    ids[4:6] = 5
    found = replace(
        capture,
        mesh=replace(capture.mesh, object_id=ids),
        instances=(*capture.instances, Instance(5, "Lone", part_of=0)),
    )
    written(scene, found, tmp_path / "result")
    assert shown_by_face(lone) == [0, 0, 0.5, 0, 0, 0]
    assert restore([lone]) == (1, ()) and state({"Lone": lone}) == before


def test_a_capture_of_an_older_version_is_written_as_before(scene, table, tmp_path):
    table.data.polygons.foreach_set("material_index", np.int32([0] * 6))
    capture = captured(tmp_path / "capture", table)
    path = capture.root / "scene.json"
    objects = json.loads(path.read_text())["objects"]
    for entry in objects:
        for key in ("slot", "face_set", "part_of", "whole"):
            del entry[key]
    path.write_text(json.dumps({"objects": objects}))
    table.data.polygons.foreach_set("material_index", np.int32([0, 1, 2, 3, 0, 0]))
    assert written(scene, capture, tmp_path / "result") == ()
    assert len({slot.material for slot in table.material_slots}) == 1


def test_undo_takes_the_parts_back(scene, sculpture, tmp_path):
    capture = captured(tmp_path / "capture", sculpture)
    before = state({"Bust": sculpture})
    bpy.ops.ed.undo_push(message="before")
    written(scene, capture, tmp_path / "result")
    bpy.ops.ed.undo_push(message="after")
    bpy.ops.ed.undo()
    assert state({"Bust": bpy.data.objects["Bust"]}) == before
    bpy.ops.ed.redo()
    assert shown_by_face(bpy.data.objects["Bust"]) == [0, 0, 0.1, 0.1, 0, 0]
    assert restore([bpy.data.objects["Bust"]]) == (1, ())
    assert state({"Bust": bpy.data.objects["Bust"]}) == before


def test_a_written_object_without_a_description_is_matt(scene, table, tmp_path):
    capture = captured(tmp_path / "capture", table)
    (tmp_path / "result").mkdir()
    uv = np.zeros((len(capture.mesh.triangles), 3, 2), np.float32)
    whole(writing_back(scene, capture, uv, [], tmp_path / "result"))
    assert table.material_slots[2].material["scan_relight_model"] == LAMBERTIAN.name
