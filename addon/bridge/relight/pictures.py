"""Pictures of a scene as files: rendered completely or not at all, two side by side, every setting restored."""

import errno
import os
import tempfile
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

import bpy
import numpy as np

from ...core.atomic import replacing
from ...core.errors import BadInputError, InterruptedRun
from ...core.luminance import LUMINANCE
from ...core.progress import Progress
from ..data.images import image_array
from ..refused import refused

FORMATS = {".png": ("PNG", "8"), ".exr": ("OPEN_EXR", "32"), ".jpg": ("JPEG", "8"), ".jpeg": ("JPEG", "8")}
"""By ending: Blender's name of the format and its depth."""
CYCLES, EEVEE = "CYCLES", "EEVEE"
_SLOT_NAME = "Scan Relight"
"""Name of the slot of Blender's Render Result for pictures that are only measured."""
_SMALL_WIDTH = 64
"""Their width in pixels."""
_RENDER = (
    "engine filepath resolution_x resolution_y resolution_percentage pixel_aspect_x pixel_aspect_y film_transparent "
    "use_border use_file_extension use_compositing use_sequencer use_overwrite use_placeholder"
).split()
_IMAGE = ("media_type", "file_format", "color_mode", "color_depth", "color_management")
_CYCLES = ("samples", "use_denoising", "use_adaptive_sampling", "device")
_VIEW = ("view_transform", "look", "exposure", "gamma", "use_curve_mapping")


def check_format(path: Path | str) -> str:
    """The ending of a picture's name, in lower case; raises `BadInputError` where we can't write that format."""
    ending = Path(path).suffix.lower()
    if ending not in FORMATS:
        raise BadInputError(f"Picture '{path}' has to end in .png, .exr or .jpg.")
    return ending


@contextmanager
def settings_kept(scene: bpy.types.Scene) -> Iterator[None]:
    """Restore a scene's render settings, camera and image format afterwards, whatever happens."""
    groups = [(scene.render, _RENDER), (scene.render.image_settings, _IMAGE), (scene.view_settings, _VIEW)]
    groups += [(getattr(scene, "cycles", None), _CYCLES), (scene.eevee, ["taa_render_samples"]), (scene, ["camera"])]
    saved = [(group, name, getattr(group, name)) for group, names in groups for name in names if hasattr(group, name)]
    try:
        yield
    finally:
        for group, name, value in saved:
            setattr(group, name, value)


@contextmanager
def result_kept() -> Iterator[None]:
    """Within: renders go into a slot of their own, so that the artist's Render Result stays."""
    slots, active_index = _render_slots(), 0
    if slots is not None:
        active_index = slots.active_index
        if _SLOT_NAME not in [slot.name for slot in slots]:
            slots.new(name=_SLOT_NAME)
        slots.active_index = [slot.name for slot in slots].index(_SLOT_NAME)
    try:
        yield
    finally:
        slots = _render_slots()
        if slots is not None and active_index < len(slots):
            slots.active_index = active_index


def _render_slots():
    """The slots of the Render Result; None before anything was rendered."""
    image = next((item for item in bpy.data.images if item.type == "RENDER_RESULT"), None)
    return image.render_slots if image is not None else None


def prepare(scene: bpy.types.Scene, engine: str = CYCLES, samples: int = 0, percentage: int = 0) -> None:
    """Set a scene up for a picture, within `settings_kept`.

    Parameters
    ----------
    engine : str
        `CYCLES` or `EEVEE`.
    samples, percentage : int
        For each pixel; of the size. 0: the scene's.
    """
    render = scene.render
    eevee = "BLENDER_EEVEE_NEXT" if bpy.app.version < (5, 0) else "BLENDER_EEVEE"
    render.engine = eevee if engine == EEVEE else engine
    render.use_border = render.use_sequencer = False
    if percentage:
        render.resolution_percentage = percentage
    if samples and engine == CYCLES:
        scene.cycles.samples = samples
    elif samples:
        scene.eevee.taa_render_samples = samples
    if engine == CYCLES and scene.cycles.use_denoising and not can_denoise():
        scene.cycles.use_denoising = False  # else Blender 4.x raises


def can_denoise() -> bool:
    """Whether this Blender was built with OpenImageDenoise; some distributions' are not."""
    import _cycles

    return bool(getattr(_cycles, "with_openimagedenoise", False))


def render_to_file(scene: bpy.types.Scene, path: Path | str) -> None:
    """Render to a file: PNG and JPEG as the scene shows it, EXR linear; raises `StorageError`."""
    path = Path(path)
    kind, depth = FORMATS[check_format(path)]
    image = scene.render.image_settings
    if hasattr(image, "media_type"):  # Blender 5.0 sorts formats by it
        image.media_type = "IMAGE"
    image.file_format, image.color_mode, image.color_depth = kind, "RGB", depth
    scene.render.use_file_extension = False
    with saving(path) as temporary:
        scene.render.filepath = str(temporary.absolute())
        bpy.ops.render.render(write_still=True, scene=scene.name)
        if "EEVEE" in scene.render.engine and _is_black(temporary):
            raise BadInputError(
                "EEVEE gave a black picture: it needs a graphics card, which Blender has none of here; take Cycles."
            )


