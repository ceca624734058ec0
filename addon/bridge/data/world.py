"""The world: light from directions where no surface was scanned (windows, holes)."""

from __future__ import annotations

from pathlib import Path

import bpy

from .images import load_image


def set_world(scene: bpy.types.Scene, environment: Path | str | None, strength: float = 1.0) -> bpy.types.World:
    """Give a scene a world of its own.

    Parameters
    ----------
    scene : bpy.types.Scene
    environment : Path, str or None
        Equirectangular radiance, linear Rec.709, as docs/architecture.md states: u = 0.5 - atan2(y, x) / (2 pi),
        v = 0.5 + asin(z) / pi. None: black.
    strength : float
        Factor on the radiance.

    Returns
    -------
    bpy.types.World

    Raises
    ------
    BadInputError
        The file is missing or is no image.
    """
    image = None if environment is None else load_image(environment, "Scan Relight environment", keep=False)
    world = bpy.data.worlds.new("Scan Relight")
    if world.node_tree is None:
        # From 5.0 on every world has its tree and the switch is deprecated.
        world.use_nodes = True
    nodes, links = world.node_tree.nodes, world.node_tree.links
    nodes.clear()
    background, output = nodes.new("ShaderNodeBackground"), nodes.new("ShaderNodeOutputWorld")
    output.location = (300, 0)
    links.new(background.outputs[0], output.inputs["Surface"])
    background.inputs["Color"].default_value = (0, 0, 0, 1)
    background.inputs["Strength"].default_value = strength
    if image is not None:
        texture = nodes.new("ShaderNodeTexEnvironment")
        texture.location = (-300, 0)
        texture.projection = "EQUIRECTANGULAR"
        texture.image = image
        links.new(texture.outputs[0], background.inputs["Color"])
    scene.world = world
    return world
