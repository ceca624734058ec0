"""The material of a corrected object: what is given laid over what was found, and back.

Before the first change the object notes what was found (`marks.FOUND`) and the material what it showed, so that the way
back needs neither the result folder nor this add-on's memory.
"""

import json
from typing import Any

import bpy

from ...core.brdf.compensation import ior_of
from ...core.brdf.lambertian import LAMBERTIAN
from ...core.brdf.registry import shown
from ...core.results.overrides import LOBE
from ..data.materials import (
    BASE_COLOR,
    EMISSION_STRENGTH,
    IOR,
    METALLIC,
    MODEL,
    ROUGHNESS,
    SPECULAR_LEVEL,
    brdf_of,
    f0_of,
    principled,
)
from ..data.nodes import feed, mix_node
from ..marks import FOUND
from ..results import file

WORN = "scan_relight_worn"
"""Of a material: JSON of the values and sockets that its run gave it, while it shows others."""
TINT = "Scan Relight tint"
"""Name of the node by which a texture is multiplied so that its mean is the given colour."""
_NUMBERS = (METALLIC, ROUGHNESS, IOR, SPECULAR_LEVEL, EMISSION_STRENGTH)


def worn_material(thing: bpy.types.Object) -> bpy.types.Material | None:
    """The recovered material that an object wears; None where it wears none that can be changed."""
    return next(
        (
            slot.material
            for slot in thing.material_slots
            if slot.material and MODEL in slot.material and not slot.material.library and principled(slot.material)
        ),
        None,
    )


def entry(thing: bpy.types.Object) -> dict[str, Any]:
    """What an object's own run says of it; {} where that is gone or another run took its place."""
    return file.rows([thing]).get(thing, {})


def found(thing: bpy.types.Object) -> dict[str, Any]:
    """`model`, `roughness`, `f0` and `base_color` as they were found; None where there is no such thing."""
    return worn(thing) | json.loads(thing.get(FOUND, "{}"))


def worn(thing: bpy.types.Object) -> dict[str, Any]:
    """The same as the run has made its material, under whatever was given to that run."""
    material = worn_material(thing)
    return json.loads(material[WORN])["values"] if WORN in material else _shown(material, entry(thing))


def note(thing: bpy.types.Object) -> None:
    """Note what was found, before the first thing is given."""
    if FOUND not in thing and not entry(thing).get("given"):
        thing[FOUND] = json.dumps(worn(thing))


def renew(thing: bpy.types.Object, given: dict[str, Any]) -> None:
    """A run has made the material anew: of what was found before stays what is given in its stead."""
    worn_material(thing).pop(WORN, None)
    keys = given.keys() | (set(LOBE) if {"model", "same_as"} & given.keys() else set())
    kept = {key: value for key, value in json.loads(thing.get(FOUND, "{}")).items() if key in keys}
    if kept:
        thing[FOUND] = json.dumps(kept)
    else:
        thing.pop(FOUND, None)


def show(thing: bpy.types.Object, wanted: dict[str, Any]) -> None:
    """Bring a material in line.

    Parameters
    ----------
    wanted : dict
        `model`, `roughness`, `f0`, `base_color` as they are to be; what the run made is brought back exactly.
    """
    material, made = worn_material(thing), worn(thing)
    if WORN not in material:
        if wanted == made:
            return
        material[WORN] = json.dumps({"values": made, "sockets": _sockets(material)})
    _restore(material, json.loads(material[WORN])["sockets"])
    if wanted == made:
        del material[WORN]
        return
    inputs, model = principled(material).inputs, shown(wanted["model"])
    if wanted["model"] != made["model"]:
        inputs[METALLIC].default_value = float(model.lobe_alone)
        inputs[SPECULAR_LEVEL].default_value = 0.5 if model.has_lobe else 0.0
        inputs[EMISSION_STRENGTH].default_value = 0.0
    if wanted["roughness"] is not None and wanted["roughness"] != made["roughness"]:
        inputs[ROUGHNESS].default_value = wanted["roughness"]
    if model.layered and wanted["f0"] != made["f0"]:
        inputs[IOR].default_value = ior_of(wanted["f0"])
    if model.lobe_alone and wanted["f0"] != made["f0"]:
        _plain_colour(material, wanted["f0"])
    elif not model.lobe_alone and wanted["base_color"] and wanted["base_color"] != made["base_color"]:
        _tint(material, wanted["base_color"], made["base_color"])


def _shown(material, entry: dict) -> dict[str, Any]:
    """What a material that nobody has changed shows, in the terms of an override."""
    inputs, model = principled(material).inputs, brdf_of(material) or LAMBERTIAN
    colour = [round(one, 6) for one in inputs[BASE_COLOR].default_value[:3]]
    f0 = colour if model.lobe_alone else (f0_of(material) or 0.0) if model.has_lobe else None
    albedo = (entry.get("evidence") or {}).get("albedo")
    return {
        "model": material[MODEL],
        "roughness": inputs[ROUGHNESS].default_value if model.has_lobe else None,
        "f0": f0,
        "base_color": (list(albedo) if albedo else colour) if model.has_diffuse else None,
    }


def _sockets(material) -> dict[str, Any]:
    inputs = principled(material).inputs
    link = inputs[BASE_COLOR].links[0] if inputs[BASE_COLOR].links else None
    return {
        "numbers": {name: inputs[name].default_value for name in _NUMBERS},
        "colour": list(inputs[BASE_COLOR].default_value),
        "from": [link.from_node.name, link.from_socket.identifier] if link else None,
    }


def _restore(material, sockets: dict) -> None:
    inputs, tree = principled(material).inputs, material.node_tree
    for name, value in sockets["numbers"].items():
        inputs[name].default_value = value
    inputs[BASE_COLOR].default_value = sockets["colour"]
    tint = tree.nodes.get(TINT)
    if tint is not None:
        tree.nodes.remove(tint)
    node = tree.nodes.get(sockets["from"][0]) if sockets["from"] else None
    if node is not None and not inputs[BASE_COLOR].links:
        output = next((one for one in node.outputs if one.identifier == sockets["from"][1]), None)
        if output is not None:
            tree.links.new(output, inputs[BASE_COLOR])


def _plain_colour(material, colour) -> None:
    """One colour, no texture: its node stays for the way back."""
    socket = principled(material).inputs[BASE_COLOR]
    for link in list(socket.links):
        material.node_tree.links.remove(link)
    socket.default_value = (*colour, 1)


def _tint(material, colour, mean) -> None:
    """Multiply a texture so that its mean is `colour`; without one, or where it is black, the colour itself."""
    socket, tree = principled(material).inputs[BASE_COLOR], material.node_tree
    if not socket.links or not mean or min(mean) < 1e-3:
        _plain_colour(material, colour)
        return
    factors = [wished / is_ for wished, is_ in zip(colour, mean, strict=True)]
    if max(abs(factor - 1) for factor in factors) < 0.005:
        return
    texture = socket.links[0].from_socket
    out = mix_node(
        tree, 1.0, texture, (*factors, 1), name=TINT, label=TINT, blend_type="MULTIPLY", location=(-200, 200)
    )
    feed(socket, out)
