"""Principled materials. The only module that knows the names of the node's sockets (Blender 4.x and 5.x)."""

import bpy

from ...core.brdf.material import ObjectMaterial
from ...core.brdf.model import Brdf, Principled
from ...core.brdf.registry import find
from ..custom_properties import UV_MAP
from .mesh_objects import ATLAS_UV
from .nodes import add_node, feed, find_node, fresh_tree, mix_node

MODEL = "scan_relight_model"
"""Custom property of each recovered material: the name of its description's model."""
REPEATS = "scan_relight_repeats"
"""Custom property of a picture: it goes on beyond its edges, as one tile does for coordinates on that tile."""
_ALPHA, _F0, _TRANSMISSION = "scan_relight_alpha", "scan_relight_f0", "scan_relight_transmission"
_OLD_NAMES = {_ALPHA: "scan_relight_phi", _F0: "scan_relight_psi"}
"""Their names in version 0.1."""

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


def f0_of(material: bpy.types.Material) -> float | None:
    """F0 as it was fitted; None where there is no lobe, or a coloured one: that is the material's colour."""
    return material.get(_F0, material.get(_OLD_NAMES[_F0]))


def make_material(
    description: ObjectMaterial, base_color: bpy.types.Image | None = None, one_sided: bool = False
) -> bpy.types.Material:
    """Make the material of one object.

    Its custom properties ``scan_relight_model``, ``_alpha``, ``_f0``, ``_transmission`` tell what was fitted.

    Parameters
    ----------
    base_color : bpy.types.Image, optional
        Of what has a diffuse part: Base Color over the atlas, linear Rec.709 (`core.brdf.material.base_colors`).
        Without it the colour is mid-grey.
    one_sided : bool
        Emitter: shine on the side of the normals only.
    """
    return dress(bpy.data.materials.new(description.name), description, base_color, one_sided)


def dress(
    material: bpy.types.Material,
    description: ObjectMaterial,
    base_color: bpy.types.Image | None = None,
    one_sided: bool = False,
) -> bpy.types.Material:
    """`make_material` in an existing material: its nodes are replaced, its name and users stay."""
    values = description.model.principled(description)
    shader = _fresh_principled(material, values, base_color if values.base_color is None else None)
    shader.distribution = "GGX"  # the fitted lobe is single scattering
    if values.emission is not None and one_sided:
        _front_only(shader.inputs[EMISSION_COLOR])
    _connect(shader)
    material[MODEL] = description.model.name
    properties = {_ALPHA: description.alpha, _F0: description.f0, _TRANSMISSION: description.transmission}
    for name in (*properties, *_OLD_NAMES.values()):
        material.pop(name, None)
    for name, number in properties.items():
        if isinstance(number, (int, float)):
            material[name] = float(number)
    return material


def shines_to_the_front(material: bpy.types.Material) -> bool:
    """Whether a lamp's material was made `one_sided`."""
    return find_node(material, "NEW_GEOMETRY") is not None


def let_light_through(material: bpy.types.Material) -> None:
    """Make a lamp's material purely additive: it emits, reflects nothing and blocks no light."""
    tree, shader = material.node_tree, principled(material)
    _set(shader.inputs, BASE_COLOR, (0, 0, 0, 1), SPECULAR_LEVEL, 0.0)
    clear = add_node(tree, "ShaderNodeBsdfTransparent", (1, 1, 1, 1), location=(0, -650))
    both = add_node(tree, "ShaderNodeAddShader", shader.outputs[0], clear.outputs[0], location=(300, -150))
    feed(find_node(material, "OUTPUT_MATERIAL").inputs[0], both.outputs[0])


def principled(material: bpy.types.Material | None) -> bpy.types.ShaderNode | None:
    """A material's Principled node; None where it has none."""
    return find_node(material, "BSDF_PRINCIPLED")


