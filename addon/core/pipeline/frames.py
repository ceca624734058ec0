"""The passes over all frames: what L_d, the sky, the specular fit and the lamps' edges each take from them.

One pass, a second where the first tells that poses are off, and one more that makes L_d sharper.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from ..errors import BadInputError
from ..light.environment import Environment, EnvironmentAccumulator
from ..light.field import LightField
from ..lit_diffuse.accumulate import accumulate
from ..passes.clipped_lamps.fringes import FringeCollector, Fringes
from ..passes.pose_refinement.poses import Poses, Texture, refine_poses
from ..passes.sharpening.sharpen import sharpened
from ..progress import Progress, Rounds
from ..scene.lit_diffuse import LitDiffuse
from ..scene.model import Frame, Pixels
from ..scene.samples import SampleCollector, Samples
from ..scene.surface import Surface
from ..settings import Settings

Seen = tuple[LitDiffuse, Environment, Samples, Fringes]


def one_pass(
    surface: Surface,
    frames: Sequence[Frame],
    read: Callable[[Frame], Pixels],
    settings: Settings,
    folder: Path,
    progress: Progress | Rounds,
) -> Seen:
    """Read every frame once.

    Parameters
    ----------
    folder : Path
        Where the exact median keeps observations meanwhile.

    Raises
    ------
    BadInputError
        From `read`, or as no frame shows any of the mesh.
    InterruptedRun
        From `progress`.
    """
    sky = EnvironmentAccumulator(float(np.median([f.camera.pixel_angle for f in frames])))
    kept = SampleCollector(surface.atlas, len(frames), settings.seed)
    fringes = FringeCollector()
    median = "batched" if settings.median == "adaptive" and "exact-median" in settings.without else settings.median

    def also(index, view, pixels, seen):
        sky.add(view, pixels)
        kept.add(index, seen)
        fringes.add(view, pixels)

    lit = accumulate(
        surface.mesh, surface.atlas, surface.scene, frames, read, median=median, order=settings.frame_order,
        edge_tier="edge-tier" not in settings.without, seed=settings.seed, threads=settings.threads, folder=folder,
        also=also, progress=progress,
    )  # fmt: skip
    if not lit.seen.any():
        raise BadInputError(
            "No frame shows any of the mesh: all pixels are invalid or the poses look elsewhere; check the frames."
        )
    return lit, sky.result(), kept.result(), fringes.result()


def all_passes(
    surface: Surface,
    frames: Sequence[Frame],
    read: Callable[[Frame], Pixels],
    settings: Settings,
    folder: Path,
    progress: Progress,
) -> tuple[LitDiffuse, Environment, Samples, Fringes, Poses]:
    """What `one_pass` finds, and the poses it is found with: as read, or put right. Parameters and errors are its."""
    rounds = Rounds(progress, 0, 1)
    found, poses = one_pass(surface, frames, read, settings, folder, rounds), Poses.as_read(frames)
    if settings.refine_poses and "pose-refinement" not in settings.without:
        lit, sky = found[:2]
        room = LightField(surface.mesh, surface.atlas, surface.scene, np.nan_to_num(lit.radiance), sky)
        rounds.next()
        poses = refine_poses(frames, read, Texture(room, lit.seen), threads=settings.threads, progress=rounds)
        if poses.moved.any():
            rounds.next()
            found = one_pass(surface, poses.of(frames), read, settings, folder, rounds)
    if settings.sharpen and "sharpening" not in settings.without:
        rounds.next()
        lit = sharpened(
            found[0], surface, poses.of(frames), read, median=settings.median, order=settings.frame_order,
            seed=settings.seed, threads=settings.threads, folder=folder, progress=rounds,
        )  # fmt: skip
        found = (lit, *found[1:])
    return *found, poses
