"""The light from outside, which is the scene's world: on or off, strength, turned about the vertical, another picture.

`switch.py` keeps its state, but for the turn, which a node has.
"""

import math
from pathlib import Path

import bpy
import numpy as np
from mathutils import Vector

from ...core.errors import BadInputError
from ...core.luminance import LUMINANCE
from ...core.scene.sphere import fibonacci
from ..data.images import RADIANCE, image_array
from ..data.nodes import add_node, feed, find_node, make_world
from .room import bounds, leaves, room_light
from .switch import STRENGTH, factor, is_on, set_factor, set_on, strength_socket
from .switch import restore as restore_strength

RECOVERED = "scan_relight_recovered_world"
"""Custom property of the scene: its world before another picture took its place."""
HDRI = "scan_relight_hdri"
"""Custom property of a world of ours: the path of the picture that it shows."""
_TURN, _COORDINATES = "Scan Relight turn", "Scan Relight place"
_OUTDOOR_FACTOR = 4.0
"""Mean radiance of a picture put around the room, relative to that of the room's median surface: it is the outdoors,
which shows through openings that cover a small part of what any spot of the room sees."""


def has_outside(scene: bpy.types.Scene) -> bool:
    """Whether the scene's world shows a picture or any colour but black."""
    node = find_node(scene.world, "BACKGROUND")
    return node is not None and bool(node.inputs["Color"].links or any(node.inputs["Color"].default_value[:3]))


def rotation(world: bpy.types.World) -> float:
    """Angle in radians by which the outside is turned about +Z, anticlockwise from above."""
    turn = world.node_tree.nodes.get(_TURN) if world.node_tree else None
    return -turn.inputs["Rotation"].default_value[2] if turn else 0.0


def set_rotation(world: bpy.types.World, angle: float) -> None:
    """Turn the outside to `angle` (radians about +Z); without effect where it shows no picture."""
    texture = find_node(world, "TEX_ENVIRONMENT")
    if texture is None:
        return
    tree, turn = world.node_tree, world.node_tree.nodes.get(_TURN)
    if not angle:
        for node in filter(None, map(tree.nodes.get, (_TURN, _COORDINATES))):
            tree.nodes.remove(node)
        return
    if turn is None:
        coordinates = add_node(tree, "ShaderNodeTexCoord", name=_COORDINATES, location=(-700, 0))
        turn = add_node(tree, "ShaderNodeMapping", coordinates.outputs["Generated"], name=_TURN, location=(-500, 0))
        feed(texture.inputs["Vector"], turn.outputs["Vector"])
    # The node turns the direction that is looked up, and so the picture the other way round.
    turn.inputs["Rotation"].default_value = (0, 0, -angle)


def use_hdri(scene: bpy.types.Scene, path: Path | str, mean: float | None = None) -> bpy.types.World:
    """Put an equirectangular picture around the room; the recovered outside is kept for `restore`.

    `mean` is the mean radiance that it is scaled to; None leaves it as it is. Raises `BadInputError`: the file is
    missing, or no picture that Blender reads.
    """
    path = Path(path).absolute()
    if not path.is_file():
        raise BadInputError(f"There is no picture '{path}'; choose an equirectangular EXR or HDR file.")
    try:
        image = bpy.data.images.load(str(path), check_existing=False)
    except RuntimeError:
        image = None
    if image is None or not all(image.size):
        if image is not None:
            bpy.data.images.remove(image)
        raise BadInputError(f"'{path}' can't be opened as a picture; choose an equirectangular EXR or HDR file.")
    if image.is_float:
        image.colorspace_settings.name = RADIANCE
    picture_mean = mean_radiance(image) if mean is not None else 0.0
    strength = mean / picture_mean if picture_mean > 0 else 1.0
    if HDRI not in (scene.world or {}) and scene.world is not None:
        scene[RECOVERED] = scene.world
    scene.world = make_world(f"Scan Relight {path.stem}", image, strength)
    scene.world[HDRI] = str(path)
    return scene.world


def restore(scene: bpy.types.Scene) -> None:
    """Reset the outside to what was recovered."""
    if scene.get(RECOVERED) is not None:
        scene.world = scene[RECOVERED]
    scene.pop(RECOVERED, None)
    if scene.world is not None:
        set_rotation(scene.world, 0.0)
        restore_strength(scene.world)


def recovered_world(scene: bpy.types.Scene) -> bpy.types.World | None:
    """The world that the scan gave, also while another picture is shown."""
    return scene.get(RECOVERED) or scene.world


def is_changed(scene: bpy.types.Scene) -> bool:
    """Whether the outside differs from what was recovered."""
    world = scene.world
    return (
        scene.get(RECOVERED) is not None
        or world is not None
        and (not is_on(world) or factor(world) != 1 or rotation(world) != 0)
    )


def strength(world: bpy.types.World | None) -> float:
    """What the world's picture or colour is multiplied by now; 0 without a world."""
    socket = strength_socket(world)
    return 0.0 if socket is None else float(socket.default_value)


