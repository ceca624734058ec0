"""Small videos of known pictures, as phones write them; needs PyAV."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from pathlib import Path

import numpy as np

WIDTH, HEIGHT = 64, 48


def grey(y: int, cb: int = 0, cr: int = 0) -> list[np.ndarray]:
    """Y', Cb and Cr of a picture of one colour, without colour where that isn't told."""
    middle = 128 if y < 256 else 512
    chroma = (HEIGHT // 2, WIDTH // 2)
    return [np.full((HEIGHT, WIDTH), y), np.full(chroma, cb or middle), np.full(chroma, cr or middle)]


def write_video(
    path: Path,
    planes: Sequence[Sequence[np.ndarray]],
    bits: int = 8,
    first: int = 0,
    codec: str = "",
    movflags: str = "",
    **tags: int,
) -> None:
    """Write Y', Cb, Cr of each frame without loss, 60 a second, the first at `first` sixtieths.

    `tags` are H.273's: `color_trc`, `color_primaries`, `colorspace`, `color_range`; else BT.709 in limited range.
    """
    import av

    height, width = planes[0][0].shape
    kind = np.uint8 if bits == 8 else np.dtype("<u2")
    with av.open(str(path), "w", format="mp4", options={"movflags": movflags} if movflags else {}) as container:
        stream = container.add_stream(codec or ("libx264" if bits == 8 else "libx265"), rate=60)
        stream.width, stream.height = width, height
        stream.pix_fmt = "yuv420p" if bits == 8 else "yuv420p10le"
        stream.options = {"crf": "0", "x265-params": "lossless=1:log-level=none"}
        for name, value in ({"color_trc": 1, "color_primaries": 1, "colorspace": 1, "color_range": 1} | tags).items():
            setattr(stream.codec_context, name, value)
        for i, own in enumerate(planes):
            frame = av.VideoFrame(width, height, stream.pix_fmt)
            for plane, values in zip(frame.planes, own):
                lines = np.zeros((plane.height, plane.line_size // np.dtype(kind).itemsize), kind)
                lines[:, : plane.width] = values
                plane.update(lines.tobytes())
            frame.pts, frame.time_base = first + i, Fraction(1, 60)
            container.mux(stream.encode(frame))
        container.mux(stream.encode(None))
