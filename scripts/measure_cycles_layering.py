"""Measure how much light Cycles' Principled node reflects, diffusely and specularly, in a white furnace.

    python scripts/measure_cycles_layering.py OUT.npz [--samples N]

An orthographic view of a sphere averages over view directions with the cosine as weight, so the mean over its disc is
the bihemispherical reflectance. Written are ``phi`` (p,), ``psi`` (s,), ``specular`` (s, p): the lobe alone, and
``diffuse`` (s, p): what is left of a white diffuse under it. Printed are the rows
of the table in addon/core/brdf/compensation.py. Needs pip's bpy.
"""

import argparse
import os
import sys
import tempfile
from pathlib import Path

os.environ.setdefault("BLENDER_USER_EXTENSIONS", tempfile.mkdtemp())
sys.path.insert(0, str(Path(__file__).resolve().parent.parent))
import bpy
import numpy as np

from addon.bridge.data.materials import make_material, principled
from addon.bridge.data.nodes import find_node, make_world
from addon.core.brdf.dielectric import DIELECTRIC
from addon.core.brdf.material import ObjectMaterial

PHI = np.linspace(0.1, 1.0, 10) ** 2
PSI = np.array([0.0025, 0.01, 0.02, 0.04, 0.08, 0.15, 0.25, 0.4, 0.6, 0.9])


def furnace(samples):
    """An empty scene with a sphere before an orthographic camera in white light; gives the sphere."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=6)
    sphere = bpy.context.object
    scene.world = make_world("white", None, 1.0)
    find_node(scene.world, "BACKGROUND").inputs["Color"].default_value = (1, 1, 1, 1)
    camera = bpy.data.cameras.new("camera")
    camera.type, camera.ortho_scale = "ORTHO", 2.1
    scene.camera = bpy.data.objects.new("camera", camera)
    scene.camera.location = 0, 0, 3
    scene.collection.objects.link(scene.camera)
    render = scene.render
    render.engine, render.film_transparent = "CYCLES", True
    render.resolution_x = render.resolution_y = 24
    render.image_settings.file_format, render.image_settings.color_mode = "OPEN_EXR", "RGBA"
    render.image_settings.color_depth = "32"
    scene.cycles.samples, scene.cycles.use_adaptive_sampling, scene.cycles.use_denoising = samples, False, False
    scene.cycles.sample_clamp_indirect, scene.cycles.blur_glossy = 0, 0
    return sphere


def reflectance(sphere, phi, psi, base):
    """Mean over the sphere's disc."""
    material = make_material(ObjectMaterial(0, "sphere", DIELECTRIC, alpha=float(phi), f0=float(psi)))
    principled(material).inputs["Base Color"].default_value = (base, base, base, 1)
    sphere.data.materials.clear()
    sphere.data.materials.append(material)
    with tempfile.TemporaryDirectory() as folder:
        scene = bpy.context.scene
        scene.render.filepath = os.path.join(folder, "out.exr")
        bpy.ops.render.render(write_still=True)
        image = bpy.data.images.load(scene.render.filepath)
        pixels = np.array(image.pixels[:]).reshape(-1, 4)
        bpy.data.images.remove(image)
    return pixels[:, :3].mean(1).sum() / pixels[:, 3].sum()


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("out")
    parser.add_argument("--samples", type=int, default=256)
    arguments = parser.parse_args()
    sphere = furnace(arguments.samples)
    black, white = (np.array([[reflectance(sphere, p, s, b) for p in PHI] for s in PSI]) for b in (0, 1))
    np.savez(arguments.out, phi=PHI, psi=PSI, specular=black, diffuse=white - black)
    # The rows of `core.brdf.compensation`: the share of 1 - psi that the layer takes beyond psi.
    for row in (1 - (white - black) - PSI[:, None]) / (1 - PSI[:, None]):
        print("    (" + ", ".join(f"{x:.4f}" for x in row) + "),")


if __name__ == "__main__":
    main()
