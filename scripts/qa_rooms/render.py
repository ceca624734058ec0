"""Render a furnished room as a capture with truth, laid out like the captures that results are scored on."""

import json
from pathlib import Path

import bpy
import numpy as np
import OpenEXR
from mathutils import Matrix

from addon.bridge.data.materials import BASE_COLOR, EMISSION_STRENGTH, METALLIC, principled
from addon.bridge.data.nodes import add_node, feed, find_node, fresh_tree
from addon.bridge.demo import render as demo_render
from addon.bridge.demo.room import FIELD_OF_VIEW, frame_path, look_at, write_all_but_frames
from addon.core.io.exr import write_exr
from addon.core.scene.model import Camera
from addon.core.scene.rays import RayScene

from .furnish import FurnishedRoom

RELIT = ("A", (0.25, 60.0, 45.0, 30.0))
"""Name of the one new light; half its edge and its radiance."""


STRENGTHS = {"EMISSION": "Strength", "BSDF_PRINCIPLED": EMISSION_STRENGTH}
"""What tells how strongly a node emits, by the node's type."""

TOO_NEW = (5, 0)
"""Blender from which on the Python module writes the combined pass alone to a multilayer file (observed in 5.2)."""


def walk(room: FurnishedRoom, count: int, phase: float, scene: RayScene) -> np.ndarray:
    """Poses (count, 4, 4) of a camera that walks about and looks around; turned away from near surfaces."""
    x0, y0, x1, y1 = room.walk
    low, high = np.radians(room.pitch)
    poses = []
    for k in range(count):
        t = 2 * np.pi * (k + phase) / count
        eye = np.array(
            [
                (x0 + x1) / 2 + (x1 - x0) / 2 * np.cos(t + phase),
                (y0 + y1) / 2 + (y1 - y0) / 2 * np.sin(2 * t + 1),
                1.45 + 0.25 * np.sin(3 * t + phase),
            ]
        )
        yaw, tilt = 2 * t + 0.8 * np.sin(3 * t + 2 * phase), (low + high) / 2 + (high - low) / 2 * np.sin(5 * t + 2)
        for turn in range(12):
            gaze = yaw + turn * 0.55
            pose = look_at(eye, eye + (np.cos(gaze) * np.cos(tilt), np.sin(gaze) * np.cos(tilt), np.sin(tilt)))
            camera = Camera(16, 12, 8 / np.tan(FIELD_OF_VIEW / 2), 8 / np.tan(FIELD_OF_VIEW / 2), 8, 6, pose)
            directions = camera.directions(camera.pixel_centres())
            hits = scene.intersect(np.broadcast_to(eye.astype(np.float32), directions.shape), directions)
            depth = np.where(hits.triangle >= 0, hits.distance, 10.0)
            if depth.min() > 0.3 and np.median(depth) > 1.0:
                break
        poses.append(pose)
    return np.array(poses)


def objects_seen(camera: Camera, object_id: np.ndarray, scene: RayScene) -> np.ndarray:
    """Object at each pixel's centre, (h, w) int; -1 where none is."""
    directions = camera.directions(camera.pixel_centres())
    hits = scene.intersect(np.broadcast_to(camera.centre.astype(np.float32), directions.shape), directions)
    ids = np.where(hits.triangle >= 0, object_id[np.maximum(hits.triangle, 0)], -1)
    return ids.reshape(camera.height, camera.width)


def truth_of(room: FurnishedRoom) -> list[dict]:
    """The true values of each object, as in truth/materials.json."""
    rows = []
    for obj in room.objects:
        paint = obj.paints[0]
        glass, metal = paint.glass, paint.metallic
        kind = "diffuse" if not paint.f0 else "dielectric" if glass else "roughconductor" if metal else "roughplastic"
        rows.append({
            "id": obj.object_id, "class_name": obj.class_name, "bsdf": kind,
            "emission": None if paint.emission is None else list(paint.emission),
            "alpha": paint.roughness**2 if paint.f0 and not glass else None,
            "f0": None if metal else paint.f0, "metallic": float(metal), "masked": glass, "base_factor": 1.0,
            "base_color": [round(float(c), 4) for c in obj.mean_albedo()],
        })  # fmt: skip
    return rows


def build(room: FurnishedRoom, scene) -> None:
    """Add all objects, the sky and the sun to the Blender scene."""
    for obj in room.objects:
        mesh_object = demo_render.build(obj)
        scene.collection.objects.link(mesh_object)
        for paint, material in zip(obj.paints, mesh_object.data.materials):
            if paint.metallic:
                principled(material).inputs[METALLIC].default_value = 1.0
            if paint.glass:
                _clear(material)
        if obj.triangles:
            mesh_object.data.shade_smooth()
            mesh_object.data.set_sharp_from_angle(angle=np.radians(40))
    if any(room.sky):
        scene.world = _sky(room)
        for origin, across, up in room.windows:
            light = bpy.data.lights.new("portal", "AREA")
            light.shape, light.size, light.size_y = "RECTANGLE", np.linalg.norm(across), np.linalg.norm(up)
            light.cycles.is_portal = True
            a, u = across / np.linalg.norm(across), up / np.linalg.norm(up)
            middle = origin + across / 2 + up / 2
            inwards = np.array([room.size[0] / 2, room.size[1] / 2, middle[2]]) - middle
            n = np.cross(a, u) * np.sign(np.cross(a, u) @ inwards)
            pose = np.eye(4)
            pose[:3, 0], pose[:3, 1], pose[:3, 2], pose[:3, 3] = np.cross(u, -n), u, -n, middle
            _link(scene, light, pose)
    if room.sun:
        add_sun(scene, *room.sun, np.radians(1.5))


