"""How a camera's codes relate to radiance: its response, a frame's exposure and white balance, vignetting."""

from dataclasses import dataclass

import numpy as np

CODES = np.arange(256) / 255
"""The codes of 8 bits."""


@dataclass(frozen=True)
class Radiometry:
    """Of one frame: code = response^-1(radiance * gain * vignetting), channel by channel.

    Attributes
    ----------
    response : (3, m) float32
        Inverse camera response: linear light at m codes, evenly from 0 to the greatest, Rec.709 red, green, blue. With
        65536 they hold the codes of 8 and of 16 bits.
    gain : (3,) float
        Exposure times white balance.
    falloff : (2,) float
        log vignetting = falloff[0] r^2 + falloff[1] r^4, r the distance from the principal point over focal length.
    """

    response: np.ndarray
    gain: np.ndarray
    falloff: np.ndarray

    def radiance(self, codes: np.ndarray, r2: np.ndarray) -> np.ndarray:
        """Linear radiance ((..., 3) float32) of codes in 0...1 ((..., 3) float32) at squared distances `r2` ((...))."""
        nearest = np.rint(codes * np.float32(self.response.shape[1] - 1)).astype(np.intp)
        linear = np.stack([self.response[c].take(nearest[..., c]) for c in range(3)], -1)
        attenuation = vignetting(r2.astype(np.float32), self.falloff.astype(np.float32))
        return linear / (attenuation[..., None] * self.gain.astype(np.float32))


def at_16_bits(response: np.ndarray) -> np.ndarray:
    """A response at the codes of 16 bits, from those of 8, (3, 256) -> (3, 65536) float32."""
    codes = np.linspace(0, 1, 1 << 16)
    return np.stack([np.interp(codes, CODES, channel) for channel in response]).astype(np.float32)


def vignetting(r2: np.ndarray, falloff: np.ndarray) -> np.ndarray:
    """Share of the light that reaches the sensor at squared distances `r2`, 1 at the principal point."""
    return np.exp(falloff[0] * r2 + falloff[1] * np.square(r2))
