"""Frames that are pictures of 8 or 16 bits: which curve their codes have, and where they clip."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from ..errors import BadInputError
from ..scene.model import Frame
from .pictures import picture_bits, unstated
from .transfer import check_transfer, clip_level


def with_curves(frames: Sequence[Frame], transfer: str) -> tuple[list[Frame], list[str], list[str]]:
    """Give frames of codes the curve `transfer` ('' where nobody told) and the value at which codes end.

    Returns
    -------
    frames : list of Frame
        Frames of floats stay as they are; so do those whose picture can't be read, which is told later.
    problems, notes : list of str

    Raises
    ------
    BadInputError
        There is no such curve, or all frames have codes and none was told.
    """
    check_transfer(transfer)
    found: list[Frame] = []
    problems = []
    coded = 0
    for frame in frames:
        try:
            bits = [picture_bits(shot.path) for shot in frame.shots]
        except BadInputError:
            found.append(frame)
            continue
        if not any(bits):
            found.append(frame)
            continue
        coded += 1
        if not transfer:
            problems.append(unstated(frame.path))
            continue
        limits = [clip_level(one, transfer) if one else float("inf") for one in bits]
        shots = tuple(
            replace(shot, saturation=min(shot.saturation, limit)) for shot, limit in zip(frame.brackets, limits[1:])
        )
        found.append(replace(frame, transfer=transfer, saturation=min(frame.saturation, limits[0]), brackets=shots))
    if coded and coded == len(frames) and not transfer:
        raise BadInputError(problems[0])
    notes = []
    if coded and transfer:
        notes.append(
            f"{coded} of {len(frames)} frames are pictures of 8 or 16 bits, decoded by the curve '{transfer}';"
            " where a camera or a program applied another (tone mapping), the light comes out wrong."
        )
    return found, problems, notes