def add_sun(scene, towards, colour: tuple[float, float, float], power: float, angle: float) -> None:
    """A sun whose light goes `towards` a direction ((3,)), of an irradiance in W/m^2 and a disc's angle in radians."""
    light = bpy.data.lights.new("sun", "SUN")
    light.energy, light.color, light.angle = power, colour, angle
    _link(scene, light, look_at((0, 0, 0), towards))


def _link(scene, data, pose) -> bpy.types.Object:
    obj = bpy.data.objects.new(data.name, data)
    obj.matrix_world = Matrix(np.asarray(pose).tolist())
    scene.collection.objects.link(obj)
    return obj


def _clear(material) -> None:
    """Thin clear glass: light goes straight through or is mirrored."""
    tree = material.node_tree
    fresnel = add_node(tree, "ShaderNodeFresnel", 1.5)
    through, gloss = add_node(tree, "ShaderNodeBsdfTransparent"), add_node(tree, "ShaderNodeBsdfGlossy", None, 0.0)
    mix = add_node(tree, "ShaderNodeMixShader", fresnel.outputs[0], through.outputs[0], gloss.outputs[0])
    feed(find_node(material, "OUTPUT_MATERIAL").inputs["Surface"], mix.outputs[0])


def _sky(room: FurnishedRoom):
    """A world that is bright above the horizon, brightest near it, and earthy below."""
    world = bpy.data.worlds.new("sky")
    tree, top = fresh_tree(world), max(room.sky)
    coordinates = add_node(tree, "ShaderNodeTexCoord")
    split = add_node(tree, "ShaderNodeSeparateXYZ", coordinates.outputs["Generated"])
    height = add_node(tree, "ShaderNodeMath", split.outputs["Z"], 0.5, 0.5, operation="MULTIPLY_ADD")
    ramp = add_node(tree, "ShaderNodeValToRGB", height.outputs[0])
    stops = ramp.color_ramp.elements
    stops[0].position, stops[0].color = 0.49, (*(c / top for c in room.ground), 1)
    stops[1].position, stops[1].color = 0.51, (*(min(1.0, 1.15 * c / top) for c in room.sky), 1)
    higher = stops.new(0.8)
    higher.color = (*(0.6 * c / top for c in room.sky), 1)
    shine = add_node(tree, "ShaderNodeBackground", ramp.outputs[0], top)
    add_node(tree, "ShaderNodeOutputWorld", shine.outputs[0])
    return world


def _override(scene) -> None:
    """Make every surface emit its base colour."""
    scene.world = None
    for material in bpy.data.materials:
        shader, colour = principled(material), (0, 0, 0, 1)
        if shader:
            socket = shader.inputs[BASE_COLOR]
            colour = socket.links[0].from_socket if socket.links else tuple(socket.default_value)
        light = add_node(material.node_tree, "ShaderNodeEmission", colour)
        feed(find_node(material, "OUTPUT_MATERIAL").inputs["Surface"], light.outputs[0])


def relight(scene, pose: np.ndarray, radiance: tuple[float, float, float]) -> bpy.types.Object:
    """Turn all lights off but one new one, the square [-1, 1]^2 of `pose`, which emits along its +z; returns it."""
    scene.world = None
    for obj in list(scene.collection.all_objects):
        if obj.type == "LIGHT":
            bpy.data.objects.remove(obj)
    for material in bpy.data.materials:
        for node in material.node_tree.nodes if material.node_tree else ():
            strength = STRENGTHS.get(node.type)
            if strength:
                for link in list(node.inputs[strength].links):
                    material.node_tree.links.remove(link)
                node.inputs[strength].default_value = 0
    mesh = bpy.data.meshes.new("light")
    mesh.from_pydata([(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)], [], [(0, 1, 2, 3)])
    material = bpy.data.materials.new("light")
    tree, top = fresh_tree(material), max(radiance)
    side = add_node(tree, "ShaderNodeNewGeometry")
    front = add_node(tree, "ShaderNodeMath", side.outputs["Backfacing"], -top, top, operation="MULTIPLY_ADD")
    shine = add_node(tree, "ShaderNodeEmission", (*(c / top for c in radiance), 1), front.outputs[0])
    add_node(tree, "ShaderNodeOutputMaterial", shine.outputs[0])
    mesh.materials.append(material)
    return _link(scene, mesh, pose)


