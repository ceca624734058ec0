"""The colour of what the sensor clipped, from the pixels along its edge that it covers in part.

A pixel that shows a share f of a lamp and 1 - f of what is behind it has the radiance b + f (L - b): too little to be
clipped, and what it has above its surroundings b has the lamp's colour (L is far above b). Glare around a lamp has it,
too. How bright the lamp is does not follow, as f is not known to better than poses and mesh are.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import ndimage

from ...luminance import LUMINANCE
from ...scene.model import Pixels
from ...scene.visibility import FrameView
from ...significance import LEVELS

AROUND = np.ones((3, 3), bool)


@dataclass(frozen=True)
class FringeParams:
    """Of the colours of what was clipped (`fringe-colours` in docs/ablation.md).

    Attributes
    ----------
    least_excess : float
        Of the level at which the sensor clipped: fainter, a fringe says more of its surroundings than of the lamp.
    least_pixels : int
        Smaller clipped spots may be glints.
    near : int
        Pixels from a clipped spot at which its surroundings begin; they end twice as far off.
    """

    least_excess: float = 0.25
    least_pixels: int = 4
    near: int = 2


FRINGES = FringeParams()


@dataclass(frozen=True)
class Fringes:
    """Colours of k objects that were clipped.

    Attributes
    ----------
    object_id : (k,) int32
    colour : (k, 3) float32
        Linear Rec.709 of luminance 1.
    """

    object_id: np.ndarray
    colour: np.ndarray

    @staticmethod
    def none() -> Fringes:
        """Where nothing is clipped."""
        return Fringes(np.zeros(0, np.int32), np.zeros((0, 3), np.float32))

    def colours(self) -> dict[int, np.ndarray]:
        """Colour of each object, (3,) float64."""
        return {int(i): colour.astype(np.float64) for i, colour in zip(self.object_id, self.colour, strict=True)}


class FringeCollector:
    """Collects fringes frame by frame; give `add` to `accumulate(also=...)`."""

    def __init__(self) -> None:
        self._excess: dict[int, list[np.ndarray]] = {}

    def add(self, view: FrameView, pixels: Pixels) -> None:
        """Take the fringes of all clipped spots that show one object."""
        clipped = pixels.saturated
        if not clipped.any():
            return
        spots, _ = ndimage.label(clipped, AROUND)
        usable = pixels.valid & ~clipped
        far_from_any = ~ndimage.binary_dilation(clipped, AROUND, FRINGES.near)
        for index, box in enumerate(ndimage.find_objects(spots), 1):
            ids = view.object_id[box][spots[box] == index]
            owner = np.bincount(ids[ids >= 0], minlength=1)
            if len(ids) < FRINGES.least_pixels or 2 * owner.max() <= len(ids):
                continue
            around = tuple(slice(max(side.start - 2 * FRINGES.near, 0), side.stop + 2 * FRINGES.near) for side in box)
            excess = self._of_spot(
                spots[around] == index, clipped[around] & (spots[around] != index), usable[around],
                far_from_any[around] & usable[around], pixels.radiance[around],
            )  # fmt: skip
            if len(excess):
                self._excess.setdefault(int(owner.argmax()), []).append(excess)

    def result(self) -> Fringes:
        """Colours of the objects with enough fringe pixels: the median of each channel's share in the luminance."""
        found = {i: np.concatenate(parts) for i, parts in sorted(self._excess.items())}
        found = {i: excess for i, excess in found.items() if len(excess) >= LEVELS.enough}
        if not found:
            return Fringes.none()
        colour = np.array([np.median(excess / (excess @ LUMINANCE)[:, None], 0) for excess in found.values()])
        colour /= (colour @ LUMINANCE)[:, None]
        return Fringes(np.array(list(found), np.int32), colour.astype(np.float32))

    def _of_spot(
        self, spot: np.ndarray, others: np.ndarray, usable: np.ndarray, behind: np.ndarray, radiance: np.ndarray
    ) -> np.ndarray:
        """What the pixels next to a clipped spot have above its surroundings, (p, 3) float64, where that is much."""
        fringe = ndimage.binary_dilation(spot, AROUND) & usable & ~ndimage.binary_dilation(others, AROUND)
        behind = behind & ndimage.binary_dilation(spot, AROUND, 2 * FRINGES.near)
        if not fringe.any() or not behind.any():
            return np.zeros((0, 3))
        excess = radiance[fringe].astype(np.float64) - np.median(radiance[behind], 0)
        # Clipped to inf, pixels have no value: the brightest of the fringe is all that is known of the sensor.
        bound = (radiance[spot] @ LUMINANCE)[radiance[spot].any(1)]
        level = float(bound.min()) if len(bound) else float((radiance[fringe] @ LUMINANCE).max())
        return excess[(excess.min(1) >= 0) & (excess @ LUMINANCE >= FRINGES.least_excess * level)]
