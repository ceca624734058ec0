"""What apps on an iPhone have in common: ARKit's world, +Y up in metres, and its cameras, which have OpenGL's axes.

Source: Apple, ARConfiguration.WorldAlignment.gravity and ARCamera.transform.
"""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import BadInputError
from ..json_values import is_number
from ..scene.pose import check_pose, rotation_of
from .gltf_nodes import TO_Z_UP
from .layout import RawMesh, Reading
from .meshes import read_mesh

TURNED = (".gltf", ".glb")
"""Meshes that come turned to +Z up from their reader."""
MAX_FRAMES = 300
"""Frames that are taken of a recording, evenly: 60 a second show nearly the same. nerfstudio's default."""
FUSE = (
    "stores depth alone: fuse it to a mesh in the recording's coordinates, put it there as 'mesh.ply', or name it with "
    "--mesh."
)


def read_pose(values: Sequence[Any], name: str) -> np.ndarray:
    """Camera to world, +Z up, of a quaternion x, y, z, w and a position.

    Parameters
    ----------
    values : seven values
        Of `name`, a frame.

    Returns
    -------
    (4, 4) float64
        Cameras have the axes that the quaternion gives them.

    Raises
    ------
    BadInputError
        They are no seven finite numbers, or the quaternion is 0.
    """
    if len(values) != 7 or not all(map(is_number, values)) or not any(values[:4]):
        raise BadInputError(f"Frame '{name}' has a pose that is no quaternion and place; export the recording again.")
    pose = np.eye(4)
    pose[:3, :3] = rotation_of(np.array([values[3], *values[:3]], np.float64))
    pose[:3, 3] = values[4:]
    return TO_Z_UP @ check_pose(pose, name)


def read_y_up(path: Path, reading: Reading, to_world: np.ndarray | None = None) -> RawMesh:
    """Read a mesh in ARKit's axes, turned to +Z up. Raises as `meshes.read_mesh`.

    Parameters
    ----------
    to_world : (4, 4) float64, optional
        From the mesh's coordinates to those of the poses, before either is turned.
    """
    mesh = read_mesh(path, reading)
    move = np.eye(4) if to_world is None else to_world
    move = TO_Z_UP @ move @ (TO_Z_UP.T if path.suffix.lower() in TURNED else np.eye(4))
    return replace(mesh, vertices=mesh.vertices @ move[:3, :3].T + move[:3, 3])
