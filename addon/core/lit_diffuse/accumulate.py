"""Accumulation: all frames into the lit diffuse texture L_d."""

from collections.abc import Callable, Sequence
from contextlib import ExitStack
from dataclasses import fields, replace
from pathlib import Path

import numpy as np

from ..luminance import LUMINANCE
from ..paper.p_square import Summary
from ..parallel import ordered_map
from ..progress import Progress, Rounds
from ..scene.atlas import Atlas
from ..scene.element_groups import ElementGroups
from ..scene.lit_diffuse import LitDiffuse
from ..scene.model import Frame, Mesh, Pixels
from ..scene.params import VISIBILITY
from ..scene.rays import RayScene
from ..scene.visibility import CLEAN, EDGE, SATURATED, FrameView, Observations, bytes_of_frame, observe, view_frame
from .medians import Estimator, make_estimator, summaries


def frame_order(count: int, seed: int) -> np.ndarray:
    """Fixed and pseudo-random: a median in fixed memory would follow slow drifts."""
    return np.random.default_rng(seed).permutation(count)


def _choose(best: Summary, edge: Summary, saturated: Summary) -> LitDiffuse:
    """For each element the best tier that has enough, else the best that has any; into `best`, the clean one.

    Where more observations are clipped above the median of the others than there are others, the median of all is not
    known (Kaplan and Meier 1958): it is that of the clipped ones, a lower bound.
    """
    clean = best.count.copy()
    tier = np.where(clean > 0, np.int8(CLEAN), np.int8(-1))

    def take(kind: int, other: Summary, beaten: np.ndarray) -> None:
        chosen = beaten & (other.count > 0)
        tier[chosen] = kind
        for name in ("median", "lower", "upper", "count"):
            getattr(best, name)[chosen] = getattr(other, name)[chosen]

    take(EDGE, edge, (clean < VISIBILITY.enough) & (edge.count >= clean))
    quartiles = (saturated.lower, saturated.median, saturated.upper)
    above = sum((quartile @ LUMINANCE >= best.median @ LUMINANCE) * 0.25 for quartile in quartiles)
    # Each is a lower bound. That of a frame exposed for less is nearer.
    bound = replace(saturated, median=saturated.upper)
    take(SATURATED, bound, (tier < 0) | (above * saturated.count > clean + edge.count))
    clipped = saturated.count / np.maximum(clean + edge.count + saturated.count, 1)
    return LitDiffuse(best.median, best.interquartile_range, best.count, tier, clipped.astype(np.float32))


def _chosen(estimators: dict[int, Estimator], count: int) -> LitDiffuse:
    """`_choose` for all elements. By blocks: all summaries at once were the most memory that a large room's frames
    took."""
    result = LitDiffuse(
        radiance=np.empty((count, 3), np.float32),
        interquartile_range=np.empty((count, 3), np.float32),
        count=np.empty(count, np.int32),
        tier=np.empty(count, np.int8),
        clipped=np.empty(count, np.float32),
    )
    start = 0
    for of_block in zip(*(summaries(estimators[tier]) for tier in (CLEAN, EDGE, SATURATED)), strict=True):
        chosen = _choose(*of_block)
        for field in fields(LitDiffuse):
            values = getattr(chosen, field.name)
            getattr(result, field.name)[start : start + len(values)] = values
        start += len(chosen.count)
    return result


def accumulate(
    mesh: Mesh,
    atlas: Atlas,
    scene: RayScene,
    frames: Sequence[Frame],
    read: Callable[[Frame], Pixels],
    *,
    median: str = "exact",
    seed: int = 0,
    threads: int = 0,
    folder: Path | None = None,
    edge_tier: bool = True,
    only: np.ndarray | None = None,
    change: Callable[[Frame, FrameView, Pixels], Pixels] | None = None,
    also: Callable[[int, FrameView, Pixels, Observations], None] | None = None,
    groups: ElementGroups | None = None,
    progress: Progress | Rounds | None = None,
) -> LitDiffuse:
    """Project every frame onto the elements it sees and take the median, kinds of observations apart.

    Frames are streamed: a handful is in memory at once.

    Parameters
    ----------
    read : callable
        Gives a frame's pixels.
    median : str
        'exact', 'p2' or 'mean'; see `medians`.
    folder : Path, optional
        Where the exact median keeps observations meanwhile.
    edge_tier : bool
        Observations at depth edges count only where there are too few others.
    only : (n,) bool, optional
        Elements to ask for; all where not given.
    change : callable, optional
        Makes a frame's pixels what is to be projected, once it is known what they show.
    also : callable, optional
        Called with each frame's index, view, pixels and observations, in this thread: others who want to see them.
    groups : ElementGroups, optional
        Of this atlas, if there are any already; they remember what frames see.

    Raises
    ------
    BadInputError
        From `read`.
    InterruptedRun
        From `progress`.
    """
    groups = groups or ElementGroups(atlas)
    estimators = {tier: make_estimator(median, len(atlas), folder, threads) for tier in (CLEAN, EDGE, SATURATED)}
    order, frame_bytes = frame_order(len(frames), seed), bytes_of_frame(frame.camera for frame in frames)

    def look(index: int) -> tuple[int, FrameView, Pixels, Observations]:
        frame = frames[index]
        pixels = read(frame)
        view = view_frame(frame.camera, mesh, scene)
        pixels = pixels if change is None else change(frame, view, pixels)
        remembered = groups.seen(frame.camera, pixels.valid)
        elements = groups.candidates(view) if remembered is None else remembered
        elements = elements if only is None else elements[only[elements]]
        observations = observe(view, pixels, atlas, scene, elements, free=remembered is not None)
        if remembered is None and only is None and change is None:
            groups.remember(frame.camera, pixels.valid, observations.element)
        return int(index), view, pixels, observations

    with ExitStack() as stack:
        for estimator in estimators.values():
            stack.callback(estimator.close)
        for done, (index, view, pixels, observations) in enumerate(ordered_map(look, order, threads, each=frame_bytes)):
            tiers = observations.tier if edge_tier else np.where(observations.tier == EDGE, CLEAN, observations.tier)
            for tier, estimator in estimators.items():
                chosen = np.flatnonzero(tiers == tier)
                estimator.add(observations.element.take(chosen), observations.radiance.take(chosen, 0))
            if also is not None:
                also(index, view, pixels, observations)
            if progress is not None:
                progress.update(0.9 * (done + 1) / len(order))
        return _chosen(estimators, len(atlas))
