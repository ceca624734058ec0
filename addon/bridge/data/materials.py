"""Principled materials. The only module that knows the names of the node's sockets (Blender 4.x and 5.x)."""

from __future__ import annotations

import bpy

from ...core.brdf.material import ObjectMaterial
from ...core.brdf.model import Brdf
from ...core.brdf.registry import find
from ..marks import UV_MAP
from .mesh_objects import ATLAS_UV
from .nodes import find_node, fresh_tree, mix_node

MODEL = "scan_relight_model"
"""Custom property of each recovered material: the name of its description's model."""
REPEATS = "scan_relight_repeats"
"""Custom property of a picture: it goes on beyond its edges, as one tile does for coordinates on that tile."""
_ALPHA, _F0, _TRANSMISSION = "scan_relight_alpha", "scan_relight_f0", "scan_relight_transmission"
_BEFORE = {_ALPHA: "scan_relight_phi", _F0: "scan_relight_psi"}
"""What version 0.1 called them."""

BASE_COLOR = "Base Color"
METALLIC = "Metallic"
ROUGHNESS = "Roughness"
IOR = "IOR"
SPECULAR_LEVEL = "Specular IOR Level"
ALPHA = "Alpha"
EMISSION_COLOR = "Emission Color"
EMISSION_STRENGTH = "Emission Strength"


def brdf_of(material: bpy.types.Material | None) -> Brdf | None:
    """The model that a recovered material is of; None of any other material."""
    return find(material.get(MODEL)) if material else None


def alpha_of(material: bpy.types.Material) -> float | None:
    """GGX's alpha as it was fitted; None where there is no lobe."""
    return material.get(_ALPHA, material.get(_BEFORE[_ALPHA]))


def f0_of(material: bpy.types.Material) -> float | None:
    """F0 as it was fitted; None where there is no lobe, or a coloured one: that is the material's colour."""
    return material.get(_F0, material.get(_BEFORE[_F0]))


def make_material(
    description: ObjectMaterial, base_color: bpy.types.Image | None = None, one_sided: bool = False
) -> bpy.types.Material:
    """Make the material of one object.

    Parameters
    ----------
    base_color : bpy.types.Image, optional
        Of what has a diffuse part: Base Color over the atlas, linear Rec.709 (`core.brdf.material.base_colors`).
        Without it the colour is mid-grey.
    one_sided : bool
        Emitter: shine on the side of the normals only.

    Returns
    -------
    bpy.types.Material
        Its custom properties ``scan_relight_model``, ``_alpha``, ``_f0``, ``_transmission`` tell what was fitted.
    """
    return dress(bpy.data.materials.new(description.name), description, base_color, one_sided)


def dress(
    material: bpy.types.Material,
    description: ObjectMaterial,
    base_color: bpy.types.Image | None = None,
    one_sided: bool = False,
) -> bpy.types.Material:
    """`make_material` with a material that is there: its nodes go, its name and whoever wears it stay."""
    nodes, links, principled = _fresh_tree(material)
    value, shown = principled.inputs, description.model.principled(description)
    # The fitted lobe is single scattering.
    principled.distribution = "GGX"
    if shown.roughness is not None:
        value[ROUGHNESS].default_value = shown.roughness
    value[METALLIC].default_value, value[ALPHA].default_value = shown.metallic, shown.alpha
    value[SPECULAR_LEVEL].default_value, value[IOR].default_value = shown.specular_level, shown.ior
    value[BASE_COLOR].default_value = (*(shown.base_color or (0.5,) * 3), 1)
    for name, number in shown.further.items():
        if name in value:
            value[name].default_value = number
    if shown.base_color is None and base_color is not None:
        _show_image(nodes, links, base_color, value[BASE_COLOR])
    if shown.emission is not None:
        _emit(value, shown.emission)
        if one_sided:
            _front_only(nodes, links, value[EMISSION_COLOR])
    material[MODEL] = description.model.name
    told = {_ALPHA: description.alpha, _F0: description.f0, _TRANSMISSION: description.transmission}
    for name in (*told, *_BEFORE.values()):
        material.pop(name, None)
    for name, number in told.items():
        if isinstance(number, (int, float)):
            material[name] = float(number)
    return material


