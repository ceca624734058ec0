"""The camera of a nerfstudio frame: size, focal lengths, principal point, lens.

Source: nerfstudio 1.1's data/dataparsers/nerfstudio_dataparser.py and cameras/cameras.py. A value stands with the frame
or, for all frames, at the top of the file.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from ..errors import BadInputError
from ..json_values import is_number
from ..scene.lens import Lens
from ..scene.lenses import Cropped, Equirectangular
from ..scene.lenses_colmap import polynomial
from ..scene.lenses_told import lens_of
from ..scene.model import Camera
from .pictures import picture_size

PERSPECTIVE = ("OPENCV", "PINHOLE", "SIMPLE_PINHOLE", "SIMPLE_RADIAL", "RADIAL", "FULL_OPENCV")
FISHEYE, FISHEYE624, PANORAMA = "OPENCV_FISHEYE", "FISHEYE624", "EQUIRECTANGULAR"
MODELS = (*PERSPECTIVE, FISHEYE, FISHEYE624, PANORAMA)
RADIAL, TANGENTIAL = ("k1", "k2", "k3", "k4", "k5", "k6"), ("p1", "p2")
LISTED = "distortion_params"
CROP = "fisheye_crop_radius"
D = TypeVar("D", float, None)
OWN_LENS = "scan_relight_lens"
"""A frame's lens as `lenses_told` writes it; stands in captures of a scene, which know more lenses than nerfstudio."""


def check_model(top: dict[str, Any], entry: dict[str, Any], path: Path) -> str:
    """The camera model; raises `BadInputError` for one that is not known."""
    model = entry.get("camera_model", top.get("camera_model", MODELS[0]))
    if model not in MODELS:
        raise BadInputError(
            f"'{path}' has frames of camera model '{model}', which aren't supported; undistort them to "
            f"one of {', '.join(MODELS)}."
        )
    return model


def read_camera(
    top: dict[str, Any], entry: dict[str, Any], name: str, picture: Path, model: str, pose: np.ndarray
) -> Camera:
    """The camera of a frame; raises `BadInputError` where a number is missing or impossible."""
    wide, high = (positive(top, entry, key, name, None) for key in ("w", "h"))
    if wide is None or high is None:
        wide, high = picture_size(picture)
    if wide != int(wide) or high != int(high):
        raise BadInputError(f"Frame '{name}' has a size of {wide} x {high}; give whole pixels as w and h.")
    width, height = int(wide), int(high)
    fx, fy = _focal_lengths(top, entry, name, width, height, model)
    centre = [entry.get(key, top.get(key, half)) for key, half in (("cx", width / 2), ("cy", height / 2))]
    if not all(is_number(value) for value in centre):
        raise BadInputError(f"Frame '{name}' has a principal point that is no number; mend its cx and cy.")
    told = entry.get(OWN_LENS)
    lens = _lens(top, entry, name, model) if told is None else _own_lens(told, name)
    if model in (FISHEYE, FISHEYE624):
        radius = positive(top, entry, CROP, name, None)
        if radius is not None and lens is not None:
            lens = Cropped(lens, radius / fx, radius / fy)
    return Camera(width, height, fx, fy, float(centre[0]), float(centre[1]), pose, lens)


def _own_lens(told: Any, name: str) -> Lens | None:
    try:
        return lens_of(told)
    except (KeyError, TypeError, ValueError, IndexError, AttributeError) as error:
        raise BadInputError(f"Frame '{name}' has a {OWN_LENS} that is none; capture the scene again.") from error


def positive(top: dict[str, Any], entry: dict[str, Any], key: str, name: str, default: D) -> float | D:
    """The number `key` of the frame, else of the file, else `default`; raises `BadInputError` unless above 0."""
    value = entry.get(key, top.get(key))
    if value is None or value == math.inf and default == math.inf:
        return default
    if not is_number(value) or not value > 0:
        raise BadInputError(f"Frame '{name}' has {key} = {value!r}; give a number above 0.")
    return float(value)


def lens_notes(top: dict[str, Any], entries: list[Any]) -> list[str]:
    """A sentence where the file's distortion may mean something else than what it was taken for."""
    for entry in (e for e in entries if isinstance(e, dict)):
        if entry.get("camera_model", top.get("camera_model", MODELS[0])) not in PERSPECTIVE[:5]:
            continue
        if LISTED in entry or LISTED in top:
            continue
        radial = [entry.get(key, top.get(key)) or 0 for key in RADIAL]
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


def _focal_lengths(
    top: dict[str, Any], entry: dict[str, Any], name: str, width: int, height: int, model: str
) -> tuple[float, float]:
    fx = positive(top, entry, "fl_x", name, None)
    fy = positive(top, entry, "fl_y", name, None)
    if model == PANORAMA:  # nerfstudio's focal lengths are half the width, for pi; `Equirectangular` counts in radians
        return (fx or width / 2) / math.pi, (fy or fx or height) / math.pi
    for key, extent in (("camera_angle_x", width), ("camera_angle_y", height)):
        angle = positive(top, entry, key, name, None)
        if angle is not None and not angle < math.pi:
            raise BadInputError(f"Frame '{name}' has a {key} of {angle}; give radians below pi.")
        if angle is None or model in (FISHEYE, FISHEYE624):
            continue
        if key == "camera_angle_x":
            fx = fx or extent / 2 / math.tan(angle / 2)
        else:
            fy = fy or extent / 2 / math.tan(angle / 2)
    fx, fy = fx or fy, fy or fx
    if fx is None or fy is None:
        wanted = "fl_x" if model in (FISHEYE, FISHEYE624) else "fl_x or camera_angle_x"
        raise BadInputError(f"Frame '{name}' has no focal length; give {wanted}.")
    return fx, fy


def _lens(top: dict[str, Any], entry: dict[str, Any], name: str, model: str) -> Lens | None:
    if model == PANORAMA:
        return Equirectangular()
    listed = _listed(top, entry, name)
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
        radial, tangential = ([_number(top, entry, key, name) for key in keys] for keys in (RADIAL, TANGENTIAL))
    if model == FISHEYE:
        return polynomial(model, fisheye=True, numerator=radial[:4], tangential=tangential)
    if any(radial[4:]) or model == "FULL_OPENCV":
        return polynomial("FULL_OPENCV", numerator=radial[:3], denominator=radial[3:], tangential=tangential)
    return polynomial(model, numerator=radial[:4], tangential=tangential)


def _listed(top: dict[str, Any], entry: dict[str, Any], name: str) -> list[float]:
    own = any(entry.get(key) is not None for key in (*RADIAL, *TANGENTIAL))
    values = entry.get(LISTED, None if own else top.get(LISTED))
    if values is None:
        return []
    if not isinstance(values, list) or not all(is_number(v) and math.isfinite(v) for v in values):
        raise BadInputError(f"Frame '{name}' has {LISTED} that are no list of numbers; mend them.")
    return [float(v) for v in values]


def _number(top: dict[str, Any], entry: dict[str, Any], key: str, name: str) -> float:
    value = entry.get(key, top.get(key))
    if value is None:
        return 0.0
    if not is_number(value) or not math.isfinite(value):
        raise BadInputError(f"Frame '{name}' has {key} = {value!r}; give a number.")
    return float(value)
