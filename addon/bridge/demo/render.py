"""Renders the demo's room with Cycles into a capture folder, exactly as a scanner's would look."""

import json
from collections.abc import Callable
from pathlib import Path

import bpy
import numpy as np
from mathutils import Matrix

from ...core.brdf.compensation import ior_of
from ...core.brdf.model import Principled
from ...core.io.exr import read_header
from ...core.kinds import Workload
from ...core.progress import Progress
from ..data.added import scene_apart
from ..data.arrays import set_layer
from ..data.images import array_image
from ..data.materials import BASE_COLOR, plain_material, principled, texture
from ..data.nodes import add_node, feed, fresh_tree
from ..refused import whole_folder
from ..relight.pictures import can_denoise
from .room import FIELD_OF_VIEW, Paint, RoomObject, frame_path, room, tour, write_all_but_frames

SIZES = {"tiny": (10, 64, 48, 24), "small": (36, 160, 120, 24), "large": (64, 320, 240, 128)}
"""Frames, width, height and samples for each pixel."""

FORMAT: Workload[int] = 3
"""Raised when the room or its rendering changes, so that an older capture is not taken for this one."""


def render_capture(folder: Path, size: str = "small", progress: Progress | None = None) -> Path:
    """Render the demo's room into `folder`, unless it is there already; returns `folder`.

    `size` is one of `SIZES`. Only the demo's comparison reads truth/materials.json of that capture.
    """
    folder, progress = Path(folder), progress or Progress()
    if is_rendered(folder, size):
        return folder
    objects = room()
    frames, width, height, samples = SIZES[size]
    poses = tour(frames)
    with whole_folder(folder, f"The demo's capture can't be written to '{folder}'") as partial:
        write_all_but_frames(partial, objects, poses, (width, height))
        render_frames(partial, objects, poses, (width, height), samples, progress)
        (partial / "truth" / "demo.json").write_text(json.dumps(stamp_of(size)))
    return folder


def is_rendered(folder: Path, size: str) -> bool:
    """Whether `folder` holds the demo's capture of this size already."""
    try:
        return json.loads((Path(folder) / "truth" / "demo.json").read_text()) == stamp_of(size)
    except (OSError, ValueError):
        return False


def stamp_of(size: str) -> dict:
    """The stamp of a finished capture."""
    return {"format": FORMAT, "size": list(SIZES[size])}


def render_frames(folder: Path, objects, poses: np.ndarray, size: tuple[int, int], samples: int, progress: Progress):
    """Render the room from every pose into the capture `folder`, as half-float EXR in linear Rec.709."""
    with scene_apart("demo") as (scene, _):
        for obj in objects:
            scene.collection.objects.link(build(obj))
        shoot = camera_of(scene, size, samples)
        for k, pose in enumerate(poses):
            progress.update(k / len(poses))
            shoot(pose, folder / frame_path(k))
            read_header(folder / frame_path(k))  # raises where it is absent or cut off
        progress.update(1.0)


def camera_of(scene, size: tuple[int, int], samples: int) -> Callable[[np.ndarray, Path], None]:
    """The demo's camera in a scene, Cycles and half-float EXR set up: renders from a pose into a file."""
    camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
    camera.data.sensor_fit, camera.data.angle, camera.data.clip_start = "HORIZONTAL", FIELD_OF_VIEW, 0.01
    scene.collection.objects.link(camera)
    scene.camera = camera
    set_up_cycles(scene, size, samples)
    image = scene.render.image_settings
    image.file_format, image.color_mode, image.color_depth = "OPEN_EXR", "RGB", "16"

    def shoot(pose: np.ndarray, path: Path) -> None:
        camera.matrix_world = Matrix(pose.tolist())
        scene.render.filepath = str(path)
        bpy.ops.render.render(write_still=True, scene=scene.name)

    return shoot


def set_up_cycles(scene, size: tuple[int, int], samples: int) -> None:
    """Path tracing on the processor, one box filter a pixel, denoised where this Blender can."""
    scene.render.engine = "CYCLES"
    scene.render.resolution_x, scene.render.resolution_y = size
    scene.render.resolution_percentage = 100
    scene.render.use_persistent_data = True
    scene.render.use_compositing = scene.render.use_sequencer = False
    cycles = scene.cycles
    cycles.device, cycles.samples, cycles.use_adaptive_sampling = "CPU", samples, False
    cycles.pixel_filter_type = "BOX"
    cycles.sample_clamp_indirect = cycles.sample_clamp_direct = 0
    cycles.max_bounces, cycles.diffuse_bounces, cycles.glossy_bounces = 10, 10, 10
    cycles.caustics_reflective, cycles.blur_glossy = True, 0
    cycles.use_light_tree = False  # two lamps: it would cost 40 % of the time for nothing
    cycles.use_denoising = can_denoise()


def build(obj: RoomObject):
    """A mesh object with its true materials."""
    vertices, faces, uv, slot = obj.faces()
    mesh = bpy.data.meshes.new(obj.class_name)
    mesh.from_pydata(vertices.tolist(), [], faces.tolist())
    set_layer(mesh, "uv", uv)
    mesh.polygons.foreach_set("material_index", slot.astype(np.int32))
    for paint in obj.paints:
        mesh.materials.append(material(obj.class_name, paint))
    return bpy.data.objects.new(obj.class_name, mesh)


def material(name: str, paint: Paint):
    """The paint as a Cycles material: emission, or a Principled."""
    if not paint.emission:
        plain = paint.albedo.ndim == 1
        lobe = {"ior": ior_of(paint.f0), "specular_level": 0.5} if paint.f0 else {}
        colour = tuple(paint.albedo.tolist()) if plain else None
        result = plain_material(name, Principled(colour, paint.roughness, **lobe))
        principled(result).distribution = "GGX"
        if not plain:
            picture = array_image(name, paint.albedo)
            feed(principled(result).inputs[BASE_COLOR], texture(result.node_tree, picture, "uv"))
        return result
    result = bpy.data.materials.new(name)
    tree = fresh_tree(result)
    add_node(tree, "ShaderNodeOutputMaterial", add_node(tree, "ShaderNodeEmission", (*paint.emission, 1)).outputs[0])
    return result
