"""Recovered materials as assets of Blender's Asset Browser."""

from collections.abc import Iterable
from pathlib import Path

import bpy

from ...core.io.folder import capture_name
from ..custom_properties import RESULT
from ..data.materials import MODEL

TAG = "Scan Relight"


def worn(objects: Iterable[bpy.types.Object]) -> dict[bpy.types.Material, str]:
    """The recovered materials that objects wear, each with the name of the capture that it comes from."""
    materials: dict[bpy.types.Material, str] = {}
    for obj in objects:
        result = obj.get(RESULT)
        for slot in obj.material_slots:
            if slot.material is not None and MODEL in slot.material and not slot.material.library:
                materials.setdefault(slot.material, capture_name(Path(result)) if result else "")
    return materials


def mark(objects: Iterable[bpy.types.Object], previews: bool = False) -> int:
    """Mark the materials that objects wear as assets; returns how many.

    Parameters
    ----------
    previews : bool
        Have Blender render previews, beside the window; it renders none in the background.
    """
    materials = worn(objects)
    for material, capture in materials.items():
        material.asset_mark()
        data = material.asset_data
        data.author = TAG
        source = f" from the scan '{capture}'" if capture else ""
        data.description = f"{material[MODEL].capitalize()}, recovered{source}"
        for tag in filter(None, (TAG, capture, material[MODEL])):
            data.tags.new(tag, skip_if_exists=True)
        if previews:
            material.asset_generate_preview()
    return len(materials)


def clear(objects: Iterable[bpy.types.Object]) -> int:
    """Clear the asset mark of the materials that objects wear; returns how many had one."""
    assets = [material for material in worn(objects) if material.asset_data is not None]
    for material in assets:
        material.asset_clear()
    return len(assets)
