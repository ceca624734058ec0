"""The layouts of FIPT (Wu et al., ICCV 2023), synthetic and real.

Synthetic: `scene.obj`, `train/transforms.json` with `camera_angle_x`, `train/Image/000_0001.exr` ... by their place in
the list, `train/segmentation/000.exr` ...; its camera has x left, y up and looks along +z. Real: `scene.obj`, `cam.txt`
(how many, then origin, a point looked at and up for each camera), `K_list.txt` (how many, then 3 rows each), `Image`,
`segmentation`. `val` is kept out, as are the folders that hold the truth (DiffCol, Roughness, albedo, Emit, IndexMA).
"""

import math
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import BadInputError
from ..json_values import is_number
from ..kinds import Limit
from ..scene.model import Camera, Frame
from ..scene.pose import check_pose
from .files import read_json, read_text
from .formats import FORMATS
from .layout import Layout, Reader, Reading, holding, usable
from .meshes import read_mesh
from .pictures import picture_size

MESH, SPLIT = "scene.obj", "train"
POSES, CAMERAS, INTRINSICS = "transforms.json", "cam.txt", "K_list.txt"
TO_OPENGL = np.diag([-1.0, 1.0, -1.0, 1.0])
"""From x left, y up, z forward to x right, y up, z backward."""
MAX_LEAN: Limit[float] = 0.1
"""Cosine between the direction of view and `up` from which on they are no camera's; the authors allow 0.002."""


def _read(
    root: Path, reading: Reading, folder: Path, cameras: Sequence[Any], make: Callable[[Any, Path, str], Camera]
) -> Layout:
    """The layout of a capture whose pictures lie in `folder`: what is told of each of its `cameras` makes it."""
    mesh = read_mesh(reading.mesh or root / MESH, reading)

    def frame(index: int, entry: Any) -> Frame:
        name = f"{index:03d}"
        path, ids = folder / "Image" / f"{name}_0001.exr", folder / "segmentation" / f"{name}.exr"
        return Frame(name, path, make(entry, path, name), id_path=ids if ids.is_file() else None)

    frames, problems = usable(lambda item: frame(*item), enumerate(cameras))
    return Layout(frames, mesh, problems=problems)


def read_synthetic(root: Path, reading: Reading) -> Layout:
    """Read a synthetic scene, as `layout.Reader` has it: the views of its `train` split."""
    path = root / SPLIT / POSES
    top = read_json(path)
    entries, angle = top.get("frames"), top.get("camera_angle_x")
    if not isinstance(entries, list) or not entries:
        raise BadInputError(f"'{path}' lists no frames; export the capture again.")
    if not is_number(angle) or not 0 < angle < math.pi:
        raise BadInputError(f"'{path}' has a camera_angle_x of {angle!r}; give radians between 0 and pi.")

    def camera(entry: Any, picture: Path, name: str) -> Camera:
        pose = check_pose(entry.get("transform_matrix") if isinstance(entry, dict) else None, name)
        width, height = picture_size(picture)
        focal = width / 2 / math.tan(angle / 2)
        return Camera(width, height, focal, focal, width / 2, height / 2, pose @ TO_OPENGL)

    return _read(root, reading, root / SPLIT, entries, camera)


def read_real(root: Path, reading: Reading) -> Layout:
    """Read a real capture, as `layout.Reader` has it."""
    poses, intrinsics = _triples(root / CAMERAS), _triples(root / INTRINSICS)
    if len(poses) != len(intrinsics):
        raise BadInputError(
            f"'{root / CAMERAS}' has {len(poses)} cameras, but '{root / INTRINSICS}' {len(intrinsics)};"
            " export both again."
        )

    def camera(view: tuple[np.ndarray, np.ndarray], picture: Path, name: str) -> Camera:
        (origin, target, up), k = view
        width, height = picture_size(picture)
        fx, fy, cx, cy = (float(k[i]) for i in ((0, 0), (1, 1), (0, 2), (1, 2)))
        if not (np.isfinite(k).all() and fx > 0 and fy > 0):
            raise BadInputError(f"Frame '{name}' has no focal length above 0 in {INTRINSICS}; export it again.")
        return Camera(width, height, fx, fy, cx, cy, _look_at(origin, target, up, name))

    return _read(root, reading, root, list(zip(poses, intrinsics)), camera)


def _look_at(origin: np.ndarray, target: np.ndarray, up: np.ndarray, name: str) -> np.ndarray:
    """Camera to world with OpenGL axes, (4, 4)."""
    with np.errstate(all="ignore"):
        forward = (target - origin) / np.linalg.norm(target - origin)
        up = up / np.linalg.norm(up)
        lean = float(forward @ up)
        up = up - lean * forward
        up = up / np.linalg.norm(up)
    if not abs(lean) <= MAX_LEAN:  # also where anything is NaN
        raise BadInputError(f"Frame '{name}' looks along its own up, or nowhere, in {CAMERAS}; export it again.")
    pose = np.eye(4)
    pose[:3] = np.stack([np.cross(forward, up), up, -forward, origin], 1)
    return check_pose(pose, name)


def _triples(path: Path) -> np.ndarray:
    """The 3 x 3 numbers of each camera in a table that begins with their count, (n, 3, 3) float64."""
    words = read_text(path).split()
    try:
        count = int(words[0]) if words else 0
        values = np.array(words[1:], np.float64)
    except ValueError as error:
        raise BadInputError(f"'{path}' holds something that is no number; export it again.") from error
    if count < 1 or values.size != 9 * count:
        raise BadInputError(
            f"'{path}' announces {count} cameras but holds {values.size} numbers instead of "
            f"{9 * max(count, 1)}; export it again."
        )
    return values.reshape(count, 3, 3)


SYNTHETIC = Reader("fipt", FORMATS["fipt"], holding(f"{SPLIT}/{POSES}", MESH), read_synthetic)
REAL = Reader("fipt-real", FORMATS["fipt-real"], holding(CAMERAS, INTRINSICS), read_real)
