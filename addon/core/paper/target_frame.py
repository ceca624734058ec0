"""The target frame of an object (Haefner et al. 2021, A1 and A2): the one frame that its lobe is fitted to.

Assumption A1: a specular highlight of direct light is likely in it. Assumption A2: its pixels are valid and not
saturated.
"""

import numpy as np

from ..luminance import LUMINANCE
from .captured_light import Light


def mirrored(direction: np.ndarray, normal: np.ndarray) -> np.ndarray:
    """Where a mirror would have the light come from: 2 <n, wo> n - wo, (m, 3)."""
    return 2 * np.einsum("ij,ij->i", direction, normal)[:, None] * normal - direction


def frame_scores(
    light: Light, position: np.ndarray, normal: np.ndarray, direction: np.ndarray, frame: np.ndarray, frames: int
) -> np.ndarray:
    """How good a target each frame is: the luminance that mirror directions see, over all it shows of the object.

    A lamp is brighter by orders than what it lights, so this counts the places where its highlight lies (A1).

    Parameters
    ----------
    position, normal, direction : (m, 3) float32
        The object's observations in all frames: place, normal, and wo to the camera. Only valid and unsaturated
        ones (A2).
    frame : (m,) int
        Which frame each was made in.
    frames : int
        Number of frames.

    Returns
    -------
    (frames,) float64
    """
    origins = light.scene.off_surface(position, normal)
    radiance = light.along(origins, mirrored(direction, normal).astype(np.float32))[0]
    return np.bincount(frame, (radiance @ LUMINANCE).astype(np.float64), frames)


def target_frame(scores: np.ndarray) -> int:
    """The best frame's index; -1 where no frame shows any of the object."""
    return int(np.argmax(scores)) if len(scores) and scores.max() > 0 else -1