def principled(material: bpy.types.Material | None) -> bpy.types.ShaderNode | None:
    """A material's Principled node; None where it has none."""
    return find_node(material, "BSDF_PRINCIPLED")


def opacity(material: bpy.types.Material) -> float:
    """Alpha of a material's Principled node; 1 where it has none."""
    shader = principled(material)
    return 1.0 if shader is None else shader.inputs[ALPHA].default_value


def plain_material(
    name: str,
    colour: tuple[float, float, float] = (0.5, 0.5, 0.5),
    roughness: float = 0.5,
    specular: float = 0.5,
    metallic: float = 0.0,
    ior: float = 1.5,
    emission: tuple[float, float, float] = (0.0, 0.0, 0.0),
    base_color: bpy.types.Image | None = None,
    alpha: float = 1.0,
) -> bpy.types.Material:
    """A Principled material of plain numbers and at most a picture over the atlas, such as any program understands.

    `specular` is Specular IOR Level, 0.5 being what `ior` says; `colour` and `emission` are linear Rec.709.
    """
    material = bpy.data.materials.new(name)
    nodes, links, principled = _fresh_tree(material)
    value = principled.inputs
    value[BASE_COLOR].default_value = (*colour, 1)
    value[ROUGHNESS].default_value, value[METALLIC].default_value = roughness, metallic
    value[SPECULAR_LEVEL].default_value, value[IOR].default_value = specular, ior
    value[EMISSION_STRENGTH].default_value, value[ALPHA].default_value = 0.0, alpha
    if any(emission):
        _emit(value, emission)
    if base_color is not None:
        _show_image(nodes, links, base_color, value[BASE_COLOR])
    return material


def _emit(value, radiance):
    """Emit exactly `radiance`: strength is the largest component, so that colours stay within 1."""
    strength = max(max(radiance), 0.0)
    value[EMISSION_COLOR].default_value = (*(max(c, 0.0) / strength if strength else 1.0 for c in radiance), 1)
    value[EMISSION_STRENGTH].default_value = strength


def _front_only(nodes, links, socket):
    """Blacken an emission colour where the surface is seen from behind; the strength stays a plain number."""
    mix, factor, front, back, mixed = mix_node(nodes)
    mix.location = (-250, -300)
    geometry = nodes.new("ShaderNodeNewGeometry")
    geometry.location = (-450, -350)
    links.new(geometry.outputs["Backfacing"], factor)
    front.default_value = tuple(socket.default_value)
    back.default_value = (0, 0, 0, 1)
    links.new(mixed, socket)


def _show_image(nodes, links, image, socket):
    """Show an image over the atlas, or its part of it."""
    coordinates = nodes.new("ShaderNodeUVMap")
    coordinates.uv_map = image.get(UV_MAP, ATLAS_UV)
    coordinates.location = (-650, 200)
    texture = nodes.new("ShaderNodeTexImage")
    texture.image = image
    texture.extension = "REPEAT" if image.get(REPEATS) else "EXTEND"
    texture.location = (-400, 200)
    links.new(coordinates.outputs[0], texture.inputs[0])
    links.new(texture.outputs["Color"], socket)


def _fresh_tree(material):
    """Nodes, links and the Principled node of an otherwise empty tree."""
    nodes, links = fresh_tree(material)
    principled = nodes.new("ShaderNodeBsdfPrincipled")
    output = nodes.new("ShaderNodeOutputMaterial")
    output.location = (300, 0)
    links.new(principled.outputs[0], output.inputs["Surface"])
    return nodes, links, principled
