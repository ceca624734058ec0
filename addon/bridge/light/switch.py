"""On or off, stronger or weaker: a recovered lamp, which is a material, or the light from outside, which is a world.

The state is kept with it as custom properties, so that it is saved with the file and needs no registered add-on; the
node tree always shows it.
"""

import bpy

from ...core.kinds import Limit
from ..data.materials import EMISSION_STRENGTH, emission_socket, principled
from ..data.nodes import find_node

STRENGTH, COLOUR = (f"scan_relight_recovered_{name}" for name in ("strength", "colour"))
"""Custom properties of a light that was changed: its strength as recovered; of a lamp also its colour."""
MAX_FACTOR: Limit[float] = 1000.0
Light = bpy.types.Material | bpy.types.World


def strength_socket(light: Light | None) -> bpy.types.NodeSocket | None:
    """The input that holds a light's strength; None where it has no such node."""
    lamp = isinstance(light, bpy.types.Material)
    node = principled(light) if lamp else find_node(light, "BACKGROUND")
    return node and node.inputs[EMISSION_STRENGTH if lamp else "Strength"]


def colour_socket(light: Light) -> bpy.types.NodeSocket | None:
    """The input that holds a lamp's colour; None where a picture gives it, and of a world."""
    return emission_socket(light) if isinstance(light, bpy.types.Material) else None


def is_on(light: Light) -> bool:
    """Whether it shines."""
    return not light.get(_key(light, "off"), False)


def set_on(light: Light, on: bool) -> None:
    """Switch it on or off; its factor and colour stay."""
    _change(light, "off", not on)


def factor(light: Light) -> float:
    """What its recovered strength is multiplied by."""
    return float(light.get(_key(light, "factor"), 1.0))


def set_factor(light: Light, value: float) -> None:
    """Multiply its recovered strength by `value` (0...`MAX_FACTOR`)."""
    _change(light, "factor", min(max(float(value), 0.0), MAX_FACTOR))


def keep(light: Light) -> None:
    """Note what was recovered, before the first change."""
    strength, colour = strength_socket(light), colour_socket(light)
    if strength is None or STRENGTH in light:
        return
    light[STRENGTH] = strength.default_value
    if colour is not None:
        light[COLOUR] = colour.default_value[:3]


def restore(light: Light) -> None:
    """Reset it to what was recovered."""
    if STRENGTH in light:
        strength_socket(light).default_value = light[STRENGTH]
        if (colour := colour_socket(light)) is not None:
            colour.default_value = (*light[COLOUR], 1)
    for name in (STRENGTH, COLOUR, _key(light, "off"), _key(light, "factor")):
        light.pop(name, None)


def _key(light: Light, name: str) -> str:
    return f"scan_relight_{'lamp' if isinstance(light, bpy.types.Material) else 'world'}_{name}"


def _change(light: Light, name: str, value: bool | float) -> None:
    keep(light)
    light[_key(light, name)] = value
    socket = strength_socket(light)
    if socket is not None:
        socket.default_value = light[STRENGTH] * factor(light) * is_on(light)
