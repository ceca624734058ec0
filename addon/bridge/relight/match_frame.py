"""Looking at the scene exactly as a frame of the capture did, with that frame behind or before it."""

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
        In the capture's order, clamped to what there is.
    background : bool
        Lay the frame's picture behind the scene, as bright as the scene's exposure shows it.
    alpha : float
        Opacity of the picture.
    front : bool
        Lay it before the scene instead.
    capture_folder : str
        Where to look for a picture that is no longer where it was.
    size : bool
        Render at the frame's size and with its shape of pixels, too.

    Returns
    -------
    str
        One sentence on what is not as it should be; '' if all is.
    """
    cameras = frame_cameras(scene)
    if not cameras:
        return "The scene has no camera of a capture; import a capture or open a result's scene.blend first."
    thing = cameras[min(max(index, 0), len(cameras) - 1)]
    use_camera(scene, thing, size)
    thing.data.show_background_images = background
    told = show_picture(thing, alpha, front, capture_folder) if background else ""
    if not shows_as_framed(scene, thing):
        other = (
            f"Frame '{thing.name}' ({thing['width']} x {thing['height']} pixels) has another shape than the "
            "picture that is rendered; turn Match Render Size on to render it whole."
        )
        told = " ".join(filter(None, (told, other)))
    return told


def current(scene: bpy.types.Scene) -> int:
    """Index of the frame whose camera is the scene's; -1 if none is."""
    cameras = frame_cameras(scene)
    return cameras.index(scene.camera) if scene.camera in cameras else -1


def show_picture(thing: bpy.types.Object, alpha: float = 1.0, front: bool = False, capture_folder: str = "") -> str:
    """Show the picture of a frame's camera; returns one sentence where that can't be done, else ''."""
    data = thing.data
    shown = data.background_images[0] if data.background_images else None
    if shown is None or shown.image is None:
        path = picture_path(thing, capture_folder)
        if path is None:
            return (
                f"The picture of frame '{thing.name}' is not where the capture had it; choose the capture's folder "
                "under Capture."
            )
        try:
            image = bpy.data.images.load(str(path), check_existing=True)
        except RuntimeError:
            return f"'{path}' can't be opened as a picture."
        shown = shown or data.background_images.new()
        shown.image = _turned(image, path) if TURNED in thing else image
    if shown.image.is_float:
        shown.image.colorspace_settings.name = RADIANCE
    # Without this Blender shows it as stored, not under the exposure and view transform of the scene beside it.
    shown.image.use_view_as_render = True
    shown.alpha, shown.display_depth, shown.frame_method = alpha, "FRONT" if front else "BACK", "STRETCH"
    exposure = float(thing.get("frame_exposure", 1.0))
    if abs(exposure - 1) > 1e-3:
        return f"Frame '{thing.name}' is shown {exposure:.2g} times as bright as the scene: it was exposed like that."
    return ""


def _turned(image: bpy.types.Image, path: Path) -> bpy.types.Image:
    """A copy of a picture of 8 or 16 bits as its EXIF shows it, which Blender does not heed; packed into the .blend."""
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


def picture_path(thing: bpy.types.Object, capture_folder: str = "") -> Path | None:
    """Where a frame's picture is: where it was, else at the same place within `capture_folder`; None if nowhere."""
    path = Path(str(thing.get("frame_path", "")))
    if not path.name:
        return None
    if path.is_file():
        return path
    parts = path.parts
    places = [Path(capture_folder, *parts[-n:]) for n in range(min(len(parts), 4), 0, -1)] if capture_folder else []
    return next((place for place in places if place.is_file()), None)
