"""The recovered room as a Blender scene, saved as a file that renders when opened."""

import errno
import math
import os
from collections.abc import Iterable
from contextlib import nullcontext, suppress
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import bpy
import numpy as np

from ...core.brdf.emitter import EMITTER
from ...core.brdf.material import ObjectMaterial, undescribed
from ...core.io.folder import SCENE
from ...core.luminance import rgb
from ...core.photo import MIDDLE_GREY
from ...core.results.room_file import openings_of, run_of
from ...core.scene.model import Capture, Instance
from ..custom_properties import OBJECT_ID, OWN_SCENE, set_run
from ..data.added import scene_apart
from ..data.arrays import make_mesh
from ..data.cameras import best_view, lens_warning, make_cameras, make_track, make_view, size_warning, use_camera
from ..data.images import image_name, load_image, load_parts, relative_to
from ..data.materials import let_light_through, make_material
from ..data.mesh_objects import by_object, each_object, is_one_sided
from ..data.nodes import make_world
from ..refused import refused
from .as_made import stamp, stamp_tree
from .parts import CAMERAS, EXPOSURE, LAMPS, ROOM, hide_cameras, new_room, part_of, scene_name

if TYPE_CHECKING:
    from ...core.pipeline.parts import Parts

BASE_COLOR, ALBEDO, SHADING, ENVIRONMENT = "base_color.exr", "albedo.exr", "shading.exr", "environment.exr"
"""Files of the result folder that the scene shows; a missing one is left out."""
_WRITING = ".scene-being-written.blend"
SCENE_FILES = SCENE, _WRITING
"""A result's own file of its room; what it is called while it is written."""


def _build(
    scene: bpy.types.Scene,
    capture: Capture,
    atlas_uv: np.ndarray,
    materials: Iterable[ObjectMaterial],
    folder: Path,
    median_radiance: float,
    parts: "Parts | None",
) -> tuple[list[bpy.types.Image], tuple[str, ...]]:
    """Build the room in an empty scene; returns the images that it refers to, and warnings."""
    images = {
        name: load_image(folder / name, image_name(capture.root.name, name), keep=name != ENVIRONMENT)
        for name in (BASE_COLOR, ALBEDO, SHADING, ENVIRONMENT)
        if (folder / name).exists()
    }
    top = new_room(capture.root)
    room, lamps, camera_collection = (part_of(top, name) for name in (ROOM, LAMPS, CAMERAS))
    scene.collection.children.link(top)
    descriptions = {m.object_id: m for m in materials}
    instances = _lamps_apart(capture.instances, descriptions)
    objects = dict(each_object(capture.mesh, instances, atlas_uv, room, parts and parts.uv))
    run = run_of(folder)
    for owner in (top, *objects.values()):
        set_run(owner, folder, run, capture.root)
    own_images = load_parts(folder, parts.images, capture.root.name, descriptions) if parts else {}
    for object_id, of_object in by_object(capture.mesh, instances).items():
        obj = objects[object_id]
        for instance in of_object:
            description = descriptions.get(instance.object_id) or undescribed(instance.object_id, instance.class_name)
            one_sided = description.model.gives_light and is_one_sided(obj.data, capture.mesh.whole)
            base_color = own_images.get(instance.object_id, images.get(BASE_COLOR))
            material = make_material(description, base_color, one_sided=one_sided)
            if instance.object_id != object_id:
                material[OBJECT_ID] = instance.object_id
            obj.data.materials.append(material)
            if description.model.gives_light:
                room.objects.unlink(obj)
                lamps.objects.link(obj)
        stamp(obj, of_object[0].name)
    panels = make_openings(folder, lamps)
    cameras = make_cameras(capture.frames, camera_collection)
    track = make_track(cameras, camera_collection)
    scene.world = make_world("Scan Relight", images.get(ENVIRONMENT))
    stamp_tree(scene.world)
    prepare(scene, median_radiance)
    if cameras:
        use_camera(scene, cameras[best_view(capture.frames, capture.mesh)])
    else:
        from ...core.scene.overview import overview  # not earlier: Blender's start should not wait for embreex

        use_camera(scene, make_view("overview", overview(capture.mesh), camera_collection))
    scene.frame_start, scene.frame_end = 1, max(len(cameras), 1)
    scene.name, scene[OWN_SCENE] = scene_name(capture.root), True
    scene[EXPOSURE] = scene.view_settings.exposure
    for obj in (*panels, *cameras, *filter(None, (track,))):
        set_run(obj, folder, run, capture.root)
        stamp(obj)
    hide_cameras(scene, top)
    warnings = tuple(filter(None, (size_warning(capture.frames), lens_warning(capture.frames))))
    return [*images.values(), *dict.fromkeys(own_images.values())], warnings


def _lamps_apart(instances: Iterable[Instance], descriptions: dict[int, ObjectMaterial]) -> list[Instance]:
    """The instances; what gives light neither is a part nor has any: a lamp is an object in a collection of its own."""
    lamps = {object_id for object_id, description in descriptions.items() if description.model.gives_light}
    return [
        replace(instance, part_of=None) if lamps & {instance.object_id, instance.part_of} else instance
        for instance in instances
    ]


