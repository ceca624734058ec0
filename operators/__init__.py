"""The operators `bpy.ops.scan_relight.*`, one thin file each."""

from __future__ import annotations


def classes() -> tuple[type, ...]:
    """Every operator, in the order of the method."""
    from .accumulate import SCAN_RELIGHT_OT_accumulate
    from .fit import SCAN_RELIGHT_OT_fit
    from .import_capture import SCAN_RELIGHT_OT_import_capture
    from .recover import SCAN_RELIGHT_OT_recover
    from .shade import SCAN_RELIGHT_OT_shade
    from .write import SCAN_RELIGHT_OT_write

    return (SCAN_RELIGHT_OT_import_capture, SCAN_RELIGHT_OT_accumulate, SCAN_RELIGHT_OT_shade, SCAN_RELIGHT_OT_fit,
            SCAN_RELIGHT_OT_write, SCAN_RELIGHT_OT_recover)


def register():
    """Register every operator."""
    import bpy

    for operator in classes():
        bpy.utils.register_class(operator)


def unregister():
    """Take back what `register` did."""
    import bpy

    for operator in reversed(classes()):
        bpy.utils.unregister_class(operator)
