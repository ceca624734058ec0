"""The material of a corrected object, or a part of one: what is given laid over what was found, and back.

All take an object and the instance of the capture that it is about, by default that of its active material slot. Before
the first change the object stores what was found (`custom_properties.FOUND`), and the material what it showed: to go
back needs neither the result folder nor this add-on's memory.
"""

import json
from typing import Any

import bpy

from ...core.brdf.compensation import ior_of
from ...core.brdf.lambertian import LAMBERTIAN
from ...core.brdf.registry import find_or_lambertian
from ...core.results.overrides import LOBE
from ..custom_properties import FOUND
from ..data.instances import chosen_in, key_of, materials_of
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
from ..results import file

WORN = "scan_relight_worn"
"""Of a material: JSON of the values and sockets that its run gave it, while it shows others."""
TINT = "Scan Relight tint"
"""Name of the node by which a texture is multiplied so that its mean is the given colour."""
_NUMBERS = (METALLIC, ROUGHNESS, IOR, SPECULAR_LEVEL, EMISSION_STRENGTH)


def worn_material(obj: bpy.types.Object, object_id: int | None = None) -> bpy.types.Material | None:
    """The recovered material that an instance wears; None where it wears none that can be changed."""
    materials = materials_of(obj, object_id)
    return next((m for m in materials if MODEL in m and not m.library and principled(m)), None)


def entry(obj: bpy.types.Object, object_id: int | None = None) -> dict[str, Any]:
    """What an object's own run says of an instance; {} where that is gone or another run took its place."""
    return file.rows_of_parts([obj]).get(obj, {}).get(chosen_in(obj) if object_id is None else object_id, {})


def recovered_values(obj: bpy.types.Object, object_id: int | None = None) -> dict[str, Any]:
    """`model`, `roughness`, `f0` and `base_color` as they were recovered; None where the model has none."""
    return worn(obj, object_id) | json.loads(obj.get(key_of(FOUND, obj, object_id), "{}"))


def worn(obj: bpy.types.Object, object_id: int | None = None) -> dict[str, Any]:
    """The same values as the run wrote them into its material, with what was given to that run."""
    material = worn_material(obj, object_id)
    if WORN in material:
        return json.loads(material[WORN])["values"]
    return _shown_values(material, entry(obj, object_id))


def note(obj: bpy.types.Object, object_id: int | None = None) -> None:
    """Note what was found, before the first thing is given."""
    found = key_of(FOUND, obj, object_id)
    if found not in obj and not entry(obj, object_id).get("given"):
        obj[found] = json.dumps(worn(obj, object_id))


def renew(obj: bpy.types.Object, object_id: int, given: dict[str, Any]) -> None:
    """A run has made the material anew: keep of the values found before only those that are overridden."""
    worn_material(obj, object_id).pop(WORN, None)
    keys = given.keys() | (set(LOBE) if {"model", "same_as"} & given.keys() else set())
    found = key_of(FOUND, obj, object_id)
    remaining = {key: value for key, value in json.loads(obj.pop(found, "{}")).items() if key in keys}
    if remaining:
        obj[found] = json.dumps(remaining)


def show(obj: bpy.types.Object, object_id: int, values: dict[str, Any]) -> None:
    """Bring a material in line with `values`, as of `recovered_values`; what the run made is brought back exactly."""
    material, original = worn_material(obj, object_id), worn(obj, object_id)
    if WORN not in material:
        if values == original:
            return
        material[WORN] = json.dumps({"values": original, "sockets": _sockets(material)})
    _restore(material, json.loads(material[WORN])["sockets"])
    if values == original:
        del material[WORN]
        return
    inputs, model = principled(material).inputs, find_or_lambertian(values["model"])
    if values["model"] != original["model"]:
        inputs[METALLIC].default_value = float(model.lobe_alone)
        inputs[SPECULAR_LEVEL].default_value = 0.5 if model.has_lobe else 0.0
        inputs[EMISSION_STRENGTH].default_value = 0.0
    if values["roughness"] is not None and values["roughness"] != original["roughness"]:
        inputs[ROUGHNESS].default_value = values["roughness"]
    if model.layered and values["f0"] != original["f0"]:
        inputs[IOR].default_value = ior_of(values["f0"])
    if model.lobe_alone and values["f0"] != original["f0"]:
        _plain_colour(material, values["f0"])
    elif not model.lobe_alone and values["base_color"] and values["base_color"] != original["base_color"]:
        _tint(material, values["base_color"], original["base_color"])


def _shown_values(material, entry: dict) -> dict[str, Any]:
    """The values of an unchanged material, in the terms of an override."""
    inputs, model = principled(material).inputs, brdf_of(material) or LAMBERTIAN
    colour = [round(c, 6) for c in inputs[BASE_COLOR].default_value[:3]]
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
        output = next((socket for socket in node.outputs if socket.identifier == sockets["from"][1]), None)
        if output is not None:
            tree.links.new(output, inputs[BASE_COLOR])


def _plain_colour(material, colour) -> None:
    """One colour, no texture: the texture's node stays, so that it can be linked again."""
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
    factors = [target / current for target, current in zip(colour, mean, strict=True)]
    if max(abs(factor - 1) for factor in factors) < 0.005:
        return
    texture, settings = socket.links[0].from_socket, {"name": TINT, "label": TINT, "blend_type": "MULTIPLY"}
    feed(socket, mix_node(tree, 1.0, texture, (*factors, 1), location=(-200, 200), **settings))
