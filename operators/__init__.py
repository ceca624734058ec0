"""The operators `bpy.ops.scan_relight.*`, one thin file each."""

from __future__ import annotations


def register():
    """Register every operator."""


def unregister():
    """Take back what `register` did."""
