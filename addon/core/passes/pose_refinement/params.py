"""When and how poses are refined; what it gains: docs/ablation.md."""

from dataclasses import dataclass


@dataclass(frozen=True)
class PoseParams:
    """Of `poses` (`pose-refinement` in the ablation).

    Attributes
    ----------
    least_shift : float
        Pixels of the small picture, median over the frames: less is what good poses show for highlights, texels and
        noise. Six rooms with their true poses have 0.05 to 0.23; the living room with poses off by 5 mm and 0.2 degrees
        has 0.7.
    samples : int
        Rays along an edge of each of these pixels, so that the texture's edges are as soft as the picture's.
    least_gradient : float
        Of log radiance over a pixel; less says nothing of a shift.
    floor : float
        Share of the room's median radiance that is added before the logarithm: noise in the dark must not count.
    rounds : int
        All frames are refined so often, each against the others as last refined.
    least_spread : float
        Of the logarithm: a picture of flat colours fits to the last bit but at its edges, which alone are informative.
    independent : float
        Share of the pixels whose errors are independent: neighbours share what the texture has wrong.
    stray : float
        Times the median shift: a frame that would move farther has gone astray. It shows mirrors, or something that
        moved.
    worse : float
        A frame goes back if its cost becomes so many times what it was. Most of the cost is the texture's error:
        without any slack a third of two rooms' frames went back, most of them from better places.
    sky : float
        Times the room's diagonal, where rays that escape are taken to end.
    """

    least_shift: float = 0.4
    samples: int = 2
    least_gradient: float = 0.01
    floor: float = 0.1
    rounds: int = 2
    least_spread: float = 0.05
    independent: float = 0.05
    stray: float = 4.0
    worse: float = 1.05
    sky: float = 100.0


POSES = PoseParams()
