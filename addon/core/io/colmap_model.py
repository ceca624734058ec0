"""A COLMAP model's cameras and images, from its text or binary files, as they are written there.

Formats: COLMAP's documentation (doc/format.rst) and src/colmap/scene/reconstruction_io. Files of rigs, frames and
points are not looked at.
"""

import mmap
import struct
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import NamedTuple

from ..errors import BadInputError
from ..kinds import Code, Limit
from ..scene.lenses_colmap import COUNTS, NAMES
from .files import mapped

MAX_NAME_BYTES: Limit[int] = 4096
MIN_CAMERA_BYTES: Code[int] = 24 + 2 * 8
MIN_IMAGE_BYTES: Code[int] = 64 + 1 + 8
"""Bytes of the smallest records: counts that the file is too short for are told before anything is made of them."""


class ColmapCamera(NamedTuple):
    """One line of cameras.txt."""

    model: str
    width: int
    height: int
    parameters: tuple[float, ...]


class ColmapImage(NamedTuple):
    """One image; the pose takes world to camera (x right, y down, z forward).

    Attributes
    ----------
    quaternion : (w, x, y, z)
        Not always of unit length.
    translation : (x, y, z)
    name : str
        Path of the picture, with "/" between folders.
    """

    number: int
    quaternion: tuple[float, ...]
    translation: tuple[float, ...]
    camera: int
    name: str


class ColmapModel(NamedTuple):
    """What the two files hold; `cameras_file` and `images_file` are for messages."""

    cameras: dict[int, ColmapCamera]
    images: list[ColmapImage]
    cameras_file: Path
    images_file: Path


def model_files(folder: Path) -> tuple[Path, Path] | None:
    """The files of cameras and images in a folder; binary ones first, as COLMAP does."""
    for ending in (".bin", ".txt"):
        files = folder / f"cameras{ending}", folder / f"images{ending}"
        if all(path.is_file() for path in files):
            return files
    return None


def read_model(folder: Path) -> ColmapModel:
    """The model in `folder`.

    Raises `BadInputError` where a file is missing or damaged, or a camera is of a model that is not known.
    """
    files = model_files(folder)
    if files is None:
        raise BadInputError(f"Folder '{folder}' holds no COLMAP model; it needs cameras and images, both .bin or .txt.")
    try:
        if files[0].suffix == ".bin":
            return ColmapModel(_binary_cameras(files[0]), _binary_images(files[1]), *files)
        return ColmapModel(_text_cameras(files[0]), _text_images(files[1]), *files)
    except OSError as error:
        raise BadInputError(f"'{error.filename}' can't be read ({error.strerror}); check the file.") from error


# Text


def _text_cameras(path: Path) -> dict[int, ColmapCamera]:
    cameras = {}
    with open(path, "rb") as file:
        for line_number, line in enumerate(file, 1):
            parts = line.split()
            if not parts or parts[0].startswith(b"#"):
                continue
            try:
                number, model, width, height, *parameters = parts
                camera = ColmapCamera(model.decode(), int(width), int(height), tuple(map(float, parameters)))
                cameras[int(number)] = camera
            except ValueError:
                raise BadInputError(
                    f"'{path}' has no camera in line {line_number} (ID MODEL WIDTH HEIGHT PARAMS); "
                    "export the model again."
                ) from None
    return cameras


def _text_images(path: Path) -> list[ColmapImage]:
    images = []
    points = False  # whether the next line holds the points of the image before
    with open(path, "rb") as file:
        for line_number, line in enumerate(file, 1):
            if points and not _is_image(line):
                points = False
                continue
            if not line.strip() or line.lstrip().startswith(b"#"):
                continue
            try:
                number, *pose, camera, name = line.split(None, 9)
                if len(pose) != 7:
                    raise ValueError
                values = tuple(map(float, pose))
                images.append(ColmapImage(int(number), values[:4], values[4:], int(camera), _name(name.strip())))
            except ValueError:
                raise BadInputError(
                    f"'{path}' has no image in line {line_number} (ID QW QX QY QZ TX TY TZ CAMERA_ID "
                    "NAME); export the model again."
                ) from None
            points = True
    return images


def _is_image(line: bytes) -> bool:
    """Whether a line, due to hold points, holds an image: some tools leave the empty lines of points out."""
    parts = line.split(None, 9)
    if len(parts) < 10:
        return False
    try:
        int(parts[0]), int(parts[8]), [float(p) for p in parts[1:8]]
    except ValueError:
        return False
    try:
        float(parts[9].split()[0])
    except ValueError:
        return True
    return False


def _name(name: bytes) -> str:
    return name.decode("utf-8", "surrogateescape").replace("\\", "/")


# Binary


@contextmanager
def _mapped(path: Path) -> Iterator[mmap.mmap]:
    if path.stat().st_size < 8:
        raise BadInputError(f"'{path}' is cut off: it has {path.stat().st_size} bytes; export the model again.")
    with mapped(path) as data:
        yield data


def _count(data: mmap.mmap, record_bytes: int, records: str, path: Path) -> int:
    count = struct.unpack_from("<Q", data)[0]
    if count > (len(data) - 8) // record_bytes:
        raise BadInputError(
            f"'{path}' claims {count} {records}, more than its {len(data)} bytes can hold; export the model again."
        )
    return count


def _cut_off(path: Path, what: str, index: int) -> BadInputError:
    return BadInputError(f"'{path}' is cut off in {what} {index + 1}; export the model again.")


def _binary_cameras(path: Path) -> dict[int, ColmapCamera]:
    cameras = {}
    with _mapped(path) as data:
        offset = 8
        for index in range(_count(data, MIN_CAMERA_BYTES, "cameras", path)):
            try:
                number, model, width, height = struct.unpack_from("<IiQQ", data, offset)
                if model not in NAMES:
                    raise BadInputError(
                        f"'{path}' has camera {number} of model number {model}, which is none of "
                        "COLMAP's that are known; undistort the pictures with COLMAP."
                    )
                parameters = struct.unpack_from(f"<{COUNTS[NAMES[model]]}d", data, offset + 24)
            except struct.error:
                raise _cut_off(path, "camera", index) from None
            cameras[number] = ColmapCamera(NAMES[model], width, height, parameters)
            offset += 24 + 8 * len(parameters)
    return cameras


def _binary_images(path: Path) -> list[ColmapImage]:
    images = []
    with _mapped(path) as data:
        offset = 8
        for index in range(_count(data, MIN_IMAGE_BYTES, "images", path)):
            try:
                number, *pose, camera = struct.unpack_from("<I7dI", data, offset)
                end = data.find(b"\0", offset + 64, offset + 64 + MAX_NAME_BYTES)
                points = 0 if end < 0 else struct.unpack_from("<Q", data, end + 1)[0]
            except struct.error:
                raise _cut_off(path, "image", index) from None
            if end < 0 or end + 9 + 24 * points > len(data):
                raise _cut_off(path, "image", index)
            name = _name(data[offset + 64 : end])
            images.append(ColmapImage(number, tuple(pose[:4]), tuple(pose[4:]), camera, name))
            offset = end + 9 + 24 * points
    return images
