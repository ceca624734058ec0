"""A mesh from a file of any kind: PLY here, others through whatever the caller brings (Blender's importers)."""

from collections.abc import Sequence
from pathlib import Path

from ..errors import BadInputError
from .layout import RawMesh, Reading
from .ply import read_ply

IMPORTED = (".obj", ".gltf", ".glb")
"""Endings that `Reading.import_mesh` is asked for."""
MESH = "mesh.ply"


def read_mesh(path: Path, reading: Reading) -> RawMesh:
    """Read the mesh `path`; raises `BadInputError` where it is absent, damaged, or of a kind that can't be read."""
    ending = path.suffix.lower()
    if ending in IMPORTED:
        if reading.import_mesh is None:
            raise BadInputError(
                f"Mesh '{path}' needs Blender to be read; run the command where bpy is installed, or convert it to PLY."
            )
        return reading.import_mesh(path)
    if ending != ".ply":
        raise BadInputError(f"Mesh '{path}' is of no kind that is known; give a PLY, OBJ, glTF or GLB file.")
    return read_ply(path)


def mesh_files(root: Path) -> list[Path]:
    """The files of meshes in a folder, by their names."""
    return sorted(path for path in root.iterdir() if path.suffix.lower() in (".ply", *IMPORTED) and path.is_file())


def find_mesh(root: Path, reading: Reading, names: Sequence[str] = (MESH,), remedy: str = "") -> Path:
    """The mesh that the user named, else the first file of `names`, else the only mesh file of the folder.

    Parameters
    ----------
    remedy : str
        What to do where there is none, as the end of a sentence.

    Raises
    ------
    BadInputError
        There is none, or several.
    """
    if reading.mesh is not None:
        return reading.mesh
    for path in (root / name for name in names):
        if path.exists():
            return path
    paths = mesh_files(root)
    if len(paths) == 1:
        return paths[0]
    if paths:
        raise BadInputError(
            f"Capture '{root}' has several meshes ({', '.join(p.name for p in paths[:3])}, ...); name one with --mesh."
        )
    if remedy:
        raise BadInputError(f"Capture '{root}' has no mesh; {remedy}")
    raise BadInputError(
        f"Mesh '{root / names[0]}' does not exist; a capture needs its mesh there, or named with --mesh."
    )
