"""Frames of a phone's video, through PyAV, which is an extra: taken out once, as PNG in a folder beside the video.

Runs read frames in any order and many times; a video is read in order alone. So the frames that are used become
pictures, in a folder named by the video's size in bytes, which another video would not have.
Source: ITU-T H.273 (numbers of primaries, curves and matrices; full and limited range), BT.709, BT.2020, BT.2100 (HLG).
"""

import os
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from itertools import groupby
from pathlib import Path
from typing import Any

import numpy as np

from ..atomic import TEMPORARY
from ..errors import BadInputError, StorageError
from ..kinds import Code, Limit
from ..parallel import thread_count
from ..photo import srgb, srgb_to_linear
from .picture import check_claim, decoding
from .png import png
from .primaries import REC709, rgb_to_xyz, xyz_to_rec709

CODECS: Code[tuple[str, ...]] = ("h264", "hevc")
"""What phones write; nothing else of FFmpeg's is handed a stranger's bytes."""
WHITE: Code[tuple[float, float]] = (0.3127, 0.3290)
PRIMARIES: Code[dict[int, tuple[float, ...]]] = {
    1: REC709,
    2: REC709,  # untold
    5: (0.64, 0.33, 0.29, 0.60, 0.15, 0.06, *WHITE),
    6: (0.630, 0.340, 0.310, 0.595, 0.155, 0.070, *WHITE),
    9: (0.708, 0.292, 0.170, 0.797, 0.131, 0.046, *WHITE),
    12: (0.680, 0.320, 0.265, 0.690, 0.150, 0.060, *WHITE),
}
LUMA: Code[dict[int, tuple[float, float]]] = {
    1: (0.2126, 0.0722), 2: (0.2126, 0.0722), 5: (0.299, 0.114), 6: (0.299, 0.114), 9: (0.2627, 0.0593),
}  # fmt: skip
"""Shares of red and blue in luma."""
BT709: Code[tuple[int, ...]] = (1, 2, 6, 14, 15)
SRGB: Code[int] = 13
HLG: Code[int] = 18
FULL: Code[int] = 2
"""The range in which codes begin at 0."""
REFERENCES: Limit[int] = 24
"""Bytes that a decoder takes for each pixel: 16 pictures that others refer to, of 1.5 bytes."""
DENSE: Limit[tuple[int, int]] = (1 << 28, 1 << 11)
"""Pixels of all frames beyond which the file has to hold a byte for so many; a phone's holds one for 80."""
THREADS: Limit[int] = 8
"""Each holds a frame."""
SLACK: Limit[float] = 0.01
"""Share of the frames by which video and poses may differ: recordings that were ended hastily lack the last ones."""


def frames(video: Path, windows: Sequence[np.ndarray]) -> dict[int, Path]:
    """The sharpest frame of each window, as a picture on disk, by number: sRGB codes, Rec.709, as stored (not turned).

    8 bits, or 16 where the video has more. Those that were taken out before are used again, without PyAV.

    Parameters
    ----------
    windows : sequence of (n,) int arrays
        Numbers of frames in the order in which they are shown, from 0; each above all of those before.

    Raises
    ------
    BadInputError
        The video is damaged, cut off, no H.264 or HEVC in MP4 or MOV, larger than any, has colours that aren't known,
        or other frames than the windows ask for; or there is no PyAV.
    StorageError
        The pictures can't be put beside it.
    """
    try:
        folder = video.with_name(f"{video.name}-{video.stat().st_size}")
        if not folder.is_dir():
            with tempfile.TemporaryDirectory(dir=video.parent, prefix=TEMPORARY) as scratch:
                taken = Path(scratch) / "frames"
                taken.mkdir()
                for number, image in _sharpest(video, windows):
                    (taken / f"{number:06d}.png").write_bytes(png(image, 1))
                if not folder.is_dir():  # another run was not faster
                    os.replace(taken, folder)
        return {int(path.stem): path for path in sorted(folder.glob("*.png")) if path.stem.isdecimal()}
    except OSError as error:
        raise StorageError(
            f"The frames of '{video}' can't be put beside it ({error.strerror or error}); copy the capture to where "
            "you may write, with room for a few GB."
        ) from error


def _sharpest(video: Path, windows: Sequence[np.ndarray]) -> Iterator[tuple[int, np.ndarray]]:
    """The number and the picture, (h, w, 3) uint8 or uint16 sRGB codes, of each window's sharpest frame."""
    with decoding(video, "Video"):
        with _opened(video) as (container, stream):
            size = stream.codec_context.width, stream.codec_context.height
            check_claim(video, *size, REFERENCES * size[0] * size[1])
            times = sorted({packet.pts for packet in container.demux(stream) if packet.size and packet.pts is not None})
        wanted = int(windows[-1][-1]) + 1
        if not times or abs(len(times) - wanted) > max(1, SLACK * wanted):
            raise BadInputError(f"Video '{video}' has {len(times)} frames, and {wanted} have poses; copy it again.")
        if len(times) * size[0] * size[1] > max(DENSE[0], DENSE[1] * video.stat().st_size):
            raise BadInputError(f"Video '{video}' claims more frames than it can hold; copy it again.")
        number_of = {time: number for number, time in enumerate(times)}
        window_of = {int(number): k for k, window in enumerate(windows) for number in window if number < len(times)}
        lost = set(window_of.values())
        parts = len(lost)
        with _opened(video) as (container, stream):
            numbered = ((number_of.get(frame.pts, -1), frame) for frame in _decoded(container, stream))
            candidates = ((n, frame) for n, frame in numbered if n in window_of and (frame.width, frame.height) == size)
            for window, group in groupby(candidates, lambda pair: window_of[pair[0]]):
                number, frame = max(group, key=lambda pair: _sharpness(pair[1]))
                lost.discard(window)
                yield number, _picture(frame, video)
        if lost:
            raise BadInputError(
                f"Video '{video}' is damaged: {len(lost)} of {parts} parts can't be read; copy it again."
            )