def make_openings(folder: Path, collection: bpy.types.Collection) -> list[bpy.types.Object]:
    """Light from behind openings, as panels that emit into the room, invisible to cameras; linked to a collection."""
    panels = []
    for number, (corners, radiance) in enumerate(openings_of(folder), 1):
        vertices, indices = np.unique(corners.reshape(-1, 3), axis=0, return_inverse=True)
        quads = indices.reshape(-1, 4)
        faces = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
        faces = faces[(np.diff(np.sort(faces, 1), axis=1) > 0).all(1)]
        material = ObjectMaterial(number, "opening", EMITTER, emission=rgb(radiance))
        data = make_mesh(material.name, vertices, faces)
        obj = bpy.data.objects.new(material.name, data)
        obj.visible_camera = False
        data.materials.append(make_material(material, one_sided=True))
        # Off, it would shade what closes the mesh behind it.
        let_light_through(data.materials[0])
        collection.objects.link(obj)
        panels.append(obj)
    return panels


def start_empty() -> None:
    """Start from an empty file; what is open in this process is lost."""
    # Not read_factory_settings: that would disable the running extension itself.
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)


def write_scene(
    path: Path | str,
    capture: Capture,
    atlas_uv: np.ndarray,
    materials: Iterable[ObjectMaterial],
    result_folder: Path | str,
    median_radiance: float = 0.0,
    fresh: bool = True,
    parts: "Parts | None" = None,
) -> tuple[str, ...]:
    """Save the recovered room as a .blend of its own that renders when opened.

    The file appears whole or not at all, and refers to the images by paths relative to itself.

    Parameters
    ----------
    path, result_folder : Path or str
        The folder holds the images (`BASE_COLOR` and its neighbours); `path` is best in it: both are moved together.
    capture : Capture
        The mesh's normals face the frames: a lamp that is an open sheet shines on that side only, as it was seen.
    atlas_uv : (t, 3, 2) float32
        What `unwrap` gave.
    materials : iterable of ObjectMaterial
        An instance without one becomes lambertian.
    median_radiance : float
        Of the frames; the exposure is set so that this becomes middle grey. 0: unknown.
    fresh : bool
        Start from an empty file; what is open in this process is lost. False: build next to what is open, save that
        part alone and take it away again.
    parts : Parts, optional
        Images that the materials show instead of the room's one; that is there all the same.

    Returns
    -------
    tuple of str
        Warnings, one sentence each.

    Raises
    ------
    BadInputError, StorageError
        An image of the result folder can't be read; the file can't be written.
    """
    path = Path(path).absolute()
    if fresh:
        start_empty()
    with nullcontext((bpy.context.scene, None)) if fresh else scene_apart("Scan Relight") as (scene, _):
        folder = Path(result_folder).absolute()
        images, warnings = _build(scene, capture, atlas_uv, materials, folder, median_radiance, parts)
        for image in images:
            relative_to(image, path.parent)
        save_whole(path, scene, images, fresh)
    return warnings


def _save(name, scene, images, fresh):
    if fresh:
        bpy.ops.wm.save_as_mainfile(filepath=name, copy=True, compress=True, relative_remap=False)
    else:
        # Blender 5.2 crashes on a scene whose view layer was never brought up to date.
        scene.view_layers[0].update()
        bpy.data.libraries.write(name, {scene, *images}, path_remap="NONE", compress=True, fake_user=False)


def save_whole(path: Path, scene: bpy.types.Scene, images: list[bpy.types.Image], fresh: bool) -> None:
    """Save the open file, or where it is not `fresh` a scene and images of it; raises `StorageError`."""
    writing = path.parent / _WRITING
    try:
        with refused(f"{path} can't be saved", "free some space or choose another folder"):
            path.parent.mkdir(parents=True, exist_ok=True)
            writing.unlink(missing_ok=True)
            _save(str(writing), scene, images, fresh)
            try:  # Blender does not notice a full disk while it compresses, but it does when it reads
                with bpy.data.libraries.load(str(writing)):
                    pass
            except OSError as error:
                raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC)) from error
            writing.replace(path)
    finally:
        with suppress(OSError):
            writing.unlink(missing_ok=True)


def prepare(scene: bpy.types.Scene, median_radiance: float = 0.0) -> None:
    """Cycles, and an exposure that shows the room's median radiance as middle grey."""
    scene.render.engine = "CYCLES"
    scene.cycles.samples = 128
    scene.cycles.use_denoising = True
    # Clamping would darken a room that is lit by small bright lamps, and Filter Glossy one with mirrors or tiles; white
    # rooms need many bounces, which cost others no time.
    scene.cycles.sample_clamp_indirect = scene.cycles.blur_glossy = 0.0
    scene.cycles.max_bounces, scene.cycles.diffuse_bounces, scene.cycles.glossy_bounces = 24, 24, 12
    if median_radiance > 0 and math.isfinite(median_radiance):
        scene.view_settings.exposure = min(max(math.log2(MIDDLE_GREY / median_radiance), -32.0), 32.0)
