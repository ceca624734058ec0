"""How texture is carried into what no frame saw."""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class TextureParams:
    """Of `planes`, that is what lies in one plane and the picture of it; of `synthesis`; and what is enough to go by.

    Attributes
    ----------
    tries : int
        Planes of its own unmeasured elements that are tried, each judged by `LEVELS.sample` of them.
    planes : int
        Of an object, those with most unmeasured surface.
    cells : int
        Of a plane's picture, at most; it is made coarser where it would have more.
    least : float
        Texels that a triangle covers at least. What is smaller shares its texels with others and is not laid out flat.
    stretch : float
        Times that an atlas's axis may be longer than the other, and a texel larger than the picture's cells.
    mostly : int
        Cells along a square of which most have to be sure (`LEVELS.sure`, or the better half) for the one in its middle
        to be copied.
    decay : float
        A texture's scale is the lag at which its autocorrelation, averaged over directions, has fallen to this.
    samples : float
        Squares of the scale that the measured part of a plane has at least.
    smooth : float
        Scales: standard deviation of the mean that is taken out before anything is copied, and put back.
    window : float
        Scales: radius within which a copy is compared with what lies around.
    blocks : int
        That radius in blocks of cells, which take their offset together.
    before : float
        Share of such a square that an offset's difference over all of the picture counts for beside it.
    offsets : int
        By which copies are tried.
    peaks : int
        Maxima of the autocorrelation, the highest ones, that these are chosen from, by which of them cover the hole.
    unlike : float
        Correlation that an offset counts for where it has less: textures without a pattern have no better ones.
    again : float
        What a place counts for in the choice of offsets once one more of them covers it.
    """

    tries: int = 16
    planes: int = 6
    cells: int = 1_000_000
    least: float = 0.05
    stretch: float = 1.5
    mostly: int = 5
    decay: float = float(np.exp(-1))
    samples: float = 64.0
    smooth: float = 4.0
    window: float = 2.0
    blocks: int = 4
    before: float = 0.25
    offsets: int = 48
    peaks: int = 2048
    unlike: float = 0.02
    again: float = 0.7


TEXTURE = TextureParams()
