"""What an object's albedo is like around a place: the prior that a poor measurement is shrunk towards.

Where the well-measured elements of an object agree among each other, a badly measured one between them (at a depth
edge, seen once) is shrunk towards them; where they differ, as in a texture, it is left as it is. Empirical Bayes on
log albedo, with the spread of the neighbours as the prior's width; a second colour among them: `second_colour`.
"""

from collections.abc import Collection
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.spatial import cKDTree
from scipy.special import ndtr

from ...groups import by_label, cell_of
from ...kinds import Block
from ...parallel import for_blocks
from ...scene.atlas import Atlas
from ...scene.lit_diffuse import LitDiffuse
from ...scene.params import COPLANAR
from ...scene.visibility import CLEAN, SATURATED
from ...significance import LEVELS, SIGMA_OF_MAD
from .params import ALBEDO, PRIOR
from .second_colour import Neighbourhood, shrunk_to_second_colour

BLOCK: Block[int] = 1 << 11


def relative_error(lit: LitDiffuse, object_id: np.ndarray, of_object: bool = True) -> np.ndarray:
    """Relative standard error of each element's L_d, from its observations: (n,) float32.

    inf where there are none, or none but clipped ones: a lower bound may be off by any factor.

    Parameters
    ----------
    object_id : (n,) int
        Of each element: one seen once or twice is as unsure as others of its object.
    of_object : bool
        If not, all that was seen once or twice is equally unsure.
    """
    level = np.maximum(np.nan_to_num(lit.radiance).mean(1), 1e-12)
    spread = lit.interquartile_range.mean(1) / 1.35 / level
    n = np.maximum(lit.count, 1)
    # The median of n values of standard deviation s has the error 1.25 s / sqrt(n); few values hide their spread.
    single: float | np.ndarray = PRIOR.single
    if of_object:
        single = _single(spread, lit.seen & (lit.count >= 3) & (lit.tier == CLEAN), object_id)
    error = np.hypot(
        1.25 * np.where(lit.count >= 3, spread, np.maximum(spread, single)) / np.sqrt(n), PRIOR.least_error
    )
    error = np.where(lit.tier == CLEAN, error, error + PRIOR.single)
    return np.where(lit.seen & (lit.tier != SATURATED), error, np.inf).astype(np.float32)


def _single(spread: np.ndarray, often: np.ndarray, object_id: np.ndarray) -> np.ndarray:
    """Relative error of a single observation of each element's object, (n,), from the elements seen `often`."""
    single = np.full(int(object_id.max()) + 1, PRIOR.single)
    ids, spreads = object_id[often], spread[often]
    for index in by_label(ids):
        if len(index) >= LEVELS.enough:
            typical = PRIOR.single_factor * np.quantile(spreads[index], ndtr(1.0))
            single[ids[index[0]]] = min(typical, PRIOR.single)
    return single[object_id]


