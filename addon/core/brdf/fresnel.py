"""Fresnel's term, as Blender's Principled and solid dielectrics have it; the paper's, Schlick's: `paper.brdf.F`.

Schlick's approximation falls short in between: at 60 degrees, where floors mirror windows, a dielectric of F0 = .04
reflects .089 and not .070. A fit makes up for that by F0 = .058, which is then too much straight on.
"""

import numpy as np

from ..kinds import Unit

INDEX: Unit[float] = 1.5
"""Index of refraction whose curve all take. Scaled to its own F0, that of n = 1.3 or 2 differs little from it, and a
metal's own rise is small."""
_SQUARE: Unit[np.float32] = np.float32(INDEX**2 - 1)
_AT_0: Unit[float] = ((INDEX - 1) / (INDEX + 1)) ** 2


def rise(w_h: np.ndarray) -> np.ndarray:
    """What the term has of light that F0 has no part in, s = 0...1: F = F0 (1 - s) + s.

    Parameters
    ----------
    w_h : (...) float
        Cosine between direction and half vector, 0...1.
    """
    g = np.sqrt(_SQUARE + w_h * w_h)
    apart, both = g - w_h, g + w_h
    perpendicular = apart / both
    parallel = perpendicular * ((w_h * both - 1) / (w_h * apart + 1))
    exact = (perpendicular * perpendicular + parallel * parallel) / 2
    return np.maximum((exact - np.float32(_AT_0)) / np.float32(1 - _AT_0), 0)


def fresnel(w_h: np.ndarray, f0: float | np.ndarray) -> np.ndarray:
    """Share of the light that is reflected, 0...1; `f0` broadcasts."""
    return f0 + (1 - f0) * rise(w_h)