def recovered_strength(world: bpy.types.World | None) -> float:
    """`strength` as it was recovered."""
    return float(world.get(STRENGTH, strength(world))) if world is not None else 0.0


def outdoor_radiance(scene: bpy.types.Scene) -> float:
    """Mean radiance that a picture around this room is scaled to, in the frames' unit."""
    return _OUTDOOR_FACTOR * room_light(scene) / math.pi


def is_open(scene: bpy.types.Scene) -> bool:
    """Whether light from outside can reach what the camera looks at, or the room's middle: any of 256 rays leaves."""
    points = [sum(bounds(scene), Vector()) / 2]
    if scene.camera:
        points.append(scene.camera.matrix_world.translation)
    return any(leaves(scene, point, direction) for point in points for direction in map(Vector, fibonacci(128)))


def remarks(scene: bpy.types.Scene) -> list[str]:
    """Remarks, one sentence each, on a picture around this room."""
    return [] if is_open(scene) else ["The scanned room is closed, so the picture around it sends no light in."]


def studio_lights() -> list[Path]:
    """The equirectangular pictures that come with Blender; some builds have none."""
    folder = bpy.utils.system_resource("DATAFILES", path="studiolights/world")
    return sorted(Path(folder).glob("*.exr")) if folder else []


def mean_radiance(image: bpy.types.Image) -> float:
    """Mean over all directions of an equirectangular picture's luminance."""
    pixels = image_array(image)[::4, ::4, :3]
    height = len(pixels)
    weight = np.cos((np.arange(height) + 0.5) / height * math.pi - math.pi / 2)
    luminance = np.nan_to_num(pixels, posinf=0.0).clip(0) @ LUMINANCE
    return float((luminance.mean(1) * weight).sum() / weight.sum())


def snapshot(world: bpy.types.World | None) -> dict:
    """The state of a world for `put_back`."""
    if world is None:
        return {}
    return {"on": is_on(world), "factor": factor(world), "rotation": rotation(world), "touched": STRENGTH in world}


def put_back(world: bpy.types.World | None, state: dict) -> None:
    """Bring a world into a state that `snapshot` gave, after `restore`."""
    if world is None:
        return
    set_rotation(world, state["rotation"])
    if state["touched"]:
        set_factor(world, state["factor"])
        set_on(world, state["on"])


def state_sockets(world: bpy.types.World) -> list[bpy.types.NodeSocket]:
    """The inputs that show the state of the light from outside."""
    texture = find_node(world, "TEX_ENVIRONMENT")
    turned = [texture.inputs["Vector"]] if texture is not None and rotation(world) else []
    return turned + ([strength_socket(world)] if STRENGTH in world else [])


_ROWS, _COLUMNS = 8, 16
_maps: dict[tuple, np.ndarray] = {}


def sky(world: bpy.types.World, turn: float) -> list[tuple[Vector, float]]:
    """The light that a world of strength 1 sends in, field by field; nothing where it shows no light.

    Parameters
    ----------
    turn : float
        Radians by which the picture is turned about +Z, anticlockwise from above.

    Returns
    -------
    list of (Vector, float)
        Unit direction to a field; its luminance in the frames' unit times its solid angle.
    """
    node = find_node(world, "BACKGROUND")
    socket = node.inputs["Color"] if node is not None else None
    if socket is None or socket.links and getattr(socket.links[0].from_node, "image", None) is None:
        return []
    if socket.links:
        light = _fields(socket.links[0].from_node.image)
    else:
        light = np.full((_ROWS, _COLUMNS), float(np.array(socket.default_value[:3]) @ LUMINANCE))
    # As Cycles lays it: the picture's middle is -X, and its rows go from below to above.
    rims = np.sin(np.linspace(-math.pi / 2, math.pi / 2, _ROWS + 1))
    samples = []
    for row, column in np.ndindex(light.shape):
        angle, z = turn + math.pi * (1 - (2 * column + 1) / _COLUMNS), (rims[row] + rims[row + 1]) / 2
        level, solid_angle = math.sqrt(1 - z * z), (rims[row + 1] - rims[row]) * 2 * math.pi / _COLUMNS
        direction = Vector((level * math.cos(angle), level * math.sin(angle), z))
        samples.append((direction, float(light[row, column] * solid_angle)))
    return samples


def _fields(image: bpy.types.Image) -> np.ndarray:
    """The luminance of a picture, averaged in fields; row 0 is below."""
    key = image.name, image.filepath, tuple(image.size)
    if key not in _maps:
        pixels = np.nan_to_num(image_array(image)[..., :3], posinf=0.0).clip(0) @ LUMINANCE
        for axis, count in enumerate((_ROWS, _COLUMNS)):
            pixels = pixels.repeat(max(-(-count // pixels.shape[axis]), 1), axis)
            pixels = np.stack([block.mean(axis) for block in np.array_split(pixels, count, axis)], axis)
        _maps[key] = pixels
    return _maps[key]
