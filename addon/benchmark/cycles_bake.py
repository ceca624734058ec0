"""Irradiance baked by Cycles: the tool that a Blender user would pick instead. Works in the open scene."""

from __future__ import annotations

import time

import bpy
import numpy as np

from ..core.parallel import thread_count
from .lit_rooms import LitRoom


def _emission_image(room: LitRoom, name: str) -> bpy.types.Image:
    """L_d over the atlas as a float image."""
    size = room.atlas.size
    image = bpy.data.images.new(name, size, size, alpha=False, float_buffer=True, is_data=True)
    pixels = np.ones((size, size, 4), np.float32)
    pixels[..., :3] = room.atlas.image(room.field.radiance)
    image.pixels.foreach_set(pixels.ravel())
    return image


def _material(image: bpy.types.Image, target: bpy.types.Image) -> bpy.types.Material:
    """A white diffuse surface that also emits the image; `target` is the active image, which is baked to."""
    material = bpy.data.materials.new("benchmark")
    material.use_nodes = True
    nodes, links = material.node_tree.nodes, material.node_tree.links
    nodes.clear()
    shown = nodes.new("ShaderNodeTexImage")
    shown.image, shown.interpolation = image, "Closest"
    emission, diffuse = nodes.new("ShaderNodeEmission"), nodes.new("ShaderNodeBsdfDiffuse")
    diffuse.inputs["Color"].default_value = (1, 1, 1, 1)
    both, output = nodes.new("ShaderNodeAddShader"), nodes.new("ShaderNodeOutputMaterial")
    links.new(shown.outputs["Color"], emission.inputs["Color"])
    links.new(emission.outputs[0], both.inputs[0])
    links.new(diffuse.outputs[0], both.inputs[1])
    links.new(both.outputs[0], output.inputs["Surface"])
    baked = nodes.new("ShaderNodeTexImage")
    baked.image = target
    nodes.active = baked
    return material


def _world(room: LitRoom) -> bpy.types.World:
    """The room's environment as the world; mapped as `core.light.environment` says."""
    radiance = room.field.environment.radiance
    height, width = radiance.shape[:2]
    image = bpy.data.images.new("benchmark sky", width, height, alpha=False, float_buffer=True, is_data=True)
    pixels = np.ones((height, width, 4), np.float32)
    pixels[..., :3] = radiance
    image.pixels.foreach_set(pixels.ravel())
    world = bpy.data.worlds.new("benchmark")
    world.use_nodes = True
    nodes, links = world.node_tree.nodes, world.node_tree.links
    texture = nodes.new("ShaderNodeTexEnvironment")
    texture.image, texture.interpolation = image, "Closest"
    links.new(texture.outputs["Color"], nodes["Background"].inputs["Color"])
    return world


def bake(room: LitRoom, samples: int, threads: int, seed: int) -> tuple[np.ndarray, float]:
    """E of every element baked by Cycles on the processor, (n, 3) float32, and the seconds that the bake took."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene, mesh, atlas = bpy.context.scene, room.field.mesh, room.atlas
    scene.render.engine = "CYCLES"
    scene.cycles.device, scene.cycles.samples, scene.cycles.seed = "CPU", samples, seed
    scene.cycles.use_adaptive_sampling = scene.cycles.use_denoising = False
    scene.cycles.max_bounces = 0
    scene.render.threads_mode, scene.render.threads = "FIXED", thread_count(threads)
    scene.world = _world(room)
    data = bpy.data.meshes.new("room")
    data.from_pydata(mesh.vertices.tolist(), [], mesh.triangles.tolist())
    data.uv_layers.new(name="atlas").uv.foreach_set("vector", atlas.uv.ravel())
    thing = bpy.data.objects.new("room", data)
    scene.collection.objects.link(thing)
    target = bpy.data.images.new("baked", atlas.size, atlas.size, alpha=False, float_buffer=True, is_data=True)
    data.materials.append(_material(_emission_image(room, "L_d"), target))
    bpy.context.view_layer.objects.active = thing
    thing.select_set(True)
    started = time.perf_counter()
    bpy.ops.object.bake(type="DIFFUSE", pass_filter={"DIRECT"}, margin=0, use_clear=True)
    seconds = time.perf_counter() - started
    pixels = np.empty(4 * atlas.size**2, np.float32)
    target.pixels.foreach_get(pixels)
    return np.pi * pixels.reshape(-1, 4)[atlas.texel, :3], seconds
