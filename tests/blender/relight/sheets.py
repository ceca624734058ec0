"""Flat sheets of known materials, from which the tests build what they need."""

import bpy
import numpy as np

from addon.bridge.custom_properties import OBJECT_ID
from addon.bridge.data.arrays import make_mesh
from addon.bridge.data.materials import make_material
from addon.core.brdf.emitter import EMITTER
from addon.core.brdf.lambertian import LAMBERTIAN
from addon.core.brdf.material import ObjectMaterial


def sheet(scene, name, size, place, rotation=(0, 0, 0), object_id=0, emission=None, one_sided=False, grey=0.5):
    """A square of `size` metres whose normal is +Z before `rotation`; a lamp where it has an `emission`."""
    h = size / 2
    thing = bpy.data.objects.new(
        name,
        make_mesh(name, np.array([[-h, -h, 0], [h, -h, 0], [h, h, 0], [-h, h, 0]]), np.array([[0, 1, 2], [0, 2, 3]])),
    )
    model = LAMBERTIAN if emission is None else EMITTER
    material = make_material(ObjectMaterial(object_id, name, model, emission=emission), one_sided=one_sided)
    if emission is None:
        shader = next(n for n in material.node_tree.nodes if n.type == "BSDF_PRINCIPLED")
        shader.inputs["Base Color"].default_value = (grey, grey, grey, 1)
    thing.data.materials.append(material)
    thing.location, thing.rotation_euler = place, rotation
    thing[OBJECT_ID] = object_id
    scene.collection.objects.link(thing)
    return thing
