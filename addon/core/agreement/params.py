"""How it is decided whether frames and mesh fit."""

from dataclasses import dataclass


@dataclass(frozen=True)
class AgreementParams:
    """Of `look`: which convention of poses fits the mesh.

    Attributes
    ----------
    agree : float
        Quality from which on the poses are taken as right. Over nine rooms: right 0.78 to 0.91, wrong up to 0.73
        (turned by 90 degrees in a box, 0.82); of phones, seven captures: right 0.77 to 0.83, wrong up to 0.77.
    better : float
        By how much another convention has to be better.
    least_hit : float
        Share of rays that meet the mesh, below which nothing can be said for a convention.
    coarse : int
        Views that all candidates are tried on: pairs of views grow with the square of their number.
    plausible : float
        A scale is tried if it spreads the cameras over a third of the mesh, within this factor.
    tie : float
        Qualities that differ by less are the same; the simpler convention is taken.
    upright : float
        Mean cosine from which on an axis is taken as the one that points up.
    count : int
        Frames that are looked at, spread evenly.
    width : int
        About so many pixels across are enough to recognise a wrong convention, and cheap.
    grid : int
        Rays along an edge of each view.
    jump : float
        Relative step in distance that counts as an edge.
    bend : float
        Cosine between two neighbouring pixels' normals below which there is an edge.
    """

    agree: float = 0.755
    better: float = 0.08
    least_hit: float = 0.05
    coarse: int = 6
    plausible: float = 5.0
    tie: float = 0.01
    upright: float = 0.7
    count: int = 16
    width: int = 160
    grid: int = 20
    jump: float = 0.05
    bend: float = 0.85


AGREEMENT = AgreementParams()


@dataclass(frozen=True)
class MisalignmentParams:
    """Of `misalignment`: how far frames are displaced from the mesh.

    Attributes
    ----------
    largest : float
        Pixels of the small view; a shift beyond is not found by following gradients.
    least_texture : float
        Mean square gradient below which a shift in that direction can't be seen.
    least_residual : float
        Residuals beyond so many times their median, or this if that is more, count as highlights or occlusion.
    """

    largest: float = 4.0
    least_texture: float = 1e-3
    least_residual: float = 0.02


MISALIGNMENT = MisalignmentParams()
