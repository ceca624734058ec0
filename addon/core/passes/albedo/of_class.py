"""Albedo of objects of one class: its level, which E's error puts off place by place, shrunk towards the class's.

Doors, panels, chairs of one class mostly are of one paint. A random-effects model of log albedo tells how far: how much
the members differ beyond their own errors is estimated (DerSimonian and Laird 1986), and each is shrunk by that
(empirical Bayes). Where they are of several paints, they stay as they are.
"""

from collections.abc import Mapping, Sequence

import numpy as np

from ...scene.atlas import Atlas
from .params import ALBEDO, CLASS_PRIOR


def shrunk_to_class(atlas: Atlas, rho: np.ndarray, measured: np.ndarray, class_of: Mapping[int, str]) -> np.ndarray:
    """Albedo with all of each object's times what its level is shrunk by, (n, 3) float32.

    Parameters
    ----------
    rho : (n, 3) float32
    measured : (n,) bool
        Elements that the level is taken from.
    class_of : mapping of int to str
        Of the objects that somebody told apart; others stay as they are.
    """
    result = rho.copy()
    members: dict[str, list[np.ndarray]] = {}
    for object_id, name in class_of.items():
        elements = atlas.elements_of(object_id)
        if measured[elements].any():
            members.setdefault(name, []).append(elements)
    for group in members.values():
        if len(group) > 1:
            for elements, factor in zip(
                group, _factors(atlas, rho, [elements[measured[elements]] for elements in group]), strict=True
            ):
                result[elements] *= factor
    return result


def _factors(atlas: Atlas, rho: np.ndarray, measured: Sequence[np.ndarray]) -> np.ndarray:
    """Factors by which the albedo of a class's k members is shrunk, (k,) float32."""
    colour = np.log(np.maximum([np.median(rho[elements], 0) for elements in measured], ALBEDO.floor))
    area = np.array([atlas.area[elements].sum() for elements in measured])
    # E errs by the place: a large member lies in several.
    variance = np.minimum(CLASS_PRIOR.of_place**2 / area, CLASS_PRIOR.most**2)
    weight = 1 / variance
    # Paints that differ in one channel differ.
    deviation = np.square(colour - np.average(colour, 0, weight)).max(1)
    excess = (weight * deviation).sum() - (len(colour) - 1)
    between = max(excess / (weight.sum() - np.square(weight).sum() / weight.sum()), 0.0)
    level = colour.mean(1)
    class_level = np.average(level, weights=1 / (variance + between))
    return np.exp(variance / (between + variance) * (class_level - level)).astype(np.float32)
