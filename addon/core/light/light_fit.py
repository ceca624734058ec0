"""The radiances under which albedo varies least within the objects, and the elements that can tell.

For trial radiances s_k the albedos would be pi L_d / (E + sum s_k G_k), G_k being the irradiance that light k throws at
radiance 1. What is minimised is the mean deviation of log albedo from its object's median, each held at a cap; at the
end from the median of all objects of its paint as well (`kinds_of`).
"""

from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize, minimize_scalar

from ..groups import by_label
from ..scene.atlas import Atlas
from .params import LIGHT_FIT


def on_flat(atlas: Atlas) -> np.ndarray:
    """Elements around which the normals of their object agree, (n,) bool."""
    cell = np.floor(atlas.position / LIGHT_FIT.flat_cell).astype(np.int64)
    cell -= cell.min(0, initial=0)
    extent = cell.max(0, initial=0) + 1
    key = ((cell[:, 0] * extent[1] + cell[:, 1]) * extent[2] + cell[:, 2]) * (int(atlas.object_id.max(initial=0)) + 1)
    _, group, count = np.unique(key + atlas.object_id, return_inverse=True, return_counts=True)
    total = np.stack([np.bincount(group, atlas.normal[:, k], len(count)) for k in range(3)], 1)
    return (np.linalg.norm(total, axis=1) >= LIGHT_FIT.flat * count)[group]


class _Grouping:
    """Values in groups ((m,) int, 0 to k - 1), whose elements weigh differently."""

    def __init__(self, group: np.ndarray, weight: np.ndarray):
        self._group, self._weight = group, weight
        before = np.concatenate([[0.0], np.cumsum(np.bincount(group, weight))])
        self._middle = (before[:-1] + before[1:]) / 2

    def medians(self, values: np.ndarray) -> np.ndarray:
        """Of each value ((m,)), its group's weighted median."""
        order = np.lexsort((values, self._group))
        reached = np.cumsum(self._weight[order])
        at = np.minimum(np.searchsorted(reached, self._middle), len(order) - 1)
        return values[order[at]][self._group]


def kinds_of(object_id: np.ndarray, log_albedo: np.ndarray, class_of: dict[int, str]) -> np.ndarray:
    """Number objects of one class that seem to be of one paint alike.

    A lamp's level is told by what it lights beside what it does not, and few objects have much of both. Of the true
    luminance two clipped lamps had 1.03 +- .045 with each object by itself (four perturbed living rooms, two seeds
    each), and .975 +- .022 with kinds.

    Parameters
    ----------
    object_id : (m,) int
    log_albedo : (m, 3) float
    class_of : dict of str

    Returns
    -------
    (m,) int64
        The same for elements of objects whose albedo is within `alike` of their class's median, and its colour within
        `same`; else the object's own.
    """
    ids, group = np.unique(object_id, return_inverse=True)
    median = np.stack([np.median(log_albedo[own], 0) for own in by_label(group)])
    names = np.array([class_of.get(int(i), "") for i in ids])
    kind = np.arange(len(ids))
    classes = np.unique(names)
    # One class for all is none.
    for name in classes if len(classes) > 1 else ():
        own = np.flatnonzero(names == name)
        off = median[own] - np.median(median[own], 0)
        alike = np.abs(off.mean(1)) < LIGHT_FIT.alike
        alike &= (np.abs(off - off.mean(1, keepdims=True)) < LIGHT_FIT.same).all(1)
        if alike.sum() > 1:
            kind[own[alike]] = kind[own[alike][0]]
    return kind[group]


@dataclass
class Sample:
    """m elements with a good L_d.

    Attributes
    ----------
    element : (m,) int
    object_id : (m,) int32
    radiance : (m, 3) float64
        L_d.
    received : (m, 3) float64
        E from all light known so far.
    most : float
        Elements that an object counts for at most; of one that has more each counts less.
    kind : (m,) int, optional
        Objects that are alike (`kinds_of`): deviations are then taken from the median of these as well.
    cap : float
        Under which all is refined.
    """

    element: np.ndarray
    object_id: np.ndarray
    radiance: np.ndarray
    received: np.ndarray
    most: float = np.inf
    kind: np.ndarray | None = None
    cap: float = LIGHT_FIT.cap

    def __post_init__(self):
        _, self.group = np.unique(self.object_id, return_inverse=True)
        self._weight = np.minimum(1, self.most / np.bincount(self.group))[self.group]
        self._groupings = [_Grouping(self.group, self._weight)]
        if self.kind is not None:
            self._groupings.append(_Grouping(np.unique(self.kind, return_inverse=True)[1], self._weight))

    def spread(self, log_albedo: np.ndarray, cap: float = LIGHT_FIT.coarse) -> float:
        """Mean absolute deviation of log albedo ((m,)) from its object's median, each held at `cap`; with kinds, the
        mean of that and of the same from its kind's median.
        """
        off = [np.minimum(np.abs(log_albedo - by.medians(log_albedo)), cap) for by in self._groupings]
        return float(np.average(np.mean(off, 0), weights=self._weight))

    def best(
        self, sent: np.ndarray, received: np.ndarray, contribution: np.ndarray
    ) -> tuple[float, float, float] | None:
        """The radiance s that explains best what is `sent`, with the spread before and after; None if unbounded."""
        if not (contribution > 0).any():
            return None
        sent = np.log(np.maximum(sent, 1e-9))

        def cost(log_s: float) -> float:
            return self.spread(sent - np.log(received + np.exp(log_s) * contribution + 1e-12))

        # The scale to search around: where the trial light gives as much as all known light together.
        grid = np.log(max(received.mean(), 1e-9) / contribution.mean()) + np.linspace(-5, 4, 37)
        costs = [cost(x) for x in grid]
        at = int(np.argmin(costs))
        if at == len(grid) - 1:
            return None  # more is always better: this says nothing about the light
        found = minimize_scalar(cost, bounds=(grid[max(at - 1, 0)], grid[at + 1]), method="bounded")
        return float(np.exp(found.x)), self.spread(sent - np.log(received + 1e-12)), float(found.fun)

    def refine(
        self,
        sent: np.ndarray,
        received: np.ndarray,
        contribution: np.ndarray,
        start: np.ndarray,
        least: np.ndarray,
        most: np.ndarray,
    ) -> np.ndarray:
        """All radiances together, under the tighter cap.

        Parameters
        ----------
        sent, received : (m,) float64
            L_d, and E from all light but these.
        contribution : (m, k) float64
        start, least, most : (k,) float
        """
        sent = np.log(np.maximum(sent, 1e-9))
        least, most = np.maximum(least, start / LIGHT_FIT.reach), np.minimum(most, start * LIGHT_FIT.reach)
        bounds = np.log(np.stack([np.minimum(least, most), most], 1))

        def cost(x: np.ndarray) -> float:
            return self.spread(sent - np.log(received + contribution @ np.exp(x) + 1e-12), self.cap)

        how = {"xtol": 5e-3, "ftol": 1e-6, "maxiter": 10}
        return np.exp(minimize(cost, np.clip(np.log(start), *bounds.T), method="Powell", bounds=bounds, options=how).x)
