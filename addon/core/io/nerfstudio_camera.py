"""The camera of a nerfstudio frame: size, focal lengths, principal point, lens.

Source: nerfstudio 1.1's data/dataparsers/nerfstudio_dataparser.py and cameras/cameras.py. A value stands with the frame
or, for all frames, at the top of the file.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from ..errors import BadInputError
from ..json_values import is_number
from ..scene.lens import Lens
from ..scene.lens_json import lens_from_json
from ..scene.lenses import Cropped, Equirectangular
from ..scene.lenses_colmap import polynomial
from ..scene.model import Camera
from .pictures import picture_size

PERSPECTIVE = ("OPENCV", "PINHOLE", "SIMPLE_PINHOLE", "SIMPLE_RADIAL", "RADIAL", "FULL_OPENCV")
FISHEYE, FISHEYE624, PANORAMA = "OPENCV_FISHEYE", "FISHEYE624", "EQUIRECTANGULAR"
MODELS = (*PERSPECTIVE, FISHEYE, FISHEYE624, PANORAMA)
RADIAL, TANGENTIAL = ("k1", "k2", "k3", "k4", "k5", "k6"), ("p1", "p2")
LISTED = "distortion_params"
D = TypeVar("D", float, None)
OWN_LENS = "scan_relight_lens"
"""A frame's lens as `lens_json` writes it; stands in captures of a scene, which know more lenses than nerfstudio."""


@dataclass(frozen=True)
class Entry:
    """A frame's values in the file: its `own` keys, then those at the `top`. `name` is the frame's, for messages."""

    top: dict[str, Any]
    own: dict[str, Any]
    name: str

    def get(self, key: str, default: Any = None) -> Any:
        """The value of a key as it stands."""
        return self.own.get(key, self.top.get(key, default))

    def positive(self, key: str, default: D) -> float | D:
        """A number above 0, or the default; raises `BadInputError` for anything else."""
        value = self.get(key)
        if value is None or value == math.inf and default == math.inf:
            return default
        if not is_number(value) or not value > 0:
            bound = " and below 1e300" if isinstance(value, (int, float)) and value > 0 else ""
            raise BadInputError(f"Frame '{self.name}' has {key} = {value!r}; give a number above 0{bound}.")
        return float(value)

    def numbers(self, keys: Sequence[str]) -> list[float]:
        """Finite numbers, 0 where nothing is told; raises `BadInputError` for anything else."""
        values = [0.0 if self.get(key) is None else self.get(key) for key in keys]
        for key, value in zip(keys, values):
            if not is_number(value):
                raise BadInputError(f"Frame '{self.name}' has {key} = {value!r}; give a number.")
        return [float(value) for value in values]

    @property
    def model(self) -> str:
        """Name of the camera model."""
        return self.get("camera_model", MODELS[0])


def check_model(entry: Entry, path: Path) -> None:
    """Raise `BadInputError` for a camera model that is not known."""
    if entry.model not in MODELS:
        raise BadInputError(
            f"'{path}' has frames of camera model '{entry.model}', which aren't supported; undistort them to "
            f"one of {', '.join(MODELS)}."
        )


def read_camera(entry: Entry, picture: Path, pose: np.ndarray) -> Camera:
    """The camera of a frame; raises `BadInputError` where a number is missing or impossible."""
    wide, high = (entry.positive(key, None) for key in ("w", "h"))
    if wide is None or high is None:
        wide, high = picture_size(picture)
    if wide != int(wide) or high != int(high):
        raise BadInputError(f"Frame '{entry.name}' has a size of {wide} x {high}; give whole pixels as w and h.")
    width, height = int(wide), int(high)
    fx, fy = _focal_lengths(entry, width, height)
    centre = [entry.get("cx", width / 2), entry.get("cy", height / 2)]
    if not all(is_number(value) for value in centre):
        raise BadInputError(f"Frame '{entry.name}' has a principal point that is no number; mend its cx and cy.")
    stored_lens = entry.own.get(OWN_LENS)
    lens = _lens(entry) if stored_lens is None else _own_lens(stored_lens, entry.name)
    if entry.model in (FISHEYE, FISHEYE624):
        radius = entry.positive("fisheye_crop_radius", None)
        if radius is not None and lens is not None:
            lens = Cropped(lens, radius / fx, radius / fy)
    return Camera(width, height, fx, fy, float(centre[0]), float(centre[1]), pose, lens)


