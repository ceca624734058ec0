"""Parameters of the albedo's prior; what each part gains: docs/ablation.md."""

from dataclasses import dataclass

from ...kinds import Unit

MAX_ALBEDO: Unit[float] = 1.0
"""What reflects more than it gets emits light."""


@dataclass(frozen=True)
class PriorParams:
    """Of `neighbourhood` (`albedo-prior` in the ablation).

    Attributes
    ----------
    neighbours : int
        Elements that a prior is made of. With 64, two kitchens have .8 and .4 dB less of albedo, a bedroom .4, a study,
        bathrooms and the living room .2, hall and office .0.
    alike : float
        Widths of the prior, by which the median of a wider neighbourhood may differ to stand for it (`wide-prior`).
    cell : float
        Texels, edge of the cells that share one prior.
    least_error : float
        Relative standard error that even the best measured element has: irradiance, texels against pixels.
    single : float
        Relative standard error of a single observation, whose spread can't be known, at most; and what is added to that
        of observations at depth edges, where another surface is mixed in.
    own : float
        Of E's standard error, where the surface is even, this share is an element's own, and of all its error for a
        second colour; the rest its neighbours have too. On mouldings and at creases E errs from texel to texel.
    single_factor : float
        It is taken for so many times this quantile (one standard deviation of a normal distribution) of the spreads
        that its object's other elements have (`object-spread`). Single observations are made where little is seen, so
        for more than theirs.
    """

    neighbours: int = 128
    alike: float = 0.7
    cell: float = 6.0
    least_error: float = 0.06
    own: float = 0.5
    single: float = 0.35
    single_factor: float = 2.0


@dataclass(frozen=True)
class SecondColourParams:
    """Of `second_colour` (`second-colour` in the ablation).

    Attributes
    ----------
    by_chance : float
        Share of the neighbours that may lie so far off by chance. With 1/8 nothing is gained in bathrooms.
    apart : float
        Relative difference between elements of one colour.
    unexplained : float
        Probability density below which neither colour tells what an element is; the plain prior decides.
    """

    by_chance: float = 1 / 16
    apart: float = 0.03
    unexplained: float = 1e-4


@dataclass(frozen=True)
class BiasParams:
    """Of `bias_field` (`bias-field` in the ablation).

    Attributes
    ----------
    reach : float
        Standard deviation of the Gaussian that the field is smoothed by, as a share of the square root of the area that
        frames see: 20 cm in a room.
    tolerance : float
        Standard deviation of log albedo among elements of one colour, beside the field.
    hue : float
        So many times less may the channels differ by from their mean.
    prior : float
        Area without bias that is counted in everywhere, as a share of the most that the Gaussian holds anywhere.
    rounds : int
        Of the iteration.
    cells : int
        Of an object's grid, at most: in what is larger than a room they grow.
    """

    reach: float = 0.02
    tolerance: float = 0.2
    hue: float = 2.0
    prior: float = 0.1
    rounds: int = 4
    cells: int = 1 << 18


PRIOR = PriorParams()
BIAS = BiasParams()
SECOND_COLOUR = SecondColourParams()


@dataclass(frozen=True)
class AlbedoParams:
    """Of `albedo`.

    Attributes
    ----------
    floor : float
        Below this share of the room's median irradiance a quotient says nothing.
    unknown, least_spread : float
        Relative error of an albedo that was taken from other objects: where there are too few to tell, and at least.
    """

    floor: float = 1e-3
    unknown: float = 0.7
    least_spread: float = 0.3


ALBEDO = AlbedoParams()
