"""The capture's cameras in Blender: pinholes exact to a thousandth of a pixel, lenses as near as Blender has them.

Panoramas and fisheyes become panoramic cameras, which Cycles alone renders; lenses that distort a perspective have no
counterpart, and become the perspective without distortion. One more, animated, goes along the capture's track.
"""

import json
from collections.abc import Iterable, Sequence
from pathlib import Path

import bpy
import numpy as np
from mathutils import Matrix

from ...core.kinds import Code, Shown, Unit
from ...core.scene.lens import Lens
from ...core.scene.lens_json import lens_from_json, lens_to_json
from ...core.scene.lenses import Cropped, Equirectangular
from ...core.scene.model import Camera, Frame, Mesh
from ...core.scene.pixel_rays import widest_angle
from ..custom_properties import CAPTURE

LENS = "lens_model"
"""Custom property of cameras with a lens: the lens, fx, fy, cx and cy as JSON, which Blender has no settings for."""
TURNED = "frame_turned"
"""Custom property of a frame's camera whose picture is shown as its EXIF turns it; absent where it is as stored."""
FRAME_INDEX = "frame_index"
"""Custom property of a frame's camera: its place in the capture's order, from 0."""
_SENSOR: Unit[float] = 36.0
_WIDE = np.radians(80)
"""A lens that sees further than this from its axis is no perspective."""
_REPORTED_ERROR: Shown[float] = 0.5
"""Pixels of error from which on a lens is reported."""
_GRID = 33


def make_cameras(frames: Iterable[Frame], collection: bpy.types.Collection, first: int = 0) -> list[bpy.types.Object]:
    """Make a camera object for each frame and link it to a collection; `first` is the first one's `FRAME_INDEX`.

    Returns
    -------
    list of bpy.types.Object
        Named after the frames. Custom properties ``width``, ``height`` (pixels) and ``pixel_aspect`` (fx / fy) tell
        the render size each one is exact for; `use_camera` sets it. ``frame_path`` and ``frame_exposure`` tell the
        frame's picture and what its radiance was multiplied by; `LENS` is the lens, where there is one, and `TURNED` is
        there where the picture is to be shown as its EXIF turns it.
    """
    cameras = []
    for index, frame in enumerate(frames, first):
        camera = make_view(frame.name, frame.camera, collection)
        camera[FRAME_INDEX] = index
        camera["frame_path"], camera["frame_exposure"] = str(Path(frame.path).absolute()), float(frame.exposure)
        if frame.turned:
            camera[TURNED] = True
        cameras.append(camera)
    return cameras


def use_camera(scene: bpy.types.Scene, camera: bpy.types.Object, size: bool = True) -> None:
    """Render through one of `make_cameras`: active camera and, with `size`, the picture's size and shape of pixels."""
    if size:
        render = scene.render
        render.resolution_x, render.resolution_y = int(camera["width"]), int(camera["height"])
        render.resolution_percentage = 100
        render.pixel_aspect_x, render.pixel_aspect_y = _pixel(camera)
    scene.camera = camera
    show_camera(scene, camera)


def best_view(frames: Iterable[Frame], mesh: Mesh) -> int:
    """Index of the frame that a room is first seen through: the first with the most objects' centres in view."""
    _, owner = np.unique(mesh.object_id, return_inverse=True)
    centres = mesh.vertices[mesh.triangles].mean(1)
    middles = np.stack([np.bincount(owner, centres[:, axis]) for axis in range(3)], -1) / np.bincount(owner)[:, None]

    def visible_count(camera: Camera) -> int:
        pixels, depth = camera.project(middles)
        inside = (pixels >= 0) & (pixels < (camera.width, camera.height))
        return int(((depth > 0) & inside.all(1)).sum())

    return int(np.argmax([visible_count(frame.camera) for frame in frames]))


def show_camera(scene: bpy.types.Scene, camera: bpy.types.Object) -> None:
    """Show one camera of a room whose others are hidden: Blender draws no picture behind a hidden one."""
    rooms = (collection for collection in scene.collection.children_recursive if CAPTURE in collection)
    room = next((collection for collection in rooms if camera in set(collection.all_objects)), None)
    if room is None or camera.name in room.objects:
        return
    for obj in [obj for obj in room.objects if FRAME_INDEX in obj and len(obj.users_collection) > 1]:
        room.objects.unlink(obj)
    room.objects.link(camera)


def shows_as_framed(scene: bpy.types.Scene, camera: bpy.types.Object) -> bool:
    """Whether a scene's picture has the sides and pixel shape that a frame's camera was made for, at any size."""
    render = scene.render
    wide, high = _pixel(camera)
    expected = camera["width"] * wide / (camera["height"] * high)
    actual = render.resolution_x * render.pixel_aspect_x / (render.resolution_y * render.pixel_aspect_y)
    return abs(actual / expected - 1) < 1e-3


def _pixel(camera: bpy.types.Object) -> tuple[float, float]:
    """Width and height of a pixel as Blender takes them: from 1 on."""
    aspect = float(camera["pixel_aspect"])
    return max(1.0, 1 / aspect), max(1.0, aspect)


