"""The white balance that all frames have in common, from how a camera's automatics follow what it sees.

Calibration knows what frames' white balances differ by, and not their mean: light and camera can trade it. But a camera
that balances by itself shows how much it balances. It sees the mean colour g of a picture (grey world, Buchsbaum 1980),
takes a share s of it out, and is slow to follow: with f the mean of the frames so far, weights falling off by a rate,

    log b = -s f(log g),   in each channel about the channels' mean.

g is known up to the constant that b is: log b' = log b - c, log g' = log g + c. So s is the slope over the frames, and
c = -(mean log b' + s mean f(log g')) / (1 - s): what a half-balanced picture keeps of the light's colour tells what was
taken out. The nearer s is to 1 the less it tells, and the more c is shrunk.
"""

import numpy as np

from ...scene.params import VISIBILITY
from .params import CALIBRATION


def mean_white_balance(log_gain: np.ndarray, log_mean: np.ndarray, told: np.ndarray) -> np.ndarray:
    """What frames' white balances are too small by, in common.

    Parameters
    ----------
    log_gain : (f, 3) float
        Exposures times white balances, each channel up to a constant, frames in the order in which they were taken.
    log_mean : (f, 3) float
        Of the frames' linear light as the camera balanced it.
    told : (f,) bool
        Frames whose gain is known.

    Returns
    -------
    (3,) float
        To be added to `log_gain`; of mean 0, and 0 where the frames' white balances don't follow their colours.
    """
    balance, seen = _chroma(log_gain), _chroma(log_mean - log_gain)
    if told.sum() < VISIBILITY.enough:
        return np.zeros(3)
    fits = [_fit(balance, _followed(seen, rate), told) for rate in np.geomspace(1 / len(seen), 1, CALIBRATION.rates)]
    _, strength, error, mean_seen = min(fits, key=lambda fit: fit[0])
    left = 1 - strength
    if left <= 0 or strength <= 0:
        return np.zeros(3)
    found = -(balance[told].mean(0) + strength * mean_seen) / left
    # What the strength is off by counts by the derivative of s / (1 - s).
    off = np.hypot(error, CALIBRATION.strength_error) / left**2 * np.sqrt(np.square(mean_seen).mean())
    return found / (1 + (off / CALIBRATION.cast) ** 2)


def _chroma(log: np.ndarray) -> np.ndarray:
    return log - log.mean(1, keepdims=True)


def _followed(seen: np.ndarray, rate: float) -> np.ndarray:
    """Exponential moving average over the frames."""
    result = np.empty_like(seen)
    result[0] = seen[0]
    for i in range(1, len(seen)):
        result[i] = result[i - 1] + rate * (seen[i] - result[i - 1])
    return result


def _fit(balance: np.ndarray, followed: np.ndarray, told: np.ndarray) -> tuple[float, float, float, np.ndarray]:
    """Squared error, strength, its standard error, and the mean of `followed`."""
    mean_seen = followed[told].mean(0)
    x, y = followed[told] - mean_seen, balance[told] - balance[told].mean(0)
    squares = max(float(np.square(x).sum()), 1e-12)
    strength = -float((x * y).sum()) / squares
    left = float(np.square(y + strength * x).sum())
    return left, strength, np.sqrt(left / (2 * len(x)) / squares), mean_seen
