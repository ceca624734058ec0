"""The world: light from directions where no surface was scanned (windows, holes)."""

from __future__ import annotations

from pathlib import Path

import bpy

from .images import load_image
from .nodes import fresh_tree


def set_world(scene: bpy.types.Scene, environment: Path | str | None, strength: float = 1.0) -> bpy.types.World:
    """Give a scene a world of its own.

    Parameters
    ----------
    environment : Path, str or None
        Equirectangular radiance, linear Rec.709, as docs/architecture.md states: u = 0.5 - atan2(y, x) / (2 pi),
        v = 0.5 + asin(z) / pi. None: black.
    strength : float
        Factor on the radiance.

    Raises
    ------
    BadInputError
        The file is missing or is no image.
    """
    image = None if environment is None else load_image(environment, "Scan Relight environment", keep=False)
    scene.world = make_world("Scan Relight", image, strength)
    return scene.world


def make_world(name: str, image: bpy.types.Image | None, strength: float) -> bpy.types.World:
    """A world that shows an equirectangular picture, or black."""
    world = bpy.data.worlds.new(name)
    nodes, links = fresh_tree(world)
    background, output = nodes.new("ShaderNodeBackground"), nodes.new("ShaderNodeOutputWorld")
    output.location = (300, 0)
    links.new(background.outputs[0], output.inputs["Surface"])
    background.inputs["Color"].default_value = (0, 0, 0, 1)
    background.inputs["Strength"].default_value = strength
    if image is not None:
        texture = nodes.new("ShaderNodeTexEnvironment")
        texture.location, texture.image = (-300, 0), image
        links.new(texture.outputs[0], background.inputs["Color"])
    return world
