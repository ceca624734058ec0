"""Radiometric calibration from the capture itself: inverse response, exposure, white balance and vignetting.

Frames that show the same place differ by what the camera did. With z the code, E_p the place's radiance, g the log of
the inverse response, a frame's log gain e and log vignetting v, in each channel (Debevec and Malik 1997, equation 2;
with vignetting Goldman and Chen 2005; Engel et al. 2016):

    g(z) - e - v(r) = log E_p

solved by reweighted least squares over places that several frames show, the E_p eliminated. g is the prior's curve,
sRGB's, and a smooth difference. Multiplying g, e and v by one number scales all residuals (the exponential ambiguity of
Goldman and Chen): that number, the contrast, comes from stated exposures where they differ, else from the prior.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy import sparse
from scipy.interpolate import BSpline

from ...photo import srgb_to_linear
from ...progress import Progress, Rounds
from ...scene.model import Frame, Mesh, Pixels
from ...scene.params import VISIBILITY
from ...scene.radiometry import CODES, Radiometry, at_16_bits
from ...scene.rays import RayScene
from ...significance import LEVELS, SIGMA_OF_MAD
from .observations import CodeObservations, observe_codes
from .params import CALIBRATION
from .white_balance import mean_white_balance


@dataclass(frozen=True)
class Calibration:
    """Response, gains and vignetting of the frames.

    Attributes
    ----------
    response : (3, 256) float64
        Inverse camera response at the codes of 8 bits, as in `Radiometry`.
    gain : (f, 3) float64
        Of each frame; the geometric mean over the calibrated ones and the channels is 1, as no frame fixes the unit.
    falloff : (2,) float64
        Vignetting, as in `Radiometry`.
    calibrated : (f,) bool
        Frames that it holds for.
    spread : () float64
        Standard deviation of the log residuals, robustly; NaN where nothing was calibrated.
    """

    response: np.ndarray
    gain: np.ndarray
    falloff: np.ndarray
    calibrated: np.ndarray
    spread: np.ndarray

    @classmethod
    def none(cls, frames: int) -> Calibration:
        """Codes, if there are any, have sRGB's curve."""
        response = np.tile(srgb_to_linear(CODES), (3, 1))
        return cls(response, np.ones((frames, 3)), np.zeros(2), np.zeros(frames, bool), np.array(np.nan))

    @property
    def clip_colour(self) -> np.ndarray:
        """At which frames clip as a rule, (3,) float64, the greatest channel 1."""
        colour = np.median(self.gain, 0) if len(self.gain) else np.ones(3)
        return colour / colour.max()

    def of(self, frames: Sequence[Frame]) -> tuple[Frame, ...]:
        """The frames with their radiometry."""
        response = at_16_bits(self.response)
        return tuple(
            replace(frame, radiometry=Radiometry(response, gain, self.falloff)) if known else frame
            for frame, gain, known in zip(frames, self.gain, self.calibrated, strict=True)
        )


def calibrate(
    mesh: Mesh,
    scene: RayScene,
    frames: Sequence[Frame],
    read: Callable[[Frame], Pixels],
    *,
    threads: int = 0,
    seed: int = 0,
    white_balance: bool = True,
    progress: Progress | Rounds | None = None,
) -> Calibration:
    """Calibrate frames of unknown response (`Frame.uncalibrated`); the others are left alone.

    Parameters
    ----------
    read : callable
        A frame's codes as "radiance", 0...1.
    white_balance : bool
        Whether to estimate the white balance that all frames have in common.

    Raises
    ------
    InterruptedRun
        From `progress`.
    """
    uncalibrated = np.array([frame.uncalibrated for frame in frames], bool)
    default = Calibration.none(len(frames))
    if uncalibrated.sum() < VISIBILITY.enough:
        return default
    selected = [frame for frame, wanted in zip(frames, uncalibrated) if wanted]
    observations = observe_codes(mesh, scene, selected, read, threads=threads, seed=seed, progress=progress)
    observations = observations.part(
        np.bincount(observations.point, minlength=1)[observations.point] >= VISIBILITY.enough
    )
    stated = np.log([frame.exposure for frame in selected])
    if len(observations.point) < CALIBRATION.points:
        return default
    response, gain, falloff, spread = solve(observations, len(selected), stated)
    if white_balance:
        mean = np.einsum("fck,ck->fc", observations.histogram, response)
        known = (np.bincount(observations.frame, minlength=len(selected)) > 0) & (mean > 0).all(1)
        gain = gain * np.exp(mean_white_balance(np.log(gain), np.log(np.maximum(mean, 1e-6)), known))
    gains = default.gain.copy()
    gains[uncalibrated] = gain
    return Calibration(response, gains, falloff, uncalibrated, np.array(spread))


