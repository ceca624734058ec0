"""The fitting problem of one object, from its observations: elements, views, and the light that they reflect."""

from collections.abc import Callable, Collection

import numpy as np

from ...brdf.ggx import GGX
from ...brdf.model import Microfacets
from ...fit.problem import Problem
from ...light.emitters import bright_triangles
from ...light.field import LightField
from ...light.lobes import GRID, LobeLight, reflected_light
from ...light.params import GATHER
from ...scene.samples import Samples
from ...significance import LEVELS
from .params import FIT


def pick(
    samples: Samples,
    of_object: np.ndarray,
    elements: int,
    views: int,
    min_views: int,
    seed: int,
    expected: Callable[[np.ndarray], np.ndarray] | None = None,
) -> np.ndarray:
    """Indices into `samples` of up to `views` views of up to `elements` elements, sorted by element.

    Parameters
    ----------
    of_object : (k,) int
        Indices of the object's observations.
    min_views : int
        Elements with fewer views are left out.
    expected : callable, optional
        Gives the radiance that a mirror would show in observations, (m,) int -> (m,). Half of the elements are those of
        a larger sample in one of whose views it is most above the others.
    """
    rng = np.random.default_rng(seed)
    ids, group, count = np.unique(samples.element[of_object], return_inverse=True, return_counts=True)
    enough = np.flatnonzero(count >= min_views)
    if len(enough) > elements:
        chosen = np.zeros(0, int)
        if expected is not None:
            candidates = rng.choice(enough, min(FIT.candidates * elements, len(enough)), replace=False)
            of_candidates = np.flatnonzero(np.isin(group, candidates))
            radiance, greatest = expected(of_object[of_candidates]), np.full(len(ids), -np.inf)
            np.maximum.at(greatest, group[of_candidates], radiance)
            highlight = greatest - np.bincount(group[of_candidates], radiance, len(ids)) / count
            chosen = candidates[np.argsort(-highlight[candidates], kind="stable")[: elements // 2]]
        others = rng.choice(np.setdiff1d(enough, chosen), elements - len(chosen), replace=False)
        enough = np.append(chosen, others)
    wanted = np.isin(group, enough)
    index, group = of_object[wanted], group[wanted]
    order = np.lexsort((rng.random(len(index)), group))
    count = np.bincount(group)
    rank = np.arange(len(index)) - np.repeat(np.cumsum(count) - count, count)
    return np.sort(index[order][rank < views])


class Problems:
    """Makes the problem of any object, with as many elements, views and rays as wished."""

    def __init__(
        self, field: LightField, samples: Samples, threads: int = 0, seed: int = 0, without: Collection[str] = ()
    ):
        self._field, self._samples = field, samples
        self._threads, self._seed, self._without = threads, seed, without
        self._bright = bright_triangles(field)
        # A clipped pixel is no value; the others are sorted by object, so that each object's lies together.
        usable = np.flatnonzero(~samples.saturated)
        owner = field.atlas.object_id[samples.element[usable]]
        order = np.argsort(owner, kind="stable")
        self._owner, self._usable = owner[order], usable[order]

    def pick(
        self,
        object_id: int,
        elements: int,
        views: int,
        min_views: int = LEVELS.views,
        seed: int = 0,
        smooth: bool = False,
        highlights: bool = False,
    ) -> np.ndarray:
        """Indices into the samples of some of an object's observations, sorted by element.

        Parameters
        ----------
        smooth : bool
            Those alone in whose pixels the surface turns by less than a crease does, or the flattest quarter: over a
            crease a pixel shows two lobes, which no wider one approximates.
        highlights : bool
            Half of the elements are those where a highlight is expected.
        """
        first, last = np.searchsorted(self._owner, [object_id, object_id + 1])
        index = self._usable[first:last]
        if smooth and len(index) and "pixel-curvature" not in self._without:
            variance = self._samples.normal_variance[index]
            index = index[variance <= max(np.sin(FIT.crease / 2) ** 2, np.quantile(variance, 0.25))]
        expected = self._mirrored if highlights else None
        return pick(self._samples, index, elements, views, min_views, self._seed + seed, expected)

    def _mirrored(self, index: np.ndarray) -> np.ndarray:
        """The radiance that a nearly smooth mirror would show in observations ((m,) int), (m,)."""
        return self.light(index, FIT.expecting, FIT.narrow_phi).A[:, 0].mean(1, dtype=np.float64)

    def light(
        self, index: np.ndarray, rays: int, phi: float | None = None, microfacets: Microfacets = GGX
    ) -> LobeLight:
        """A and B of observations: for the whole grid, or for the one width `phi` with rays of that width."""
        return reflected_light(
            self._field, self._bright, self._samples.element[index], self._samples.direction[index], rays=rays,
            grid=GRID if phi is None else np.array([phi], np.float32),
            proposals=GATHER.proposals if phi is None else (phi,),
            threads=self._threads, seed=self._seed, microfacets=microfacets,
        )  # fmt: skip

    def element(self, index: np.ndarray) -> np.ndarray:
        """The elements of observations."""
        return self._samples.element[index]

    def problem(
        self, index: np.ndarray, rays: int, phi: float | None = None, microfacets: Microfacets = GGX
    ) -> Problem:
        """The fit's problem over observations (see `light`)."""
        element = self._samples.element[index]
        cosine = np.einsum("ij,ij->i", self._field.atlas.normal[element], self._samples.direction[index])
        radiance = self._samples.radiance[index]
        light = self.light(index, rays, phi, microfacets)
        if phi is None and "pixel-curvature" not in self._without:
            light = light.widened(self._samples.normal_variance[index])
        light = light.as_exact() if "ray-noise" in self._without else light
        return Problem(element, radiance, light, cosine, frozenset(self._without))
