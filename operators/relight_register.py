"""What the artist's side adds to Blender: its property groups, operators and panels."""

from __future__ import annotations

import bpy

from . import (
    before_after,
    export,
    panel_export,
    panel_relight,
    relight,
    relight_exposure,
    relight_probe,
    relight_props,
    relight_setup,
    relight_view,
    relight_virtual,
)


def own(*modules) -> tuple[type, ...]:
    """The classes of modules whose names are Blender's, in the order of their writing."""
    return tuple(
        one
        for module in modules
        for name, one in vars(module).items()
        if name.startswith("SCAN_RELIGHT_") and one.__module__ == module.__name__
    )


def relight_groups() -> tuple[type, ...]:
    """Property groups."""
    return (
        relight_props.ScanRelightLamp,
        relight_props.ScanRelightLight,
        relight_props.ScanRelightOutside,
        relight_props.ScanRelightStudio,
    )


def relight_operators() -> tuple[type, ...]:
    """Operators."""
    return own(
        relight, relight_exposure, relight_setup, relight_probe, relight_view, relight_virtual, before_after, export
    )


def relight_panels() -> tuple[type, ...]:
    """Lists and panels; a panel comes before those within it."""
    return own(panel_relight, panel_export)


def relight_pointers() -> tuple[tuple[type, str, type], ...]:
    """Blender type, name and property group."""
    return (
        (bpy.types.Material, "scan_relight_lamp", relight_props.ScanRelightLamp),
        (bpy.types.Light, "scan_relight_light", relight_props.ScanRelightLight),
        (bpy.types.World, "scan_relight_outside", relight_props.ScanRelightOutside),
        (bpy.types.Scene, "scan_relight_studio", relight_props.ScanRelightStudio),
    )
