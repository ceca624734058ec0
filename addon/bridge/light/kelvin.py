"""Colour of light in kelvin: from a temperature to linear Rec.709 and back.

The locus of black bodies is that of Kim et al. (US patent 7024034, 2006), 1667...25000 K; the way back is McCamy's
(Correlated color temperature as an explicit function of chromaticity coordinates, 1992), good to a few kelvins between
2800 and 6500 K and to some per cent beyond.
"""

import numpy as np

from ...core.errors import BadInputError
from ...core.io.primaries import REC709, rgb_to_xyz
from ...core.kinds import Limit
from ...core.luminance import LUMINANCE

LOWEST: Limit[float] = 1700.0
HIGHEST: Limit[float] = 20000.0
"""Kelvin that can be asked for: a match, the blue sky."""
_TO_XYZ = rgb_to_xyz(REC709)


def rgb_of(kelvin: float) -> tuple[float, float, float]:
    """Linear Rec.709 of a black body, of luminance 1; raises `BadInputError` outside `LOWEST`...`HIGHEST`."""
    if not LOWEST <= kelvin <= HIGHEST:
        raise BadInputError(f"A colour temperature is between {LOWEST:g} and {HIGHEST:g} K, not {kelvin:g} K.")
    t = 1e3 / kelvin
    if kelvin < 4000:
        x = ((-0.2661239 * t - 0.2343589) * t + 0.8776956) * t + 0.179910
    else:
        x = ((-3.0258469 * t + 2.1070379) * t + 0.2226347) * t + 0.240390
    if kelvin < 2222:
        y = ((-1.1063814 * x - 1.34811020) * x + 2.18555832) * x - 0.20219683
    elif kelvin < 4000:
        y = ((-0.9549476 * x - 1.37418593) * x + 2.09137015) * x - 0.16748867
    else:
        y = ((3.0817580 * x - 5.87338670) * x + 3.75112997) * x - 0.37001483
    rgb = np.maximum(np.linalg.solve(_TO_XYZ, (x / y, 1.0, (1 - x - y) / y)), 0.0)
    return tuple(float(c) for c in rgb / (rgb @ LUMINANCE))


def kelvin_of(rgb: tuple[float, float, float]) -> float:
    """The correlated colour temperature of a linear Rec.709 colour, within `LOWEST`...`HIGHEST`; black: 6500."""
    xyz = _TO_XYZ @ np.asarray(rgb, float)
    if not xyz.sum() > 0:
        return 6500.0
    x, y = xyz[:2] / xyz.sum()
    n = (x - 0.3320) / (0.1858 - y) if abs(0.1858 - y) > 1e-6 else 0.0
    return float(min(max(((449.0 * n + 3525.0) * n + 6823.3) * n + 5520.33, LOWEST), HIGHEST))


def luminance(rgb: tuple[float, float, float]) -> float:
    """Luminance of a linear Rec.709 colour."""
    return float(np.asarray(rgb, float)[:3] @ LUMINANCE)
