"""The scene of its own that a room has: its settings, and how a window shows it."""

from __future__ import annotations

import bpy

from ..light import outside
from .as_made import WRITTEN, is_corrected

EXPOSURE = "scan_relight_exposure"
"""Of a scene of ours: the exposure that it was made with."""
_CYCLES = ("samples", "use_denoising", "sample_clamp_indirect", "max_bounces", "diffuse_bounces", "glossy_bounces")
_RENDER = ("engine", "resolution_x", "resolution_y", "resolution_percentage", "pixel_aspect_x", "pixel_aspect_y")


def dress(scene: bpy.types.Scene) -> None:
    """Prepare a room's own scene for this artist: her graphics card, a viewport that calms down quickly."""
    scene[EXPOSURE] = scene.view_settings.exposure
    addon = bpy.context.preferences.addons.get("cycles")
    card = addon is not None and addon.preferences is not None and addon.preferences.has_active_device()
    scene.cycles.device = "GPU" if card else "CPU"
    scene.cycles.use_preview_denoising = True


def take_settings(scene: bpy.types.Scene, shell: bpy.types.Scene) -> list[str]:
    """Bring a room's own scene up to date with the scene of a new result; what the artist changed stays.

    Returns
    -------
    list of str
        One sentence on each thing that stays hers.
    """
    kept = []
    if EXPOSURE not in scene:  # the capture was imported, no more
        for name in _RENDER:
            setattr(scene.render, name, getattr(shell.render, name))
        for name in _CYCLES:
            setattr(scene.cycles, name, getattr(shell.cycles, name))
        scene.frame_start, scene.frame_end = shell.frame_start, shell.frame_end
        scene.view_settings.exposure = shell.view_settings.exposure
        scene.world = shell.world
        scene.camera = scene.camera or shell.camera
        dress(scene)
        return kept
    if abs(scene.view_settings.exposure - scene[EXPOSURE]) < 1e-4:
        scene.view_settings.exposure = shell.view_settings.exposure
        scene[EXPOSURE] = shell.view_settings.exposure
    else:
        kept.append("The exposure stays as you set it.")
    world = outside.recovered_world(scene)
    if world is None or shell.world is None:
        scene.world = scene.world or shell.world
    elif WRITTEN not in world or is_corrected(world):
        kept.append(f"World '{world.name}' was edited and stays.")
    else:
        label, state = world.name, outside.snapshot(world)
        world.user_remap(shell.world)  # wherever it was linked, and where a picture stands in for it
        bpy.data.worlds.remove(world)
        shell.world.name = label
        outside.put_back(shell.world, state)
    return kept


def show(window: bpy.types.Window | None, scene: bpy.types.Scene) -> None:
    """Let a window show a room's own scene as it looks: through a frame's camera, rendered under its own light.

    Material Preview has no light from surfaces that emit, and the lamps of a scan are such: only Rendered is true.
    """
    if window is None:
        return
    window.scene = scene
    space = next((area.spaces.active for area in window.screen.areas if area.type == "VIEW_3D"), None)
    if space is None:
        return
    if scene.camera is not None:
        space.region_3d.view_perspective = "CAMERA"
    space.shading.use_scene_lights_render = space.shading.use_scene_world_render = True
    space.shading.type = "RENDERED"
