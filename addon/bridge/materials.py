"""Principled materials. The only module that knows the names of the node's sockets (Blender 4.x and 5.x)."""

from __future__ import annotations

import math

import bpy

from ..core.material import EMITTER, LAMP_ALBEDO, METAL, SPECULAR, ObjectMaterial
from .marks import UV_MAP
from .mesh_objects import ATLAS_UV

MODEL = "scan_relight_model"
"""Custom property of each recovered material: its description's model."""
REPEATS = "scan_relight_repeats"
"""Custom property of a picture: it goes on beyond its edges, as one tile does for coordinates on that tile."""
MAX_F0 = 0.9
"""The index of refraction grows without bound as F0 nears 1; this is an index of 38."""

BASE_COLOR = "Base Color"
METALLIC = "Metallic"
ROUGHNESS = "Roughness"
IOR = "IOR"
SPECULAR_LEVEL = "Specular IOR Level"
ALPHA = "Alpha"
EMISSION_COLOR = "Emission Color"
EMISSION_STRENGTH = "Emission Strength"


def ior_of(f0: float) -> float:
    """Index of refraction whose reflectance at normal incidence is `f0` (clamped to 0...`MAX_F0`)."""
    root = math.sqrt(min(max(f0, 0.0), MAX_F0))
    return (1 + root) / (1 - root)


def make_material(
    description: ObjectMaterial,
    base_color: bpy.types.Image | None = None,
    emission: bpy.types.Image | None = None,
    one_sided: bool = False,
) -> bpy.types.Material:
    """Make the material of one object.

    Parameters
    ----------
    description : ObjectMaterial
    base_color : bpy.types.Image, optional
        Lambertian and specular: Base Color over the atlas, linear Rec.709; for specular objects already compensated
        (see `core.brdf.compensation`). Without it the colour is mid-grey.
    emission : bpy.types.Image, optional
        Emitter: radiance over the atlas; without it the description's one radiance.
    one_sided : bool
        Emitter: shine on the side of the normals only.

    Returns
    -------
    bpy.types.Material
        Its custom properties ``scan_relight_model``, ``_phi``, ``_psi``, ``_transmission`` tell what was fitted.
    """
    return dress(bpy.data.materials.new(description.name), description, base_color, emission, one_sided)


def dress(
    material: bpy.types.Material,
    description: ObjectMaterial,
    base_color: bpy.types.Image | None = None,
    emission: bpy.types.Image | None = None,
    one_sided: bool = False,
) -> bpy.types.Material:
    """`make_material` with a material that is there: its nodes go, its name and whoever wears it stay."""
    nodes, links, principled = _fresh_tree(material)
    value = {
        name: principled.inputs[name]
        for name in (BASE_COLOR, METALLIC, ROUGHNESS, IOR, SPECULAR_LEVEL, EMISSION_COLOR, EMISSION_STRENGTH, ALPHA)
    }
    # The fitted lobe is single scattering.
    principled.distribution = "GGX"
    if description.phi is not None:  # else Blender's default, which shows nowhere while there is no specular lobe
        value[ROUGHNESS].default_value = math.sqrt(min(max(description.phi, 0.0), 1.0))
    value[SPECULAR_LEVEL].default_value = 0.0
    value[IOR].default_value = 1.5
    value[BASE_COLOR].default_value = (0.5, 0.5, 0.5, 1)
    if description.model == SPECULAR:
        value[SPECULAR_LEVEL].default_value = 0.5
        value[IOR].default_value = ior_of(description.psi or 0.0)
    if description.coat:
        value[SPECULAR_LEVEL].default_value = 0.5
        value[IOR].default_value = ior_of(description.coat["f0"])
        value[ROUGHNESS].default_value = description.coat["roughness"]
    if description.model == METAL:
        value[METALLIC].default_value = 1.0
        value[SPECULAR_LEVEL].default_value = 0.5
        value[BASE_COLOR].default_value = (*(min(max(c, 0.0), 1.0) for c in description.f0 or (0.5,) * 3), 1)
    elif description.model == EMITTER:
        # An image holds all that was seen; of a description's radiance what the lamp reflects has been taken off.
        grey = LAMP_ALBEDO if emission is None else 0.0
        value[BASE_COLOR].default_value = (grey, grey, grey, 1)
        _emit(nodes, links, value, description.emission or (0.0, 0.0, 0.0), emission)
        if one_sided:
            _front_only(nodes, links, value[EMISSION_COLOR])
    elif base_color is not None:
        # Glass lets a share of the light through straight on: no bending, as frames say nothing of it.
        value[ALPHA].default_value = description.opacity
        links.new(_texture(nodes, links, base_color, (-400, 200)), value[BASE_COLOR])
    material[MODEL] = description.model
    for name in ("phi", "psi", "transmission"):
        number = getattr(description, name)
        if number is not None:
            material[f"scan_relight_{name}"] = float(number)
        elif f"scan_relight_{name}" in material:
            del material[f"scan_relight_{name}"]
    return material


def principled(material: bpy.types.Material | None) -> bpy.types.ShaderNode | None:
    """A material's Principled node; None where it has none."""
    nodes = material.node_tree.nodes if material and material.node_tree else ()
    return next((node for node in nodes if node.type == "BSDF_PRINCIPLED"), None)


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
        _emit(nodes, links, value, emission, None)
    if base_color is not None:
        links.new(_texture(nodes, links, base_color, (-400, 200)), value[BASE_COLOR])
    return material


def _emit(nodes, links, value, radiance, image):
    """Emit exactly `radiance`, or the image's: strength is the largest component, so that colours stay within 1."""
    if image is not None:
        links.new(_texture(nodes, links, image, (-400, -200)), value[EMISSION_COLOR])
        value[EMISSION_STRENGTH].default_value = 1.0
        return
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
    if socket.links:
        links.new(socket.links[0].from_socket, front)
    else:
        front.default_value = tuple(socket.default_value)
    back.default_value = (0, 0, 0, 1)
    links.new(mixed, socket)


def mix_node(nodes):
    """A node that mixes two colours, and its sockets: factor, the colours where that is 0 and 1, result."""
    mix = nodes.new("ShaderNodeMix")
    mix.data_type = "RGBA"
    # By type, as the node has sockets of the same name for each of its data types.
    colours = [s for s in mix.inputs if s.type == "RGBA"]
    return (
        mix,
        next(s for s in mix.inputs if s.type == "VALUE"),
        *colours,
        next(s for s in mix.outputs if s.type == "RGBA"),
    )


def _texture(nodes, links, image, place):
    """Colour output of an image over the atlas, or its part of it."""
    coordinates = nodes.new("ShaderNodeUVMap")
    coordinates.uv_map = image.get(UV_MAP, ATLAS_UV)
    coordinates.location = (place[0] - 250, place[1])
    texture = nodes.new("ShaderNodeTexImage")
    texture.image = image
    texture.extension = "REPEAT" if image.get(REPEATS) else "EXTEND"
    texture.location = place
    links.new(coordinates.outputs[0], texture.inputs[0])
    return texture.outputs["Color"]


def _fresh_tree(material):
    """Nodes, links and the Principled node of an otherwise empty tree."""
    if material.node_tree is None:
        # From 5.0 on every material has its tree and the switch is deprecated.
        material.use_nodes = True
    nodes, links = material.node_tree.nodes, material.node_tree.links
    nodes.clear()
    principled = nodes.new("ShaderNodeBsdfPrincipled")
    output = nodes.new("ShaderNodeOutputMaterial")
    output.location = (300, 0)
    links.new(principled.outputs[0], output.inputs["Surface"])
    return nodes, links, principled
