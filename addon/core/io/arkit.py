"""What apps on an iPhone have in common: ARKit's world, +Y up in metres, and its cameras, which have OpenGL's axes.

Source: Apple, ARConfiguration.WorldAlignment.gravity and ARCamera.transform.
"""

from dataclasses import replace
from pathlib import Path

import numpy as np

from .gltf_nodes import TO_Z_UP
from .layout import RawMesh, Reading
from .meshes import read_mesh

TURNED = (".gltf", ".glb")
"""Meshes that come turned to +Z up from their reader."""


def read_y_up(path: Path, reading: Reading, to_world: np.ndarray | None = None) -> RawMesh:
    """Read a mesh in ARKit's axes, turned to +Z up.

    Parameters
    ----------
    to_world : (4, 4) float64, optional
        From the mesh's coordinates to those of the poses, before either is turned.

    Raises
    ------
    BadInputError
        As `meshes.read_mesh`.
    """
    mesh = read_mesh(path, reading)
    move = np.eye(4) if to_world is None else to_world
    move = TO_Z_UP @ move @ (TO_Z_UP.T if path.suffix.lower() in TURNED else np.eye(4))
    return replace(mesh, vertices=mesh.vertices @ move[:3, :3].T + move[:3, 3])
