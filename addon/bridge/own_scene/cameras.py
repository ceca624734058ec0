"""The open scene's cameras as the frames of a capture: the inverse of `cameras.py`, exact to a thousandth of a pixel.

Blender stores a focal length in millimetres and a sensor size, and which side of the picture the sensor spans depends
on the picture's shape; a capture stores pixels. The background image of a camera is the picture that it took.
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
from ..data.cameras import stored_lens

PROPERTIES = (("frame_exposure", "exposure"), ("exposure", "exposure"), ("saturation", "saturation"))
"""Custom properties of a camera and the fields of its frame that they set; `make_cameras` writes the first."""
AUTO, ANIMATION, OBJECTS = "AUTO", "ANIMATION", "OBJECTS"
_DIGITS = re.compile(r"(\d+)(?!.*\d)")


@dataclass(frozen=True)
class View:
    """A camera at one frame of the animation, and the picture that it took.

    Attributes
    ----------
    camera : Camera
        In the pixels of the picture; its pose in Blender's units.
    properties : dict of str to float
        `exposure` and `saturation`, where the camera has the custom `PROPERTIES`; see `core.scene.model.Frame`.
    """

    name: str
    camera: Camera
    path: Path
    properties: dict[str, float]


def pixel_lens(data: bpy.types.Camera, width: float, height: float, aspect: float) -> tuple[float, ...]:
    """Focal lengths and principal point (fx, fy, cx, cy) in pixels of a picture of `width` x `height`.

    Parameters
    ----------
    data : bpy.types.Camera
        A perspective camera.
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


def frame_size(scene: bpy.types.Scene, obj: bpy.types.Object) -> tuple[float, float, float]:
    """Width, height and pixel aspect of a camera's frame: its own where `make_cameras` stored them, or the scene's."""
    if all(key in obj for key in ("width", "height", "pixel_aspect")):
        return float(obj["width"]), float(obj["height"]), float(obj["pixel_aspect"])
    render = scene.render
    return (float(render.resolution_x), float(render.resolution_y), render.pixel_aspect_y / render.pixel_aspect_x)


def camera_of(
    obj: bpy.types.Object, size: tuple[int, int], dimensions: tuple[float, float, float], method: str = "STRETCH"
) -> Camera:
    """The capture's camera for a picture of `size` that a camera of Blender's has as its background.

    Parameters
    ----------
    obj : bpy.types.Object
        A camera, evaluated where it is animated.
    size, dimensions
        Width and height of the picture in pixels; see `frame_size`.
    method : str
        How the background fills the camera's frame: 'STRETCH', 'FIT' or 'CROP'.

    Raises
    ------
    BadInputError
        The camera is neither a perspective one nor one of `make_cameras`, or its pose is not rigid.
    """
    data = obj.data
    stored = stored_lens(obj)
    if data.type != "PERSP" and (stored is None or data.type != "PANO"):
        raise BadInputError(f"Camera '{obj.name}' is {data.type.lower()}; frames need perspective cameras.")
    width, height, aspect = dimensions
    fx, fy, cx, cy = pixel_lens(data, width, height, aspect)
    lens = None
    # A perspective that was changed since is not the one that the lens was stored for.
    if stored is not None and (data.type == "PANO" or np.allclose(stored[1], (fx, fy, cx, cy), rtol=1e-3, atol=0.1)):
        lens, (fx, fy, cx, cy) = stored
    # Pixels of the frame for each pixel of the picture, centre on centre.
    scale_x, scale_y = width / size[0], height / size[1]
    if method != "STRETCH":
        scale_x = scale_y = (min if method == "FIT" else max)(scale_x, scale_y)
    matrix = np.array(obj.matrix_world.normalized(), np.float64)
    if not np.isfinite(matrix).all() or abs(abs(np.linalg.det(matrix[:3, :3])) - 1) > 1e-3:
        raise BadInputError(f"Camera '{obj.name}' is sheared or has no size; apply its scale.")
    if np.linalg.det(matrix[:3, :3]) < 0:
        raise BadInputError(f"Camera '{obj.name}' is mirrored; apply its scale.")
    cx, cy = size[0] / 2 + (cx - width / 2) / scale_x, size[1] / 2 + (cy - height / 2) / scale_y
    return Camera(*size, fx / scale_x, fy / scale_y, cx, cy, matrix, lens)


def cameras_with_pictures(scene: bpy.types.Scene, among: Iterable[bpy.types.Object] = ()) -> list[bpy.types.Object]:
    """The cameras of `among` (of the scene, where there is none) that have a background image, sorted by name."""
    cameras = [obj for obj in among if obj.type == "CAMERA"] or scene.objects
    with_background = (obj for obj in cameras if obj.type == "CAMERA" and background(obj.data))
    return sorted(with_background, key=lambda obj: obj.name)


