"""From the stored codes of 8 and 16-bit pictures to linear light.

Only the curve that the user names is undone. What a camera or a grading did besides (a film-like shoulder, local
contrast) is not in the file and can't be undone: such pictures give wrong light.
Source: IEC 61966-2-1 (sRGB).
"""

import functools

import numpy as np

from ..errors import BadInputError
from ..json_values import float_of
from ..kinds import Code, Limit
from ..photo import srgb_to_linear
from ..scene.model import AUTO

SRGB, LINEAR = "srgb", "linear"
CODES: Code[str] = "codes"
"""In place of a curve: the stored codes as they are, without conversion of primaries."""
GAMMAS: Limit[tuple[float, float]] = (0.1, 10.0)
"""Bounds of a plausible gamma."""
CLIP_SHARE = {8: 248.5 / 255, 16: 1 - 2.0**-12}
"""Share of the greatest code from which on a value counts as clipped: JPEG rings (in 26 captures of quality 92, by the
median, 249 is the first code that more pixels have by being clipped than otherwise), and 12 bits that were shifted into
16 end there."""


def check_transfer(text: str) -> None:
    """Raise `BadInputError` unless `text` is '', 'auto' or names a curve."""
    if text not in ("", AUTO):
        _gamma(text)


def to_linear(values: np.ndarray, transfer: str) -> np.ndarray:
    """Undo the curve `transfer` of `values` in 0...1; float64, of the same shape."""
    values = np.asarray(values, np.float64)
    if transfer in (LINEAR, CODES):
        return values
    if transfer == SRGB:
        return srgb_to_linear(values)
    return values ** _gamma(transfer)


def decode(codes: np.ndarray, transfer: str) -> np.ndarray:
    """Linear light, 1 at the greatest code, of `codes` (any shape, uint8 or uint16), float32."""
    return _table(codes.dtype.itemsize * 8, transfer)[codes]


def clip_level(bits: int, transfer: str) -> float:
    """The linear value from which on a picture of `bits` a channel counts as clipped; of `AUTO`, the code."""
    if transfer == AUTO:
        return CLIP_SHARE[bits]
    return float(to_linear(np.array(CLIP_SHARE[bits]), transfer))


@functools.lru_cache(maxsize=8)
def _table(bits: int, transfer: str) -> np.ndarray:
    return to_linear(np.linspace(0, 1, 1 << bits), transfer).astype(np.float32)


def _gamma(text: str) -> float:
    if text in (SRGB, LINEAR):
        return 1.0
    gamma = float_of(text)
    if not GAMMAS[0] <= gamma <= GAMMAS[1]:
        raise BadInputError(f"There is no curve '{text}' of pictures; give auto, srgb, linear, or a gamma such as 2.2.")
    return gamma
