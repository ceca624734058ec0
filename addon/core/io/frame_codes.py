"""Frames that are pictures of 8 or 16 bits: which curve their codes have, and where they clip."""

from collections.abc import Sequence
from dataclasses import replace

from ..errors import BadInputError
from ..scene.model import AUTO, Frame
from .pictures import picture_bits, unstated_curve
from .transfer import check_transfer, clip_level


def with_curves(frames: Sequence[Frame], transfer: str) -> tuple[list[Frame], list[str], list[str]]:
    """Give frames of codes the curve `transfer` and the value at which codes end.

    Where nobody told a curve (''), it is `AUTO` if all frames are codes; codes among floats are told as problems.

    Returns
    -------
    frames : list of Frame
        Frames of floats stay as they are; so do those whose picture can't be read, which is told later.
    problems, notes : list of str

    Raises
    ------
    BadInputError
        There is no such curve.
    """
    check_transfer(transfer)
    result: list[Frame] = []
    problems = []
    depths = [_bits(frame) for frame in frames]
    coded = sum(any(bits) for bits in depths)
    transfer = transfer or (AUTO if coded == sum(map(bool, depths)) else "")
    for frame, bits in zip(frames, depths):
        if not any(bits):
            result.append(frame)
            continue
        if not transfer:
            problems.append(unstated_curve(frame.path))
            continue
        limits = [clip_level(depth, transfer) if depth else float("inf") for depth in bits]
        shots = tuple(
            replace(shot, saturation=min(shot.saturation, limit)) for shot, limit in zip(frame.brackets, limits[1:])
        )
        result.append(replace(frame, transfer=transfer, saturation=min(frame.saturation, limits[0]), brackets=shots))
    notes = []
    if coded and transfer == AUTO:
        notes.append(
            f"{coded} of {len(frames)} frames are pictures of 8 or 16 bits whose curve nobody told: response, exposure,"
            " white balance and vignetting are estimated from places that several frames show, and the contrast is"
            " taken to be sRGB's. Give --transfer if the curve is known."
        )
    elif coded and transfer:
        notes.append(
            f"{coded} of {len(frames)} frames are pictures of 8 or 16 bits, decoded by the curve '{transfer}';"
            " where a camera or a program applied another (tone mapping), the light comes out wrong."
        )
    return result, problems, notes


def _bits(frame: Frame) -> list[int]:
    """Bits of a channel in each of a frame's pictures, 0 of floats; none where one can't be read, told later."""
    try:
        return [picture_bits(shot.path) for shot in frame.shots]
    except BadInputError:
        return []
