"""The lamps that were found in the scan: on or off, stronger or weaker, of another colour, and back again.

A lamp is a material whose model gives light; `switch.py` keeps its state.
"""

import bpy

from ...core.errors import BadInputError
from ...core.naming import in_order, numbered
from ..data.materials import brdf_of, emission, emission_socket, principled
from .kelvin import HIGHEST, LOWEST, kelvin_of, luminance, rgb_of
from .switch import COLOUR, STRENGTH, factor, is_on, keep, restore, set_factor, set_on, strength_socket

radiance = emission
"""Radiance that a lamp emits at present, linear Rec.709 in the frames' unit."""


def is_lamp(material: bpy.types.Material | None) -> bool:
    """Whether a material is a recovered lamp's."""
    brdf = brdf_of(material)
    return brdf is not None and brdf.gives_light and principled(material) is not None


def find_lamps(scene: bpy.types.Scene) -> list[bpy.types.Material]:
    """The materials of all recovered lamps in a scene, each once, sorted by name."""
    return sorted(sum(lamps_by_object(scene).values(), []), key=lambda material: in_order(material.name))


def lamps_by_object(scene: bpy.types.Scene) -> dict[str, list[bpy.types.Material]]:
    """Each lamp of a scene once, under the name of the first object that wears it."""
    lamps, seen = {}, set()
    for obj in scene.objects:
        for slot in obj.material_slots if obj.type == "MESH" else ():
            if slot.material not in seen:
                seen.add(slot.material)
                if is_lamp(slot.material):
                    lamps.setdefault(obj.name, []).append(slot.material)
    return lamps


def lamp_named(scene: bpy.types.Scene, name: str) -> list[bpy.types.Material]:
    """The lamps that match a name: that very material, or all of that class; raises `BadInputError` without any."""
    lamps = find_lamps(scene)
    query = name.strip().casefold()
    matches = [m for m in lamps if m.name.casefold() == query]
    matches = matches or [m for m in lamps if numbered(m.name.casefold())[0] == query]
    if not matches:
        known = "known are " + ", ".join(f"'{m.name}'" for m in lamps) if lamps else "the scan has no lamp at all"
        raise BadInputError(f"There is no lamp '{name}'; {known}.")
    return matches


def colour(material: bpy.types.Material) -> tuple[float, float, float] | None:
    """Colour of the light, linear Rec.709, its largest component 1 as recovered; None where a picture gives it."""
    socket = emission_socket(material)
    return None if socket is None else tuple(socket.default_value[:3])


def set_colour(material: bpy.types.Material, value: tuple[float, float, float]) -> None:
    """Give the light another colour at the same strength; without effect where a picture gives it."""
    keep(material)
    socket = emission_socket(material)
    if socket is not None:
        socket.default_value = (*(max(float(c), 0.0) for c in value), 1)


def kelvin(material: bpy.types.Material) -> float:
    """Temperature of the colour of its light, the nearest there is; 6500 where a picture gives the colour."""
    return kelvin_of(colour(material) or (1.0, 1.0, 1.0))


def set_kelvin(material: bpy.types.Material, value: float) -> None:
    """Give the light the colour of a temperature, at the same luminance; without effect where a picture gives it."""
    current = colour(material)
    if current is not None:
        bright = luminance(current)
        set_colour(material, tuple(bright * c for c in rgb_of(min(max(value, LOWEST), HIGHEST))))


def recovered_radiance(material: bpy.types.Material) -> tuple[float, float, float]:
    """Radiance that was recovered, linear Rec.709 in the frames' unit."""
    strength = material.get(STRENGTH, strength_socket(material).default_value)
    tint = material.get(COLOUR) or colour(material) or (1.0, 1.0, 1.0)
    return tuple(float(strength) * float(c) for c in tint)


def is_changed(material: bpy.types.Material) -> bool:
    """Whether a lamp differs from what was recovered."""
    return STRENGTH in material and (not is_on(material) or factor(material) != 1 or is_coloured(material))


def is_coloured(material: bpy.types.Material) -> bool:
    """Whether a lamp's colour is another one than was recovered."""
    return COLOUR in material and tuple(material[COLOUR]) != colour(material)


def snapshot(material: bpy.types.Material) -> dict:
    """The state of a lamp for `put_back`."""
    on, touched = is_on(material), STRENGTH in material
    return {"on": on, "factor": factor(material), "colour": colour(material), "touched": touched}


def put_back(material: bpy.types.Material, state: dict) -> None:
    """Bring a lamp into a state that `snapshot` gave."""
    restore(material)
    if not state["touched"]:
        return
    set_factor(material, state["factor"])
    if state["colour"] is not None:
        set_colour(material, state["colour"])
    set_on(material, state["on"])


def carry(old: bpy.types.Material, new: bpy.types.Material) -> None:
    """Give a lamp that was recovered anew the state of the lamp that it replaces."""
    state = snapshot(old)
    if state["colour"] is not None and tuple(old.get(COLOUR, state["colour"])) == state["colour"]:
        state["colour"] = None  # as found: the new one's own
    put_back(new, state)


def state_sockets(material: bpy.types.Material) -> list[bpy.types.NodeSocket]:
    """The inputs that show a lamp's state; none while it is as recovered."""
    if STRENGTH not in material or not is_lamp(material):
        return []
    return [socket for socket in (strength_socket(material), emission_socket(material)) if socket is not None]
