"""Where the sensor clips, found in the pictures of a capture that does not say so (`saturation` in transforms.json).

Clipped values pile up at one number that nothing exceeds. So does a lamp of one radiance in pictures without noise, but
in always the same channels of its pixels: a clipped picture also has pixels of which one channel is clipped and the
others are not, with all kinds of values. The number is looked for in what is stored (a sensor that clips) and, where
exposures differ, in stored / exposure (an HDR picture that was clipped and then scaled).
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ..errors import BadInputError
from ..kinds import Block
from ..scene.model import Frame
from .brackets import DIFFERENT
from .exr import HALF_MAX

LOOK = 32
"""Frames that are looked at, spread evenly; 0.4 s for 320 x 240."""
MAX_PIXELS: Block[int] = 1 << 23
"""Pixels of a picture of which all are looked at; of more, every second, third and so on."""
WIDTH = 1e-3
"""Values within this share of the greatest are alike: a half float rounds by up to 5e-4."""
PILE = 16
"""Fewer pixels there are no pile."""
STEEP = 4.0
"""The pile is this many times what lies in the ten times wider band below it; a smooth tail has a tenth."""
PARTLY = 4
"""Pixels with other channels at the level than the rest of the pile, of different values, that tell it from a lamp."""


class _Pile(NamedTuple):
    """What lies at a level: pixels in each frame, how many just below it, and what their other channels hold."""

    frames: np.ndarray
    below: int
    patterns: np.ndarray
    others: int


def _pile(pictures: Sequence[np.ndarray], level: np.ndarray) -> _Pile:
    """Count around `level` ((k,), a number for each of the k pictures, (m, 3) each)."""
    patterns, frames, below, others = np.zeros(8, int), [], 0, []
    for values, frame_level in zip(pictures, level):
        near = values[values.max(1) >= frame_level * (1 - 11 * WIDTH)]
        at = near >= frame_level * (1 - WIDTH)
        clipped = at.any(1)
        frames.append(int(clipped.sum()))
        below += int((~clipped).sum())
        patterns += np.bincount(at[clipped] @ np.array([1, 2, 4]), minlength=8)
        others.append(near[clipped][~at[clipped]] / frame_level)
    return _Pile(np.array(frames), below, patterns, len(np.unique(np.concatenate(others).round(3))))


def _is_clipped(pile: _Pile, exposure: np.ndarray) -> bool:
    """Whether a pile is one of clipped values; `exposure` ((k,)) is 1 throughout where it can tell nothing."""
    count = int(pile.frames.sum())
    if count < PILE or count < STEEP * pile.below:
        return False
    reached = exposure[pile.frames >= PARTLY]
    if len(reached) and reached.max() > DIFFERENT * reached.min():
        return True
    # The commonest set of clipped channels may be a lamp's; the others are its edges, highlights, the sky.
    return count - int(pile.patterns.max()) >= PARTLY and pile.others >= PARTLY


def find_clipping(frames: Sequence[Frame], read: Callable[[Path], np.ndarray]) -> tuple[tuple[Frame, ...], list[str]]:
    """Give the frames the saturation that their pictures show; they stay as they are where any of them states one.

    Parameters
    ----------
    read : callable
        A picture's stored values, (h, w, 3) float32.

    Returns
    -------
    frames : tuple of Frame
    notes : list of str
        One sentence where clipping was found.
    """
    frames = tuple(frames)
    if any(np.isfinite(frame.saturation) for frame in frames):
        return frames, []
    pictures, exposures, top = [], [], []
    for i in np.unique(np.linspace(0, len(frames) - 1, min(LOOK, len(frames))).astype(int)) if frames else ():
        try:
            values = read(frames[i].path).reshape(-1, 3)
        except BadInputError:
            continue  # told when the frame is read for what it shows
        values = values[(np.isfinite(values) & (values < HALF_MAX)).all(1)]
        top.append(values.max(initial=0))
        # Only what lies at a level or just below is counted, and no level is below a picture's greatest value.
        pictures.append(
            values[values.max(1, initial=0) >= top[-1] * (1 - 11 * WIDTH)][:: len(values) // MAX_PIXELS + 1]
        )
        exposures.append(frames[i].exposure)
    exposure = np.array(exposures)
    if not sum(len(values) for values in pictures):
        return frames, []
    tops = np.array(top)
    none = np.ones(len(top))
    piles = []
    scalings = [(none, exposure, "")] + ([(exposure, none, " times the exposure")] if np.ptp(exposure) > 0 else [])
    for scale, known_exposure, what in scalings:
        level = float((tops / scale).max())
        pile = _pile(pictures, level * scale)
        if level > 0 and _is_clipped(pile, known_exposure):
            piles.append((int(pile.frames.sum()), level, what))
    if not piles:
        return frames, []
    # Of the frame that reaches the greater value by the wrong scale alone, the pile is there as well, but smaller.
    _, level, what = max(piles)
    saturations = [level * (frame.exposure if what else 1.0) * (1 - WIDTH) for frame in frames]
    note = (
        f"The frames clip at {level:.4g}{what}, as their values pile up there; what is that bright counts as a "
        "lower bound. Give `saturation` in the poses' file if this is wrong."
    )
    return tuple(replace(frame, saturation=s) for frame, s in zip(frames, saturations)), [note]
