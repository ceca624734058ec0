"""When an object is taken for a flat mirror; what it gains: docs/ablation.md."""

from dataclasses import dataclass


@dataclass(frozen=True)
class MirrorsParams:
    """Of `flat_mirrors`, `mirror_patches` and `mirrored` (`mirrors` in the ablation).

    Attributes
    ----------
    flat_share : float
        Share of an object's surface that must lie in one plane.
    plane_share : float
        How far from that plane, as a share of the object's size.
    together : float
        Least correlation, within the elements, of what they show and of what a mirror would.
    unexplained : float
        Most of a region's deviation from its elements' own means that is left from the mirrored room
        (`mirror_patches`).
    least_f0 : float
        A black pane shows the room mirrored as well, as a dielectric: by 0.04 to 0.1 as it is looked at.
    most_f0 : float
        A mirror sends no more than it gets, 1; twice that if the room's light is off. A page of a book under a spot
        sent 4 to 9 times what it would have mirrored, and followed it.
    tells : float
        Share of the deviation under the mesh's own plane that a turned one must come below. What a pane over a dark
        hearth shows tells nothing of its normal: it was turned by a degree to take a hundredth off.
    stray : float
        Deviation of log radiance from which on more counts no more: a ray beside an edge meets something else.
    tilt, tilts : float, int
        Radians by which the plane is turned first to fit what is mirrored, and how often: a scan's planes are off.
    """

    flat_share: float = 0.8
    plane_share: float = 0.02
    together: float = 0.6
    unexplained: float = 0.3
    least_f0: float = 0.2
    most_f0: float = 2.0
    tells: float = 0.98
    stray: float = 0.5
    tilt: float = 0.01
    tilts: int = 40


MIRRORS = MirrorsParams()
