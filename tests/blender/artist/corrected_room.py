"""A small recovered room with a result folder made by hand: four objects, an atlas of 64 x 64, what no frame saw."""

import json

import bpy
import numpy as np

from addon.core.io.exr import write_exr
from tests.blender.artist.artist_room import bridge

SIZE = 64
BOARD, TAP, LAMP, TABLE = 3, 5, 7, 9
RUN = "0123456789abcdef"
ENTRIES = [
    {"object_id": BOARD, "class_name": "board", "model": "lambertian", "evidence": {"albedo": [0.4, 0.2, 0.1]}},
    {"object_id": TAP, "class_name": "tap", "model": "metal", "alpha": 0.04, "f0": [0.9, 0.6, 0.3]},
    {"object_id": LAMP, "class_name": "lamp", "model": "emitter", "emission": [3.0, 2.0, 1.0]},
    {
        "object_id": TABLE,
        "class_name": "table",
        "model": "specular",
        "alpha": 0.09,
        "f0": 0.05,
        "evidence": {"albedo": [0.5, 0.5, 0.5]},
    },
]


def unseen():
    """(64, 64) bool, row 0 at the bottom: a hole in the board and one in the table."""
    hole = np.zeros((SIZE, SIZE), bool)
    hole[10:16, 10:16] = hole[40:46, 40:46] = True
    return hole


def colours():
    """Base Color, (64, 64, 3), row 0 at the bottom: a ramp, 0.9 in what no frame saw."""
    image = np.empty((SIZE, SIZE, 3), np.float32)
    image[...] = np.linspace(0.2, 0.6, SIZE)[:, None]
    image[unseen()] = 0.9
    return image


def write_result(folder, entries=ENTRIES, run=RUN):
    """Images and materials.json."""
    folder.mkdir(exist_ok=True)
    coverage = np.empty((SIZE, SIZE, 3), np.float32)
    coverage[...] = np.where(unseen()[..., None], (0, 0, 1), (20, 0.1, 2))
    for name, image in (("base_color", colours()), ("albedo", colours()), ("coverage", coverage)):
        write_exr(folder / f"{name}.exr", np.ascontiguousarray(image[::-1]))
    (folder / "materials.json").write_text(json.dumps({"run": run, "capture": "room", "objects": entries}))


def build(folder, part_of=None):
    """The room in the open scene, by object id; nothing is selected. `part_of`: of what each part is one."""
    from addon.core.results.room_file import material
    from addon.core.scene.model import Instance, Mesh

    write_result(folder)
    part_of = part_of or {}
    vertices, triangles, owner, uv = [], [], [], []
    for k, entry in enumerate(ENTRIES):
        low = np.float32([k % 2, k // 2]) * 0.5
        square = np.float32([(0.03, 0.03), (0.47, 0.03), (0.47, 0.47), (0.03, 0.47)])
        triangles += [[4 * k, 4 * k + 1, 4 * k + 2], [4 * k, 4 * k + 2, 4 * k + 3]]
        vertices += [(4 * x + 2 * k, 4 * y, 0) for x, y in square]
        uv += [[low + square[i] for i in face] for face in ((0, 1, 2), (0, 2, 3))]
        owner += [entry["object_id"]] * 2
    mesh = Mesh(np.float32(vertices), np.int32(triangles), np.int32(owner))
    instances, collection = (
        [Instance(one["object_id"], one["class_name"], part_of=part_of.get(one["object_id"])) for one in ENTRIES],
        bpy.context.scene.collection,
    )
    objects = dict(bridge("data.mesh_objects").each_object(mesh, instances, np.float32(uv), collection))
    image = bridge("results.images").image(folder, "base_color.exr")
    for entry in ENTRIES:
        whole = part_of.get(entry["object_id"])
        thing = objects[entry["object_id"] if whole is None else whole]
        thing.data.materials.append(bridge("data.materials").make_material(material(entry), image))
        if whole is not None:
            thing.data.materials[-1]["object_id"] = entry["object_id"]
        bridge("custom_properties").set_run(thing, folder, RUN)
    bpy.context.view_layer.update()
    return objects


def select(*things):
    """Select things; the last one is the active one."""
    for thing in bpy.context.scene.objects:
        thing.select_set(thing in things)
    bpy.context.view_layer.objects.active = things[-1]


def sockets(thing):
    """Plain values of an object's Principled node."""
    node = next(n for n in thing.material_slots[0].material.node_tree.nodes if n.type == "BSDF_PRINCIPLED")
    found = {
        name: node.inputs[name].default_value
        for name in ("Metallic", "Roughness", "IOR", "Specular IOR Level", "Emission Strength")
    }
    found["Base Color"] = tuple(round(one, 4) for one in node.inputs["Base Color"].default_value[:3])
    found["linked"] = bool(node.inputs["Base Color"].links)
    return found
