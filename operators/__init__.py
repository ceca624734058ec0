"""The operators `bpy.ops.scan_relight.*`, the sidebar's panels, the preferences: one thin file each."""

from __future__ import annotations


def classes() -> tuple[type, ...]:
    """Everything that Blender has to know: property groups, preferences, operators, panels. Each part adds its own."""
    from .base.job_operator import SCAN_RELIGHT_OT_stop
    from .correct.register import correct_groups, correct_operators, correct_panels
    from .manual import SCAN_RELIGHT_OT_manual
    from .menus import SCAN_RELIGHT_MT_all
    from .preferences import ScanRelightPreferences
    from .recover.accumulate import SCAN_RELIGHT_OT_accumulate
    from .recover.assets import SCAN_RELIGHT_OT_mark_assets
    from .recover.capture_from_scene import SCAN_RELIGHT_OT_capture_from_scene
    from .recover.check_capture import SCAN_RELIGHT_OT_check_capture
    from .recover.files import (
        SCAN_RELIGHT_FH_json,
        SCAN_RELIGHT_OT_drop,
        SCAN_RELIGHT_OT_open_capture,
        SCAN_RELIGHT_OT_open_result,
        SCAN_RELIGHT_OT_use_folder,
    )
    from .recover.fit import SCAN_RELIGHT_OT_fit
    from .recover.import_capture import SCAN_RELIGHT_OT_import_capture
    from .recover.link_room import SCAN_RELIGHT_OT_link_room
    from .recover.panel_capture import SCAN_RELIGHT_PT_capture
    from .recover.panel_recover import SCAN_RELIGHT_PT_recover
    from .recover.recover import SCAN_RELIGHT_OT_recover
    from .recover.restore_materials import SCAN_RELIGHT_OT_restore_materials
    from .recover.run import SCAN_RELIGHT_OT_run
    from .recover.scene_props import ScanRelightReading, ScanRelightScene, ScanRelightSettings
    from .recover.shade import SCAN_RELIGHT_OT_shade
    from .recover.write import SCAN_RELIGHT_OT_write
    from .relight.register import relight_groups, relight_operators, relight_panels
    from .results.clear_cache import SCAN_RELIGHT_OT_clear_cache
    from .results.find import SCAN_RELIGHT_OT_find_result, SCAN_RELIGHT_PT_missing
    from .results.look import SCAN_RELIGHT_OT_look
    from .results.move import SCAN_RELIGHT_OT_move_results
    from .results.open_report import SCAN_RELIGHT_OT_open_report
    from .results.panel import SCAN_RELIGHT_PT_results, SCAN_RELIGHT_PT_stages, SCAN_RELIGHT_UL_results
    from .results.panel_look import SCAN_RELIGHT_PT_look, SCAN_RELIGHT_PT_own_scene
    from .results.select import SCAN_RELIGHT_OT_select_result_object

    return (
        # Property groups: those that others point to come first.
        ScanRelightSettings, ScanRelightReading, ScanRelightScene, ScanRelightPreferences, *relight_groups(),
        *correct_groups(),
        # Operators, in the order of the method.
        SCAN_RELIGHT_OT_check_capture, SCAN_RELIGHT_OT_import_capture,
        SCAN_RELIGHT_OT_accumulate, SCAN_RELIGHT_OT_shade, SCAN_RELIGHT_OT_fit, SCAN_RELIGHT_OT_write,
        SCAN_RELIGHT_OT_recover, SCAN_RELIGHT_OT_run, SCAN_RELIGHT_OT_stop, SCAN_RELIGHT_OT_clear_cache,
        SCAN_RELIGHT_OT_link_room,
        SCAN_RELIGHT_OT_move_results, SCAN_RELIGHT_OT_find_result,
        SCAN_RELIGHT_OT_open_capture, SCAN_RELIGHT_OT_open_result, SCAN_RELIGHT_OT_use_folder, SCAN_RELIGHT_OT_drop,
        SCAN_RELIGHT_FH_json,
        # The artist's side.
        SCAN_RELIGHT_OT_capture_from_scene, SCAN_RELIGHT_OT_restore_materials, SCAN_RELIGHT_OT_select_result_object,
        SCAN_RELIGHT_OT_look, SCAN_RELIGHT_OT_open_report, *relight_operators(), *correct_operators(),
        SCAN_RELIGHT_OT_mark_assets, SCAN_RELIGHT_OT_manual, SCAN_RELIGHT_MT_all,
        # Panels, in the order of the work; a panel's parts come after it.
        SCAN_RELIGHT_PT_missing, SCAN_RELIGHT_PT_capture, SCAN_RELIGHT_PT_own_scene,
        SCAN_RELIGHT_PT_recover,
        SCAN_RELIGHT_UL_results, SCAN_RELIGHT_PT_results, *correct_panels(),
        SCAN_RELIGHT_PT_stages,
        SCAN_RELIGHT_PT_look,
        *relight_panels(),
    )  # fmt: skip


def pointers() -> tuple[tuple[type, str, type], ...]:
    """Blender type, name and property group of everything that hangs on Blender's own data."""
    import bpy

    from .correct.register import correct_pointers
    from .recover.scene_props import ScanRelightScene
    from .relight.register import relight_pointers

    return ((bpy.types.Scene, "scan_relight", ScanRelightScene), *relight_pointers(), *correct_pointers())


def register():
    """Register every class and hang the property groups up."""
    import bpy

    from . import keymaps, manual, menus, translations
    from .base.job_operator import forget_job
    from .correct.register import register_handlers
    from .results import find
    from .results.panel import active_row_property

    for cls in classes():
        bpy.utils.register_class(cls)
    for owner, name, group in pointers():
        setattr(owner, name, bpy.props.PointerProperty(type=group))
    bpy.types.Scene.scan_relight_row = active_row_property()
    bpy.app.handlers.load_pre.append(forget_job)
    bpy.app.handlers.load_post.append(find.look_for_results)
    bpy.app.handlers.save_pre.append(find.keep_images)
    bpy.app.handlers.save_post.append(find.found_is_kept)
    register_handlers()
    translations.register()
    menus.register()
    keymaps.register()
    bpy.utils.register_manual_map(manual.manual_map)


def unregister():
    """Take back what `register` did."""
    import bpy

    from ..addon.bridge.corrections import corrections
    from ..addon.bridge.job import job
    from . import keymaps, manual, menus, translations
    from .base.job_operator import forget_job
    from .correct.register import unregister_handlers
    from .recover import findings
    from .relight import light_pictures
    from .results import find, told

    bpy.utils.unregister_manual_map(manual.manual_map)
    keymaps.unregister()
    menus.unregister()
    translations.unregister()
    unregister_handlers()
    corrections.forget()
    bpy.app.handlers.load_pre.remove(forget_job)
    bpy.app.handlers.load_post.remove(find.look_for_results)
    bpy.app.handlers.save_pre.remove(find.keep_images)
    bpy.app.handlers.save_post.remove(find.found_is_kept)
    findings.forget()
    told.forget()
    light_pictures.forget()
    del bpy.types.Scene.scan_relight_row
    job.forget()
    job.end_all()
    for owner, name, _ in pointers():
        delattr(owner, name)
    for cls in reversed(classes()):
        bpy.utils.unregister_class(cls)
