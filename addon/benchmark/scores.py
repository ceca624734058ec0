"""How far a result is from a capture's truth: for measuring only, nothing in the pipeline reads truth."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path

import bpy
import numpy as np
from mathutils import Matrix

from ..bridge.demo.compare import describe, seen_albedo
from ..bridge.demo.render import build, set_up_cycles
from ..bridge.demo.room import room
from ..bridge.demo.run import VIEW, new_lights, switch_off_the_lamps
from ..bridge.marks import OBJECT_ID
from ..core.brdf.dielectric import DIELECTRIC
from ..core.brdf.emitter import EMITTER
from ..core.brdf.lambertian import LAMBERTIAN
from ..core.brdf.metal import METAL
from ..core.brdf.model import Brdf
from ..core.io.exr import read_exr
from ..core.io.read import read_capture
from ..core.kinds import Workload
from ..core.passes.albedo.albedo import MEASURED
from .truth_views import albedo_psnr

PICTURE: Workload[tuple[int, int]] = (160, 120)
SAMPLES: Workload[int] = 64


@dataclass(frozen=True)
class Scores:
    """None: the capture has no truth for it.

    Attributes
    ----------
    albedo : float or None
        PSNR in dB over held-out views.
    albedo_error : float or None
        Root mean square, of pixels or else of objects' mean Base Colors.
    roughness, specular : float or None
        Mean absolute error over truly glossy objects that were found glossy.
    models : str or None
        'right of all'.
    relight : float or None
        Root mean square in display values, of the demo's room under its new lights.
    """

    albedo: float | None = None
    albedo_error: float | None = None
    roughness: float | None = None
    specular: float | None = None
    models: str | None = None
    relight: float | None = None


def score(capture: Path, result: Path) -> Scores:
    """Compare RESULT/scene.blend with the truth beside a capture; opens other files in this Blender."""
    truth = capture / "truth" / "materials.json"
    if not truth.is_file():
        return Scores()
    objects = {o["id"]: o for o in json.loads(truth.read_text())}
    psnr = albedo_psnr(capture, result) if (capture / "truth" / "transforms.json").is_file() else None
    is_demo = (capture / "truth" / "demo.json").is_file()
    bpy.ops.wm.open_mainfile(filepath=str((result / "scene.blend").absolute()))
    measured = read_exr(result / "coverage.exr").rgb[::-1, :, 2] == MEASURED
    found = {thing[OBJECT_ID]: describe(thing, measured) for thing in bpy.data.objects if OBJECT_ID in thing}
    glossy = [(found[i], o) for i, o in objects.items()
              if i in found and o["alpha"] is not None and found[i]["roughness"] is not None]  # fmt: skip
    rough = [abs(f["roughness"] - o["alpha"] ** 0.5) for f, o in glossy]
    f0 = [abs(f["f0"] - o["f0"]) for f, o in glossy if f["f0"] is not None]
    right = sum(f["model"] == _true_model(objects[i]).name for i, f in found.items() if i in objects)
    error = 10 ** (-psnr / 20) if psnr is not None else None
    relight = None
    if is_demo:
        colours = seen_albedo(read_capture(capture))
        off = [f["base_color"] - colours[i] for i, f in found.items()
               if f["base_color"] is not None and np.isfinite(colours.get(i, np.nan)).all()]  # fmt: skip
        error = float(np.sqrt(np.mean(np.square(off))))
        ours = _relit(result / "scene.blend", result / "tmp-relit.png")
        relight = float(np.sqrt(np.mean((ours - _relit(None, result / "tmp-relit.png")) ** 2)))
    return Scores(
        psnr, error, float(np.mean(rough)) if rough else None, float(np.mean(f0)) if f0 else None,
        f"{right} of {len(found)}", relight,
    )  # fmt: skip


def _true_model(known: dict) -> Brdf:
    """The model that would be right for an object."""
    if known["emission"]:
        return EMITTER
    if known["metallic"]:
        return METAL
    return DIELECTRIC if known["alpha"] is not None else LAMBERTIAN


def _relit(blend: Path | None, path: Path) -> np.ndarray:
    """The demo's view with its lamps off and two new lights, in display values (h, w, 3); None: the true room."""
    if blend is None:
        bpy.ops.wm.read_factory_settings(use_empty=True)
        for thing in room():
            if not any(paint.emission for paint in thing.paints):
                bpy.context.scene.collection.objects.link(build(thing))
    else:
        bpy.ops.wm.open_mainfile(filepath=str(blend.absolute()))
        switch_off_the_lamps(bpy.context.scene)
    scene = bpy.context.scene
    set_up_cycles(scene, PICTURE, SAMPLES)
    scene.world = None
    scene.view_settings.view_transform = "Standard"
    scene.render.image_settings.file_format = "PNG"
    camera = bpy.data.objects.new("score", bpy.data.cameras.new("score"))
    camera.data.angle, camera.data.clip_start = np.radians(80), 0.01
    camera.matrix_world = Matrix(VIEW.tolist())
    scene.collection.objects.link(camera)
    scene.camera = camera
    new_lights(scene)
    scene.render.filepath = str(path.absolute())
    bpy.ops.render.render(write_still=True)
    image = bpy.data.images.load(str(path.absolute()))
    pixels = np.empty(len(image.pixels), np.float32)
    image.pixels.foreach_get(pixels)
    bpy.data.images.remove(image)
    return pixels.reshape(PICTURE[1], PICTURE[0], -1)[..., :3]
