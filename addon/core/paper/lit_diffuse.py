"""The lit diffuse texture L_d (Haefner et al. 2021, sec. 3.1): every frame projected onto the elements that it sees.

A highlight moves over a surface with the camera, so few frames show it in any one place: the median over the frames is
what a surface sends diffusely. The frames come in the order of the video, and none is kept: the median is a running
one, P-square (`p_square`).
"""

from collections.abc import Callable, Sequence

from ..parallel import ordered_map
from ..progress import Progress, Rounds
from ..scene.atlas import Atlas
from ..scene.element_groups import ElementGroups
from ..scene.model import Frame, Mesh, Pixels
from ..scene.rays import RayScene
from ..scene.visibility import FrameView, Observations, bytes_of_frame, observe, view_frame
from .p_square import PSquare, Summary

FrameObservations = tuple[int, FrameView, Pixels, Observations]
"""A frame's index, what its camera sees of the mesh, its pixels, and what it says of the elements."""


def lit_diffuse(
    mesh: Mesh,
    atlas: Atlas,
    scene: RayScene,
    frames: Sequence[Frame],
    read: Callable[[Frame], Pixels],
    *,
    threads: int = 0,
    also: Callable[[int, FrameView, Pixels, Observations], None] | None = None,
    progress: Progress | Rounds | None = None,
) -> Summary:
    """L_d of every element: the running median of all that the frames show of it.

    Parameters
    ----------
    frames : sequence of Frame
        In the order of the video.
    read : callable
        Gives a frame's pixels.
    also : callable, optional
        Called with each frame too, as `FrameObservations`.

    Returns
    -------
    Summary
        `median` is L_d, linear Rec.709; NaN where no frame saw the element.

    Raises
    ------
    BadInputError
        From `read`.
    InterruptedRun
        From `progress`.
    """
    groups, frame_bytes = ElementGroups(atlas), bytes_of_frame(frame.camera for frame in frames)
    median = PSquare(len(atlas))

    def look(index: int) -> FrameObservations:
        pixels = read(frames[index])
        view = view_frame(frames[index].camera, mesh, scene)
        return index, view, pixels, observe(view, pixels, atlas, scene, groups.candidates(view))

    for index, view, pixels, observations in ordered_map(look, range(len(frames)), threads, each=frame_bytes):
        median.add(observations.element, observations.radiance)
        if also is not None:
            also(index, view, pixels, observations)
        if progress is not None:
            progress.update((index + 1) / len(frames))
    return median.result()
