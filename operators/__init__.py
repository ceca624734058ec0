"""The operators `bpy.ops.scan_relight.*`, the sidebar's panels, the preferences: one thin file each."""


def classes() -> tuple[type, ...]:
    """All classes to register, in the order of menus and panels."""
    from . import manual, menus
    from .base import operator
    from .correct import correct
    from .correct import panel as correct_panel
    from .preferences import ScanRelightPreferences
    from .recover import files, panel_capture, panel_recover, room, scene_props, stages
    from .relight import export, lights, view
    from .relight import panel as relight_panel
    from .results import find, look
    from .results import panel as results_panel

    def classes_of(*modules, kinds: tuple[str, ...]) -> list[type]:
        """The classes of some kinds in modules, in the order of definition."""
        starts = tuple(f"SCAN_RELIGHT_{kind}" for kind in kinds)
        members = [(module, cls) for module in modules for name, cls in vars(module).items() if name.startswith(starts)]
        return [cls for module, cls in members if cls.__module__ == module.__name__]

    modules = stages, operator, room, find, files, look, lights, view, export, correct, manual, menus
    operators = classes_of(*modules, kinds=("OT", "MT", "FH"))
    panels = classes_of(
        *(find, panel_capture, panel_recover, results_panel, correct_panel, look, relight_panel, export),
        kinds=("PT", "UL"),
    )
    groups = scene_props.ScanRelightSettings, scene_props.ScanRelightReading, *(group for _, _, group in pointers())
    return *groups, ScanRelightPreferences, *operators, *panels


def pointers() -> tuple[tuple[type, str, type], ...]:
    """Type of Blender's, name and property group of each pointer property."""
    from bpy.types import Light, Material, Object, Scene, World

    from .correct.props import ScanRelightCorrecting, ScanRelightCorrection
    from .recover.scene_props import ScanRelightScene
    from .relight.props import ScanRelightLamp, ScanRelightLight, ScanRelightOutside, ScanRelightStudio

    return (
        (Scene, "scan_relight", ScanRelightScene),
        (Material, "scan_relight_lamp", ScanRelightLamp),
        (Light, "scan_relight_light", ScanRelightLight),
        (World, "scan_relight_outside", ScanRelightOutside),
        (Scene, "scan_relight_studio", ScanRelightStudio),
        (Object, "scan_relight_correct", ScanRelightCorrection),
        (Scene, "scan_relight_correct", ScanRelightCorrecting),
    )


def handlers() -> tuple[tuple[list, object], ...]:
    """Blender's lists of handlers, and ours."""
    from bpy.app.handlers import load_post, load_pre, save_post, save_pre

    from .base.job_operator import forget_job
    from .correct.correct import keep_painted
    from .results import find

    return (
        (load_pre, forget_job),
        (load_post, find.look_for_results),
        (save_pre, find.keep_images),
        (save_post, find.clear_messages),
        (save_pre, keep_painted),
    )


def register():
    """Register every class, an operator by its name with its docstring as the tooltip; add the pointer properties."""
    import bpy

    from . import keymaps, manual, menus, translations
    from .results.panel import active_row_property

    for cls in classes():
        if issubclass(cls, bpy.types.Operator):
            cls.bl_idname = cls.__name__.lower().replace("_ot_", ".")
            cls.bl_description = " ".join(cls.__doc__.split())
        bpy.utils.register_class(cls)
    for owner, name, group in pointers():
        setattr(owner, name, bpy.props.PointerProperty(type=group))
    bpy.types.Scene.scan_relight_row = active_row_property()
    for handler_list, handler in handlers():
        handler_list.append(handler)
    translations.register()
    menus.register()
    keymaps.register()
    bpy.utils.register_manual_map(manual.manual_map)


def unregister():
    """Undo `register`."""
    import bpy

    from ..addon.bridge.corrections import corrections
    from ..addon.bridge.job import job
    from ..addon.bridge.results import file
    from . import keymaps, manual, menus, translations
    from .recover import findings
    from .relight import lights

    bpy.utils.unregister_manual_map(manual.manual_map)
    keymaps.unregister()
    menus.unregister()
    translations.unregister()
    for handler_list, handler in handlers():
        handler_list.remove(handler)
    for module in (corrections, findings, file, job):
        module.forget()
    lights.forget_pictures()
    job.end_all()
    del bpy.types.Scene.scan_relight_row
    for owner, name, _ in pointers():
        delattr(owner, name)
    for cls in reversed(classes()):
        bpy.utils.unregister_class(cls)
