"""The instances of the capture that an object shows: its own, and the parts of it, each in a material slot."""

import bpy

from ..custom_properties import OBJECT_ID


def slots_of(obj: bpy.types.Object) -> dict[int, list[int]]:
    """Indices of the material slots that show each instance, the object's own first; {} for one not of a capture."""
    if OBJECT_ID not in obj:
        return {}
    slots: dict[int, list[int]] = {obj[OBJECT_ID]: []}
    for index in range(len(obj.material_slots)):
        slots.setdefault(in_slot(obj, index), []).append(index)
    return slots


def in_slot(obj: bpy.types.Object, index: int) -> int:
    """The instance that a material slot of an object of a capture shows."""
    slots = obj.material_slots
    material = slots[index].material if index < len(slots) else None
    return obj[OBJECT_ID] if material is None else material.get(OBJECT_ID, obj[OBJECT_ID])


def chosen_in(obj: bpy.types.Object) -> int:
    """The instance that is meant by an object of a capture: that of its active material slot."""
    return in_slot(obj, obj.active_material_index)


def choose(obj: bpy.types.Object, object_id: int) -> None:
    """Make the slot of an instance the active one."""
    slots = slots_of(obj).get(object_id)
    if slots and obj.active_material_index not in slots:
        obj.active_material_index = slots[0]


def materials_of(obj: bpy.types.Object, object_id: int | None = None) -> list[bpy.types.Material]:
    """The materials of an instance, by default the one that is meant."""
    slots = slots_of(obj).get(chosen_in(obj) if object_id is None else object_id, [])
    return [material for index in slots if (material := obj.material_slots[index].material) is not None]


def name_of(obj: bpy.types.Object, object_id: int | None = None) -> str:
    """What an instance is called: a part as its material, any other as its object."""
    object_id = chosen_in(obj) if object_id is None else object_id
    return obj.name if object_id == obj[OBJECT_ID] else next((m.name for m in materials_of(obj, object_id)), obj.name)


def key_of(name: str, obj: bpy.types.Object, object_id: int | None = None) -> str:
    """The custom property of an object that holds `name` of an instance: a part's bears its number."""
    object_id = chosen_in(obj) if object_id is None else object_id
    return name if object_id == obj[OBJECT_ID] else f"{name}_{object_id}"
