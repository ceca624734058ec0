"""Recovered materials as assets of Blender's Asset Browser."""

from collections.abc import Iterable
from pathlib import Path

import bpy

from ...core.io.folder import capture_name
from ..data.materials import MODEL
from ..marks import RESULT

TAG = "Scan Relight"


def worn(things: Iterable[bpy.types.Object]) -> dict[bpy.types.Material, str]:
    """The recovered materials that objects wear, each with the name of the capture that it comes from."""
    found: dict[bpy.types.Material, str] = {}
    for thing in things:
        result = thing.get(RESULT)
        for slot in thing.material_slots:
            if slot.material is not None and MODEL in slot.material and not slot.material.library:
                found.setdefault(slot.material, capture_name(Path(result)) if result else "")
    return found


def mark(things: Iterable[bpy.types.Object], previews: bool = False) -> int:
    """Mark what objects wear as assets; returns how many materials that are.

    Parameters
    ----------
    previews : bool
        Have Blender render previews, beside the window; it renders none in the background.
    """
    found = worn(things)
    for material, capture in found.items():
        material.asset_mark()
        data = material.asset_data
        data.author = TAG
        source = f" from the scan '{capture}'" if capture else ""
        data.description = f"{material[MODEL].capitalize()}, recovered{source}"
        for tag in filter(None, (TAG, capture, material[MODEL])):
            data.tags.new(tag, skip_if_exists=True)
        if previews:
            material.asset_generate_preview()
    return len(found)


def clear(things: Iterable[bpy.types.Object]) -> int:
    """Take what objects wear out of the assets; returns how many materials were one."""
    found = [material for material in worn(things) if material.asset_data is not None]
    for material in found:
        material.asset_clear()
    return len(found)
