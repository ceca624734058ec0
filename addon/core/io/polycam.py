"""Polycam's "raw data" (LiDAR and room mode): `keyframes/` with a JSON of each camera, and the mesh `raw.glb`.

`corrected_cameras` and `corrected_images`, from optimizing all poses, come before `cameras` and `images`, ARKit's own.
Depth and its confidence are not looked at.
Source: Polycam's polyform, README.md (format); nerfstudio's process_data/polycam_utils.py and its defaults.
"""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import BadInputError
from ..json_values import is_number
from ..scene.model import Frame
from ..scene.pose import check_pose
from .arkit import read_y_up
from .camera_check import pinhole
from .files import read_json
from .formats import FORMATS
from .gltf_nodes import TO_Z_UP
from .layout import Layout, Reader, Reading, usable
from .meshes import find_mesh
from .pictures import ENDINGS

FOLDER, MESH, MESH_INFO = "keyframes", "raw.glb", "mesh_info.json"
CORRECTED, OWN = ("corrected_cameras", "corrected_images"), ("cameras", "images")
CAMERA = ("width", "height", "fx", "fy", "cx", "cy")
BLURRED = 25.0
"""A `blur_score` (the lower the more blurred) below which nearly nothing is sharp: nerfstudio's default."""
BORDER = 15 / 1024
"""Share of a corrected picture's width at each edge where undistortion may have left it black: nerfstudio's default, 15
pixels of the app's 1024."""
EXPORT = (
    "export it from Polycam as GLTF and put it beside 'keyframes' as 'raw.glb', or name one in the same coordinates "
    "with --mesh."
)


def find(root: Path) -> bool:
    """Whether a folder is such an export."""
    return any((root / FOLDER / cameras).is_dir() for cameras, _ in (CORRECTED, OWN))


def read(root: Path, reading: Reading) -> Layout:
    """Read the cameras and the mesh, as `layout.Reader` has it."""
    path = find_mesh(root, reading, (MESH,), EXPORT)
    corrected = all((root / FOLDER / name).is_dir() for name in CORRECTED)
    cameras, pictures = (root / FOLDER / name for name in (CORRECTED if corrected else OWN))
    listed = sorted(cameras.glob("*.json"))
    if not listed:
        raise BadInputError(f"'{cameras}' holds no cameras; export the raw data from Polycam again.")
    blurred: list[str] = []

    def frame(file: Path) -> Frame:
        entry = read_json(file)
        camera = pinhole(entry, CAMERA, file)
        pose = check_pose([[entry.get(f"t_{i}{k}") for k in range(4)] for i in range(3)], file.stem)
        if is_number(score := entry.get("blur_score")) and score < BLURRED:
            blurred.append(file.stem)
        picture = next((p for p in (pictures / (file.stem + end) for end in ENDINGS) if p.is_file()), None)
        return Frame(
            file.stem,
            picture or pictures / f"{file.stem}.jpg",
            replace(camera, camera_to_world=TO_Z_UP @ pose),
            margin=round(BORDER * camera.width) if corrected else 0,
        )

    frames, problems = usable(frame, listed)
    notes = []
    if not corrected:
        notes.append(
            f"'{root / FOLDER}' has no corrected pictures and cameras, as of a scan of too many frames; ARKit's own "
            "poses were taken, which drift."
        )
    if blurred and len(blurred) < len(frames) / 2:
        names = set(blurred)
        frames = [item for item in frames if item.name not in names]
        notes.append(
            f"{len(names)} of {len(listed)} frames are blurred by Polycam's measure (blur_score below {BLURRED:g}; the "
            f"first: '{blurred[0]}') and were passed over."
        )
    mesh = read_y_up(path, reading, _alignment(root))
    return Layout(frames, mesh, problems=problems, notes=notes)


def _alignment(root: Path) -> np.ndarray | None:
    """From the mesh's coordinates to those of the cameras, (4, 4); None where they are the same."""
    if not (root / MESH_INFO).is_file():
        return None
    matrix: Any = read_json(root / MESH_INFO).get("alignmentTransform")
    if matrix is None:
        return None
    if isinstance(matrix, list) and all(isinstance(row, list) for row in matrix):
        matrix = [value for row in matrix for value in row]
    if isinstance(matrix, list) and len(matrix) == 16 and all(map(is_number, matrix)):
        try:  # column by column; from the cameras' world to the mesh's
            return np.linalg.inv(check_pose(np.reshape(matrix, (4, 4)).T, MESH_INFO))
        except BadInputError:
            pass
    raise BadInputError(
        f"'{root / MESH_INFO}' has an alignmentTransform that does not turn and move; export the raw data again."
    )


READER = Reader("polycam", FORMATS["polycam"], find, read)
