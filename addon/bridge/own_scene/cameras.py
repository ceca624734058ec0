"""The open scene's cameras as the frames of a capture: the inverse of `cameras.py`, exact to a thousandth of a pixel.

Blender keeps a lens as millimetres over a sensor, and which side of the picture the sensor spans depends on the
picture; a capture keeps pixels. Backgrounds tell which picture a camera took.
"""

import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

import bpy
import numpy as np

from ...core.errors import BadInputError
from ...core.io.exr import read_header
from ...core.scene.model import Camera
from ..data.cameras import kept_lens

PROPERTIES = (("frame_exposure", "exposure"), ("exposure", "exposure"), ("saturation", "saturation"))
"""Custom properties of a camera and what they say of its frame; `make_cameras` leaves the first."""
AUTO, ANIMATION, OBJECTS = "AUTO", "ANIMATION", "OBJECTS"
_DIGITS = re.compile(r"(\d+)(?!.*\d)")


@dataclass(frozen=True)
class View:
    """A camera at one moment, and the picture that it took.

    Attributes
    ----------
    camera : Camera
        In the pixels of the picture; its pose in Blender's units.
    told : dict of str to float
        `exposure` and `saturation`, where the camera's `PROPERTIES` say them; see `core.scene.model.Frame`.
    """

    name: str
    camera: Camera
    path: Path
    told: dict[str, float]


def pixel_lens(data: bpy.types.Camera, width: float, height: float, aspect: float = 1.0) -> tuple[float, ...]:
    """Focal lengths and principal point (fx, fy, cx, cy) in pixels of a picture.

    Parameters
    ----------
    data : bpy.types.Camera
        A perspective camera.
    width, height : float
        Of the picture, in pixels.
    aspect : float
        Height of a pixel over its width.

    Notes
    -----
    As `BKE_camera_params_compute_viewplane` in Blender's source: the sensor spans the longer side where its fit is
    automatic, lengths count in widths of a pixel, and shifts in what the sensor spans.
    """
    fit = data.sensor_fit
    if fit == "AUTO":
        fit = "HORIZONTAL" if width >= aspect * height else "VERTICAL"
    span = width if fit == "HORIZONTAL" else aspect * height
    sensor = data.sensor_height if data.sensor_fit == "VERTICAL" else data.sensor_width
    fx = data.lens / sensor * span
    return fx, fx / aspect, width / 2 - data.shift_x * span, height / 2 + data.shift_y * span / aspect


def frame_size(scene: bpy.types.Scene, thing: bpy.types.Object) -> tuple[float, float, float]:
    """Width, height and pixel aspect of what a camera shows: its own where `make_cameras` left them, or the scene's."""
    if all(key in thing for key in ("width", "height", "pixel_aspect")):
        return float(thing["width"]), float(thing["height"]), float(thing["pixel_aspect"])
    render = scene.render
    return (float(render.resolution_x), float(render.resolution_y), render.pixel_aspect_y / render.pixel_aspect_x)


def camera_of(
    thing: bpy.types.Object, size: tuple[int, int], shown: tuple[float, float, float], method: str = "STRETCH"
) -> Camera:
    """What took a picture of `size` that a camera has as its background.

    Parameters
    ----------
    thing : bpy.types.Object
        A camera, evaluated where it is animated.
    size : tuple of int
        Width and height of the picture.
    shown : tuple of float
        See `frame_size`.
    method : str
        How the background fills the camera's frame: 'STRETCH', 'FIT' or 'CROP'.

    Raises
    ------
    BadInputError
        The camera is neither a perspective one nor one of `make_cameras`, or has no rigid place.
    """
    data = thing.data
    kept = kept_lens(thing)
    if data.type != "PERSP" and (kept is None or data.type != "PANO"):
        raise BadInputError(f"Camera '{thing.name}' is {data.type.lower()}; frames need perspective cameras.")
    width, height, aspect = shown
    fx, fy, cx, cy = pixel_lens(data, width, height, aspect)
    lens = None
    # A perspective that was changed since is no longer the one that the lens was kept for.
    if kept is not None and (data.type == "PANO" or np.allclose(kept[1], (fx, fy, cx, cy), rtol=1e-3, atol=0.1)):
        lens, (fx, fy, cx, cy) = kept
    # Pixels of the frame for each pixel of the picture, centre on centre.
    across, down = width / size[0], height / size[1]
    if method != "STRETCH":
        across = down = (min if method == "FIT" else max)(across, down)
    matrix = np.array(thing.matrix_world.normalized(), np.float64)
    if not np.isfinite(matrix).all() or abs(abs(np.linalg.det(matrix[:3, :3])) - 1) > 1e-3:
        raise BadInputError(f"Camera '{thing.name}' is sheared or has no size; apply its scale.")
    if np.linalg.det(matrix[:3, :3]) < 0:
        raise BadInputError(f"Camera '{thing.name}' is mirrored; apply its scale.")
    return Camera(
        *size,
        fx / across,
        fy / down,
        size[0] / 2 + (cx - width / 2) / across,
        size[1] / 2 + (cy - height / 2) / down,
        matrix,
        lens,
    )