def frame_cameras(scene: bpy.types.Scene) -> list[bpy.types.Object]:
    """The cameras of a scene that `make_cameras` made, one room after the other, in the capture's order."""
    cameras = [
        obj for obj in scene.objects if obj.type == "CAMERA" and "pixel_aspect" in obj and obj.get(FRAME_INDEX, 0) >= 0
    ]
    return sorted(cameras, key=lambda obj: (obj.get(CAPTURE, ""), obj.get(FRAME_INDEX, 0)))


def size_warning(frames: Iterable[Frame]) -> str:
    """One sentence if the frames don't share one size and pixel shape, which scenes have and not cameras; '' if so."""
    formats = {(f.camera.width, f.camera.height, round(f.camera.fx / f.camera.fy, 6)) for f in frames}
    if len(formats) < 2:
        return ""
    return (
        f"The frames have {len(formats)} different sizes or pixel shapes, which Blender keeps in the scene, not in a "
        "camera: set the render size from the camera's custom properties before you render through another one."
    )


def stored_lens(camera: bpy.types.Object) -> tuple[Lens, tuple[float, ...]] | None:
    """The lens that `make_cameras` left with a camera, and its fx, fy, cx, cy; None where it left none."""
    try:
        lens, pixels = json.loads(camera[LENS])
        fx, fy, cx, cy = map(float, pixels)
        return lens_from_json(lens), (fx, fy, cx, cy)
    except (KeyError, TypeError, ValueError):
        return None


def lens_warning(frames: Iterable[Frame]) -> str:
    """One sentence if Blender's cameras can't have some of the frames' lenses ('' if they can): the error in pixels."""
    cameras = [frame.camera for frame in frames if frame.camera.lens is not None]
    distinct = {(c.width, c.height, c.fx, c.fy, c.cx, c.cy, c.lens): c for c in cameras}
    errors = [(max_pixel_error(camera), camera) for camera in distinct.values()]
    error, camera = max(errors, key=lambda pair: pair[0], default=(0.0, None))
    if error < _REPORTED_ERROR:
        return ""
    return (
        f"Blender has no camera with a lens such as {camera.lens.name}: its cameras show what the frames show "
        f"up to {error:.1f} pixels beside it, most of all in the corners; the recovery itself uses the exact lens."
    )


def max_pixel_error(camera: Camera) -> float:
    """Largest distance in pixels between the Blender camera's picture and the camera's own."""
    if isinstance(camera.lens, Equirectangular):
        return 0.0
    y, x = (np.linspace(0, extent, _GRID) for extent in (camera.height, camera.width))
    pixels = np.stack([i.ravel() for i in np.meshgrid(x, y)], -1)
    points = (pixels - (camera.cx, camera.cy)) / (camera.fx, camera.fy)
    points = points[camera.lens.unproject(points)[1]]
    if _is_wide(camera):
        radius = np.hypot(points[:, 0], points[:, 1])
        theta = sum(k * (camera.fx * _SENSOR / camera.width * radius) ** power
                    for power, k in enumerate(_angles(camera), 1))  # fmt: skip
        across = points / np.maximum(radius, 1e-12)[:, None] * np.sin(theta)[:, None]
        rays = np.column_stack([across, np.cos(theta)])
    else:
        rays = np.column_stack([points, np.ones(len(points))])
    projected, valid = camera.lens.project(rays)
    error = np.hypot(*((projected - points) * (camera.fx, camera.fy))[valid].T)
    return float(error.max(initial=0)) if valid.any() else float("inf")


def _is_wide(camera: Camera) -> bool:
    """Whether it becomes a panoramic camera."""
    lens = camera.lens.lens if isinstance(camera.lens, Cropped) else camera.lens
    return isinstance(lens, Equirectangular) or getattr(lens, "fisheye", False) or widest_angle(camera) > _WIDE


def _angles(camera: Camera) -> np.ndarray:
    """Coefficients of the ray's angle as a polynomial of the distance in millimetres from the principal point, (4,).

    Least squares in pixels over the frame, the mean of all directions where a lens is not round.
    """
    corners = np.array([(x, y) for x in (0, camera.width) for y in (0, camera.height)], float)
    reach = np.linalg.norm((corners - (camera.cx, camera.cy)) / (camera.fx, camera.fy), axis=1).max()
    radius, phi = np.meshgrid(np.linspace(0, reach, 401)[1:], np.arange(16) * (np.pi / 8), indexing="ij")
    points = np.stack([radius * np.cos(phi), radius * np.sin(phi)], -1).reshape(-1, 2)
    rays, valid = camera.lens.unproject(points)
    theta = np.arctan2(np.hypot(rays[:, 0], rays[:, 1]), rays[:, 2]).reshape(radius.shape)
    usable = valid.reshape(radius.shape).all(1)
    radius, theta = radius[usable, 0], theta[usable].mean(1)
    millimetres = camera.fx * _SENSOR / camera.width * radius
    pixels = 1 / np.maximum(np.gradient(theta, radius), 1e-6)  # how much a wrong angle counts
    powers = (millimetres / millimetres[-1])[:, None] ** np.arange(1, 5)
    k = np.linalg.lstsq(powers * pixels[:, None], theta * pixels, rcond=None)[0]
    return k / millimetres[-1] ** np.arange(1, 5)


