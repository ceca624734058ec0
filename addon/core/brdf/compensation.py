"""What Blender's Principled node takes from the diffuse part that lies under a specular one.

The method adds a diffuse and a specular lobe. Principled layers them: its diffuse is darkened by what the specular
layer reflects, E(psi, phi). Base Color must be the albedo / (1 - E) for the diffuse part to come out as fitted.
"""

import math

import numpy as np

MAX_F0 = 0.9
"""The index of refraction grows without bound as F0 nears 1; this is an index of 38."""
_PSI = np.array([0.0, 0.0025, 0.01, 0.02, 0.04, 0.08, 0.15, 0.25, 0.4, 0.6, MAX_F0])
_ROUGHNESS = np.linspace(0.1, 1.0, 10)
# (E - psi) / (1 - psi) as Cycles 4.5 and 5.2 have it (they agree to 1e-8): a row for each psi, a column for each
# roughness. Made by scripts/measure_cycles_layering.py. Cycles leaves out the light that masking takes from the
# lobe, so that E is no smaller than psi however rough the surface: it can't be had by integrating the lobe.
_BEYOND_PSI = np.array(
    [
        (0.0000, 0.0000, 0.0000, 0.0000, 0.0000, 0.0000, 0.0000, 0.0000, 0.0000, 0.0000),
        (0.0240, 0.0218, 0.0179, 0.0140, 0.0105, 0.0078, 0.0059, 0.0044, 0.0033, 0.0025),
        (0.0385, 0.0358, 0.0307, 0.0250, 0.0199, 0.0152, 0.0118, 0.0090, 0.0069, 0.0052),
        (0.0466, 0.0438, 0.0380, 0.0314, 0.0254, 0.0198, 0.0154, 0.0119, 0.0093, 0.0073),
        (0.0537, 0.0508, 0.0448, 0.0375, 0.0303, 0.0241, 0.0190, 0.0149, 0.0116, 0.0089),
        (0.0571, 0.0543, 0.0481, 0.0407, 0.0333, 0.0265, 0.0210, 0.0164, 0.0129, 0.0099),
        (0.0509, 0.0482, 0.0426, 0.0359, 0.0293, 0.0233, 0.0184, 0.0147, 0.0114, 0.0089),
        (0.0339, 0.0316, 0.0272, 0.0223, 0.0177, 0.0138, 0.0108, 0.0084, 0.0065, 0.0050),
        (0.0077, 0.0060, 0.0042, 0.0027, 0.0016, 0.0012, 0.0006, 0.0004, 0.0001, 0.0000),
        (0.0008, 0.0003, 0.0001, 0.0000, 0.0000, 0.0002, 0.0001, 0.0000, 0.0000, 0.0000),
        (0.0001, 0.0005, 0.0006, 0.0000, 0.0000, 0.0000, 0.0000, 0.0000, 0.0000, 0.0000),
    ]
)


def ior_of(f0: float) -> float:
    """Index of refraction whose reflectance at normal incidence is `f0` (clamped to 0...`MAX_F0`)."""
    root = math.sqrt(min(max(f0, 0.0), MAX_F0))
    return (1 + root) / (1 - root)


def layer_reflectance(psi: float | np.ndarray, phi: float | np.ndarray) -> np.ndarray:
    """Share E of the light that Principled's specular layer keeps from its diffuse, averaged over the hemisphere.

    Parameters
    ----------
    psi : float or (...) array
        F0; clamped to 0...0.9, as the material's index of refraction is.
    phi : float or (...) array
        GGX alpha; below 0.01 taken as 0.01, where E changes no more.

    Returns
    -------
    (...) float64, 0...0.9
    """
    psi = np.clip(np.asarray(psi, np.float64), 0.0, _PSI[-1])
    roughness = np.sqrt(np.clip(np.asarray(phi, np.float64), _ROUGHNESS[0] ** 2, 1.0))
    # E rises like the root of psi where psi is small.
    row, row_share = _between(np.sqrt(_PSI), np.sqrt(psi))
    column, column_share = _between(_ROUGHNESS, roughness)
    upper = (1 - column_share) * _BEYOND_PSI[row, column] + column_share * _BEYOND_PSI[row, column + 1]
    lower = (1 - column_share) * _BEYOND_PSI[row + 1, column] + column_share * _BEYOND_PSI[row + 1, column + 1]
    return psi + (1 - psi) * ((1 - row_share) * upper + row_share * lower)


def base_color(albedo: np.ndarray, psi: float | np.ndarray, phi: float | np.ndarray) -> np.ndarray:
    """Base Color under which the diffuse part of a specular material reflects `albedo`.

    Parameters
    ----------
    albedo : (n, 3) float32
        Linear Rec.709.
    psi, phi : float or (n,) array
        The lobe of each element.

    Returns
    -------
    (n, 3), of `albedo`'s type; above 1 where the two lobes together would reflect more than all light
    """
    transmitted = np.broadcast_to(1 - layer_reflectance(psi, phi), albedo.shape[:1])
    return (albedo / transmitted[:, None]).astype(albedo.dtype)


def _between(knots, x):
    """Index of the knot at or below `x`, and how far `x` lies on the way to the next one (0...1)."""
    index = np.clip(np.searchsorted(knots, x, "right") - 1, 0, len(knots) - 2)
    return index, (x - knots[index]) / (knots[index + 1] - knots[index])
