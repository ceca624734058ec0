"""The passes over all frames: what L_d, the sky, the specular fit and the lamps' edges each take from them.

One pass, a second where the first shows that poses are off, and one more that makes L_d sharper.
"""

from __future__ import annotations

import shutil
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from ..agreement.views import sees
from ..errors import BadInputError, StorageError
from ..io.pixels import as_codes, read_pixels
from ..io.read import MAX_BAD_SHARE
from ..kinds import Block
from ..light.environment import Environment, EnvironmentAccumulator
from ..light.field import LightField
from ..lit_diffuse.accumulate import accumulate
from ..lit_diffuse.exact import Exact
from ..lit_diffuse.from_picture import lit_from_picture
from ..lit_diffuse.from_texture import lit_from_tiles
from ..memory import give_back
from ..passes.pose_refinement.poses import Poses, Texture, refine_poses
from ..passes.radiometric_calibration.calibrate import Calibration, calibrate
from ..passes.sharpening.sharpen import sharpened
from ..progress import Progress, Rounds
from ..results.values import kinds_of
from ..scene.lit_diffuse import LitDiffuse
from ..scene.model import Capture, Frame, Pixels
from ..scene.samples import SampleCollector, Samples
from ..scene.stored_light import LitTexture
from ..scene.surface import Surface
from ..scene.visibility import FrameView, Observations
from ..settings import Settings
from .published.frames import lit_diffuse as running_lit_diffuse
from .stage import Stage
from .surface import STAGE as SURFACE

STAGE = Stage("lit_diffuse", Path(__file__), (SURFACE,), ("refine_poses", "median", "sharpen", "seed"))

SAMPLED: Block[tuple[int, int]] = (32, 4096)
"""Numbers of frames and of elements from which the number of observations is estimated before all are read."""


@dataclass(frozen=True)
class Observed:
    """What the passes over all frames give.

    Attributes
    ----------
    environment : Environment
        Light from outside, as the frames saw it.
    samples : Samples
        Observations kept one by one for the specular fit.
    poses : Poses
        Where the frames were found to be.
    calibration : Calibration
        What the codes of frames mean whose transfer curve is unknown.
    """

    lit_diffuse: LitDiffuse
    environment: Environment
    samples: Samples
    poses: Poses
    calibration: Calibration

    def of(self, frames: Sequence[Frame]) -> tuple[Frame, ...]:
        """The capture's frames where they were found to be, calibrated."""
        return self.calibration.of(self.poses.of(frames))


OBSERVED = kinds_of(Observed, LitDiffuse, Environment, Samples, Poses, Calibration)
"""What a stored `Observed` holds."""


class FrameReader:
    """Reads frames' pixels. One that turns out damaged counts as blind, unless too many are.

    Parameters
    ----------
    count : int
        Of the capture's frames.

    Attributes
    ----------
    bad, blind : list of str
        Sentences on frames that turned out damaged; names of those without a valid pixel.
    """

    def __init__(self, count: int):
        self._count = count
        self.bad: list[str] = []
        self.blind: list[str] = []

    def __call__(self, frame: Frame) -> Pixels:
        """A frame's pixels. Raises `BadInputError`: too many are damaged."""
        try:
            pixels = read_pixels(frame)
            if not pixels.valid.any() and frame.name not in self.blind:
                self.blind.append(frame.name)
            return pixels
        except BadInputError as error:
            if (message := f"{error} It was left out.") not in self.bad:
                self.bad.append(message)
            if len(self.bad) > MAX_BAD_SHARE * self._count:
                raise BadInputError(
                    f"{len(self.bad)} of {self._count} frames can't be read; the first: {error}"
                ) from error
            shape = (frame.camera.height, frame.camera.width)
            return Pixels(np.zeros((*shape, 3), np.float32), np.zeros(shape, bool), np.zeros(shape, bool))


