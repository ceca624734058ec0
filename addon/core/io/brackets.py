"""Several exposures of one pose, merged to one picture of more range than a sensor has.

Each pixel is the maximum-likelihood estimate for photon noise from the exposures that show it neither clipped nor
black: radiance = sum w z / sum w t, with stored value z and exposure t (Kirk and Andersen, "Noise characterization of
weighting schemes for combination of multiple exposures", BMVC 2006; their Poisson weights). w falls to 0 towards the
clip, where a value is a mixture of clipped ones, so that no seam shows where an exposure drops out.
"""

import itertools
from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ..kinds import Unit
from ..scene.model import Frame

SAME_POSE: Unit[float] = 1e-6
"""Metres, and entries of a rotation, within which two poses are one."""
DIFFERENT = 1.05
"""Ratio of two exposures from which on frames of one pose are brackets."""
RISE = 0.8
"""Share of the saturation from which on w falls."""
FLOOR = 1 / 500
"""Share of the saturation below which a value is black level and rounding."""


class Exposed(NamedTuple):
    """One exposure as it is stored.

    Attributes
    ----------
    rgb : (h, w, 3) float32
    usable : (h, w) bool
        False: it says nothing here.
    clipped : (h, w) bool
    """

    rgb: np.ndarray
    usable: np.ndarray
    clipped: np.ndarray
    exposure: float
    saturation: float


def merge(shots: Iterable[Exposed]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Merge exposures of one pose, handed over from the shortest to the longest.

    Returns
    -------
    radiance : (h, w, 3) float32
        Where all exposures are clipped, the shortest's: a lower bound. Where all are black, the longest's.
    valid : (h, w) bool
        Any exposure says something.
    saturated : (h, w) bool
        All that say something are clipped.
    """
    shots = iter(shots)
    first = next(shots)
    total, radiance = np.zeros(first.rgb.shape, np.float32), np.zeros(first.rgb.shape, np.float32)
    time = np.zeros(first.usable.shape, np.float32)
    valid, exact = np.zeros_like(first.usable), np.zeros_like(first.usable)
    for shot in itertools.chain((first,), shots):
        good = shot.usable & ~shot.clipped
        with np.errstate(over="ignore", divide="ignore", invalid="ignore"):
            exposure = np.float32(shot.exposure)
            estimate = shot.rgb / exposure
        takes = good | (shot.usable & ~valid)  # a longer exposure that is not clipped, or the first that says anything
        radiance[takes] = estimate[takes]
        exact |= good
        valid |= shot.usable
        peak = np.where(good, shot.rgb.max(-1), 0)
        weight = good.astype(np.float32)
        if np.isfinite(shot.saturation):
            weight *= np.clip((1 - peak / shot.saturation) / (1 - RISE), 0, 1)
            weight *= peak >= FLOOR * shot.saturation
        total += weight[..., None] * np.where(good[..., None], shot.rgb, 0)
        time += weight * exposure
    known = time > 0
    radiance[known] = total[known] / time[known][:, None]
    return radiance, valid, valid & ~exact


def group_brackets(frames: Sequence[Frame]) -> tuple[list[Frame], list[str]]:
    """Make frames of one pose and camera with different exposures one frame with brackets.

    Returns
    -------
    frames : list of Frame
        In capture order; a group stands where its first frame stood.
    notes : list of str
        One sentence where any were found.
    """
    groups: dict[tuple, list[int]] = {}
    for i, frame in enumerate(frames):
        groups.setdefault(_key(frame), []).append(i)
    leaders: dict[int, list[Frame]] = {}
    inside: set[int] = set()
    for members in groups.values():
        exposures = [frames[i].exposure for i in members]
        if len(members) > 1 and max(exposures) > DIFFERENT * min(exposures):
            leaders[members[0]] = [frames[i] for i in members[1:]]
            inside.update(members[1:])
    if not leaders:
        return list(frames), []
    merged = [_lead(frame, leaders.get(i, [])) for i, frame in enumerate(frames) if i not in inside]
    count = len(inside) + len(leaders)
    first = frames[next(iter(leaders))].name
    return merged, [
        f"{count} frames share {len(leaders)} poses with different exposures (the first: '{first}'); those "
        "of one pose are merged to one HDR frame."
    ]


def unfold(frames: Sequence[Frame]) -> list[Frame]:
    """Each exposure as a frame of its own, so that all pictures are looked at alike."""
    return [
        replace(frame, path=shot.path, exposure=shot.exposure, saturation=shot.saturation, brackets=())
        for frame in frames
        for shot in frame.shots
    ]


def fold(frames: Sequence[Frame], exposures: Sequence[Frame]) -> list[Frame]:
    """Undo `unfold`: `frames` with what their `exposures` have become."""
    result, at = [], 0
    for frame in frames:
        end = at + 1 + len(frame.brackets)
        result.append(_lead(exposures[at], exposures[at + 1 : end]))
        at = end
    return result


def _lead(frame: Frame, others: Sequence[Frame]) -> Frame:
    return replace(frame, brackets=(*frame.brackets, *(shot for other in others for shot in other.shots)))


def _key(frame: Frame) -> tuple:
    """Equal for frames that saw the same through the same lens."""
    pose = tuple(np.round(frame.camera.camera_to_world[:3] / SAME_POSE).ravel().tolist())
    camera = repr(replace(frame.camera, camera_to_world=np.eye(4)))
    return camera, pose, frame.mask_path, frame.id_path, frame.transfer