def solve(
    observations: CodeObservations, frames: int, stated: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray, float]:
    """Response, gains, falloff and the residuals' spread, as in `Calibration`, of observations of some frames.

    Parameters
    ----------
    stated : (f,) float
        Logarithm of the stated exposures; all the same where none are stated.
    """
    point = np.unique(observations.point, return_inverse=True)[1]
    rows, places, k = len(point), int(point.max()) + 1, CALIBRATION.splines
    prior = _log_srgb(observations.code)
    member = sparse.csr_matrix((np.ones(rows), (point, np.arange(rows))), shape=(places, rows))
    of_frame = sparse.csr_matrix((np.ones(rows), (np.arange(rows), observations.frame)), shape=(rows, frames))
    falloff = sparse.csr_matrix(np.stack([observations.r2, observations.r2**2], 1))
    # Unknowns: for each channel the splines and the gains, then the falloff for all.
    designs = [sparse.hstack([-_splines(observations.code[:, c], k), of_frame, falloff]).tocsr() for c in range(3)]
    block = k + frames
    index = [np.r_[c * block : (c + 1) * block, 3 * block, 3 * block + 1] for c in range(3)]
    penalties = [_penalty(observations.code[:, c], frames) for c in range(3)]
    # A code's noise counts by the slope of the logarithm.
    slope = np.gradient(_log_srgb(CODES), CODES)
    deviation = np.hypot(CALIBRATION.texture, CALIBRATION.noise * np.interp(observations.code, CODES, slope))
    weight = deviation**-2 * np.median(deviation) ** 2
    x = np.zeros(3 * block + 2)
    residual = np.zeros((rows, 3))
    for _ in range(LEVELS.reweighted):
        normal, rhs = np.zeros((len(x), len(x))), np.zeros(len(x))
        for c, (design, at) in enumerate(zip(designs, index)):
            w = weight[:, c]
            summed = np.maximum(np.bincount(point, w, places), 1e-12)
            weighted = sparse.diags(w) @ design
            means = member @ weighted
            normal[np.ix_(at, at)] += (design.T @ weighted - means.T @ sparse.diags(1 / summed) @ means).toarray()
            rhs[at] += weighted.T @ prior[:, c] - means.T @ ((member @ (w * prior[:, c])) / summed)
        for at, penalty in zip(index, penalties):
            normal[np.ix_(at[:block], at[:block])] += penalty
        x = np.linalg.solve(normal + 1e-9 * np.trace(normal) / len(x) * np.eye(len(x)), rhs)
        for c, (design, at) in enumerate(zip(designs, index)):
            log_radiance = prior[:, c] - design @ x[at]
            w = weight[:, c]
            residual[:, c] = log_radiance - ((member @ (w * log_radiance)) / np.maximum(member @ w, 1e-12))[point]
        spread = SIGMA_OF_MAD * float(np.median(np.abs(residual)))
        # One weight for all channels: what is no diffuse surface is none in all of them.
        sigma = np.maximum(deviation, spread)
        chi_square = np.square(residual / sigma).mean(1, keepdims=True)
        weight = np.median(sigma) ** 2 / sigma**2 / (1 + chi_square / LEVELS.outlier**2)
    log_response = np.stack([_log_srgb(CODES) + _splines(CODES, k) @ x[at[:k]] for at in index])
    gain = np.stack([x[at[k:block]] for at in index], 1)
    contrast = _stated_contrast(gain.mean(1), stated)
    log_gain = (gain - gain.mean(0)) / contrast
    top = log_response[:, -1:]
    response = np.exp((log_response - top) / contrast)
    response[:, 0] = 0.0
    # Radiance grows with its code, whatever noise gives for codes that hardly occur.
    response = np.maximum.accumulate(response, 1)
    return response, np.exp(log_gain), x[-2:] / contrast, spread


def _log_srgb(code: np.ndarray) -> np.ndarray:
    return np.log(np.maximum(srgb_to_linear(code), srgb_to_linear(np.array(0.5 / 255))))


def _splines(code: np.ndarray, count: int) -> sparse.csr_matrix:
    """Cubic B-splines over 0...1, (n, count)."""
    knots = np.r_[np.zeros(3), np.linspace(0, 1, count - 2), np.ones(3)]
    return BSpline.design_matrix(np.clip(code, 0, 1), knots, 3)


def _penalty(code: np.ndarray, frames: int) -> np.ndarray:
    """Of one channel's splines and gains: smooth, of the prior's contrast, and tied to each other."""
    k = CALIBRATION.splines
    result = np.zeros((k + frames, k + frames))
    second = np.diff(np.eye(k), 2, axis=0)
    result[:k, :k] = CALIBRATION.roughness * second.T @ second + 1e-3 * np.eye(k)
    # Contrast is what the difference has in common with the prior's own curve over the codes that occur: none.
    code = np.quantile(code, CODES)
    curve = _log_srgb(code)
    common = _splines(code, k).T @ (curve - curve.mean()) / np.square(curve - curve.mean()).sum()
    result[:k, :k] += 1e9 * np.outer(common, common)
    # As one observation would: frames that share nothing with the others stay at 1.
    result[k:, k:] = np.eye(frames) / frames
    return result


def _stated_contrast(log_gain: np.ndarray, stated: np.ndarray) -> float:
    """Factor by which the logarithms are too large, by stated exposures (total least squares); 1 if these are equal."""
    if stated.std() < CALIBRATION.least_range or log_gain.std() == 0:
        return 1.0
    return float(np.clip(log_gain.std() / stated.std(), 1 / CALIBRATION.widest, CALIBRATION.widest))