def small_median(scene: bpy.types.Scene, engine: str = CYCLES, samples: int = 16) -> float:
    """Median luminance of a small picture through the scene's camera, linear; the scene's settings stay."""
    from ...core.io.exr import read_exr  # not earlier: Blender's start should not wait for OpenEXR

    with tempfile.TemporaryDirectory(prefix="scan_relight_") as folder, result_kept(), settings_kept(scene):
        prepare(scene, engine, samples)
        render = scene.render
        render.resolution_y = max(round(_SMALL_WIDTH * render.resolution_y / render.resolution_x), 8)
        render.resolution_x, render.resolution_percentage = _SMALL_WIDTH, 100
        if engine == CYCLES:
            scene.cycles.use_denoising = False
        render_to_file(scene, Path(folder) / "small.exr")
        return float(np.median(read_exr(Path(folder) / "small.exr").rgb @ LUMINANCE))


def seconds_expected(scene: bpy.types.Scene) -> float:
    """About how long a picture will take, from two of few samples; 0 where that is not worth measuring.

    Blender tells Python nothing while it renders: its handler of render statistics waits for Python, which waits for
    the render, and what Cycles writes of its samples is next to nothing without a window.
    """
    if scene.render.engine != CYCLES or scene.cycles.samples < 32:
        return 0.0
    samples, denoising = scene.cycles.samples, scene.cycles.use_denoising
    few_samples, seconds = max(samples // 16, 4), []
    try:
        scene.cycles.use_denoising = False
        for count in (few_samples, 1):  # the first render also loads the device's kernels
            scene.cycles.samples = count
            start = time.monotonic()
            bpy.ops.render.render(write_still=False, scene=scene.name)
            seconds.append(time.monotonic() - start)
    finally:
        scene.cycles.samples, scene.cycles.use_denoising = samples, denoising
    return seconds[1] + (samples - 1) * max(seconds[0] - seconds[1], 0.0) / (few_samples - 1)


def render_stage(
    scene: bpy.types.Scene, path: Path, progress: Progress, stage: str, expected: float | None = None
) -> float:
    """Render to a file as a stage that takes about `expected` seconds, by default measured; returns its seconds."""
    progress.stage(stage)
    expected = seconds_expected(scene) if expected is None else expected
    start = time.monotonic()
    with _timed_progress(progress, expected):
        render_to_file(scene, path)
    seconds = time.monotonic() - start
    progress.done()
    return seconds


@contextmanager
def _timed_progress(progress: Progress, expected: float) -> Iterator[None]:
    """While a picture is rendered within, report progress by the clock; `expected` seconds, 0: no reports."""
    finished, start = threading.Event(), time.monotonic()

    def report() -> None:
        with suppress(InterruptedRun):  # a request to stop is handled by the caller, after the render
            while not finished.wait(0.25):
                progress.update(min((time.monotonic() - start) / expected, 0.97))

    thread = threading.Thread(target=report, name="scan relight picture", daemon=True)
    if expected > 0:
        thread.start()
    try:
        yield
    finally:
        finished.set()
        if expected > 0:
            thread.join()


def _is_black(path: Path) -> bool:
    """Whether a picture holds nothing but zeros; EEVEE without a graphics card renders that without an error."""
    if not path.exists():
        return False
    image = bpy.data.images.load(str(path.absolute()))
    try:
        return not image_array(image)[..., :3].any()
    finally:
        bpy.data.images.remove(image)


@contextmanager
def saving(path: Path) -> Iterator[Path]:
    """A temporary file beside `path` that Blender saves a picture to, moved over it; one sentence where that fails."""
    with refused(f"'{path}' can't be written", "free some space or choose another result folder"):
        path.parent.mkdir(parents=True, exist_ok=True)
        with replacing(path) as temporary:
            temporary.touch()  # a folder that can't be written fails before the picture is rendered, with its name
            yield temporary
            content = temporary.read_bytes() if temporary.exists() else b""
            complete = content[-8:-4] == b"IEND" if path.suffix.lower() == ".png" else len(content) > 100
            if not complete:  # Blender does not always notice a full disk
                raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))


def save_side_by_side(left: Path, right: Path, out: Path) -> None:
    """Join two pictures of one size side by side; `out` has their file name extension."""
    inputs = [bpy.data.images.load(str(Path(path).absolute())) for path in (left, right)]
    pixels = [image_array(item) for item in inputs]
    gap = np.ones((pixels[0].shape[0], max(pixels[0].shape[1] // 80, 1), 4), np.float32)
    joined = np.concatenate([pixels[0], gap, pixels[1]], 1)
    joined[..., 3] = 1.0
    kind = FORMATS[check_format(out)][0]
    image = bpy.data.images.new("before_after", joined.shape[1], joined.shape[0], float_buffer=kind == "OPEN_EXR")
    try:
        image.pixels.foreach_set(joined.ravel())
        with saving(Path(out)) as temporary:
            image.filepath_raw, image.file_format = str(temporary.absolute()), kind
            image.save()
    finally:
        bpy.data.batch_remove([*inputs, image])
