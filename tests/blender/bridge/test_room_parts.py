"""Parts in scene.blend and in the open file: material slots of one object, also after another run."""

import json

import numpy as np
import pytest

from addon.core.brdf.dielectric import DIELECTRIC
from addon.core.brdf.emitter import EMITTER
from addon.core.brdf.lambertian import LAMBERTIAN
from addon.core.brdf.material import ObjectMaterial
from addon.core.results.room_file import read_room, write_room
from addon.core.scene.model import Capture, Instance, Mesh

bpy = pytest.importorskip("bpy")

from addon.bridge.corrections import corrections  # noqa: E402
from addon.bridge.room.bring import bringing  # noqa: E402
from addon.bridge.scene.write import write_scene  # noqa: E402
from addon.bridge.slices import whole  # noqa: E402

TABLE, LEG, SHADE = 4, 9, 6
NAMES = {TABLE: "Table", SHADE: "Shade", LEG: "Leg"}


def make_result(folder, parts=(LEG, SHADE), lamps=(), roughness=0.5, run="0123456789abcdef"):
    """A finished result of three squares; `parts` are parts of the table, `lamps` give light."""
    folder.mkdir()
    square = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], float)
    vertices = np.concatenate([square + (x, 0, 0) for x in (0, 2, 4)])
    triangles = np.concatenate([np.int32([[0, 1, 2], [0, 2, 3]]) + 4 * k for k in range(3)])
    mesh = Mesh(vertices, triangles, np.repeat(np.int32([TABLE, LEG, SHADE]), 2))
    instances = tuple(Instance(i, name, part_of=TABLE if i in parts else None) for i, name in NAMES.items())
    capture = Capture(folder.parent / "capture", mesh, instances, ())
    materials = [
        ObjectMaterial(i, name, EMITTER, emission=(2.0, 2.0, 2.0))
        if i in lamps
        else ObjectMaterial(i, name, DIELECTRIC, alpha=roughness**2, f0=0.04)
        if i == LEG
        else ObjectMaterial(i, name, LAMBERTIAN)
        for i, name in NAMES.items()
    ]
    uv = (triangles[..., None] / 12 + np.float32([0, 0.5])).astype(np.float32)
    entries = [{"object_id": m.object_id, "class_name": m.class_name, "model": m.model.name} for m in materials]
    (folder / "materials.json").write_text(json.dumps({"run": run, "objects": entries}))
    write_scene(folder / "scene.blend", capture, uv, materials, folder, fresh=False)
    write_room(folder, capture, uv)
    return folder


def objects(scene):
    """The numbers that each scanned object shows, in the order of its slots, by its name."""
    return {
        obj.name: [
            obj["object_id"] if k == 0 else slot.material["object_id"] for k, slot in enumerate(obj.material_slots)
        ]
        for obj in scene.objects
        if "object_id" in obj
    }


def material_of(scene, object_id):
    """The material of an instance."""
    return corrections.material.worn_material(corrections.instances_in(scene.objects)[object_id], object_id)


def principled(material):
    return next(node for node in material.node_tree.nodes if node.type == "BSDF_PRINCIPLED").inputs


@pytest.fixture
def first(tmp_path):
    return make_result(tmp_path / "first")


def test_the_stored_room_knows_the_parts(first):
    assert [i.part_of for i in read_room(first).capture.instances] == [None, TABLE, TABLE]


