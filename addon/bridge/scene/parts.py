"""A room's collections, marked with its capture; the scene of its own that it has, and how a window shows it."""

from pathlib import Path

import bpy

from ...core.errors import BadInputError, MissingStageError
from ..custom_properties import CAPTURE, OWN_SCENE
from ..light import outside
from ..render_device import preferences_of_cycles
from .as_made import WRITTEN, is_corrected

ROOM, LAMPS, CAMERAS = "Room", "Lamps", "Cameras"
PART = "scan_relight_part"
"""Of a collection within a room's: which of the three it is, whatever the artist calls it."""


def new_room(capture_folder: Path | str) -> bpy.types.Collection:
    """A collection "Scan Relight" with its parts, linked to no scene."""
    top = bpy.data.collections.new("Scan Relight")
    top[CAPTURE] = str(Path(capture_folder).absolute())
    for name in (ROOM, LAMPS, CAMERAS):
        part = bpy.data.collections.new(name)
        part[PART] = name
        top.children.link(part)
    return top


def hide_cameras(scene: bpy.types.Scene, top: bpy.types.Collection) -> None:
    """Hide the cameras' collection in a scene (its eye icon): as many cameras as frames would cover the room.

    Not "disabled in viewports": Blender would then not even update the cameras' matrices.
    """
    part = part_of(top, CAMERAS)
    for layer in scene.view_layers:
        if layer.layer_collection is None:  # Blender 5: a new scene's layers know nothing before their first update
            layer.update()
        layer_collections = [layer.layer_collection]
        for layer_collection in layer_collections:
            layer_collections.extend(layer_collection.children)
            if layer_collection.collection == part != top:
                layer_collection.hide_viewport = True


def load_scene(path: Path, link: bool = False) -> bpy.types.Scene:
    """The scene of a result's scene.blend, appended by Blender itself, or linked.

    Raises `MissingStageError` or `BadInputError`: there is none, or it can't be read.
    """
    if not path.is_file():
        raise MissingStageError(f"Folder '{path.parent}' holds no {path.name}; run the recovery to its end first.")
    try:
        with bpy.data.libraries.load(str(path), link=link) as (data_from, data_to):
            data_to.scenes = data_from.scenes[:1]
    except OSError as error:
        raise BadInputError(
            f"'{path}' can't be read by Blender {bpy.app.version_string}; run the recovery again from its last stage."
        ) from error
    if not data_to.scenes or data_to.scenes[0] is None or not data_to.scenes[0].collection.children:
        raise BadInputError(f"'{path}' holds no room; run the recovery again from its last stage.")
    return data_to.scenes[0]


def scene_name(capture_folder: Path | str) -> str:
    """Name of the scene that is made for a capture's room."""
    return f"Scan Relight: {Path(capture_folder).name}"


def part_of(top: bpy.types.Collection, name: str) -> bpy.types.Collection:
    """One of a room's parts; the room's own collection where the artist removed it."""
    return next((part for part in top.children_recursive if part.get(PART, part.name.split(".")[0]) == name), top)


def rooms(scene: bpy.types.Scene) -> list[bpy.types.Collection]:
    """The collections of the rooms in a scene."""
    return [collection for collection in scene.collection.children_recursive if CAPTURE in collection]


def find_room(capture_folder: Path | str) -> bpy.types.Collection | None:
    """The collection of a capture's room that any scene of this file shows; None without one."""
    root = Path(capture_folder).resolve()
    for scene in sorted(bpy.data.scenes, key=lambda candidate: not candidate.get(OWN_SCENE)):
        for top in rooms(scene):
            if top.library is None and Path(top[CAPTURE]).resolve() == root:
                return top
    return None


def imported(capture_folder: Path | str) -> bpy.types.Collection:
    """`find_room`; raises `MissingStageError` without one."""
    top = find_room(capture_folder)
    if top is None:
        raise MissingStageError(f"Capture '{capture_folder}' is not in this file; import it first.")
    return top


def scenes_with(top: bpy.types.Collection) -> list[bpy.types.Scene]:
    """The scenes that show a room, its own first."""
    scenes = [scene for scene in bpy.data.scenes if top in scene.collection.children_recursive]
    return sorted(scenes, key=lambda scene: not scene.get(OWN_SCENE))


def own_scene(top: bpy.types.Collection) -> bpy.types.Scene | None:
    """The scene that was made for a room; None without one."""
    return next((scene for scene in scenes_with(top) if scene.get(OWN_SCENE)), None)


EXPOSURE = "scan_relight_exposure"
"""Of a scene of ours: the exposure that it was made with."""
_CYCLES = "samples use_denoising sample_clamp_indirect blur_glossy max_bounces diffuse_bounces glossy_bounces".split()
_RENDER = "engine resolution_x resolution_y resolution_percentage pixel_aspect_x pixel_aspect_y".split()


def dress(scene: bpy.types.Scene) -> None:
    """Prepare a room's own scene for this artist: her graphics card, a viewport that calms down quickly."""
    scene[EXPOSURE] = scene.view_settings.exposure
    preferences = preferences_of_cycles()
    scene.cycles.device = "GPU" if preferences is not None and preferences.has_active_device() else "CPU"
    scene.cycles.use_preview_denoising = True


def take_settings(scene: bpy.types.Scene, shell: bpy.types.Scene) -> list[str]:
    """Update a room's own scene from a new result's; a sentence on each setting that stays the artist's."""
    messages = []
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
        return messages
    if abs(scene.view_settings.exposure - scene[EXPOSURE]) < 1e-4:
        scene.view_settings.exposure = shell.view_settings.exposure
        scene[EXPOSURE] = shell.view_settings.exposure
    else:
        messages.append("The exposure stays as you set it.")
    world = outside.recovered_world(scene)
    if world is None or shell.world is None:
        scene.world = scene.world or shell.world
    elif WRITTEN not in world or is_corrected(world):
        messages.append(f"World '{world.name}' was edited and stays.")
    else:
        label, state = world.name, outside.snapshot(world)
        world.user_remap(shell.world)  # wherever it was linked, and where a picture stands in for it
        bpy.data.worlds.remove(world)
        shell.world.name = label
        outside.put_back(shell.world, state)
    return messages


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
