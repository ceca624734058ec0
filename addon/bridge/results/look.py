"""What the viewport shows on the recovered objects: their materials, or one of the images that these are made from.

A look is a Geometry Nodes modifier that sets another material in the viewport alone: no material, slot or node tree of
an object is changed, renders never evaluate the modifier (`show_render` is off), and this also holds where a file is
opened without the add-on. One material serves a whole room, as all its objects share one atlas.
"""

import math
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

import bpy

from ...core.errors import BadInputError
from ...core.kinds import Shown
from ..custom_properties import OBJECT_ID, RESULT
from ..data.images import RADIANCE
from ..data.materials import texture
from ..data.mesh_objects import ATLAS_UV
from ..data.nodes import add_node, fresh_tree, mix_node
from .file import FITS, result_states
from .images import image

MATERIAL, ALBEDO, SHADING = "MATERIAL", "ALBEDO", "SHADING"
LIT_DIFFUSE, COVERAGE, CERTAINTY = "LIT_DIFFUSE", "COVERAGE", "CERTAINTY"
NAME = "Scan Relight look"
MARK = "scan_relight_look"
"""Custom property of the look's node group and material: the name of the look."""
MANY_OBSERVATIONS: Shown[int] = 256
"""Number of observations at the upper end of the ramp."""
MAX_RELATIVE_ERROR: Shown[float] = 0.5
"""Relative standard error of an albedo at the lower end of the ramp."""
UNSEEN_COLOUR: Shown[tuple[float, float, float, float]] = (0.35, 0.0, 0.25, 1.0)
"""Colour of unseen elements, linear Rec.709: not on the ramp."""
RAMP: Shown[tuple[tuple[float, float, float], ...]] = (
    (0.05, 0.03, 0.2),
    (0.03, 0.13, 0.27),
    (0.01, 0.28, 0.27),
    (0.1, 0.5, 0.15),
    (0.98, 0.8, 0.02),
)
"""Dark blue over green to yellow, linear Rec.709: its luminance is monotonic, so it reads without colour too."""


@dataclass(frozen=True)
class Look:
    """One entry of the choice.

    Attributes
    ----------
    label, text : str
        Displayed name and description.
    file : str
        Image of the result folder; '' for the materials themselves.
    light : bool
        Radiance, which the scene's exposure applies to; otherwise the exposure is compensated.
    """

    label: str
    text: str
    file: str = ""
    light: bool = False


LOOKS = {
    MATERIAL: Look("Material", "The recovered materials under the scene's light"),
    ALBEDO: Look("Albedo", "The colour of every spot without any light", "albedo.exr"),
    SHADING: Look("Shading", "The light on every spot, as it would look on white paint", "shading.exr", True),
    LIT_DIFFUSE: Look("Lit Diffuse", "What the frames saw of every spot, without highlights", "lit_diffuse.exr", True),
    COVERAGE: Look(
        "Coverage",
        "How often each spot was seen: dark blue once, yellow 256 times or more; purple never",
        "coverage.exr",
    ),
    CERTAINTY: Look(
        "Certainty",
        "How sure the albedo is: yellow within 3 %, dark blue 50 % or worse; purple where it "
        "was filled in or is a lamp",
        "albedo_error.exr",
    ),
}


def current(scene: bpy.types.Scene) -> str:
    """The current look of a scene."""
    for obj in scene.objects:
        modifier = obj.modifiers.get(NAME)
        if modifier is not None and modifier.type == "NODES" and modifier.node_group is not None:
            return modifier.node_group.get(MARK, MATERIAL)
    return MATERIAL


def recovered(scene: bpy.types.Scene) -> list[bpy.types.Object]:
    """The objects with recovered materials."""
    of_captures = (obj for obj in scene.objects if obj.type == "MESH" and OBJECT_ID in obj)
    return [obj for obj in of_captures if ATLAS_UV in obj.data.uv_layers and not obj.library]


def result_of(scene: bpy.types.Scene) -> Path | None:
    """The result folder that the recovered objects of a scene came from, of several the last one's, if it exists."""
    folders = (obj.get(RESULT) for obj in reversed(recovered(scene)))
    return next((Path(folder) for folder in folders if folder and Path(folder).is_dir()), None)


def set_look(scene: bpy.types.Scene, look: str) -> None:
    """Show one of `LOOKS` in the viewport on all recovered objects, each from its own result.

    Objects of another run than the one in their folder are left out: the images would not match them. Raises
    `BadInputError`: no object's run is the one in its folder, or an image is missing or damaged; the look stays then.
    """
    if look == MATERIAL:
        _remove_modifiers(scene.objects)
        _remove_unused()
        return
    objects = recovered(scene)
    if not objects:
        raise BadInputError("No object of this scene wears recovered materials; run the recovery first.")
    folders = {obj: result.folder for obj, (state, result) in result_states(objects).items() if state == FITS}
    if not folders:
        raise BadInputError(
            "The result folder holds no images of the run that this scene's objects came from; run "
            "again and bring in the result."
        )
    distinct = dict.fromkeys(folders.values())
    for path in (folder / LOOKS[look].file for folder in distinct):
        if not path.is_file():
            raise BadInputError(f"'{path}' is missing; run the recovery again to its end.")
    try:
        groups = {folder: _group(_material(scene, look, folder), look) for folder in distinct}
    except BadInputError:
        _remove_unused()
        raise
    _remove_modifiers(scene.objects)
    _remove_unused(groups.values())
    for obj, folder in folders.items():
        modifier = obj.modifiers.new(NAME, "NODES")
        modifier.node_group = groups[folder]
        modifier.show_render = modifier.show_expanded = False


