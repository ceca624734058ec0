"""Lamps that the frames see: objects that give more light than they could reflect."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..luminance import LUMINANCE

EMITTER_ALBEDO = 2.0
"""An object whose median albedo would have to be above this gives light of its own. 1 is the physical bound; the rest
is room for missing light and for noise."""
AGREES = 0.25
"""Luminances that lie this near each other (relative) count as the same."""


@dataclass(frozen=True)
class Lamp:
    """One object that gives light.

    Attributes
    ----------
    object_id : int
    radiance : (3,) float32
        Median over its elements, or solved for.
    seen : bool
        False: solved for from the light that it throws.
    note : str
        How the radiance was found, where that needs saying.
    """

    object_id: int
    radiance: np.ndarray
    seen: bool
    note: str = ""


def find_seen(object_id: np.ndarray, radiance: np.ndarray, irradiance: np.ndarray) -> list[Lamp]:
    """Objects whose albedo pi L_d / E would have to be above `EMITTER_ALBEDO`.

    Parameters
    ----------
    object_id : (m,) int
        Of a sample of elements.
    radiance, irradiance : (m, 3) float32
        L_d and E there.
    """
    luminance, received = radiance @ LUMINANCE, irradiance @ LUMINANCE
    lamps = []
    for one in np.unique(object_id):
        own = object_id == one
        if np.median(np.pi * luminance[own] / np.maximum(received[own], 1e-12)) > EMITTER_ALBEDO:
            lamps.append(Lamp(int(one), np.median(radiance[own], 0), True))
    return lamps


def twin(object_id: int, luminance: float, class_of: dict[int, str], seen: list[Lamp]) -> Lamp | None:
    """A seen lamp of the object's class with about the luminance that was solved for the object."""
    for other in seen:
        if class_of.get(other.object_id) == class_of.get(object_id):
            if abs(luminance / float(other.radiance @ LUMINANCE) - 1) < AGREES:
                return other
    return None