def _around(position: np.ndarray, references: np.ndarray, log_rho: np.ndarray) -> Neighbourhood:
    """The nearest references of m places."""
    # At most an eighth of the object: a small object's ends are not each other's neighbourhood.
    k = min(PRIOR.neighbours, max(len(references) // 8, 3), len(references))
    tree, neighbours = cKDTree(references), np.empty((len(position), k), np.int32)
    median = np.empty((len(position), 3), np.float32)
    width = np.empty(len(position), np.float32)
    channels = np.ascontiguousarray(log_rho.T)

    def gather(part: slice) -> None:
        neighbours[part] = tree.query(position[part], k=k)[1].reshape(-1, k)
        values = channels[:, neighbours[part]]
        median[part] = _median(values).T
        width[part] = SIGMA_OF_MAD * _median(np.abs(values - median[part].T[..., None]).mean(0))

    for_blocks(gather, len(position), BLOCK, 0)
    return Neighbourhood(median, np.maximum(width, np.float32(0.02)), neighbours)


def _median(values: np.ndarray) -> np.ndarray:
    """As np.median along the last axis: NumPy sorts 128 values seven times as fast as it parts them (AVX-512)."""
    count = values.shape[-1]
    return np.sort(values)[..., [(count - 1) // 2, count // 2]].mean(-1)


def _prior(
    position: np.ndarray, references: np.ndarray, log_rho: np.ndarray, without: Collection[str]
) -> Neighbourhood:
    """As `_around`, from as far around each place as it stays the same.

    `references` are in random order: half of them reach twice as far (in area) with as many neighbours.
    """
    prior = _around(position, references, log_rho)
    if "wide-prior" in without:
        return prior
    centre, allowed = prior.median.copy(), PRIOR.alike * prior.width
    todo, count = np.arange(len(position)), len(references) // 2
    while count >= 8 * PRIOR.neighbours and len(todo):
        wider = _around(position[todo], references[:count], log_rho[:count])
        alike = np.abs(wider.median - centre[todo]).mean(1) <= allowed[todo]
        todo = todo[alike]
        for array, new in zip(prior, wider, strict=True):
            array[todo] = new[alike]
        count //= 2
    return prior


def _is_even(normals: np.ndarray, neighbours: np.ndarray) -> np.ndarray:
    """Which of m places, each among the `neighbours` ((m, k) int) of n `normals` ((n, 3)), lie on an even surface."""
    length = np.empty(len(neighbours), np.float32)

    def measure(part: slice) -> None:
        length[part] = np.linalg.norm(normals[neighbours[part]].mean(1), axis=1)

    for_blocks(measure, len(neighbours), BLOCK, 0)
    return length > np.cos(COPLANAR.turn)


@dataclass(frozen=True)
class References:
    """Well-measured elements of the parts of a scan that were told apart by shape alone.

    Where such parts end is a guess: the rim of one may bear the colour of the next.

    Attributes
    ----------
    position : (r, 3) float32
    rho : (r, 3) float32
        Clamped quotient.
    error : (r,) float32
        Its relative standard error.
    """

    position: np.ndarray
    rho: np.ndarray
    error: np.ndarray

    @cached_property
    def tree(self) -> cKDTree:
        """Of the positions."""
        return cKDTree(self.position)


def well_measured(error: np.ndarray) -> np.ndarray:
    """Which of an object's elements the prior is made of, (r,) int, in random order; `error` ((m,)) as in `shrink`."""
    known = np.flatnonzero(np.isfinite(error))
    # The better half at least: the few that are surer may be all of one kind, the frame of a painting.
    sure = known[error[known] <= max(LEVELS.sure, float(np.median(error[known])))]
    if len(sure) < PRIOR.neighbours:
        sure = known
    # A thinned set reaches further around.
    return np.random.default_rng(0).permutation(sure)[: LEVELS.sample]


def shrink(
    atlas: Atlas,
    elements: np.ndarray,
    rho: np.ndarray,
    error: np.ndarray,
    without: Collection[str] = (),
    references: References | None = None,
    shared: np.ndarray | None = None,
) -> tuple[np.ndarray, np.ndarray]:
    """Albedo of one object's elements, each shrunk towards its neighbourhood as far as it is uncertain.

    Parameters
    ----------
    elements : (m,) int
        The object's elements.
    rho : (m, 3) float32
        Clamped quotient; anything where `error` is inf.
    error : (m,) float32
        Relative standard error; 0: stays as it is; inf: not measured. At least one is finite.
    references : References, optional
        Elements among which a second colour is looked for, in place of the object's own.
    shared : (m,) float32, optional
        The part of `error` that is E's.

    Returns
    -------
    rho : (m, 3) float32
    error : (m,) float32
        Its relative standard error: the posterior's; the prior's width where nothing was measured.
    """
    position = atlas.position[elements]
    sure = well_measured(error)
    edge = PRIOR.cell * float(np.sqrt(np.median(atlas.area[elements])))
    cell = cell_of(position - position.min(0), max(edge, 1e-9))
    _, index, count = np.unique(cell, return_inverse=True, return_counts=True)
    # The prior is evaluated at the centroid of a cell's elements: at one of them it would be shifted for the others.
    centre = np.stack([np.bincount(index, position[:, axis]) for axis in range(3)], 1) / count[:, None]
    todo = np.flatnonzero(error > 0)
    cells, index = np.unique(index[todo], return_inverse=True)
    rho = np.maximum(rho, ALBEDO.floor)
    reference, reference_error = rho[sure], error[sure]
    prior = _prior(centre[cells], position[sure], np.log(reference), without)
    shrunk, shrunk_error = rho.astype(np.float32), error.astype(np.float32)
    rho, error = rho[todo], error[todo]
    measured = np.isfinite(error)
    log_rho = np.log(rho)
    median, width = prior.median[index], prior.width[index][:, None]
    error = np.minimum(error, 1e3)[:, None]
    # An element that lies further off than its own error allows is something else, as a line in a pattern is: the
    # prior gets the width that makes this element likeliest.
    # All channels are judged together, by their sum: a channel near 0 is all noise in its logarithm.
    offset = np.log(np.exp(log_rho).sum(1, keepdims=True) / np.exp(median).sum(1, keepdims=True))
    excess = offset**2 - (LEVELS.sigmas * error) ** 2
    variance = np.maximum(width**2, excess)
    # On an even surface E errs smoothly: what it errs by is its neighbours' too, and no reason to give up texture.
    even = _is_even(atlas.normal[elements[sure]], prior.neighbours)[index, None]
    of_all = 0 if shared is None else np.minimum(shared[todo, None], error)
    own = np.sqrt(error**2 - even * (1 - PRIOR.own**2) * of_all**2)
    trust = (variance / (variance + own**2)).astype(np.float32)
    if "albedo-prior" in without:
        trust[:] = 1
    trust[~measured] = 0
    shrunk_error[todo] = np.where(measured, np.sqrt(trust[:, 0]) * error[:, 0], width[:, 0])
    result = trust * log_rho + (1 - trust) * median
    if not {"second-colour", "albedo-prior"} & set(without):
        if references is not None:
            neighbours = references.tree.query(centre[cells], k=min(PRIOR.neighbours, len(references.rho)), workers=-1)[
                1
            ]
            prior = prior._replace(neighbours=neighbours.reshape(len(cells), -1))
            reference, reference_error = np.maximum(references.rho, ALBEDO.floor), references.error
        mixture = prior, index[measured], reference, reference_error
        result[measured] = shrunk_to_second_colour(result[measured], rho[measured], error[measured, 0], *mixture)
    shrunk[todo] = np.exp(result)
    return shrunk, shrunk_error
