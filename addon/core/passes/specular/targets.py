"""Target frame of an object: likely to show a highlight of direct light (A1), pixels valid and unsaturated (A2)."""

from __future__ import annotations

import numpy as np

from ...luminance import LUMINANCE

MIN_OBSERVATIONS = 12
"""A frame that shows fewer of the object's sampled elements says too little."""


def score_frames(frame: np.ndarray, highlight: np.ndarray, diffuse: np.ndarray, frames: int) -> np.ndarray:
    """How good a target each frame is for one object (Haefner et al. 2021, assumptions A1 and A2).

    Parameters
    ----------
    frame : (m,) int
        Frame of each observation of the object; valid and unsaturated ones only (A2).
    highlight : (m, 3) float32
        Radiance that a lobe of middle width would reflect there, by the light field (A1).
    diffuse : (m, 3) float32
        L_d there.
    frames : int
        Number of frames in the capture.

    Returns
    -------
    (frames,) float64
        The standard deviation of highlight over L_d in the frame: a highlight that lies evenly over all pixels can't
        be told from albedo. 0 where a frame shows too little of the object.
    """
    strength = (highlight @ LUMINANCE) / np.maximum(diffuse @ LUMINANCE, 1e-3 * np.median(diffuse @ LUMINANCE) + 1e-9)
    count = np.bincount(frame, minlength=frames).astype(float)
    mean = np.bincount(frame, strength, frames) / np.maximum(count, 1)
    square = np.bincount(frame, strength**2, frames) / np.maximum(count, 1)
    spread = np.sqrt(np.maximum(square - mean**2, 0))
    return np.where(count >= MIN_OBSERVATIONS, spread, 0.0)


def target_frame(scores: np.ndarray) -> int:
    """The best frame's index; -1 if none serves."""
    return int(np.argmax(scores)) if len(scores) and scores.max() > 0 else -1
