"""What counts as beyond chance, how few are too few to decide, and how many are enough, wherever that matters."""

from dataclasses import dataclass

from .kinds import Unit

SIGMA_OF_MAD: Unit[float] = 1.4826
"""A normal distribution's standard deviation over its median absolute deviation."""


@dataclass(frozen=True)
class SignificanceParams:
    """One set of levels, sizes and rounds for all passes.

    Attributes
    ----------
    sigmas : float
        Standard errors from which on a difference is no chance: three leave .3 % of a normal distribution. What lies
        this many standard deviations out counts as an outlier, where such count no more than that.
    likely : float
        Standard errors from which on something is likely (5 % are chance), where something else speaks for it, too.
    outlier : float
        Standard deviations beyond which a residual weighs less in a robust fit (Huber). 1.5 to 2 is usual: 2 keeps 97 %
        of least squares' efficiency under normal errors.
    few : int
        Elements of an object with which something may be fitted to it.
    enough : int
        Elements or observations that give a spread: its standard error is then 13 % of it.
    many : int
        Pixels, vertices or pairs of observations that say something where all of them are looked at together.
    sample : int
        Elements, or places of a mesh, that stand for all of a room's, or of a large object's.
    sure : float
        Relative standard error up to which an element speaks for others.
    of_object : int
        Elements that stand for an object where each takes many rays.
    views : int
        Views of an element that show what changes with the view.
    neighbours : int
        The nearest elements or points that one is compared with, or takes its value from.
    most : int
        Objects of a kind that are looked at one by one: the greatest, or those that matter most.
    reweighted : int
        Rounds of reweighted least squares; more change nothing.
    steps : int
        Of an iterative solution, at most.
    nearly_all : float
        The share that is all but a few.
    gain : float
        Share by which something that was not there before (a sun, a sky, a highlight, glass) must lower what is left
        unexplained, besides that being beyond chance. Without a sun a living room gains .01, with one bedrooms .25 to
        .39; opaque things taken for glass gain up to .08. What adds so much may be refused again.
    dark : float
        Of the room's median radiance, or an albedo: what is darker in a channel is all noise there.
    """

    sigmas: float = 3.0
    likely: float = 2.0
    outlier: float = 2.0
    few: int = 12
    enough: int = 30
    many: int = 100
    sample: int = 4096
    sure: float = 0.15
    of_object: int = 350
    views: int = 4
    neighbours: int = 8
    most: int = 64
    reweighted: int = 10
    steps: int = 200
    nearly_all: float = 0.95
    gain: float = 0.1
    dark: float = 0.02


LEVELS = SignificanceParams()
