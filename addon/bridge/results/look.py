"""What the viewport shows on the recovered objects: their materials, or one of the images that these come from.

A look is a Geometry Nodes modifier that sets another material, seen by the viewport alone: no material, slot or node
tree of an object is touched, a render never evaluates the modifier (its switch for renders is off), and this stays so
where a file is opened without the add-on. One material serves a whole room, as all its objects share one atlas.
"""

import math
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

import bpy

from ...core.errors import BadInputError
from ...core.kinds import Shown
from ..data.images import RADIANCE
from ..data.materials import texture
from ..data.mesh_objects import ATLAS_UV
from ..data.nodes import add_node, fresh_tree, mix_node
from ..marks import OBJECT_ID, RESULT
from .file import FITS, standings
from .images import image

MATERIAL, ALBEDO, SHADING = "MATERIAL", "ALBEDO", "SHADING"
LIT_DIFFUSE, COVERAGE, CERTAINTY = "LIT_DIFFUSE", "COVERAGE", "CERTAINTY"
NAME = "Scan Relight look"
MARK = "scan_relight_look"
"""Custom property of the look's node group and material: which look it is."""
OFTEN: Shown[int] = 256
"""Observations from which on a spot counts as seen as often as can be wished."""
DOUBTFUL: Shown[float] = 0.5
"""Relative standard error of an albedo at the far end of the ramp."""
NEVER: Shown[tuple[float, float, float, float]] = (0.35, 0.0, 0.25, 1.0)
"""Colour of what no frame saw, linear Rec.709: on neither ramp."""
RAMP: Shown[tuple[tuple[float, float, float], ...]] = (
    (0.05, 0.03, 0.2),
    (0.03, 0.13, 0.27),
    (0.01, 0.28, 0.27),
    (0.1, 0.5, 0.15),
    (0.98, 0.8, 0.02),
)
"""Dark blue over green to yellow, linear Rec.709: its brightness grows all along, so it reads without colour too."""


@dataclass(frozen=True)
class Look:
    """One entry of the choice.

    Attributes
    ----------
    label, text : str
        As the artist reads it.
    file : str
        Image of the result folder; '' for the materials themselves.
    light : bool
        Radiance, which the scene's exposure applies to; else the exposure is taken out again.
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
    """The look that a scene shows."""
    for thing in scene.objects:
        modifier = thing.modifiers.get(NAME)
        if modifier is not None and modifier.type == "NODES" and modifier.node_group is not None:
            return modifier.node_group.get(MARK, MATERIAL)
    return MATERIAL


def recovered(scene: bpy.types.Scene) -> list[bpy.types.Object]:
    """The objects that wear recovered materials."""
    return [
        thing
        for thing in scene.objects
        if thing.type == "MESH" and OBJECT_ID in thing and ATLAS_UV in thing.data.uv_layers and not thing.library
    ]


def result_of(scene: bpy.types.Scene) -> Path | None:
    """The result folder that the recovered objects of a scene came from, of several the last one's, if it is there."""
    told = (thing.get(RESULT) for thing in reversed(recovered(scene)))
    return next((Path(one) for one in told if one and Path(one).is_dir()), None)


def set_look(scene: bpy.types.Scene, look: str) -> None:
    """Let the viewport show a look on all recovered objects, each from the result that it came from.

    Objects of another run than lies in their folder now are left out: the images would not fit them.

    Parameters
    ----------
    look : str
        One of `LOOKS`.

    Raises
    ------
    BadInputError
        Nothing is recovered in the scene whose run lies in its folder, or an image is missing or damaged; the look
        stays as it was.
    """
    if look == MATERIAL:
        _take_off(scene.objects)
        _sweep()
        return
    things = recovered(scene)
    if not things:
        raise BadInputError("No object of this scene wears recovered materials; run the recovery first.")
    folders = {thing: result.folder for thing, (state, result) in standings(things).items() if state == FITS}
    if not folders:
        raise BadInputError(
            "The result folder holds no images of the run that this scene's objects came from; run "
            "again and bring in the result."
        )
    for folder in dict.fromkeys(folders.values()):
        if not (folder / LOOKS[look].file).is_file():
            raise BadInputError(f"'{folder / LOOKS[look].file}' is missing; run the recovery again to its end.")
    try:
        groups = {folder: _group(_material(scene, look, folder), look) for folder in dict.fromkeys(folders.values())}
    except BadInputError:
        _sweep()
        raise
    _take_off(scene.objects)
    _sweep(groups.values())
    for thing, folder in folders.items():
        modifier = thing.modifiers.new(NAME, "NODES")
        modifier.node_group = groups[folder]
        modifier.show_render = modifier.show_expanded = False


def _take_off(things: Iterable[bpy.types.Object]) -> None:
    for thing in things:
        modifier = thing.modifiers.get(NAME)
        if modifier is not None and not thing.library:
            thing.modifiers.remove(modifier)


