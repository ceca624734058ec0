"""One object for each instance, with every triangle where it was."""

import numpy as np
import pytest

from addon.core.scene.model import Instance, Mesh

bpy = pytest.importorskip("bpy")
import bmesh  # noqa: E402

from addon.bridge.data.mesh_objects import ATLAS_UV, CAPTURE_UV, each_object, is_one_sided  # noqa: E402

INSTANCES = (Instance(2, "Sofa"), Instance(5, "Sofa"), Instance(7, "Wall"), Instance(8, "Ghost"))


@pytest.fixture
def mesh():
    rng = np.random.default_rng(0)
    return Mesh(
        rng.uniform(-4, 4, (40, 3)) + (100, 0, 0),
        rng.integers(0, 40, (60, 3)).astype(np.int32),
        rng.permutation(np.repeat([2, 5, 7], 20)).astype(np.int32),
        rng.random((60, 3, 2)).astype(np.float32),
    )


def read(data, name):
    uv = np.empty(len(data.loops) * 2, np.float32)
    data.uv_layers[name].data.foreach_get("uv", uv)
    return uv.reshape(-1, 3, 2)


def test_triangles_and_coordinates_come_back(scene, mesh):
    atlas = np.random.default_rng(1).random((60, 3, 2)).astype(np.float32)
    objects = dict(each_object(mesh, INSTANCES, atlas, scene.collection))
    bpy.context.view_layer.update()
    assert list(objects) == [2, 5, 7]
    for object_id, thing in objects.items():
        data, own = thing.data, mesh.object_id == object_id
        place = np.empty(len(data.vertices) * 3, np.float32)
        data.vertices.foreach_get("co", place)
        corner = np.empty(len(data.loops), np.int32)
        data.loops.foreach_get("vertex_index", corner)
        world = place.reshape(-1, 3)[corner].reshape(-1, 3, 3) + np.array(thing.matrix_world.translation)
        np.testing.assert_allclose(world, mesh.vertices[mesh.triangles[own]], atol=2e-5)
        np.testing.assert_array_equal(read(data, ATLAS_UV), atlas[own])
        np.testing.assert_array_equal(read(data, CAPTURE_UV), mesh.uv[own])
        assert len(data.vertices) == len(np.unique(mesh.triangles[own]))
        assert data.uv_layers.active.name == ATLAS_UV and data.uv_layers[ATLAS_UV].active_render
        assert thing["object_id"] == object_id and not any(p.use_smooth for p in data.polygons)
        assert np.abs(np.array(data.vertices[0].co)).max() < 8.1


def test_names(scene, mesh):
    objects = dict(each_object(mesh, INSTANCES, mesh.uv, scene.collection))
    assert [o.name for o in objects.values()] == ["Sofa 2", "Sofa 5", "Wall 7"]


def test_without_own_coordinates(scene, mesh):
    bare = Mesh(mesh.vertices, mesh.triangles, mesh.object_id)
    objects = dict(each_object(bare, INSTANCES, mesh.uv, scene.collection))
    assert [u.name for u in objects[2].data.uv_layers] == [ATLAS_UV]


def test_parts_are_slots_of_what_they_are_part_of(scene, mesh):
    atlas = np.random.default_rng(1).random((60, 3, 2)).astype(np.float32)
    instances = (Instance(2, "Leg", part_of=7), Instance(5, "Foot", part_of=2), Instance(7, "Table"))
    [(object_id, thing)] = each_object(mesh, instances, atlas, scene.collection)
    assert object_id == thing["object_id"] == 7 and thing.name == "Table 7" and len(bpy.data.meshes) == 1
    slots = np.array([face.material_index for face in thing.data.polygons])
    for slot, part in enumerate((7, 2, 5)):
        np.testing.assert_array_equal(read(thing.data, ATLAS_UV)[slots == slot], atlas[mesh.object_id == part])
    assert len(thing.data.vertices) == len(np.unique(mesh.triangles)), "they share the vertices of the seam"


def test_a_part_of_what_has_no_triangles_is_an_object(scene, mesh):
    instances = (Instance(2, "Leg", part_of=8), *INSTANCES[1:])
    objects = dict(each_object(mesh, instances, mesh.uv, scene.collection))
    assert [o.name for o in objects.values()] == ["Leg 2", "Sofa 5", "Wall 7"]


@pytest.mark.parametrize(
    ("below", "guessed", "one_sided"),
    [
        (2.0, True, False),  # closed
        (0.3, True, False),  # what was fused of a globe from below
        (0.3, False, True),
        (-0.85, True, True),  # of its bottom alone
    ],
)
def test_a_lamp_shines_to_its_front_if_it_is_open_and_no_globe(below, guessed, one_sided):
    data, globe = bpy.data.meshes.new("lamp"), bmesh.new()
    bmesh.ops.create_icosphere(globe, subdivisions=3, radius=1)
    others = [face for face in globe.faces if face.calc_center_median().z > below]
    bmesh.ops.delete(globe, geom=others, context="FACES")
    globe.to_mesh(data)
    globe.free()
    assert is_one_sided(data, guessed) == one_sided
