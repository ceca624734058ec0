"""What the artist's side adds to Blender: its property groups, operators and panels."""

from __future__ import annotations

import bpy

from . import before_after, export, exposure, lights, panel, panel_export, probe, props, setup, view, virtual


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
    return (props.ScanRelightLamp, props.ScanRelightLight, props.ScanRelightOutside, props.ScanRelightStudio)


def relight_operators() -> tuple[type, ...]:
    """Operators."""
    return own(lights, exposure, setup, probe, view, virtual, before_after, export)


def relight_panels() -> tuple[type, ...]:
    """Lists and panels; a panel comes before those within it."""
    return own(panel, panel_export)


def relight_pointers() -> tuple[tuple[type, str, type], ...]:
    """Blender type, name and property group."""
    return (
        (bpy.types.Material, "scan_relight_lamp", props.ScanRelightLamp),
        (bpy.types.Light, "scan_relight_light", props.ScanRelightLight),
        (bpy.types.World, "scan_relight_outside", props.ScanRelightOutside),
        (bpy.types.Scene, "scan_relight_studio", props.ScanRelightStudio),
    )
