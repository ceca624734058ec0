"""What is known of light that no frame shows: the sky's parts, and E from everything."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, field

import numpy as np

from ...light.lamps import Lamp
from ...light.params import LIGHT_FIT, SKY
from .params import UNSEEN


@dataclass
class Sky:
    """Parts of the sky whose radiance is not known, and what is known of it so far.

    Attributes
    ----------
    contribution : list of (m,) float64
        E from each part at radiance 1.
    guess : list of (3,) float64
        Radiance of the seen neighbours; of a clipped part the lower bound.
    clipped : list of bool
        Of what frames saw of a part only a lower bound is known.
    measured : list of bool
        Whether frames tell radiance on a part's side of the horizon.
    radiance : list of (3,) float64
    solved : set of int
        Parts of which the radiance was solved for.
    """

    contribution: list[np.ndarray]
    guess: list[np.ndarray]
    clipped: list[bool]
    measured: list[bool]
    radiance: list[np.ndarray] = field(default_factory=list)
    solved: set[int] = field(default_factory=set)

    def __post_init__(self):
        self.radiance = [g.copy() for g in self.guess]

    def bounds(self, i: int) -> tuple[np.ndarray, np.ndarray]:
        """Least and greatest radiance that is believed, (3,) each."""
        guess = np.maximum(self.guess[i], 1e-12)
        if self.clipped[i]:
            return guess, SKY.above * guess
        return guess / (UNSEEN.darker if self.measured[i] else LIGHT_FIT.reach), np.full(
            3, LIGHT_FIT.reach * guess.max()
        )

    def without(self, parts: Collection[int]) -> Sky:
        """The other parts, at the radiance that they have."""
        others = [i for i in range(len(self.contribution)) if i not in parts]
        lists = (self.contribution, self.radiance, self.clipped, self.measured)
        return Sky(*([values[i] for i in others] for values in lists))  # type: ignore[arg-type]

    def notes(self) -> list[str]:
        """One sentence for each part that was solved."""
        notes = []
        for i in sorted(self.solved):
            values, guess = (", ".join(f"{x:.3g}" for x in radiances[i]) for radiances in (self.radiance, self.guess))
            if self.clipped[i]:
                notes.append(
                    "Part of the sky is clipped in every frame that sees it; it was solved from the light it "
                    f"throws: radiance {values} (at least {guess})."
                )
            else:
                notes.append(
                    f"Part {i + 1} of the sky that no frame sees was solved from the light it throws: radiance "
                    f"{values} (its seen neighbours: {guess})."
                )
        return notes


def all_light(
    base: np.ndarray, lamps: list[Lamp], contribution: dict[int, np.ndarray], sky: Sky, without: int = -1
) -> np.ndarray:
    """E from everything, (m, 3): `base`, the lamps, and the sky but for one part."""
    total = base.copy()
    for lamp in lamps:
        total += contribution[lamp.object_id][:, None] * lamp.radiance
    for i, (G, s) in enumerate(zip(sky.contribution, sky.radiance, strict=True)):
        if i != without:
            total += G[:, None] * s
    return total
