"""The operators `bpy.ops.scan_relight.*`, one thin file each."""

from __future__ import annotations


def classes() -> tuple[type, ...]:
    """Every operator, in the order of the method."""
    from .accumulate import SCANRELIGHT_OT_accumulate
    from .fit import SCANRELIGHT_OT_fit
    from .import_capture import SCANRELIGHT_OT_import_capture
    from .recover import SCANRELIGHT_OT_recover
    from .shade import SCANRELIGHT_OT_shade
    from .write import SCANRELIGHT_OT_write

    return (SCANRELIGHT_OT_import_capture, SCANRELIGHT_OT_accumulate, SCANRELIGHT_OT_shade, SCANRELIGHT_OT_fit,
            SCANRELIGHT_OT_write, SCANRELIGHT_OT_recover)


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