def test_one_object_with_a_slot_for_each_part(scene, first):
    whole(bringing(first, scene))
    assert objects(scene) == {"Table 4": [TABLE, SHADE, LEG]}
    table = scene.objects["Table 4"]
    centres = {face.material_index: (table.matrix_world @ face.center).x // 2 for face in table.data.polygons}
    assert centres == {0: 0, 1: 2, 2: 1}
    assert "object_id" not in table.material_slots[0].material
    for face in table.data.polygons:  # the atlas as it was laid out: u is the vertex's number / 12
        for loop in face.loop_indices:
            x, y, _ = table.matrix_world @ table.data.vertices[table.data.loops[loop].vertex_index].co
            number = 4 * int(x // 2) + [(0, 0), (1, 0), (1, 1), (0, 1)].index((round(x % 2), round(y)))
            assert table.data.uv_layers["ScanRelight"].uv[loop].vector.x == pytest.approx(number / 12)


def test_a_part_that_gives_light_is_a_lamp_of_its_own(scene, tmp_path):
    whole(bringing(make_result(tmp_path / "lit", lamps=(SHADE,)), scene))
    assert objects(scene) == {"Table 4": [TABLE, LEG], "Shade 6": [SHADE]}
    assert [c.name for c in scene.objects["Shade 6"].users_collection] == ["Lamps"]


def test_what_is_part_of_a_lamp_is_an_object(scene, tmp_path):
    whole(bringing(make_result(tmp_path / "lit", lamps=(TABLE,)), scene))
    assert objects(scene) == {"Table 4": [TABLE], "Shade 6": [SHADE], "Leg 9": [LEG]}


def test_another_run_updates_each_slot(scene, first, tmp_path):
    whole(bringing(first, scene))
    table = scene.objects["Table 4"]
    table.material_slots[2].material.name = "Chrome"
    brought = whole(bringing(make_result(tmp_path / "second", roughness=0.25, run="b" * 16), scene))
    assert brought.warnings == () and objects(scene) == {"Table 4": [TABLE, SHADE, LEG]}
    assert scene.objects["Table 4"] == table and table.material_slots[2].material.name == "Chrome"
    assert principled(material_of(scene, LEG))["Roughness"].default_value == pytest.approx(0.25)
    assert len([m for m in bpy.data.materials if "scan_relight_model" in m]) == 3


def test_a_corrected_slot_stays_and_the_others_are_new(scene, first, tmp_path):
    whole(bringing(first, scene))
    principled(material_of(scene, TABLE))["Roughness"].default_value = 0.77
    brought = whole(bringing(make_result(tmp_path / "second", roughness=0.25, run="b" * 16), scene))
    assert "the material was corrected and stays" in brought.warnings[0]
    assert principled(material_of(scene, TABLE))["Roughness"].default_value == pytest.approx(0.77)
    assert principled(material_of(scene, LEG))["Roughness"].default_value == pytest.approx(0.25)


@pytest.mark.parametrize("parts", [(), (LEG,)])
@pytest.mark.parametrize("back", [False, True])
def test_parts_that_come_and_go_take_along_what_is_given(scene, tmp_path, parts, back):
    """And a statement on a part, by which it becomes an object of its own or ceases to be one."""
    results = make_result(tmp_path / "first"), make_result(tmp_path / "second", parts, run="b" * 16)
    before, after = results[::-1] if back else results
    whole(bringing(before, scene))
    shown = corrections.instances_in(scene.objects)
    for object_id in (LEG, SHADE):
        corrections.give(shown[object_id], object_id, roughness=object_id / 10)
    assert whole(bringing(after, scene)).warnings == ()
    shown = corrections.instances_in(scene.objects)
    assert len(objects(scene)) == (1 if back else 3 - len(parts))
    for object_id in (LEG, SHADE):
        assert corrections.given(shown[object_id], object_id) == {"roughness": object_id / 10}
        assert principled(material_of(scene, object_id))["Roughness"].default_value == pytest.approx(object_id / 10)
    assert sum(key.startswith("scan_relight_given") for obj in scene.objects for key in obj.keys()) == 2


def test_an_edited_mesh_keeps_its_parts(scene, first, tmp_path):
    whole(bringing(first, scene))
    table = scene.objects["Table 4"]
    table.data.vertices[0].co.z += 0.2
    indices = [face.material_index for face in table.data.polygons]
    brought = whole(bringing(make_result(tmp_path / "second", roughness=0.25, run="b" * 16), scene))
    assert "the mesh was edited" in brought.warnings[0]
    assert [face.material_index for face in table.data.polygons] == indices
    assert principled(material_of(scene, LEG))["Roughness"].default_value == pytest.approx(0.25)


def test_an_export_has_a_plain_material_for_each_part(scene, first, tmp_path):
    from addon.bridge.export.export import copies

    whole(bringing(first, scene))
    with copies(scene, [scene.objects["Table 4"]], [], tmp_path / "textures") as collection:
        [table] = collection.objects
        assert [slot.material.name for slot in table.material_slots] == ["Table 4", "Shade 6", "Leg 9"]
        assert not any("scan_relight_model" in slot.material for slot in table.material_slots)


def test_a_lamp_in_a_slot_shines_from_its_own_faces(scene, first):
    """As on an artist's own object: the legs, 2 m to the side, give the light."""
    from mathutils import Vector

    from addon.bridge.data.materials import dress
    from addon.bridge.relight import estimate

    whole(bringing(first, scene))
    leg = material_of(scene, LEG)
    dress(leg, ObjectMaterial(LEG, "Leg", EMITTER, emission=(2.0, 2.0, 2.0)))
    samples = list(estimate._lamp_source(scene, leg.name)(Vector((2.5, 0.5, 1))))
    assert samples and all(abs((Vector((2.5, 0.5, 1)) + d * r).x - 2.5) <= 0.5 for d, r, _ in samples)
