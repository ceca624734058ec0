"""Copies that the core can read of pictures that it can't, made through whatever the caller brings (Blender).

The readers of pictures run in many threads, and Blender's work in the main thread alone: so each picture is copied once
before the work begins.
"""

from __future__ import annotations

import os
import tempfile
from collections.abc import Callable, Iterable
from dataclasses import replace
from hashlib import sha256
from pathlib import Path

import numpy as np

from ..errors import StorageError
from ..progress import Progress
from .exr import write_exr
from .foreign import foreign_info
from .model import Capture, Frame, Pixels
from .pictures import JPEG, TIFF, picture_kind
from .pixels import read_pixels
from .png import write_png

Load = Callable[[Path], np.ndarray]
"""Gives a picture's codes, (h, w, 3) uint8 or uint16 with row 0 the top, or its linear values, float32. Called from the
main thread alone."""


def converted(capture: Capture, folder: Path, load: Load, progress: Progress) -> Capture:
    """The capture with its foreign pictures replaced by copies in `folder` that the core can read.

    A copy that is there already, of a picture that has not changed since, is taken as it is; others are removed.

    Raises
    ------
    BadInputError
        A picture can't be decoded.
    StorageError
        The folder can't be written.
    InterruptedRun
    """
    todo = _foreign(capture.frames)
    copies: dict[Path, Path] = {}
    for i, path in enumerate(todo):
        copies[path] = _copy(path, folder, load)
        progress.update((i + 1) / len(todo))
    for left in set(folder.glob("*-*.*")) - set(copies.values()):
        left.unlink(missing_ok=True)
    return replace(capture, frames=tuple(_moved(frame, copies) for frame in capture.frames)) if copies else capture


def reading_through(load: Load) -> Callable[[Frame], Pixels]:
    """As `read_pixels`, for frames of any kind; for a look at a few, as the copies are thrown away."""

    def read(frame: Frame) -> Pixels:
        todo = _foreign([frame])
        if not todo:
            return read_pixels(frame)
        with tempfile.TemporaryDirectory(prefix="scan_relight_") as folder:
            return read_pixels(_moved(frame, {path: _copy(path, Path(folder), load) for path in todo}))

    return read


def _foreign(frames: Iterable[Frame]) -> list[Path]:
    """The pictures of the frames that the core can't read, each once."""
    return sorted({path for frame in frames for path in frame.files if _is_foreign(path)})


def _copy(path: Path, folder: Path, load: Load) -> Path:
    """Make the copy of `path`, of the same time, unless it is there."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        stat = path.stat()
        unique = sha256(f"{path.absolute()} {stat.st_size} {stat.st_mtime_ns}".encode("utf-8", "surrogatepass"))
        ending = ".png" if foreign_info(path)[2] else ".exr"
        target = folder / f"{path.stem[:80]}-{unique.hexdigest()[:12]}{ending}"
        if not target.is_file():
            pixels = load(path)
            if ending == ".png":
                write_png(target, pixels, level=1)
            else:
                write_exr(target, pixels)
            os.utime(target, ns=(stat.st_mtime_ns, stat.st_mtime_ns))  # stages know a picture by its time
    except OSError as error:
        raise StorageError(f"'{folder}' can't be written ({error.strerror or error}); free some space or choose "
                           "another result folder.") from error
    return target


def _moved(frame: Frame, copies: dict[Path, Path]) -> Frame:
    def moved(path):
        return copies.get(path, path)

    return replace(frame, path=moved(frame.path), mask_path=moved(frame.mask_path), id_path=moved(frame.id_path),
                   brackets=tuple(replace(shot, path=moved(shot.path)) for shot in frame.brackets))


def _is_foreign(path: Path) -> bool:
    return picture_kind(path) in (JPEG, TIFF)