def _remove_modifiers(objects: Iterable[bpy.types.Object]) -> None:
    for obj in objects:
        modifier = obj.modifiers.get(NAME)
        if modifier is not None and not obj.library:
            obj.modifiers.remove(modifier)


def _remove_unused(used: Iterable[bpy.types.NodeTree] = ()) -> None:
    """Remove leftovers of earlier looks: groups other than `used`, materials and images that nothing uses."""
    for group in [item for item in bpy.data.node_groups if MARK in item and not item.users and not item.library]:
        if group not in used:
            bpy.data.node_groups.remove(group)
    for material in [item for item in bpy.data.materials if MARK in item and not item.users and not item.library]:
        images = {node.image for node in material.node_tree.nodes if node.type == "TEX_IMAGE"}
        bpy.data.materials.remove(material)
        for picture in images:
            if picture is not None and not picture.users:
                bpy.data.images.remove(picture)


def refresh(scene: bpy.types.Scene) -> None:
    """Remove the look from objects without a recovered material."""
    objects = set(recovered(scene))
    _remove_modifiers(obj for obj in scene.objects if obj not in objects)
    _remove_unused()


def _group(material: bpy.types.Material, look: str) -> bpy.types.NodeTree:
    group = bpy.data.node_groups.new(NAME, "GeometryNodeTree")
    group[MARK] = look
    for direction in ("INPUT", "OUTPUT"):
        group.interface.new_socket("Geometry", in_out=direction, socket_type="NodeSocketGeometry")
    group_input = add_node(group, "NodeGroupInput")
    set_material = add_node(group, "GeometryNodeSetMaterial", group_input.outputs[0], location=(200, 0))
    set_material.inputs["Material"].default_value = material
    add_node(group, "NodeGroupOutput", set_material.outputs[0], location=(400, 0))
    return group


def _material(scene: bpy.types.Scene, look: str, folder: Path) -> bpy.types.Material:
    material = bpy.data.materials.new(f"{NAME}: {LOOKS[look].label}")
    material[MARK] = look
    tree, strength = fresh_tree(material), 1.0
    if look == COVERAGE:
        count = _channels(tree, folder, LOOKS[look].file)[0]
        frequency = _math(tree, "LOGARITHM", _math(tree, "MAXIMUM", count, 1.0), MANY_OBSERVATIONS)
        colour = _ramp(tree, frequency, _math(tree, "LESS_THAN", count, 0.5))
    elif look == CERTAINTY:
        colour = _ramp(tree, _certainty(tree, folder), _unmeasured(tree, folder))
    else:
        colour = _texture(tree, folder, LOOKS[look].file)
        strength = 1 / math.pi if look == SHADING else 1.0  # a white Lambertian surface reflects E / pi
    emission = add_node(tree, "ShaderNodeEmission", colour, strength)
    add_node(tree, "ShaderNodeOutputMaterial", emission.outputs[0])
    if not LOOKS[look].light:
        _without_exposure(scene, emission.inputs["Strength"])
    return material


def _texture(tree, folder: Path, name: str):
    picture = image(folder, name, keep=False, share=True)
    # Counts must not be interpolated between the texels of different islands.
    interpolation = "Linear" if picture.colorspace_settings.name == RADIANCE else "Closest"
    return texture(tree, picture, ATLAS_UV, interpolation=interpolation)


def _channels(tree, folder: Path, name: str):
    return add_node(tree, "ShaderNodeSeparateColor", _texture(tree, folder, name)).outputs


def _math(tree, operation: str, *values):
    return add_node(tree, "ShaderNodeMath", *values, operation=operation).outputs[0]


def _certainty(tree, folder: Path):
    """0...1 for relative errors of the albedo from `MAX_RELATIVE_ERROR` down to 1/16 of it, by their logarithm."""
    error, albedo = (
        _math(tree, "ADD", _math(tree, "ADD", red, green), blue)
        for red, green, blue in (_channels(tree, folder, name) for name in ("albedo_error.exr", "albedo.exr"))
    )
    relative = _math(tree, "DIVIDE", error, _math(tree, "MAXIMUM", albedo, 1e-3))
    relative = _math(tree, "MAXIMUM", relative, MAX_RELATIVE_ERROR / 64)
    return _math(tree, "LOGARITHM", _math(tree, "DIVIDE", MAX_RELATIVE_ERROR, relative), 16.0)


def _unmeasured(tree, folder: Path):
    """1 where the albedo was not measured."""
    from ...core.passes.albedo.albedo import CLOSED, MEASURED  # not earlier: Blender's start should not wait for it

    origin = _math(tree, "MODULO", _channels(tree, folder, "coverage.exr")[2], float(CLOSED))
    return _math(tree, "SUBTRACT", 1.0, _math(tree, "COMPARE", origin, float(MEASURED), 0.5))


def _ramp(tree, value, unseen):
    node = add_node(tree, "ShaderNodeValToRGB", value)
    elements = node.color_ramp.elements
    while len(elements) < len(RAMP):
        elements.new(0.5)
    for k, (element, colour) in enumerate(zip(elements, RAMP)):
        element.position, element.color = k / (len(RAMP) - 1), (*colour, 1)
    return mix_node(tree, unseen, node.outputs[0], UNSEEN_COLOUR)


def _without_exposure(scene: bpy.types.Scene, socket) -> None:
    """Compensate the scene's exposure, whatever it is set to later: an albedo is no radiance."""
    driver = socket.driver_add("default_value").driver
    driver.type = "SCRIPTED"
    variable = driver.variables.new()
    variable.name = "stops"
    target = variable.targets[0]
    target.id_type, target.id, target.data_path = "SCENE", scene, "view_settings.exposure"
    driver.expression = "pow(2, -stops)"
