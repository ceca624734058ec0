"""COLMAP's camera models by name and number: from their parameters to focal lengths, principal point and lens.

Source: COLMAP's doc/cameras.rst and src/colmap/sensor/models.h (4.x), which also fix the parameters' order.
"""

import functools
import math
from collections.abc import Callable, Sequence
from typing import NamedTuple

from ..errors import BadInputError
from .lens import Lens
from .lenses import Division, EnhancedUnified, Equirectangular, FieldOfView
from .lenses_polynomial import Polynomial


class Intrinsics(NamedTuple):
    """Pixels; `lens` None is the perspective without distortion."""

    fx: float
    fy: float
    cx: float
    cy: float
    lens: Lens | None


class Model(NamedTuple):
    """One model: whether fx and fy are one parameter, how many parameters follow cx and cy, and the lens of those."""

    number: int
    name: str
    single: bool
    extra: int
    lens: Callable[[Sequence[float]], Lens | None]


def polynomial(
    name: str,
    *,
    fisheye: bool = False,
    numerator: Sequence[float] = (),
    denominator: Sequence[float] = (),
    tangential: Sequence[float] = (0.0, 0.0),
    prism: Sequence[float] = (0.0,) * 4,
    chained: bool = False,
) -> Polynomial | None:
    """A `Polynomial`, or None where that is a perspective without distortion."""
    parts = [tuple(float(c) for c in part) for part in (numerator, denominator, tangential, prism)]
    if not fisheye and not any(any(part) for part in parts):
        return None
    return _shared(name, fisheye, *parts, chained)


@functools.lru_cache(maxsize=1024)
def _shared(*values) -> Polynomial:
    """One lens for all frames of one camera: what it finds out of itself is found once."""
    return Polynomial(*values)


def _fov(p: Sequence[float]) -> Lens | None:
    if not 0 <= p[0] < math.pi:
        raise BadInputError("omega must be at least 0 and below pi")
    return FieldOfView(p[0]) if p[0] > 0 else None


def _eucm(p: Sequence[float]) -> Lens | None:
    if not (0 <= p[0] <= 1 and p[1] > 0):
        raise BadInputError("alpha must be in 0...1 and beta above 0")
    return EnhancedUnified(p[0], p[1]) if p[0] > 0 else None


def _division(name: str) -> Callable[[Sequence[float]], Lens | None]:
    return lambda p: Division(p[0], name) if p[0] else None


MODELS = (
    Model(0, "SIMPLE_PINHOLE", True, 0, lambda p: None),
    Model(1, "PINHOLE", False, 0, lambda p: None),
    Model(2, "SIMPLE_RADIAL", True, 1, lambda p: polynomial("SIMPLE_RADIAL", numerator=p)),
    Model(3, "RADIAL", True, 2, lambda p: polynomial("RADIAL", numerator=p)),
    Model(4, "OPENCV", False, 4, lambda p: polynomial("OPENCV", numerator=p[:2], tangential=p[2:])),
    Model(5, "OPENCV_FISHEYE", False, 4, lambda p: polynomial("OPENCV_FISHEYE", fisheye=True, numerator=p)),
    Model(6, "FULL_OPENCV", False, 8, lambda p: polynomial(
        "FULL_OPENCV", numerator=(*p[:2], p[4]), denominator=p[5:], tangential=p[2:4])),
    Model(7, "FOV", False, 1, _fov),
    Model(8, "SIMPLE_RADIAL_FISHEYE", True, 1, lambda p: polynomial(
        "SIMPLE_RADIAL_FISHEYE", fisheye=True, numerator=p)),
    Model(9, "RADIAL_FISHEYE", True, 2, lambda p: polynomial("RADIAL_FISHEYE", fisheye=True, numerator=p)),
    Model(10, "THIN_PRISM_FISHEYE", False, 8, lambda p: polynomial(
        "THIN_PRISM_FISHEYE", fisheye=True, numerator=(*p[:2], *p[4:6]), tangential=p[2:4],
        prism=(p[6], 0.0, p[7], 0.0))),
    # Its p0 stands where the others have p2.
    Model(11, "RAD_TAN_THIN_PRISM_FISHEYE", False, 12, lambda p: polynomial(
        "RAD_TAN_THIN_PRISM_FISHEYE", fisheye=True, numerator=p[:6], tangential=(p[7], p[6]), prism=p[8:],
        chained=True)),
    Model(12, "SIMPLE_DIVISION", True, 1, _division("SIMPLE_DIVISION")),
    Model(13, "DIVISION", False, 1, _division("DIVISION")),
    Model(14, "SIMPLE_FISHEYE", True, 0, lambda p: polynomial("SIMPLE_FISHEYE", fisheye=True)),
    Model(15, "FISHEYE", False, 0, lambda p: polynomial("FISHEYE", fisheye=True)),
    Model(16, "EUCM", False, 2, _eucm),
)  # fmt: skip
EQUIRECTANGULAR = 17, "EQUIRECTANGULAR"
"""Its parameters are the picture's width and height."""
BY_NAME = {model.name: model for model in MODELS}
NAMES = {**{model.number: model.name for model in MODELS}, EQUIRECTANGULAR[0]: EQUIRECTANGULAR[1]}
COUNTS = {**{m.name: m.extra + (3 if m.single else 4) for m in MODELS}, EQUIRECTANGULAR[1]: 2}
"""How many parameters each model has."""


def intrinsics(name: str, parameters: Sequence[float], width: int, height: int) -> Intrinsics:
    """What a model's parameters say.

    Raises
    ------
    BadInputError
        No such model, another count of parameters, or values that make no lens. The message is a clause: the caller
        knows whose parameters they are.
    """
    if name not in COUNTS:
        raise BadInputError(f"its model '{name}' is none of COLMAP's")
    values = [float(p) for p in parameters]
    if len(values) != COUNTS[name] and not (name == EQUIRECTANGULAR[1] and not values):
        raise BadInputError(f"its model {name} takes {COUNTS[name]} parameters and {len(values)} are given")
    if not all(math.isfinite(v) for v in values):
        raise BadInputError("a parameter is not finite")
    if name == EQUIRECTANGULAR[1]:
        wide, high = values or (width, height)
        if not (wide > 0 and high > 0):
            raise BadInputError("its width and height must be above 0")
        return Intrinsics(wide / (2 * math.pi), high / math.pi, wide / 2, high / 2, Equirectangular())
    model = BY_NAME[name]
    focal = values[:1] * 2 if model.single else values[:2]
    cx, cy, *extra = values[1 if model.single else 2 :]
    if not min(focal) > 0:
        raise BadInputError("its focal length must be above 0")
    return Intrinsics(focal[0], focal[1], cx, cy, model.lens(extra))