def check_disk_space(surface: Surface, frames: Sequence[Frame], folder: Path) -> None:
    """Raise `StorageError` where what `Exact` keeps, estimated from some of the frames, does not fit on the disk."""
    sampled_frames = frames[:: -(-len(frames) // SAMPLED[0])]
    points = surface.atlas.position[:: -(-len(surface.atlas) // SAMPLED[1])]
    seen = sum(len(sees(frame.camera, points, surface.scene)[0]) for frame in sampled_frames)
    observations = seen / (len(sampled_frames) * len(points)) * len(frames) * len(surface.atlas)
    need, free = int(observations) * Exact.RECORD.itemsize, shutil.disk_usage(folder).free
    if observations > Exact.HELD and need > free:
        raise StorageError(
            f"The exact median keeps about {need / 1e9:.2g} GB of observations in '{folder}' meanwhile, where "
            f"{free / 1e9:.2g} GB are free; free some space, choose another result folder, or take a greater texel "
            "size or --median p2."
        )


@dataclass(frozen=True)
class Passes:
    """The passes over the frames of a room, as the settings ask for them.

    Attributes
    ----------
    read : callable
        Gives a frame's pixels.
    folder : Path
        Where the exact median keeps observations meanwhile.
    """

    surface: Surface
    read: Callable[[Frame], Pixels]
    settings: Settings
    folder: Path

    def lit_diffuse(
        self,
        frames: Sequence[Frame],
        progress: Progress | Rounds,
        also: Callable[[int, FrameView, Pixels, Observations], None] | None = None,
    ) -> LitDiffuse:
        """L_d as the settings ask for it; `also` and errors as of `accumulate`."""
        surface, s = self.surface, self.settings
        inputs = surface.mesh, surface.atlas, surface.scene, frames, self.read
        if "lit_diffuse" in s.published:
            return running_lit_diffuse(*inputs, threads=s.threads, also=also, progress=progress)
        return accumulate(
            *inputs, median=s.median, edge_tier="edge-tier" not in s.without, seed=s.seed, threads=s.threads,
            folder=self.folder, also=also, groups=surface.groups, progress=progress,
        )  # fmt: skip

    def sharpened(
        self, lit_diffuse: LitDiffuse, frames: Sequence[Frame], progress: Progress | Rounds, **options: Any
    ) -> LitDiffuse:
        """L_d with its detail given back; `options` and errors as of `sharpen.sharpened`."""
        s = self.settings
        return sharpened(
            lit_diffuse, self.surface, frames, self.read, median=s.median, seed=s.seed, threads=s.threads,
            folder=self.folder, progress=progress, **options,
        )  # fmt: skip

    def once(self, frames: Sequence[Frame], poses: Poses, progress: Progress | Rounds) -> Observed:
        """Read every frame once, from where `poses` has it.

        Raises
        ------
        BadInputError
            From `read`, or as no frame shows any of the mesh.
        InterruptedRun
            From `progress`.
        """
        frames = poses.of(frames)
        sky = EnvironmentAccumulator(float(np.median([f.camera.pixel_angle for f in frames])))
        collector = SampleCollector(self.surface.atlas, len(frames), self.settings.seed, self.surface.mesh.geometry[0])

        def also(index, view, pixels, observations):
            sky.add(view, pixels)
            collector.add(index, observations, view)

        lit_diffuse = self.lit_diffuse(frames, progress, also)
        if not lit_diffuse.seen.any():
            raise BadInputError(
                "No frame shows any of the mesh: all pixels are invalid or the poses look elsewhere; check the frames."
            )
        return Observed(lit_diffuse, sky.result(), collector.result(), poses, Calibration.none(len(frames)))

    def all(self, frames: Sequence[Frame], progress: Progress) -> Observed:
        """What `once` finds with the poses as read, or refined; errors as there."""
        surface, settings, rounds = self.surface, self.settings, Rounds(progress, 0, 1)
        calibration = Calibration.none(len(frames))
        if "radiometric-calibration" not in settings.without and any(frame.uncalibrated for frame in frames):
            calibration = calibrate(
                surface.mesh, surface.scene, frames, lambda frame: self.read(as_codes(frame)),
                threads=settings.threads, seed=settings.seed,
                white_balance="white-balance" not in settings.without, progress=rounds,
            )  # fmt: skip
            frames = calibration.of(frames)
            rounds.next()
        observed = self.once(frames, Poses.as_read(frames), rounds)
        if settings.refine_poses and "pose-refinement" not in settings.without:
            lit_diffuse = observed.lit_diffuse
            room = LightField(
                surface.mesh, surface.atlas, surface.scene, np.nan_to_num(lit_diffuse.radiance), observed.environment,
                lookup=surface.lookup,
            )  # fmt: skip
            rounds.next()
            poses = refine_poses(
                frames, self.read, Texture(room, lit_diffuse.seen), threads=settings.threads, progress=rounds
            )
            del room
            give_back()
            observed = replace(observed, poses=poses)
            if poses.moved.any():
                rounds.next()
                observed = self.once(frames, poses, rounds)
        if settings.sharpen and "sharpening" not in settings.without:
            rounds.next()
            lit_diffuse = self.sharpened(observed.lit_diffuse, observed.poses.of(frames), rounds, groups=surface.groups)
            observed = replace(observed, lit_diffuse=lit_diffuse)
        return replace(observed, calibration=calibration)


def observe(passes: Passes, capture: Capture, progress: Progress) -> Observed:
    """What the frames of a capture show, or the light stored on its mesh; errors as of `Passes.once`."""
    if capture.frames:
        return passes.all(capture.frames, progress)
    mesh = replace(capture.mesh, vertices=passes.surface.mesh.vertices)
    atlas, stored = passes.surface.atlas, mesh.lit
    if isinstance(stored, LitTexture):
        lit_diffuse = lit_from_picture(mesh, stored, atlas, progress)
    else:
        lit_diffuse = lit_from_tiles(mesh, atlas, progress)
    return Observed(lit_diffuse, Environment.dark(), Samples.none(), Poses.as_read(()), Calibration.none(0))
