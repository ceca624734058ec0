"""Properties of the panel Correct: an object's values, and choices for the next operator.

The properties of objects store nothing: they read and write what the bridge stores with object and material.
"""

from math import radians

import bpy

from ...addon.bridge.corrections import corrections
from ...addon.core.brdf.lambertian import LAMBERTIAN
from ...addon.core.brdf.registry import find_or_lambertian, models
from ...addon.core.errors import ScanRelightError
from ..base.properties import bool_property, enum_property, float_property, vector_property

_GIVEN = [brdf for brdf in models() if brdf.can_be_given]
_SORTED = sorted(_GIVEN, key=lambda brdf: (brdf.gives_light, brdf.has_diffuse, not brdf.has_lobe))
STATEMENTS = [(brdf.name, brdf.label, brdf.text) for brdf in _SORTED]
_ITEMS = [
    (brdf.name, brdf.label, brdf.text, number)
    for number, brdf in enumerate((*_GIVEN, *(brdf for brdf in models() if not brdf.can_be_given)))
]
SMOOTH_ANGLE = float_property(
    "Angle",
    "Edges where faces meet at a greater angle stay sharp",
    subtype="ANGLE",
    min=0.0,
    max=radians(180),
    default=radians(30),
)
ALBEDO = vector_property(
    "Albedo",
    "Share of the light that it reflects, for each channel, linear: white wall paint has about 0.80, a grey card 0.18",
    subtype="COLOR",
    min=0.01,
    max=1.0,
    default=(0.8, 0.8, 0.8),
)


def targets(context, obj: bpy.types.Object) -> list[bpy.types.Object]:
    """The objects that a change in the panel applies to: all selected ones, if the changed one is their active one."""
    chosen = [selected for selected in getattr(context, "selected_objects", ()) if corrections.correctable(selected)]
    to_all = context.scene.scan_relight_correct.all_selected and obj == context.view_layer.objects.active
    return chosen if to_all and obj in chosen else [obj]


def _value(group, key: str, default):
    obj = group.id_data
    value = corrections.effective(obj).get(key) if corrections.correctable(obj) else None
    return default if value is None else value


def _give(group, **values) -> None:
    for obj in targets(bpy.context, group.id_data):
        if corrections.correctable(obj):
            try:
                corrections.give(obj, **values)
            except ScanRelightError:
                continue  # a lamp has no roughness: the panel shows no such property, and a script sees no change


def _f0(group) -> float:
    value = _value(group, "f0", 0.0)
    return sum(value) / 3 if hasattr(value, "__len__") else value


def _colour(group):
    lobe_alone = find_or_lambertian(_value(group, "model", "")).lobe_alone
    value = _value(group, "f0" if lobe_alone else "base_color", (0.5, 0.5, 0.5))
    return tuple(value) if hasattr(value, "__len__") else (value,) * 3


def _give_colour(group, value) -> None:
    colour = list(value)
    for obj in targets(bpy.context, group.id_data):
        if corrections.correctable(obj):
            brdf = find_or_lambertian(corrections.effective(obj)["model"])
            corrections.give(obj, **{"f0" if brdf.lobe_alone else "base_color": colour})


class ScanRelightCorrection(bpy.types.PropertyGroup):
    """`Object.scan_relight_correct`."""

    model: enum_property(
        "Model",
        "How the surface reflects",
        _ITEMS,
        get=lambda self: next(item[3] for item in _ITEMS if item[0] == _value(self, "model", LAMBERTIAN.name)),
        set=lambda self, value: value < len(_GIVEN) and _give(self, model=_ITEMS[value][0]),
    )
    roughness: float_property(
        "Roughness",
        "Of the highlight: 0 is a mirror, 1 hardly shows any",
        min=0.0,
        max=1.0,
        subtype="FACTOR",
        precision=3,
        get=lambda self: _value(self, "roughness", 0.5),
        set=lambda self, value: _give(self, roughness=value),
    )
    f0: float_property(
        "F0",
        "Share of the light that the surface mirrors when looked at straight on; most plastics, "
        "lacquers and woods have 0.04",
        min=0.0,
        max=0.9,
        soft_max=0.2,
        precision=3,
        step=0.5,
        get=_f0,
        set=lambda self, value: _give(self, f0=value),
    )
    colour: vector_property(
        "Base Color",
        "Mean colour of the object, linear; a texture keeps its detail and is scaled. "
        "Of a metal the colour of its reflection",
        subtype="COLOR",
        min=0.0,
        max=1.0,
        get=_colour,
        set=_give_colour,
    )


class ScanRelightCorrecting(bpy.types.PropertyGroup):
    """`Scene.scan_relight_correct`."""

    refit_automatically: bool_property(
        "Refit Automatically",
        "After a statement such as This Is Metal fit the objects again at once; values set by hand wait for Refit",
        default=True,
    )
    all_selected: bool_property(
        "All Selected",
        "A value that is set here goes to all selected objects, not to the active one alone",
        default=True,
    )
    like: bpy.props.PointerProperty(
        name="Like",
        description="The object whose highlight the selected ones have",
        type=bpy.types.Object,
        poll=lambda self, obj: corrections.correctable(obj),
    )
    albedo: ALBEDO
    smooth_angle: SMOOTH_ANGLE