def render(
    room: FurnishedRoom, folder: Path, frames: int, size: tuple[int, int], samples: int, held_out: int, denoise: bool
) -> None:
    """Write the capture `folder` with its truth/.

    Parameters
    ----------
    room : FurnishedRoom
    folder : Path
        Must not be there yet.
    frames, held_out : int
        How many frames are taken, and how many views with truth.
    size : tuple of int
        Width and height.
    samples : int
        For each pixel of a frame; truth has twice as many.
    denoise : bool
        What few samples leave in frames and held-out pictures; never in truth's light.
    """
    if bpy.app.version >= TOO_NEW:
        raise SystemExit(f"Rooms are made with Blender 4.5: {bpy.app.version_string} as a module writes no passes.")
    bpy.ops.wm.read_factory_settings(use_empty=True)
    vertices, triangles, object_id = _triangles(room)
    rays = RayScene(vertices, triangles)
    poses, held_poses = walk(room, frames, 0.0, rays), walk(room, held_out, 0.43, rays)
    write_all_but_frames(folder, room.objects, poses, size)
    truth = folder / "truth"
    (truth / "materials.json").write_text(json.dumps(truth_of(room), indent=1))
    views = [
        {"file_path": f"image/view_{k:03d}.exr", "transform_matrix": pose.tolist()} for k, pose in enumerate(held_poses)
    ]
    lens = json.loads((folder / "transforms.json").read_text())
    (truth / "transforms.json").write_text(json.dumps(lens | {"frames": views}, indent=1))
    scene = bpy.context.scene
    build(room, scene)
    shoot = demo_render.camera_of(scene, size, samples)
    scene.cycles.use_denoising = denoise
    scene.cycles.use_light_tree = True
    # Truncation after few bounces would look like an excess of E: 3 % in a white room after 6.
    scene.cycles.max_bounces = scene.cycles.diffuse_bounces = 24
    scene.cycles.glossy_bounces = 12
    for k, pose in enumerate(poses):
        shoot(pose, folder / frame_path(k))
    # Held-out views: the picture, and what light and colour it is made of.
    layer = scene.view_layers[0]
    layer.use_pass_diffuse_direct = layer.use_pass_diffuse_indirect = layer.use_pass_diffuse_color = True
    scene.cycles.samples, image = 2 * samples, scene.render.image_settings
    image.file_format, image.color_depth = "OPEN_EXR_MULTILAYER", "32"
    for name in ("image", "albedo", "object_id", "diffuse_light", "diffuse_color", f"relight_{RELIT[0]}"):
        (truth / name).mkdir()
    for k, pose in enumerate(held_poses):
        name = f"view_{k:03d}.exr"
        shoot(pose, truth / "all.exr")
        planes = OpenEXR.File(str(truth / "all.exr"), separate_channels=True).channels()

        def layer_of(kind, planes=planes):
            return np.stack([planes[f"{layer.name}.{kind}.{c}"].pixels for c in "RGB"], -1)

        write_exr(truth / "image" / name, layer_of("Combined"))
        write_exr(truth / "diffuse_light" / name, layer_of("DiffDir") + layer_of("DiffInd"))
        write_exr(truth / "diffuse_color" / name, layer_of("DiffCol"))
        focal = size[0] / 2 / np.tan(FIELD_OF_VIEW / 2)
        view = Camera(*size, focal, focal, size[0] / 2, size[1] / 2, pose)
        ids = objects_seen(view, object_id, rays).astype(np.float32)
        write_exr(truth / "object_id" / name, ids)
    (truth / "all.exr").unlink()
    image.file_format = "OPEN_EXR"
    light_pose = np.diag([RELIT[1][0], -RELIT[1][0], -1.0, 1.0])
    x0, y0, x1, y1 = room.walk
    light_pose[:3, 3] = (x0 + 0.25 * (x1 - x0), (y0 + y1) / 2, room.size[2] - 0.35)
    (truth / "relight.json").write_text(
        json.dumps(
            {RELIT[0]: {"rectangle_to_world_z_up": light_pose.tolist(), "radiance": list(RELIT[1][1:])}}, indent=1
        )
    )
    light = relight(scene, light_pose, RELIT[1][1:])
    for k, pose in enumerate(held_poses[: max(1, held_out // 3)]):
        shoot(pose, truth / f"relight_{RELIT[0]}" / f"view_{k:03d}.exr")
    bpy.data.objects.remove(light)
    _override(scene)
    scene.cycles.samples, scene.cycles.use_denoising = 16, False
    for k, pose in enumerate(held_poses):
        shoot(pose, truth / "albedo" / f"view_{k:03d}.exr")


def _triangles(room: FurnishedRoom) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The room's vertices (v, 3), triangles (t, 3) and the triangles' objects (t,)."""
    quads = np.concatenate([obj.quads for obj in room.objects])
    first = 4 * np.arange(len(quads))[:, None, None]
    triangles = (first + np.array([[0, 1, 2], [0, 2, 3]])).reshape(-1, 3)
    ids = np.repeat([obj.object_id for obj in room.objects], [2 * len(obj.quads) for obj in room.objects])
    return quads.reshape(-1, 3).astype(np.float32), triangles.astype(np.int32), ids
