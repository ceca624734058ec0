"""Record3D's recordings: `metadata.json` with all poses, pictures in `rgb` ("EXR + RGB") or `rgbd` (an unzipped .r3d).

Depth and its confidence are not looked at.
Source: marek-simonik/record3d, issues 27, 33, 36, 64, 83, 93; nerfstudio's process_data/record3d_utils.py.
"""

import re
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import BadInputError
from ..json_values import is_number
from ..scene.model import Camera, Frame
from .arkit import FUSE, MAX_FRAMES, read_pose, read_y_up
from .files import read_json
from .formats import FORMATS
from .layout import Layout, Reader, Reading, usable
from .meshes import find_mesh
from .pictures import ENDINGS

METADATA, FOLDERS, ARCHIVE = ("metadata.json", "metadata"), ("rgb", "rgbd"), ".r3d"
PICTURE = re.compile(r"\d{1,9}")
UP = (
    "Record3D's +Y was taken as up; some recordings begin with the camera's own up instead. If the room does not stand "
    "upright, name the axis that points up (--convention up:+y)."
)


def find(root: Path) -> bool:
    """Whether a folder is such an export, or holds one that is still zipped."""
    return _parts(root) is not None or any(root.glob(f"*{ARCHIVE}"))


def read(root: Path, reading: Reading) -> Layout:
    """Read the poses, the cameras and the mesh, as `layout.Reader` has it."""
    parts = _parts(root)
    if parts is None:
        archive = next(iter(sorted(root.glob(f"*{ARCHIVE}"))), root / f"recording{ARCHIVE}")
        raise BadInputError(f"'{archive}' is a zip; unzip it, and choose the folder that holds its 'metadata'.")
    path, folder = parts
    metadata = read_json(path)
    poses = metadata.get("poses")
    if not isinstance(poses, list) or not poses:
        raise BadInputError(f"'{path}' lists no poses: only recordings of the LiDAR camera have them.")
    pictures = {int(p.stem): p for p in sorted(folder.iterdir()) if PICTURE.fullmatch(p.stem)
                and p.suffix.lower() in ENDINGS and p.is_file()}  # fmt: skip
    if not pictures:
        raise BadInputError(f"Folder '{folder}' has no pictures called 0.jpg and so on; export the recording again.")
    chosen = sorted(pictures)
    if len(chosen) > MAX_FRAMES:
        chosen = [chosen[k] for k in np.linspace(0, len(chosen) - 1, MAX_FRAMES).astype(int)]

    def frame(index: int) -> Frame:
        if index >= len(poses):
            raise BadInputError(f"Frame '{index}' has no pose in '{path}', which has {len(poses)}.")
        pose = read_pose(poses[index] if isinstance(poses[index], list) else [], f"{index}")
        return Frame(f"{index:06d}", pictures[index], _camera(metadata, index, pose, path))

    frames, problems = usable(frame, chosen)
    notes = [UP]
    if len(chosen) < len(pictures):
        notes.append(f"{len(chosen)} of {len(pictures)} frames were taken, evenly: others show nearly the same.")
    mesh = read_y_up(find_mesh(root, reading, remedy=f"Record3D {FUSE}"), reading)
    return Layout(frames, mesh, problems=problems, notes=notes)


def _parts(root: Path) -> tuple[Path, Path] | None:
    metadata = next((root / name for name in METADATA if (root / name).is_file()), None)
    folder = next((root / name for name in FOLDERS if (root / name).is_dir()), None)
    return None if metadata is None or folder is None else (metadata, folder)


def _camera(metadata: dict[str, Any], index: int, pose: np.ndarray, path: Path) -> Camera:
    """The frame's own camera, else that of the whole recording (`K`, column by column)."""
    size = [metadata.get("w"), metadata.get("h")]
    per_frame, shared = metadata.get("perFrameIntrinsicCoeffs"), metadata.get("K")
    values: Any = per_frame[index] if isinstance(per_frame, list) and index < len(per_frame) else None
    if values is None and isinstance(shared, list) and len(shared) == 9:
        values = [shared[k] for k in (0, 4, 6, 7)]
    numbers = [*size, *values] if isinstance(values, list) else []
    if len(numbers) != 6 or not all(map(is_number, numbers)) or min(numbers[:4]) <= 0:
        raise BadInputError(f"'{path}' does not tell the camera of frame '{index}' (w, h and K); export it again.")
    width, height, fx, fy, cx, cy = map(float, numbers)
    return Camera(int(width), int(height), fx, fy, cx, cy, pose)


READER = Reader("record3d", FORMATS["record3d"], find, read)
