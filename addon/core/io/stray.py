"""Stray Scanner's recordings: the video `rgb.mp4`, and in `odometry.csv` a pose for each of its frames.

Poses are ARKit's, of cameras with OpenCV's axes, and those of pixels as they are stored: the video is shown turned.
Each has its focal length and centre; older versions have those of the last frame alone, in `camera_matrix.csv`. Depth,
its confidence and accelerations are not looked at.
Source: strayrobots/scanner, docs/format.md, OdometryEncoder.swift, DatasetEncoder.swift, VideoEncoder.swift.
"""

from pathlib import Path

import numpy as np

from ..errors import BadInputError
from ..json_values import float_of
from ..kinds import Limit
from ..scene.model import Camera, Frame
from . import video
from .arkit import FUSE, MAX_FRAMES, read_pose, read_y_up
from .files import check_links, read_text
from .formats import FORMATS
from .layout import Layout, Reader, Reading, holding, usable
from .meshes import find_mesh
from .pictures import picture_size
from .traj import TO_OPENGL

VIDEO, POSES, MATRIX = "rgb.mp4", "odometry.csv", "camera_matrix.csv"
POSE, LENS = ("qx", "qy", "qz", "qw", "x", "y", "z"), ("fx", "fy", "cx", "cy")
MAX_FRAME_NUMBER: Limit[int] = 1 << 22
"""Frames of 19 hours."""
OFF_CENTRE: Limit[float] = 0.1
"""How far a phone's principal point may lie from the middle, as a share of a side; it lies within 0.02."""


def read(root: Path, reading: Reading) -> Layout:
    """Read the poses, the cameras and the mesh, as `layout.Reader` has it, and take the frames out of the video.

    Raises `StorageError` as well, as `video.frames` does.
    """
    path = find_mesh(root, reading, remedy=f"Stray Scanner {FUSE}")  # first: a video takes half a minute
    rows = _rows(root)
    if not reading.outside:
        check_links(root, VIDEO, [root / VIDEO])
    numbers = np.array(sorted(rows))
    pictures = video.frames(root / VIDEO, np.array_split(numbers, min(MAX_FRAMES, len(numbers))))
    if not pictures:
        raise BadInputError(f"Folder '{root}' has no pictures in the folder of its video; delete that folder.")

    def frame(number: int, picture: Path) -> Frame:
        if number not in rows:
            raise BadInputError(f"Frame '{number}' has no pose in '{root / POSES}'.")
        values, name = rows[number], f"{number:06d}"
        (fx, fy, cx, cy), (width, height) = (values.get(key, np.nan) for key in LENS), picture_size(picture)
        if not max(abs(cx / width - 0.5), abs(cy / height - 0.5)) < OFF_CENTRE:
            raise BadInputError(
                f"Frame '{name}' has {width} x {height} pixels, and its camera's centre is {cx:.4g}, {cy:.4g}: it "
                f"isn't as the phone stored it, or its camera isn't told; copy '{VIDEO}' and '{POSES}' anew."
            )
        pose = read_pose([values.get(key) for key in POSE], name) @ TO_OPENGL
        return Frame(name, picture, Camera(width, height, fx, fy, cx, cy, pose))

    frames, problems = usable(lambda item: frame(*item), pictures.items())
    folder = next(iter(pictures.values())).parent.name
    notes = [
        f"{len(frames)} of {len(rows)} frames are used, of each part of the recording the sharpest; see '{folder}'."
    ]
    return Layout(frames, read_y_up(path, reading), problems=problems, notes=notes)


def _rows(root: Path) -> dict[int, dict[str, float]]:
    """What the lines of poses tell, by the numbers of their frames; what is no number is not a number."""
    head, *lines = _cells(root / POSES) or [[]]
    whole: dict[str, float] = {}
    if not set(LENS) <= set(head) and (root / MATRIX).is_file():
        matrix = [float_of(cell) for line in _cells(root / MATRIX) for cell in line]
        whole = dict(zip(LENS, (matrix[k] for k in (0, 4, 2, 5)))) if len(matrix) == 9 else {}
    rows = [whole | dict(zip(head, map(float_of, line))) for line in lines]
    numbered = ((row.get("frame", float(i)), row) for i, row in enumerate(rows))
    by_number = {int(number): row for number, row in numbered if 0 <= number < MAX_FRAME_NUMBER}
    if not set(POSE) <= set(head) or not by_number:
        raise BadInputError(f"'{root / POSES}' lists no poses ({', '.join(POSE)}); export the recording again.")
    return by_number


def _cells(path: Path) -> list[list[str]]:
    return [[cell.strip() for cell in line.split(",")] for line in read_text(path).splitlines() if line.strip()]


READER = Reader("stray", FORMATS["stray"], holding(POSES, VIDEO), read)
