"""The lit diffuse texture, and how much of it was clipped."""

from collections.abc import Callable, Sequence

import numpy as np

from ...paper.lit_diffuse import lit_diffuse as running_median
from ...progress import Progress, Rounds
from ...scene.atlas import Atlas
from ...scene.lit_diffuse import LitDiffuse
from ...scene.model import Frame, Mesh, Pixels
from ...scene.rays import RayScene
from ...scene.visibility import CLEAN, SATURATED, FrameView, Observations


def lit_diffuse(
    mesh: Mesh,
    atlas: Atlas,
    scene: RayScene,
    frames: Sequence[Frame],
    read: Callable[[Frame], Pixels],
    *,
    threads: int,
    also: Callable[[int, FrameView, Pixels, Observations], None] | None = None,
    progress: Progress | Rounds | None = None,
) -> LitDiffuse:
    """L_d as `paper.lit_diffuse` has it, where all observations are of one kind; those clipped are counted beside."""
    clipped = np.zeros(len(atlas), np.int32)

    def count(index: int, view: FrameView, pixels: Pixels, observations: Observations) -> None:
        clipped[observations.element[observations.tier == SATURATED]] += 1
        if also is not None:
            also(index, view, pixels, observations)

    medians = running_median(mesh, atlas, scene, frames, read, threads=threads, also=count, progress=progress)
    share = (clipped / np.maximum(medians.count, 1)).astype(np.float32)
    tier = np.where(medians.count == 0, -1, np.where(share == 1, SATURATED, CLEAN)).astype(np.int8)
    return LitDiffuse(medians.median, medians.interquartile_range, medians.count, tier, share)
