"""What correcting a recovered room adds to Blender: its property groups, operators, panels and handler."""

from __future__ import annotations

import bpy

from ..relight.register import own
from . import correct, paint, panel, props, white


def correct_groups() -> tuple[type, ...]:
    """Property groups."""
    return props.ScanRelightCorrection, props.ScanRelightCorrecting


def correct_operators() -> tuple[type, ...]:
    """Operators."""
    return own(correct, white, paint)


def correct_panels() -> tuple[type, ...]:
    """Panels, within Results; a panel comes before those within it."""
    return own(panel)


def correct_pointers() -> tuple[tuple[type, str, type], ...]:
    """Blender type, name and property group."""
    return (
        (bpy.types.Object, "scan_relight_correct", props.ScanRelightCorrection),
        (bpy.types.Scene, "scan_relight_correct", props.ScanRelightCorrecting),
    )


def register_handlers() -> None:
    """What is painted is saved with the file."""
    bpy.app.handlers.save_pre.append(paint.keep_painted)


def unregister_handlers() -> None:
    """Take that back."""
    bpy.app.handlers.save_pre.remove(paint.keep_painted)