def background(data: bpy.types.Camera) -> bpy.types.CameraBackgroundImage | None:
    """The first background image that has a picture."""
    items = data.background_images
    return next((item for item in items if (item.image if item.source == "IMAGE" else item.clip)), None)


def views(
    scene: bpy.types.Scene,
    depsgraph: bpy.types.Depsgraph,
    cameras: list[bpy.types.Object],
    problems: list[str],
    mode: str = AUTO,
    first: int | None = None,
    last: int | None = None,
    step: int = 1,
) -> Iterator[View]:
    """Every picture with the camera that took it.

    Parameters
    ----------
    scene : bpy.types.Scene
        With `ANIMATION` its frame is changed; the caller sets it back.
    cameras : list of bpy.types.Object
        See `cameras_with_pictures`.
    problems : list of str
        Gets one sentence for each picture that can't be used.
    mode : str
        `OBJECTS`: one frame for each camera. `ANIMATION`: one for each frame of the scene's animation, through the
        active camera, or the only one. `AUTO`: an animation where the only camera has a sequence or a clip behind it.
    first, last, step : int, optional
        Frames of the animation; the scene's where left out.
    """
    if mode == AUTO:
        background_image = background(cameras[0].data)
        animated = background_image.source == "MOVIE_CLIP" or background_image.image.source in ("SEQUENCE", "MOVIE")
        mode = ANIMATION if len(cameras) == 1 and animated else OBJECTS
    frames: Iterable[int | None] = (None,)
    if mode == ANIMATION:
        cameras = [scene.camera] if scene.camera in cameras else cameras[:1]
        start, end = scene.frame_start if first is None else first, scene.frame_end if last is None else last
        frames = range(start, end + 1, max(step, 1))
    used_names: set[str] = set()
    for frame in frames:
        if frame is not None:
            scene.frame_set(frame)
        for obj in cameras:
            base = re.sub(r"[^\w.-]+", "_", obj.name).strip("._") or "camera"  # in a file's name on every system
            name = base + ("" if frame is None else f"_{frame:04d}")
            while name.lower() in used_names:
                name += "_"
            try:
                view = _view(scene, depsgraph, obj, scene.frame_current, name)
            except BadInputError as error:
                problems.append(str(error))
                continue
            used_names.add(name.lower())
            yield view


def _view(scene, depsgraph, obj, frame, name) -> View:
    background_image = background(obj.data)
    displacement = abs(background_image.scale - 1), *map(abs, background_image.offset), abs(background_image.rotation)
    if max(displacement) > 1e-6 or background_image.use_flip_x or background_image.use_flip_y:
        raise BadInputError(f"The background of camera '{obj.name}' is moved, scaled, turned or flipped; reset it.")
    path, evaluated = picture(background_image, frame, obj.name), obj.evaluated_get(depsgraph)
    camera = camera_of(evaluated, read_header(path), frame_size(scene, obj), background_image.frame_method)
    return View(name, camera, path, {field: float(obj[key]) for key, field in PROPERTIES if key in obj})


def picture(background_image: bpy.types.CameraBackgroundImage, frame: int, owner: str) -> Path:
    """The file that a background shows at frame `frame`; raises `BadInputError` where there is none that is EXR.

    Numbers of sequences follow `BKE_image_user_frame_get` and `get_sequence_fname` in Blender's source.
    """
    clip = background_image.source == "MOVIE_CLIP"
    source = background_image.clip if clip else background_image.image
    path = Path(bpy.path.abspath(source.filepath, library=source.library))
    if source.source == "SEQUENCE":
        if clip:
            first = _DIGITS.search(path.stem)
            frame += (int(first[1]) if first else 0) - source.frame_start + source.frame_offset
        else:
            user = background_image.image_user
            count, frame = user.frame_duration, frame - user.frame_start + 1
            if user.use_cyclic and count:
                frame = (frame - 1) % count + 1
            if count and not 1 <= frame <= count:
                raise BadInputError(f"Camera '{owner}' has no picture at frame {frame + user.frame_start - 1}.")
            frame += user.frame_offset
        path = path.with_stem(_DIGITS.sub(lambda digits: f"{frame:0{len(digits[1])}d}", path.stem, count=1))
    elif source.source == "FILE" and source.packed_file and not path.is_file():
        raise BadInputError(
            f"The picture behind camera '{owner}' is packed into the file; unpack it (File, External Data) so that it "
            "can be read."
        )
    elif source.source == "MOVIE":
        raise BadInputError(
            f"Camera '{owner}' has the film '{path.name}' behind it; materials need linear radiance: "
            "give a sequence of EXR pictures."
        )
    if path.suffix.lower() != ".exr":
        raise BadInputError(
            f"Camera '{owner}' has the picture '{path.name or source.name}' behind it, which is no EXR; materials need "
            "linear radiance."
        )
    if not path.is_file():
        raise BadInputError(
            f"The picture '{path}' behind camera '{owner}' is missing; find it again (File, External Data)."
        )
    return path
