"""The white balance that all frames have in common, from how a camera's automatics follow what it sees.

Calibration knows what frames' white balances differ by, and not their mean: light and camera can trade it. But a camera
that balances by itself shows how much it balances. It sees the mean colour g of a picture (grey world, Buchsbaum 1980),
takes a share s of it out, and is slow to follow: with f the mean of the frames so far, weights falling off by a rate,

    log b = -s f(log g),   in each channel about the channels' mean.

g is known up to the constant that b is: log b' = log b - c, log g' = log g + c. So s is the slope over the frames, and
c = -(mean log b' + s mean f(log g')) / (1 - s): what a half-balanced picture keeps of the light's colour shows what was
taken out. The nearer s is to 1 the less it shows, and the more c is shrunk.
"""

import numpy as np

from ...scene.params import VISIBILITY
from .params import CALIBRATION


def mean_white_balance(log_gain: np.ndarray, log_mean: np.ndarray, known: np.ndarray) -> np.ndarray:
    """Logarithm by which the white balances of all frames are too small.

    Parameters
    ----------
    log_gain : (f, 3) float
        Exposures times white balances, each channel up to a constant, frames in the order in which they were taken.
    log_mean : (f, 3) float
        Of the frames' linear light as the camera balanced it.
    known : (f,) bool
        Frames whose gain is known.

    Returns
    -------
    (3,) float
        To be added to `log_gain`; of mean 0, and 0 where the frames' white balances don't follow their colours.
    """
    balance, chroma = _chroma(log_gain), _chroma(log_mean - log_gain)
    if known.sum() < VISIBILITY.enough:
        return np.zeros(3)
    fits = [
        _fit(balance, _moving_average(chroma, rate), known)
        for rate in np.geomspace(1 / len(chroma), 1, CALIBRATION.rates)
    ]
    _, strength, error, mean_followed = min(fits, key=lambda fit: fit[0])
    retained = 1 - strength
    if retained <= 0 or strength <= 0:
        return np.zeros(3)
    correction = -(balance[known].mean(0) + strength * mean_followed) / retained
    # The strength's error counts by the derivative of s / (1 - s).
    uncertainty = np.hypot(error, CALIBRATION.strength_error) / retained**2 * np.sqrt(np.square(mean_followed).mean())
    return correction / (1 + (uncertainty / CALIBRATION.cast) ** 2)


def _chroma(log: np.ndarray) -> np.ndarray:
    return log - log.mean(1, keepdims=True)


def _moving_average(chroma: np.ndarray, rate: float) -> np.ndarray:
    """Exponential moving average over the frames."""
    result = np.empty_like(chroma)
    result[0] = chroma[0]
    for i in range(1, len(chroma)):
        result[i] = result[i - 1] + rate * (chroma[i] - result[i - 1])
    return result


def _fit(balance: np.ndarray, followed: np.ndarray, known: np.ndarray) -> tuple[float, float, float, np.ndarray]:
    """Squared error, strength, its standard error, and the mean of `followed`."""
    mean_followed = followed[known].mean(0)
    x, y = followed[known] - mean_followed, balance[known] - balance[known].mean(0)
    squares = max(float(np.square(x).sum()), 1e-12)
    strength = -float((x * y).sum()) / squares
    squared_error = float(np.square(y + strength * x).sum())
    return squared_error, strength, np.sqrt(squared_error / (2 * len(x)) / squares), mean_followed