def _rim(camera: Camera) -> float:
    """The angle from the axis at which the picture's circle ends, or the widest in the frame."""
    widest = min(widest_angle(camera), np.pi)
    if not isinstance(camera.lens, Cropped):
        return widest
    phi = np.arange(64) * (np.pi / 32)
    rim = np.stack([camera.lens.across * np.cos(phi), camera.lens.down * np.sin(phi)], -1)
    rays, valid = camera.lens.lens.unproject(rim)
    return float(np.arccos(rays[:, 2].clip(-1, 1)).max()) if valid.all() else widest


def _set_panorama(data: bpy.types.Camera, camera: Camera) -> None:
    """Make `data` a whole or partial panorama, or a fisheye."""
    data.type = "PANO"
    if isinstance(camera.lens, Equirectangular):
        data.panorama_type = "EQUIRECTANGULAR"
        data.shift_x = data.shift_y = 0.0
        data.longitude_min, data.longitude_max = (x / camera.fx for x in (-camera.cx, camera.width - camera.cx))
        data.latitude_min, data.latitude_max = (y / camera.fy for y in (camera.cy - camera.height, camera.cy))
        return
    data.panorama_type = "FISHEYE_LENS_POLYNOMIAL"
    data.fisheye_fov = 2 * _rim(camera)
    # Its sign is Cycles' own; shifts count in the picture's width and height here.
    data.fisheye_polynomial_k0 = 0.0
    for power, k in enumerate(_angles(camera), 1):
        setattr(data, f"fisheye_polynomial_k{power}", -k)
    data.shift_x = 0.5 - camera.cx / camera.width
    data.shift_y = camera.cy / camera.height - 0.5


def make_view(name: str, camera: Camera, collection: bpy.types.Collection) -> bpy.types.Object:
    """Make a camera object that belongs to no frame and link it to a collection."""
    data = bpy.data.cameras.new(name)
    data.sensor_fit = "HORIZONTAL"
    data.sensor_width = _SENSOR
    data.lens = camera.fx * _SENSOR / camera.width
    aspect = camera.fx / camera.fy
    # Shifts count in widths of the picture; a tall pixel counts by its true height.
    data.shift_x = 0.5 - camera.cx / camera.width
    data.shift_y = (camera.cy - camera.height / 2) * aspect / camera.width
    if isinstance(camera.lens, Equirectangular):
        aspect = 1.0  # a panorama's pixels may have any shape
    if camera.lens is not None and _is_wide(camera):
        _set_panorama(data, camera)
    data.clip_start, data.clip_end = 0.01, 1000.0
    data.display_size = 0.15
    data.passepartout_alpha = 1.0  # what lies outside the picture Cycles' viewport then needn't compute
    obj = bpy.data.objects.new(name, data)
    obj.matrix_world = Matrix(np.asarray(camera.camera_to_world, np.float64).tolist())
    obj["width"], obj["height"], obj["pixel_aspect"] = camera.width, camera.height, aspect
    if camera.lens is not None:
        obj[LENS] = json.dumps([lens_to_json(camera.lens), [camera.fx, camera.fy, camera.cx, camera.cy]])
    collection.objects.link(obj)
    return obj


TRACK = "Scan Relight track"
"""Name of the camera."""
NO_FRAME: Code[int] = -1
"""Its `FRAME_INDEX`: it is none of the frames' cameras."""


def make_track(cameras: Sequence[bpy.types.Object], collection: bpy.types.Collection) -> bpy.types.Object | None:
    """A camera animated along those of the frames, the timeline's frame k at the k-th; None of fewer than two."""
    if len(cameras) < 2:
        return None
    track = cameras[0].copy()
    track.name, track.data = TRACK, cameras[0].data.copy()
    track.data.name = TRACK
    for name in ("frame_path", "frame_exposure", TURNED):
        track.pop(name, None)
    track[FRAME_INDEX] = NO_FRAME
    track.rotation_mode = "QUATERNION"
    previous = None
    for frame, camera in enumerate(cameras, 1):
        location, rotation, _ = camera.matrix_basis.decompose()
        if previous is not None:
            rotation.make_compatible(previous)  # the quaternion's sign with the shorter rotation
        track.location, track.rotation_quaternion, previous = location, rotation, rotation
        track.keyframe_insert("location", frame=frame)
        track.keyframe_insert("rotation_quaternion", frame=frame)
    track.animation_data.action.name = TRACK
    track.matrix_basis = cameras[0].matrix_basis
    collection.objects.link(track)
    return track


def track_cameras(scene: bpy.types.Scene) -> list[bpy.types.Object]:
    """The cameras of a scene that are animated along a capture's track."""
    return [obj for obj in scene.objects if obj.type == "CAMERA" and obj.get(FRAME_INDEX, 0) == NO_FRAME]
