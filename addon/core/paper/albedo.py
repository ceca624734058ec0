"""Diffuse albedo rho = pi L_d / S (Haefner et al. 2021, sec. 3.2; the paper's sums leave out pi and 2 pi / N)."""

import numpy as np


def albedo(lit_diffuse: np.ndarray, irradiance: np.ndarray) -> np.ndarray:
    """rho of n elements.

    Parameters
    ----------
    lit_diffuse : (n, 3) float32
        L_d; NaN where no frame saw the element.
    irradiance : (n, 3) float32
        S, radiance * steradian.

    Returns
    -------
    (n, 3) float32
        Linear Rec.709, as it comes: above 1 where light is missing from S, and on lamps. NaN where no frame saw the
        element, or no light reaches it.
    """
    receives_light = irradiance > 0
    return np.where(
        receives_light, np.float32(np.pi) * lit_diffuse / np.where(receives_light, irradiance, 1), np.float32(np.nan)
    )
