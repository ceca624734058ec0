"""phi and psi of an object: nested least squares (Haefner et al. 2021, sec. 3.4).

    min over phi, psi of  sum of (I - L_d - psi A(phi) - B(phi))^2   over the pixels of the target frame

For each phi of a grid psi follows in closed form; the phi of the least sum is taken.
"""

from dataclasses import dataclass

import numpy as np

PHI = np.array(
    [0.01, 0.02, 0.035, 0.055, 0.08, 0.11, 0.15, 0.2, 0.26, 0.33, 0.41, 0.5, 0.6, 0.72, 0.85, 1.0], np.float32
)
"""The grid: close to equal steps in sqrt(phi), the roughness that Blender's users see."""


@dataclass(frozen=True)
class Lobe:
    """The fit of one object.

    Attributes
    ----------
    residual : (m, 3) float64
        I - L_d - I_nd of each pixel; radiance.
    """

    phi: float
    psi: float
    residual: np.ndarray


def best_psi(A: np.ndarray, B: np.ndarray, non_diffuse: np.ndarray) -> np.ndarray:
    """psi in closed form, within 0...1: <A, I - L_d - B> / <A, A>; 0 where there is nothing to reflect.

    Parameters
    ----------
    A, B : (m, p, 3) float
        For each pixel, phi and channel.
    non_diffuse : (m, 3) float
        I - L_d.

    Returns
    -------
    (p,) float64
    """
    above = np.einsum("mpc,mpc->p", A, non_diffuse[:, None] - B, dtype=np.float64)
    below = np.einsum("mpc,mpc->p", A, A, dtype=np.float64)
    return np.clip(above / np.where(below > 0, below, np.inf), 0, 1)


def fit_lobe(A: np.ndarray, B: np.ndarray, non_diffuse: np.ndarray, grid: np.ndarray = PHI) -> Lobe:
    """The best phi of a grid, and its psi; parameters as of `best_psi`."""
    psi = best_psi(A, B, non_diffuse)
    residual = non_diffuse[:, None].astype(np.float64) - psi[:, None] * A - B
    best = int(np.argmin(np.einsum("mpc,mpc->p", residual, residual)))
    return Lobe(float(grid[best]), float(psi[best]), residual[:, best])