@contextmanager
def _opened(video: Path) -> Iterator[tuple[Any, Any]]:
    try:
        import av
    except ImportError as error:
        raise BadInputError(
            f"Video '{video}' needs PyAV; install it (pip: av) into this Python, or read the capture once where it is: "
            "its frames are kept beside it."
        ) from error
    # From a file that is open, as one kind of container: a playlist would name other files. Apple's writer begins a
    # frame before time 0 and hides it by an edit list; poses count it.
    with open(video, "rb") as file, av.open(file, format="mov", options={"ignore_editlist": "1"}) as container:
        stream = container.streams.video[0]
        if stream.codec_context.name not in CODECS:
            raise BadInputError(f"Video '{video}' has no H.264 or HEVC, as phones record; convert it.")
        context = stream.codec_context
        context.options = {"max_pixels": str((context.width + 64) * (context.height + 64))}
        context.thread_type, context.thread_count = "AUTO", min(THREADS, thread_count(0))
        yield container, stream


def _decoded(container: Any, stream: Any) -> Iterator[Any]:
    """The frames that can be read, in the order in which they are shown."""
    from av import FFmpegError

    for packet in container.demux(stream):
        try:
            yield from (frame for frame in packet.decode() if not frame.is_corrupt)
        except FFmpegError:  # a frame less
            continue


def _sharpness(frame: Any) -> float:
    """Sum of squares of the steps between neighbours in luma at half the size: motion blur takes it away."""
    small = frame.reformat(frame.width // 2 or 1, frame.height // 2 or 1, "gray", threads=1)
    steps = (np.diff(small.to_ndarray().astype(np.float32), axis=axis) for axis in (0, 1))
    return float(sum(np.vdot(step, step) for step in steps))


def _picture(frame: Any, video: Path) -> np.ndarray:
    """sRGB codes of Rec.709, (h, w, 3): uint8, or uint16 where the frame has more bits."""
    colours = frame.color_primaries, frame.color_trc, frame.colorspace
    planar = len(frame.planes) == 3 and not frame.format.is_rgb and not frame.format.is_big_endian
    known = colours[0] in PRIMARIES and colours[1] in (*BT709, SRGB, HLG) and colours[2] in LUMA
    if not planar or not known:
        raise BadInputError(
            f"Video '{video}' has colours that aren't known ({frame.format.name}; H.273: primaries {colours[0]}, "
            f"transfer {colours[1]}, matrix {colours[2]}); convert it to BT.709, or record SDR or HLG."
        )
    bits = frame.format.components[0].bits
    light = _light(np.linspace(0, 1, 1 << 16), colours[1])
    codes = np.rint(_rgb(frame, bits) * np.float32(65535)).astype(np.uint16)
    if PRIMARIES[colours[0]] == REC709:
        return _stored(light, bits)[codes]
    matrix = xyz_to_rec709(rgb_to_xyz(PRIMARIES[colours[0]])).astype(np.float32)
    return _stored(light.astype(np.float32)[codes] @ matrix.T, bits)


def _rgb(frame: Any, bits: int) -> np.ndarray:
    """The frame's R'G'B', (h, w, 3) float32 in 0...1; chroma is repeated."""
    kind, shift = np.uint8 if bits == 8 else np.uint16, 1 << (bits - 8)
    y, cb, cr = (
        np.frombuffer(plane, kind).reshape(plane.height, -1)[:, : plane.width].astype(np.float32)
        for plane in frame.planes
    )
    down, across = -(-y.shape[0] // cb.shape[0]), -(-y.shape[1] // cb.shape[1])
    cb, cr = ((plane - 128 * shift).repeat(down, 0).repeat(across, 1)[: y.shape[0], : y.shape[1]] for plane in (cb, cr))
    if frame.color_range == FULL:
        y, cb, cr = (plane / np.float32((1 << bits) - 1) for plane in (y, cb, cr))
    else:
        y, cb, cr = (y - 16 * shift) / (219 * shift), cb / (224 * shift), cr / (224 * shift)
    of_red, of_blue = LUMA[frame.colorspace]
    red, blue = y + 2 * (1 - of_red) * cr, y + 2 * (1 - of_blue) * cb
    green = (y - of_red * red - of_blue * blue) / (1 - of_red - of_blue)
    return np.clip(np.stack([red, green, blue], -1), 0, 1)


def _light(codes: np.ndarray, curve: int) -> np.ndarray:
    """Scene light, 0...1, of R'G'B' by the curve's number in H.273."""
    if curve == SRGB:
        return srgb_to_linear(codes)
    if curve == HLG:
        a, b, c = 0.17883277, 0.28466892, 0.55991073
        return np.where(codes <= 0.5, codes**2 / 3, (np.exp((codes - c) / a) + b) / 12)
    return np.where(codes < 0.081, codes / 4.5, ((codes + 0.099) / 1.099) ** (1 / 0.45))


def _stored(light: np.ndarray, bits: int) -> np.ndarray:
    """Light as sRGB codes, uint8 or, of more than 8 bits, uint16: what undoes them need not know the video's curve."""
    kind = np.uint8 if bits == 8 else np.uint16
    return (srgb(light) * np.iinfo(kind).max + 0.5).astype(kind)
