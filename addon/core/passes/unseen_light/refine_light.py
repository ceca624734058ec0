"""All unknown light together: what was found one by one is refined under a tighter cap (`light_fit`)."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, field, replace

import numpy as np

from ...light.lamps import Lamp, twin
from ...light.light_fit import Sample
from ...light.params import LIGHT_FIT
from ...luminance import LUMINANCE
from ...scene.model import Instance, class_names
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
    told : list of bool
        Whether frames tell radiance on a part's side of the horizon.
    radiance : list of (3,) float64
    solved : set of int
        Parts of which the radiance was solved for.
    """

    contribution: list[np.ndarray]
    guess: list[np.ndarray]
    clipped: list[bool]
    told: list[bool]
    radiance: list[np.ndarray] = field(default_factory=list)
    solved: set[int] = field(default_factory=set)

    def __post_init__(self):
        self.radiance = [g.copy() for g in self.guess]

    def bounds(self, i: int) -> tuple[np.ndarray, np.ndarray]:
        """Least and greatest radiance that is believed, (3,) each."""
        guess = np.maximum(self.guess[i], 1e-12)
        if self.clipped[i]:
            return guess, UNSEEN.brightest * guess
        return guess / (UNSEEN.darker if self.told[i] else LIGHT_FIT.reach), np.full(3, LIGHT_FIT.reach * guess.max())

    def without(self, parts: Collection[int]) -> Sky:
        """The other parts, at the radiance that they have."""
        kept = [i for i in range(len(self.contribution)) if i not in parts]
        lists = (self.contribution, self.radiance, self.clipped, self.told)
        return Sky(*([one[i] for i in kept] for one in lists))  # type: ignore[arg-type]

    def notes(self) -> list[str]:
        """One sentence for each part that was solved."""
        said = []
        for i in sorted(self.solved):
            values, guess = (", ".join(f"{x:.3g}" for x in one[i]) for one in (self.radiance, self.guess))
            if self.clipped[i]:
                said.append(
                    "Part of the sky is clipped in every frame that sees it; it was solved from the light it "
                    f"throws: radiance {values} (at least {guess})."
                )
            else:
                said.append(
                    f"Part {i + 1} of the sky that no frame sees was solved from the light it throws: radiance "
                    f"{values} (its seen neighbours: {guess})."
                )
        return said


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


def shared_by_class(
    colours: dict[int, np.ndarray], objects: list[int], instances: tuple[Instance, ...]
) -> dict[int, np.ndarray]:
    """The known colours, and for those of `objects` without one the mean of their class's."""
    class_of = class_names(instances)
    alike: dict[str | None, list[np.ndarray]] = {}
    for i, colour in colours.items():
        alike.setdefault(class_of.get(i), []).append(colour)
    of_class = {name: np.mean(known, 0) for name, known in alike.items()}
    return {i: of_class[class_of.get(i)] for i in objects if class_of.get(i) in of_class} | colours


def refined(
    sample: Sample,
    lamps: list[Lamp],
    contribution: dict[int, np.ndarray],
    least: dict[int, float],
    model: dict[int, int],
    seen: list[Lamp],
    sky: Sky,
    base: np.ndarray,
    colours: dict[int, np.ndarray],
) -> list[Lamp]:
    """The lamps with refined radiances; those of the sky are refined in place.

    Parameters
    ----------
    lamps : list of Lamp
        Unseen ones, as found one by one. One that took a seen lamp's radiance keeps it.
    least : dict of float
        Luminance below which each would be no lamp.
    model : dict of int
        `lamp_models`.
    base : (m, 3) float64
        E from all light that the frames show.
    colours : dict of (3,) float
        Known colours of lamps: only their luminance is solved for.
    """
    fixed = [lamp for lamp in lamps if lamp.twin is not None]
    free = [lamp for lamp in lamps if lamp.twin is None]
    parts = sorted(sky.solved)
    if not free and not parts:
        return lamps
    others = sky.without(parts)

    def contributions_of() -> np.ndarray:
        """E that each of `free` and `parts` throws at radiance 1, (m, k)."""
        return np.stack([*(contribution[lamp.object_id] for lamp in free), *(sky.contribution[i] for i in parts)], 1)

    def solve(weights: np.ndarray, start: np.ndarray, bright: np.ndarray | None = None) -> np.ndarray:
        """Radiances of `free` and `parts` in the channel that `weights` ((3,)) makes.

        With the luminance of all E ((m,)), `bright`, those under which the albedo's colour varies least: the texture
        and the errors of E that all channels share are gone then.
        """
        low, high = np.zeros(len(start)), np.full(len(start), np.inf)
        for k, lamp in enumerate(free):
            low[k] = least[lamp.object_id] * float(start[k] / max(float(lamp.radiance @ LUMINANCE), 1e-12))
        for k, i in enumerate(parts, len(free)):
            low[k], high[k] = (bound @ weights for bound in sky.bounds(i))
        sent, others_light = sample.radiance @ weights, all_light(base, fixed, contribution, others)
        if bright is not None:
            sent = sent * bright / np.maximum(sample.radiance @ LUMINANCE, 1e-12)
        return sample.refine(sent, others_light @ weights, contributions_of(), start, low, high)

    def now() -> np.ndarray:
        return np.maximum([*(lamp.radiance for lamp in free), *(sky.radiance[i] for i in parts)], 1e-9)

    luminance = solve(LUMINANCE, now() @ LUMINANCE)
    twins = {
        lamp.object_id: replace(lamp, radiance=same.radiance, twin=same.object_id, solved=float(s))
        for lamp, s in zip(free, luminance, strict=False)
        if (same := twin(lamp.object_id, s, model, seen)) is not None
    }
    if twins:
        fixed += twins.values()
        free = [lamp for lamp in free if lamp.object_id not in twins]
        if not free and not parts:
            return [twins.get(lamp.object_id, lamp) for lamp in lamps]
        luminance = solve(LUMINANCE, now() @ LUMINANCE)
    colour = now() * (luminance / (now() @ LUMINANCE))[:, None]
    bright = all_light(base, fixed, contribution, others) @ LUMINANCE + contributions_of() @ luminance
    told = np.array([lamp.object_id in colours for lamp in free] + [False] * len(parts), bool)
    fixed += [replace(lamp, radiance=colour[k].astype(np.float32)) for k, lamp in enumerate(free) if told[k]]
    free = [lamp for lamp in free if lamp.object_id not in colours]
    colour, luminance = colour[~told], luminance[~told]
    if len(colour):
        by_channel = np.stack([solve(np.eye(3)[c], colour[:, c], bright) for c in range(3)], 1)
        share = by_channel @ LUMINANCE / luminance
        colour = np.where(np.abs(share - 1)[:, None] < LIGHT_FIT.alike, by_channel / share[:, None], colour)
    for k, i in enumerate(parts, len(free)):
        sky.radiance[i] = np.clip(colour[k], *sky.bounds(i))
    done = {lamp.object_id: lamp for lamp in fixed}
    done |= {lamp.object_id: replace(lamp, radiance=colour[k].astype(np.float32)) for k, lamp in enumerate(free)}
    return [done[lamp.object_id] for lamp in lamps]
