"""What is bright behind the openings of a scan's mesh, as lamps: panels that shine into the room, unseen by cameras."""

from __future__ import annotations

from pathlib import Path

import bpy
import numpy as np

from ...core.brdf.emitter import EMITTER
from ...core.brdf.material import ObjectMaterial
from ...core.luminance import rgb
from ...core.results.room_file import openings_of
from ..data.arrays import make_mesh
from ..data.materials import make_material

NAME = "opening"


def make_openings(folder: Path, collection: bpy.types.Collection) -> list[bpy.types.Object]:
    """An object for each panel that the result folder tells of, linked to a collection."""
    made = []
    for number, (corners, radiance) in enumerate(openings_of(folder), 1):
        vertices, place = np.unique(corners.reshape(-1, 3), axis=0, return_inverse=True)
        quads = place.reshape(-1, 4)
        material = ObjectMaterial(number, NAME, EMITTER, emission=rgb(radiance))
        data = make_mesh(material.name, vertices, np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]]))
        thing = bpy.data.objects.new(material.name, data)
        thing.visible_camera = False
        data.materials.append(make_material(material, one_sided=True))
        collection.objects.link(thing)
        made.append(thing)
    return made
