"""Blender's own Texture Paint, made ready for what no frame saw of an object."""

from __future__ import annotations

import bpy

from ...core.kinds import Unit
from ..data.mesh_objects import ATLAS_UV
from . import corrections, unseen

_GAMMA: Unit[float] = 1 / 2.4


def begin(context: bpy.types.Context, thing: bpy.types.Object, where: str, masked: bool = True) -> None:
    """Canvas, stencil mask and colour for the active object, then Texture Paint.

    Parameters
    ----------
    context : bpy.types.Context
        `thing` is its active object.
    where : str
        Where the canvas goes, see `unseen.own_image`.
    masked : bool
        Protect what any frame saw.

    Raises
    ------
    BadInputError, StorageError
        As of `unseen.own_image` and `unseen.unseen_mask`.
    """
    if masked:
        unseen.unseen_mask(thing)  # raises before anything is changed
    settings = context.scene.tool_settings.image_paint
    settings.mode, settings.canvas = "IMAGE", unseen.own_image(thing, where)
    layers = thing.data.uv_layers
    layers.active = layers[ATLAS_UV]
    settings.use_stencil_layer = masked
    if masked:
        settings.stencil_image, settings.invert_stencil = unseen.stencil(thing), False
        thing.data.uv_layer_stencil = layers[ATLAS_UV]
    bpy.ops.object.mode_set(mode="TEXTURE_PAINT")
    colour = corrections.effective(thing).get("base_color")
    if colour:
        _brush_colour(context, colour)


def _brush_colour(context, colour) -> None:
    """The brush begins with the object's mean colour."""
    tools = context.scene.tool_settings
    unified = getattr(tools.image_paint, "unified_paint_settings", None) or tools.unified_paint_settings
    owner = unified if unified.use_unified_color else tools.image_paint.brush
    if owner is None:
        return
    if owner.bl_rna.properties["color"].subtype == "COLOR_GAMMA":  # sRGB up to 4.5
        colour = [12.92 * c if c <= 0.0031308 else 1.055 * c**_GAMMA - 0.055 for c in colour]
    owner.color = [min(max(c, 0.0), 1.0) for c in colour]