def cameras_with_pictures(scene: bpy.types.Scene, among: Iterable[bpy.types.Object] = ()) -> list[bpy.types.Object]:
    """The cameras of `among` (of the scene, where there is none) that have a picture behind them, by name."""
    cameras = [thing for thing in among if thing.type == "CAMERA"] or scene.objects
    found = (thing for thing in cameras if thing.type == "CAMERA" and background(thing.data))
    return sorted(found, key=lambda thing: thing.name)


def background(data: bpy.types.Camera) -> bpy.types.CameraBackgroundImage | None:
    """The first background that holds a picture."""
    return next((one for one in data.background_images if (one.image if one.source == "IMAGE" else one.clip)), None)


def views(
    scene: bpy.types.Scene,
    depsgraph: bpy.types.Depsgraph,
    things: list[bpy.types.Object],
    problems: list[str],
    how: str = AUTO,
    first: int | None = None,
    last: int | None = None,
    step: int = 1,
) -> Iterator[View]:
    """Every picture with the camera that took it.

    Parameters
    ----------
    scene : bpy.types.Scene
        With `ANIMATION` its frame is changed; the caller sets it back.
    things : list of bpy.types.Object
        See `cameras_with_pictures`.
    problems : list of str
        Gets one sentence for each picture that can't be used.
    how : str
        `OBJECTS`: one frame for each camera. `ANIMATION`: one for each frame of the scene's animation, through the
        active camera, or the only one. `AUTO`: an animation where the one camera has a sequence or a clip behind it.
    first, last, step : int, optional
        Frames of the animation; the scene's where left out.
    """
    if how == AUTO:
        back = background(things[0].data)
        moving = back.source == "MOVIE_CLIP" or back.image.source in ("SEQUENCE", "MOVIE")
        how = ANIMATION if len(things) == 1 and moving else OBJECTS
    moments: Iterable[int | None] = (None,)
    if how == ANIMATION:
        things = [scene.camera] if scene.camera in things else things[:1]
        moments = range(
            scene.frame_start if first is None else first, (scene.frame_end if last is None else last) + 1, max(step, 1)
        )
    taken: set[str] = set()
    for moment in moments:
        if moment is not None:
            scene.frame_set(moment)
        for thing in things:
            plain = re.sub(r"[^\w.-]+", "_", thing.name).strip("._") or "camera"  # in a file's name on every system
            name = plain + ("" if moment is None else f"_{moment:04d}")
            while name.lower() in taken:
                name += "_"
            try:
                view = _view(scene, depsgraph, thing, scene.frame_current, name)
            except BadInputError as error:
                problems.append(str(error))
                continue
            taken.add(name.lower())
            yield view


def _view(scene, depsgraph, thing, moment, name) -> View:
    back = background(thing.data)
    moved = abs(back.scale - 1), *map(abs, back.offset), abs(back.rotation)
    if max(moved) > 1e-6 or back.use_flip_x or back.use_flip_y:
        raise BadInputError(f"The background of camera '{thing.name}' is moved, scaled, turned or flipped; reset it.")
    path = picture(back, moment, thing.name)
    camera = camera_of(thing.evaluated_get(depsgraph), read_header(path), frame_size(scene, thing), back.frame_method)
    return View(name, camera, path, {told: float(thing[key]) for key, told in PROPERTIES if key in thing})


def picture(back: bpy.types.CameraBackgroundImage, moment: int, owner: str) -> Path:
    """The file that a background shows at frame `moment`; raises `BadInputError` where there is none that is EXR.

    Numbers of sequences follow `BKE_image_user_frame_get` and `get_sequence_fname` in Blender's source.
    """
    clip = back.source == "MOVIE_CLIP"
    shown = back.clip if clip else back.image
    path, problem = Path(bpy.path.abspath(shown.filepath, library=shown.library)), ""
    if shown.source == "SEQUENCE":
        if clip:
            first = _DIGITS.search(path.stem)
            moment += (int(first[1]) if first else 0) - shown.frame_start + shown.frame_offset
        else:
            user = back.image_user
            count, moment = user.frame_duration, moment - user.frame_start + 1
            if user.use_cyclic and count:
                moment = (moment - 1) % count + 1
            if count and not 1 <= moment <= count:
                raise BadInputError(f"Camera '{owner}' has no picture at frame {moment + user.frame_start - 1}.")
            moment += user.frame_offset
        path = path.with_stem(_DIGITS.sub(lambda found: f"{moment:0{len(found[1])}d}", path.stem, count=1))
    elif shown.source == "FILE" and shown.packed_file and not path.is_file():
        problem = (
            f"The picture behind camera '{owner}' is packed into the file; unpack it (File, External Data) so that it "
            "can be read."
        )
    elif shown.source == "MOVIE":
        problem = (
            f"Camera '{owner}' has the film '{path.name}' behind it; materials need linear radiance: "
            "give a sequence of EXR pictures."
        )
    if not problem and path.suffix.lower() != ".exr":
        problem = (
            f"Camera '{owner}' has the picture '{path.name or shown.name}' behind it, which is no EXR; materials need "
            "linear radiance."
        )
    if not problem and not path.is_file():
        problem = f"The picture '{path}' behind camera '{owner}' is missing; find it again (File, External Data)."
    if problem:
        raise BadInputError(problem)
    return path
