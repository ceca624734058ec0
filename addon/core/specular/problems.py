"""The observations of one object made into a fit's problem: elements, views, and the light that they reflect."""

from __future__ import annotations

import numpy as np

from ..lit_diffuse.accumulate import LitDiffuse
from ..shading.emitters import bright_triangles
from ..shading.field import LightField
from .layout import Problem
from .lobes import LobeLight, reflected_light
from .samples import Samples

LEAST_VIEWS = 4
"""Elements seen by fewer frames can't tell what changes with the view."""


def pick(samples: Samples, of_object: np.ndarray, elements: int, views: int, least: int, seed: int) -> np.ndarray:
    """Indices into `samples` of up to `views` views of up to `elements` elements, sorted by element.

    Parameters
    ----------
    of_object : (k,) int
        Indices of the object's observations.
    least : int
        Elements with fewer views are left out.
    """
    rng = np.random.default_rng(seed)
    names, group, count = np.unique(samples.element[of_object], return_inverse=True, return_counts=True)
    enough = np.flatnonzero(count >= least)
    if len(enough) > elements:
        enough = rng.choice(enough, elements, replace=False)
    wanted = np.zeros(len(names), bool)
    wanted[enough] = True
    index, group = of_object[wanted[group]], group[wanted[group]]
    if not len(index):
        return index
    order = np.lexsort((rng.random(len(index)), group))
    index, group = index[order], group[order]
    start = np.concatenate([[0], np.flatnonzero(np.diff(group)) + 1])
    rank = np.arange(len(index)) - np.repeat(start, np.diff(np.concatenate([start, [len(index)]])))
    return np.sort(index[rank < views])


class Problems:
    """Makes the problem of any object, with as many elements, views and rays as wished.

    Parameters
    ----------
    field : LightField
    lit_diffuse : LitDiffuse
    samples : Samples
    """

    def __init__(self, field: LightField, lit_diffuse: LitDiffuse, samples: Samples, threads: int = 0, seed: int = 0):
        self._field, self._lit, self._samples = field, lit_diffuse, samples
        self._threads, self._seed = threads, seed
        self._bright = bright_triangles(field)
        # A clipped pixel is no value; what is left is sorted by object, so that each object's lies together.
        usable = np.flatnonzero(~samples.saturated)
        owner = field.atlas.object_id[samples.element[usable]]
        order = np.argsort(owner, kind="stable")
        self._owner, self._usable = owner[order], usable[order]

    def pick(self, object_id: int, elements: int, views: int, least: int = LEAST_VIEWS, seed: int = 0) -> np.ndarray:
        """Indices into the samples of some of an object's observations, sorted by element."""
        first, last = np.searchsorted(self._owner, [object_id, object_id + 1])
        return pick(self._samples, self._usable[first:last], elements, views, least, self._seed + seed)

    def light(self, index: np.ndarray, rays: int, phi: float | None = None) -> LobeLight:
        """A and B of observations: for the whole grid, or for the one width `phi` with rays of that width."""
        known = {} if phi is None else {"grid": np.float32([phi]), "proposals": (phi,)}
        return reflected_light(
            self._field, self._bright, self._samples.element[index], self._samples.direction[index],
            rays=rays, threads=self._threads, seed=self._seed, **known,
        )  # fmt: skip

    def problem(self, index: np.ndarray, rays: int) -> Problem:
        """The fit's problem over observations."""
        element = self._samples.element[index]
        cosine = np.einsum("ij,ij->i", self._field.atlas.normal[element], self._samples.direction[index])
        return Problem(
            element,
            self._samples.radiance[index],
            self._lit.radiance[element],
            self.light(index, rays),
            cosine,
        )