def emission_socket(material: bpy.types.Material) -> bpy.types.NodeSocket | None:
    """The input that holds the colour of its light, also on a lamp with a black back; None where a picture gives it."""
    socket = principled(material).inputs[EMISSION_COLOR]
    if socket.links and socket.links[0].from_node.type == "MIX":
        socket = next(inner for inner in socket.links[0].from_node.inputs if inner.type == "RGBA")
    return None if socket.links else socket


def emission(material: bpy.types.Material) -> tuple[float, float, float]:
    """Radiance that a material emits to its front, linear Rec.709; (0, 0, 0) for none."""
    socket, strength = emission_socket(material), principled(material).inputs[EMISSION_STRENGTH].default_value
    return tuple(strength * c for c in (socket.default_value[:3] if socket else (1.0, 1.0, 1.0)))


def opacity(material: bpy.types.Material) -> float:
    """Alpha of a material's Principled node; 1 where it has none."""
    shader = principled(material)
    return 1.0 if shader is None else shader.inputs[ALPHA].default_value


def plain_material(name: str, values: Principled, base_color: bpy.types.Image | None = None) -> bpy.types.Material:
    """A Principled material of plain numbers and at most a picture, which any program understands."""
    material = bpy.data.materials.new(name)
    _connect(_fresh_principled(material, values, base_color))
    return material


def _emit(inputs, radiance) -> None:
    """Emit exactly `radiance`: strength is the largest component, so that colours stay within 1."""
    strength = max(*radiance, 0.0)
    colour = (*(max(c, 0.0) / strength if strength else 1.0 for c in radiance), 1)
    _set(inputs, EMISSION_COLOR, colour, EMISSION_STRENGTH, strength)


def _front_only(socket) -> None:
    """Blacken an emission colour where the surface is seen from behind; the strength stays a plain number."""
    tree = socket.id_data
    geometry = add_node(tree, "ShaderNodeNewGeometry", location=(-450, -350))
    front = tuple(socket.default_value)
    feed(socket, mix_node(tree, geometry.outputs["Backfacing"], front, (0, 0, 0, 1), location=(-250, -300)))


def texture(tree: bpy.types.NodeTree, image: bpy.types.Image, uv_map: str, **settings) -> bpy.types.NodeSocket:
    """The colour of an image that is laid out by a UV map."""
    uv_node = add_node(tree, "ShaderNodeUVMap", uv_map=uv_map, location=(-650, 200))
    settings |= {"image": image, "extension": "REPEAT" if image.get(REPEATS) else "EXTEND", "location": (-400, 200)}
    return add_node(tree, "ShaderNodeTexImage", uv_node.outputs[0], **settings).outputs["Color"]


def _connect(shader: bpy.types.ShaderNode) -> None:
    """Make a node the surface of its material, last of all: Blender updates what is used of a tree after each change,
    in a time that goes with the number of materials."""
    output = add_node(shader.id_data, "ShaderNodeOutputMaterial", location=(300, 0))
    feed(output.inputs[0], shader.outputs[0])


def _set(inputs, *names_and_values) -> None:
    """Give inputs values, name and value in turn; None leaves an input as it is."""
    for name, value in zip(names_and_values[::2], names_and_values[1::2], strict=True):
        feed(inputs[name], value)


def _fresh_principled(
    material: bpy.types.Material, values: Principled, base_color: bpy.types.Image | None
) -> bpy.types.ShaderNode:
    """The Principled node of an otherwise empty tree, shown by nothing yet (`_connect`)."""
    shader = add_node(fresh_tree(material), "ShaderNodeBsdfPrincipled")
    inputs = shader.inputs
    _set(inputs, METALLIC, values.metallic, ALPHA, values.alpha, SPECULAR_LEVEL, values.specular_level, IOR, values.ior)
    _set(inputs, ROUGHNESS, values.roughness, BASE_COLOR, (*(values.base_color or (0.5,) * 3), 1))
    for name, number in values.further.items():
        if name in inputs:
            inputs[name].default_value = number
    if base_color is not None:
        feed(inputs[BASE_COLOR], texture(shader.id_data, base_color, base_color.get(UV_MAP, ATLAS_UV)))
    if values.emission is not None:
        _emit(inputs, values.emission)
    return shader
