"""Strength of a lamp of Blender's in watts or in lumens.

Blender's watts are radiant, and its colours linear Rec.709. The lumens of one are 683 lm/W (the constant of the
candela's definition, SI brochure, 9th edition, 2.3.1, which Blender's glTF exporter takes too) times the luminance of
the light's colour: 1 W of white light is 683 lm, of Rec.709's green 488 lm. The watts on a real lamp's label are
electric: about 8 W of an LED for the 800 lm that 1.2 W of ours give. A sun has watts per square metre, and so lux.
"""

import bpy

from ...core.kinds import Unit
from .kelvin import luminance

LUMENS_PER_WATT: Unit[float] = 683.0
ROOM, WATT, LUMEN = "ROOM", "WATT", "LUMEN"
"""Of a new light's strength: relative to the light of the room, radiant watts, lumens."""


def efficacy(data: bpy.types.Light) -> float:
    """Lumens for each watt of a lamp, by its colour; at least 1e-3, so that black light can be divided by it."""
    colour = [float(c) for c in data.color]
    if data.use_temperature:
        colour = [c * float(t) for c, t in zip(colour, data.temperature_color, strict=True)]
    return max(LUMENS_PER_WATT * luminance(colour), 1e-3)


def lumens(data: bpy.types.Light) -> float:
    """What a lamp gives in lumens; a sun in lux."""
    return data.energy * efficacy(data)


def set_lumens(data: bpy.types.Light, value: float) -> None:
    """Give a lamp so many lumens, a sun so many lux; its colour stays."""
    data.energy = value / efficacy(data)


def set_strength(data: bpy.types.Light, value: float, unit: str) -> None:
    """Give a lamp a strength in `WATT` or `LUMEN` (a sun: for each square metre)."""
    if unit == LUMEN:
        set_lumens(data, value)
    else:
        data.energy = value