def _own_lens(stored_lens: Any, name: str) -> Lens | None:
    try:
        return lens_from_json(stored_lens)
    except (KeyError, TypeError, ValueError, IndexError, AttributeError) as error:
        raise BadInputError(f"Frame '{name}' has a {OWN_LENS} that is none; capture the scene again.") from error


def lens_notes(entries: Sequence[Entry]) -> list[str]:
    """A sentence where the file's distortion may mean something else than what it was taken for."""
    for entry in entries:
        if entry.model not in PERSPECTIVE[:5] or LISTED in entry.own or LISTED in entry.top:
            continue
        radial = [entry.get(key) or 0 for key in RADIAL]
        if any(radial[4:]):
            return [
                "k5 or k6 is given, which nerfstudio does not know: k1 to k6 were taken as OpenCV's rational model "
                "(k4 to k6 divide)."
            ]
        if radial[3]:
            return [
                "k4 was taken as nerfstudio takes it, as the factor of r^8; if the numbers are OpenCV's, where k4 "
                "divides, name the camera_model FULL_OPENCV."
            ]
    return []


def _focal_lengths(entry: Entry, width: int, height: int) -> tuple[float, float]:
    focal = [entry.positive(key, None) for key in ("fl_x", "fl_y")]
    if entry.model == PANORAMA:  # nerfstudio's are half the width, for pi; `Equirectangular` counts in radians
        return (focal[0] or width / 2) / math.pi, (focal[1] or focal[0] or height) / math.pi
    fisheye = entry.model in (FISHEYE, FISHEYE624)
    for axis, (key, extent) in enumerate((("camera_angle_x", width), ("camera_angle_y", height))):
        angle = entry.positive(key, None)
        if angle is not None and not angle < math.pi:
            raise BadInputError(f"Frame '{entry.name}' has a {key} of {angle}; give radians below pi.")
        if angle is not None and not fisheye:
            focal[axis] = focal[axis] or extent / 2 / math.tan(angle / 2)
    fx, fy = focal[0] or focal[1], focal[1] or focal[0]
    if fx is None or fy is None:
        wanted = "fl_x" if fisheye else "fl_x or camera_angle_x"
        raise BadInputError(f"Frame '{entry.name}' has no focal length; give {wanted}.")
    return fx, fy


def _lens(entry: Entry) -> Lens | None:
    model, name = entry.model, entry.name
    if model == PANORAMA:
        return Equirectangular()
    listed = _listed(entry)
    if model == FISHEYE624:
        if len(listed) != 12:
            raise BadInputError(
                f"Frame '{name}' has {len(listed)} {LISTED}, but FISHEYE624 takes 12: k0 to k5, p0, p1, s0 to s3."
            )
        return polynomial(
            model, fisheye=True, numerator=listed[:6], tangential=(listed[7], listed[6]), prism=listed[8:], chained=True
        )
    if listed:
        if any(listed) and len(listed) != 6:
            raise BadInputError(f"Frame '{name}' has {len(listed)} {LISTED}; give six: k1 to k4, p1, p2.")
        radial, tangential = [*listed[:4], 0.0, 0.0], listed[4:6] if len(listed) == 6 else [0.0, 0.0]
    else:
        radial, tangential = entry.numbers(RADIAL), entry.numbers(TANGENTIAL)
    if model == FISHEYE:
        return polynomial(model, fisheye=True, numerator=radial[:4], tangential=tangential)
    if any(radial[4:]) or model == "FULL_OPENCV":
        return polynomial("FULL_OPENCV", numerator=radial[:3], denominator=radial[3:], tangential=tangential)
    return polynomial(model, numerator=radial[:4], tangential=tangential)


def _listed(entry: Entry) -> list[float]:
    has_coefficients = any(entry.own.get(key) is not None for key in (*RADIAL, *TANGENTIAL))
    values = entry.own.get(LISTED, None if has_coefficients else entry.top.get(LISTED))
    if values is None:
        return []
    if not isinstance(values, list) or not all(is_number(v) for v in values):
        raise BadInputError(f"Frame '{entry.name}' has {LISTED} that are no list of numbers; mend them.")
    return [float(v) for v in values]
