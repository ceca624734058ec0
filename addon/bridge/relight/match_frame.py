"""Looking at the scene exactly as a frame of the capture did, with that frame behind or in front of it."""

from pathlib import Path

import bpy
import numpy as np

from ..data.cameras import TURNED, frame_cameras, shows_as_framed, use_camera
from ..data.images import RADIANCE, image_array


def match_frame(
    scene: bpy.types.Scene,
    index: int,
    background: bool = True,
    alpha: float = 1.0,
    front: bool = False,
    capture_folder: str = "",
    size: bool = False,
) -> str:
    """Render and look through a frame's camera.

    Parameters
    ----------
    index : int
        In the capture's order, clamped to the frames that exist.
    background : bool
        Show the frame's picture, as bright as the scene's exposure shows it.
    alpha, front, capture_folder
        Its opacity; in front of the scene, not behind it; where to look for one that was moved.
    size : bool
        Render at the frame's size and with its shape of pixels, too.

    Returns
    -------
    str
        One sentence on what went wrong; '' otherwise.
    """
    cameras = frame_cameras(scene)
    if not cameras:
        return "The scene has no camera of a capture; import a capture or open a result's scene.blend first."
    obj = cameras[min(max(index, 0), len(cameras) - 1)]
    use_camera(scene, obj, size)
    obj.data.show_background_images = background
    message = show_picture(obj, alpha, front, capture_folder) if background else ""
    if not shows_as_framed(scene, obj):
        warning = (
            f"Frame '{obj.name}' ({obj['width']} x {obj['height']} pixels) has another shape than the "
            "picture that is rendered; turn Match Render Size on to render it whole."
        )
        message = " ".join(filter(None, (message, warning)))
    return message


def current(scene: bpy.types.Scene) -> int:
    """Index of the frame whose camera is the scene's; -1 if none is."""
    cameras = frame_cameras(scene)
    return cameras.index(scene.camera) if scene.camera in cameras else -1


def show_picture(obj: bpy.types.Object, alpha: float = 1.0, front: bool = False, capture_folder: str = "") -> str:
    """Show the picture of a frame's camera; returns one sentence where that can't be done, else ''."""
    data = obj.data
    background = data.background_images[0] if data.background_images else None
    if background is None or background.image is None:
        path = picture_path(obj, capture_folder)
        if path is None:
            return (
                f"The picture of frame '{obj.name}' is not where the capture had it; choose the capture's folder "
                "under Capture."
            )
        try:
            image = bpy.data.images.load(str(path), check_existing=True)
        except RuntimeError:
            return f"'{path}' can't be opened as a picture."
        background = background or data.background_images.new()
        background.image = _turned(image, path) if TURNED in obj else image
    if background.image.is_float:
        background.image.colorspace_settings.name = RADIANCE
    # Without this Blender shows it as stored, not under the scene's exposure and view transform.
    background.image.use_view_as_render = True
    background.alpha, background.display_depth, background.frame_method = alpha, "FRONT" if front else "BACK", "STRETCH"
    exposure = float(obj.get("frame_exposure", 1.0))
    if abs(exposure - 1) > 1e-3:
        return f"Frame '{obj.name}' is shown {exposure:.2g} times as bright as the scene: it was exposed like that."
    return ""


def _turned(image: bpy.types.Image, path: Path) -> bpy.types.Image:
    """A copy of a picture of 8 or 16 bits oriented by its EXIF, which Blender ignores; packed into the .blend."""
    name = f"{image.name} turned"
    if name in bpy.data.images:
        return bpy.data.images[name]
    from ...core.io.picture import turn  # not earlier: Blender's start should not wait for the readers of pictures
    from ...core.io.pictures import picture_orientation

    pixels = turn(image_array(image)[::-1], picture_orientation(path))[::-1]
    copy = bpy.data.images.new(name, pixels.shape[1], pixels.shape[0])
    copy.pixels.foreach_set(np.ascontiguousarray(pixels).ravel())
    copy.update()
    copy.pack()
    return copy


def picture_path(obj: bpy.types.Object, capture_folder: str = "") -> Path | None:
    """Where a frame's picture is: its stored path, else the same one in `capture_folder`; None if neither exists."""
    path = Path(str(obj.get("frame_path", "")))
    if not path.name:
        return None
    if path.is_file():
        return path
    parts = path.parts
    candidates = [Path(capture_folder, *parts[-n:]) for n in range(min(len(parts), 4), 0, -1)] if capture_folder else []
    return next((candidate for candidate in candidates if candidate.is_file()), None)
