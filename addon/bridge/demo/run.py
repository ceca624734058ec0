"""The demo: a room whose truth is known is rendered, recovered, compared and lit anew."""

from collections.abc import Callable
from pathlib import Path

import bpy
import numpy as np
from mathutils import Matrix

from ...core.atomic import write_bytes
from ...core.io.folder import SCENE
from ...core.kinds import Workload
from ...core.pipeline.run import WEIGHTS
from ...core.progress import Progress, ProgressEvent
from ...core.results.store import Store
from ...core.settings import Settings
from ..job.run import run
from ..light import outside
from ..light.lamps import find_lamps, set_on
from ..relight.pictures import can_denoise, render_to_file, save_side_by_side
from .compare import comparison
from .render import is_rendered, render_capture
from .room import look_at

PICTURES = {"tiny": (96, 72, 16), "small": (480, 360, 32), "large": (960, 720, 128)}
"""Width, height and samples of the before and the relit picture."""
VIEW = look_at((0.42, 0.35, 1.62), (2.75, 2.5, 0.72))
LIGHTS: Workload[tuple[tuple, ...]] = (
    ((2.9, 0.7, 2.3), (1.9, 2.9, 0.2), (1.0, 0.42, 0.14), 75.0),
    ((0.4, 2.3, 2.0), (3.0, 1.6, 0.4), (0.16, 0.36, 1.0), 60.0),
)
"""Of the relit picture: where, where to, colour, watts."""


def run_demo(
    out: Path | str,
    size: str,
    settings: Settings,
    listener: Callable[[ProgressEvent], None] | None = None,
    should_stop: Callable[[], bool] | None = None,
) -> str:
    """Render the known room into OUT/capture, recover it into OUT, and compare.

    `size` is one of `demo.render.SIZES`; for `listener` and `should_stop` see `Progress`. Returns the table of
    recovered against true values, which OUT/comparison.txt holds too.
    """
    out = Path(out)
    Store(out).close()  # a folder that can't be written is reported now, not after the rendering
    progress = Progress(listener, should_stop, {"render": 60, **WEIGHTS, "pictures": 30})
    capture = out / "capture"
    stored = is_rendered(capture, size)
    progress.stage("render")
    render_capture(capture, size, progress)
    progress.done(stored)
    run(capture, out, settings, progress)
    progress.stage("pictures")
    bpy.ops.wm.open_mainfile(filepath=str((out / SCENE).absolute()))
    table = comparison(capture, out)
    write_bytes(out / "comparison.txt", f"{table}\n".encode())
    pictures(out, size, progress)
    progress.done()
    return table


def pictures(out: Path, size: str, progress: Progress) -> None:
    """Render the open scene as found and under new lights: before.png, relit.png, before_after.png."""
    scene = bpy.context.scene
    width, height, samples = PICTURES[size]
    scene.render.engine, scene.cycles.device, scene.cycles.samples = "CYCLES", "CPU", samples
    scene.cycles.use_denoising, scene.cycles.use_light_tree = can_denoise(), False
    scene.render.resolution_x, scene.render.resolution_y, scene.render.resolution_percentage = width, height, 100
    scene.render.pixel_aspect_x = scene.render.pixel_aspect_y = 1
    scene.view_settings.view_transform = "Standard"
    camera = bpy.data.objects.new("Demo view", bpy.data.cameras.new("Demo view"))
    camera.data.angle, camera.data.clip_start = np.radians(80), 0.01
    camera.matrix_world = Matrix(VIEW.tolist())
    scene.collection.objects.link(camera)
    scene.camera = camera
    render_to_file(scene, out / "before.png")
    progress.update(0.5)
    for lamp in find_lamps(scene):
        set_on(lamp, False)
    outside.set_on(scene.world, False)
    for location, target, tint, power in LIGHTS:
        light = bpy.data.lights.new("Demo light", "AREA")
        light.color, light.energy, light.size = tint, power, 0.5
        obj = bpy.data.objects.new("Demo light", light)
        obj.matrix_world = Matrix(look_at(location, target).tolist())
        scene.collection.objects.link(obj)
    render_to_file(scene, out / "relit.png")
    save_side_by_side(out / "before.png", out / "relit.png", out / "before_after.png")
