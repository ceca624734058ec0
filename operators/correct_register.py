"""What correcting a recovered room adds to Blender: its property groups, operators, panels and handler."""

from __future__ import annotations

import bpy

from . import correct, correct_paint, correct_props, correct_white, panel_correct
from .relight_register import own


def correct_groups() -> tuple[type, ...]:
    """Property groups."""
    return correct_props.ScanRelightCorrection, correct_props.ScanRelightCorrecting


def correct_operators() -> tuple[type, ...]:
    """Operators."""
    return own(correct, correct_white, correct_paint)


def correct_panels() -> tuple[type, ...]:
    """Panels, within Results; a panel comes before those within it."""
    return own(panel_correct)


def correct_pointers() -> tuple[tuple[type, str, type], ...]:
    """Blender type, name and property group."""
    return (
        (bpy.types.Object, "scan_relight_correct", correct_props.ScanRelightCorrection),
        (bpy.types.Scene, "scan_relight_correct", correct_props.ScanRelightCorrecting),
    )


def register_handlers() -> None:
    """What is painted is saved with the file."""
    bpy.app.handlers.save_pre.append(correct_paint.keep_painted)


def unregister_handlers() -> None:
    """Take that back."""
    bpy.app.handlers.save_pre.remove(correct_paint.keep_painted)
