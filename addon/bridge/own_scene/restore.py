"""The original materials of the artist's objects, restored: the way back from `write_back`."""

from collections.abc import Iterable

import bpy
import numpy as np

from ..custom_properties import BEFORE, OBJECT_ID, RESULT, RUN
from ..data.arrays import read, vertices_of
from ..data.materials import MODEL
from ..data.mesh_objects import ATLAS_UV
from ..refused import sentences
from ..results import images
from .mesh import same_topology

COPY_OF = "scan_relight_copy_of"
"""Custom property of a copy: the object that it was made of."""
PREVIOUS_UV = "ScanRelight before"
"""New name of a UV map that already had the name of ours."""
PREVIOUS_SLOT = "scan_relight_slot_before"
"""Attribute of a mesh's faces: their original material index, where there was any."""


def restore(objects: Iterable[bpy.types.Object]) -> tuple[int, tuple[str, ...]]:
    """Give objects their original materials back, as before the first `own_scene.write_back`.

    Those without recovered materials are skipped; a copy stands for the object that it was made of. Returns how many
    were restored, and warnings.
    """
    originals = {(obj.get(COPY_OF) or obj): None for obj in objects}
    count, edited, changed_slots = 0, [], []
    for obj in originals:
        backup = obj.get(BEFORE)
        if backup is None or obj.library:
            continue
        count += 1
        if "copies" in backup:
            remove_copies(obj)
            continue
        current_materials = [slot.material for slot in obj.material_slots]
        if backup.get("mesh") is not None:
            mesh, obj.data = obj.data, backup["mesh"]
            if not (same_topology(mesh, obj.data) and np.array_equal(vertices_of(mesh), vertices_of(obj.data))):
                edited.append(obj.name)
                mesh.use_fake_user = True
            elif not mesh.users:
                bpy.data.meshes.remove(mesh)
        else:
            layers = obj.data.uv_layers
            if ATLAS_UV in layers:
                layers.remove(layers[ATLAS_UV])
            if "aside" in backup and PREVIOUS_UV in layers:
                layers[PREVIOUS_UV].name = ATLAS_UV
        old_materials = [slot_entry.get("material") for slot_entry in backup.get("slots", ())]
        if "faces" in backup and backup.get("mesh") is None:
            _restore_slots(obj.data, len(old_materials))
        if not old_materials and len(obj.material_slots) == 1:
            slot_indices = read(obj.data.polygons, "material_index", kind=np.int32)
            obj.data.materials.clear()
            if slot_indices.any():  # else an attribute would appear that was not there
                obj.data.polygons.foreach_set("material_index", slot_indices)
        elif len(old_materials) != len(obj.material_slots):
            changed_slots.append(obj.name)
        for slot, material in zip(obj.material_slots, old_materials):
            slot.material = material
        for key in (BEFORE, RESULT, RUN, OBJECT_ID):
            if key in obj:
                del obj[key]
        remove_unused_materials(current_materials)
    images.drop_unused({obj[RESULT] for obj in bpy.data.objects if RESULT in obj})
    slots_text = "material slots were added or removed since; as many old materials as there are slots are back"
    return count, sentences(
        (edited, "edited since; the mesh from before is back, and the edited one is kept among the file's meshes"),
        (changed_slots, slots_text),
    )


def _restore_slots(data: bpy.types.Mesh, count: int) -> None:
    """Give a mesh's faces their original material indices back, and take away the slots beyond the first `count`."""
    while len(data.materials) > count:
        data.materials.pop()
    before = data.attributes.get(PREVIOUS_SLOT)
    if before is not None:
        data.polygons.foreach_set("material_index", read(before.data, "value", kind=np.int32))
        data.attributes.remove(before)
    elif "material_index" in data.attributes:
        data.attributes.remove(data.attributes["material_index"])


def restorable(objects: Iterable[bpy.types.Object]) -> list[bpy.types.Object]:
    """Those that `restore` would change."""
    return [obj for obj in objects if BEFORE in obj or COPY_OF in obj]


def remove_copies(obj: bpy.types.Object) -> None:
    """Remove an object's copies and restore its visibility."""
    backup = obj.get(BEFORE)
    if backup is None or "copies" not in backup:
        return
    for entry in backup["copies"]:
        copy = entry.get("copy")
        if copy is None:
            continue
        data, copy_materials = copy.data, [slot.material for slot in copy.material_slots]
        bpy.data.objects.remove(copy)
        if not data.users:
            bpy.data.meshes.remove(data)
        remove_unused_materials(copy_materials)
    obj.hide_viewport, obj.hide_render = bool(backup["hide_viewport"]), bool(backup["hide_render"])
    del obj[BEFORE]


def remove_unused_materials(materials: Iterable[bpy.types.Material | None]) -> None:
    """Remove those recovered materials that nothing uses any more."""
    for material in {material for material in materials if material is not None}:
        if MODEL in material and not material.users and not material.library:
            bpy.data.materials.remove(material)
