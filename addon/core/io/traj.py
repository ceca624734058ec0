"""The layout of the Replica sequences for SLAM: `traj.txt` with a pose a line, pictures in `results`.

Each line is the 4 x 4 matrix from camera to world, row by row, of a camera with x right, y down and z forward.
`cam_params.json` and the mesh `<name>_mesh.ply` lie in the folder or, as they are given out, beside it. Depth pictures
are not looked at. (Sucar et al., iMAP, ICCV 2021; Zhu et al., NICE-SLAM, CVPR 2022.)
"""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np

from ..errors import BadInputError
from ..scene.model import Camera, Frame
from ..scene.pose import check_pose
from .camera_check import pinhole
from .files import read_json, read_text
from .formats import FORMATS
from .layout import Layout, RawMesh, Reader, Reading, holding, usable
from .meshes import find_mesh, mesh_files, read_mesh
from .pictures import ENDINGS

POSES, PARAMETERS, FOLDER = "traj.txt", "cam_params.json", "results"
TO_OPENGL = np.diag([1.0, -1.0, -1.0, 1.0])
"""From x right, y down, z forward to x right, y up, z backward."""
PICTURE = re.compile(r"^frame(\d+)$", re.IGNORECASE)


def read(root: Path, reading: Reading) -> Layout:
    """Read the poses, the camera and the mesh, as `layout.Reader` has it."""
    camera = _camera(root)
    lines = _lines(root / POSES)
    pictures = _pictures(root / FOLDER)
    if not pictures:
        raise BadInputError(
            f"Folder '{root / FOLDER}' has no pictures called frame000000.exr and so on; put the frames there."
        )

    def frame(index: int, path: Path) -> Frame:
        name = path.stem
        if index >= len(lines):
            raise BadInputError(f"Frame '{name}' has no line in '{root / POSES}', which has {len(lines)}.")
        pose = check_pose(_matrix(lines[index], name), name)
        return Frame(name, path, replace(camera, camera_to_world=pose @ TO_OPENGL))

    frames, problems = usable(lambda item: frame(*item), sorted(pictures.items()))
    idle = len(lines) - len(set(pictures) & set(range(len(lines))))
    notes = [f"{idle} of {len(lines)} lines of {POSES} have no picture."] if idle else []
    return Layout(frames, _mesh(root, reading), problems=problems, notes=notes)


def _camera(root: Path) -> Camera:
    """The one camera of all frames, without a pose."""
    path = next((p for p in (root / PARAMETERS, root.absolute().parent / PARAMETERS) if p.is_file()), None)
    if path is None:
        raise BadInputError(
            f"'{root / PARAMETERS}' does not exist; give the camera there: "
            '{"camera": {"w": 1200, "h": 680, "fx": 600, "fy": 600, "cx": 599.5, "cy": 339.5}}.'
        )
    top = read_json(path)
    values = top.get("camera", top)
    return pinhole(values, ("w", "h", "fx", "fy", "cx", "cy"), path)


def _lines(path: Path) -> list[str]:
    lines = [line for line in read_text(path).splitlines() if line.strip()]
    if not lines:
        raise BadInputError(f"'{path}' holds no poses; export it again.")
    return lines


def _matrix(line: str, name: str) -> np.ndarray:
    try:
        values = np.array(line.split(), np.float64)
    except ValueError:
        values = np.zeros(0)
    if values.size not in (12, 16):
        raise BadInputError(f"Frame '{name}' has no line of 16 numbers in {POSES}; export the poses again.")
    return values.reshape(-1, 4)


def _pictures(folder: Path) -> dict[int, Path]:
    """The picture of each line; of several kinds the one that holds most: they are listed in that order."""
    pictures: dict[int, Path] = {}
    order = {ending: place for place, ending in enumerate(ENDINGS)}
    for path in folder.iterdir() if folder.is_dir() else ():
        match = PICTURE.match(path.stem)
        if match and path.suffix.lower() in order and path.is_file() and len(match[1]) < 10:
            present = pictures.get(int(match[1]))
            if present is None or order[path.suffix.lower()] < order[present.suffix.lower()]:
                pictures[int(match[1])] = path
    return pictures


def _mesh(root: Path, reading: Reading) -> RawMesh:
    """The mesh that is named, or in the folder, or beside it under the folder's name."""
    beside = root.absolute().parent / f"{root.absolute().name}_mesh.ply"
    if reading.mesh is None and not mesh_files(root) and beside.is_file():
        return read_mesh(beside, reading)
    return read_mesh(find_mesh(root, reading), reading)


READER = Reader("traj", FORMATS["traj"], holding(POSES, FOLDER), read)