def _sweep(but: Iterable[bpy.types.NodeTree] = ()) -> None:
    """Remove what earlier looks left: groups other than `but`, materials and images that nothing uses."""
    for group in [one for one in bpy.data.node_groups if MARK in one and not one.users and not one.library]:
        if group not in but:
            bpy.data.node_groups.remove(group)
    for material in [one for one in bpy.data.materials if MARK in one and not one.users and not one.library]:
        images = {node.image for node in material.node_tree.nodes if node.type == "TEX_IMAGE"}
        bpy.data.materials.remove(material)
        for picture in images:
            if picture is not None and not picture.users:
                bpy.data.images.remove(picture)


def refresh(scene: bpy.types.Scene) -> None:
    """Take the look off objects that wear no recovered material any more."""
    keep = set(recovered(scene))
    _take_off(thing for thing in scene.objects if thing not in keep)
    _sweep()


def _group(material: bpy.types.Material, look: str) -> bpy.types.NodeTree:
    group = bpy.data.node_groups.new(NAME, "GeometryNodeTree")
    group[MARK] = look
    for way in ("INPUT", "OUTPUT"):
        group.interface.new_socket("Geometry", in_out=way, socket_type="NodeSocketGeometry")
    start = add_node(group, "NodeGroupInput")
    put = add_node(group, "GeometryNodeSetMaterial", start.outputs[0], location=(200, 0))
    put.inputs["Material"].default_value = material
    add_node(group, "NodeGroupOutput", put.outputs[0], location=(400, 0))
    return group


def _material(scene: bpy.types.Scene, look: str, folder: Path) -> bpy.types.Material:
    material = bpy.data.materials.new(f"{NAME}: {LOOKS[look].label}")
    material[MARK] = look
    tree, strength = fresh_tree(material), 1.0
    if look == COVERAGE:
        count = _channels(tree, folder, LOOKS[look].file)[0]
        often = _math(tree, "LOGARITHM", _math(tree, "MAXIMUM", count, 1.0), OFTEN)
        colour = _ramp(tree, often, _math(tree, "LESS_THAN", count, 0.5))
    elif look == CERTAINTY:
        colour = _ramp(tree, _sure(tree, folder), _unmeasured(tree, folder))
    else:
        colour = _texture(tree, folder, LOOKS[look].file)
        strength = 1 / math.pi if look == SHADING else 1.0  # what leaves white paint is E / pi
    shine = add_node(tree, "ShaderNodeEmission", colour, strength)
    add_node(tree, "ShaderNodeOutputMaterial", shine.outputs[0])
    if not LOOKS[look].light:
        _without_exposure(scene, shine.inputs["Strength"])
    return material


def _texture(tree, folder: Path, name: str):
    picture = image(folder, name, keep=False, share=True)
    # Between an island's texels and the next nothing may be mixed into counts.
    kind = "Linear" if picture.colorspace_settings.name == RADIANCE else "Closest"
    return texture(tree, picture, ATLAS_UV, interpolation=kind)


def _channels(tree, folder: Path, name: str):
    return add_node(tree, "ShaderNodeSeparateColor", _texture(tree, folder, name)).outputs


def _math(tree, operation: str, *values):
    return add_node(tree, "ShaderNodeMath", *values, operation=operation).outputs[0]


def _sure(tree, folder: Path):
    """0...1 for relative errors of the albedo from `DOUBTFUL` down to 1/16 of it, by their logarithm."""
    error, albedo = (
        _math(tree, "ADD", _math(tree, "ADD", red, green), blue)
        for red, green, blue in (_channels(tree, folder, name) for name in ("albedo_error.exr", "albedo.exr"))
    )
    relative = _math(tree, "DIVIDE", error, _math(tree, "MAXIMUM", albedo, 1e-3))
    relative = _math(tree, "MAXIMUM", relative, DOUBTFUL / 64)
    return _math(tree, "LOGARITHM", _math(tree, "DIVIDE", DOUBTFUL, relative), 16.0)


def _unmeasured(tree, folder: Path):
    """1 where the albedo was not measured."""
    from ...core.passes.albedo.albedo import CLOSED, MEASURED  # not earlier: Blender's start should not wait for it

    origin = _math(tree, "MODULO", _channels(tree, folder, "coverage.exr")[2], float(CLOSED))
    return _math(tree, "SUBTRACT", 1.0, _math(tree, "COMPARE", origin, float(MEASURED), 0.5))


def _ramp(tree, value, never):
    node = add_node(tree, "ShaderNodeValToRGB", value)
    elements = node.color_ramp.elements
    while len(elements) < len(RAMP):
        elements.new(0.5)
    for k, (element, colour) in enumerate(zip(elements, RAMP)):
        element.position, element.color = k / (len(RAMP) - 1), (*colour, 1)
    return mix_node(tree, never, node.outputs[0], NEVER)


def _without_exposure(scene: bpy.types.Scene, socket) -> None:
    """Take the scene's exposure out again, whatever it is set to later: an albedo is no light."""
    driver = socket.driver_add("default_value").driver
    driver.type = "SCRIPTED"
    variable = driver.variables.new()
    variable.name = "stops"
    target = variable.targets[0]
    target.id_type, target.id, target.data_path = "SCENE", scene, "view_settings.exposure"
    driver.expression = "pow(2, -stops)"
