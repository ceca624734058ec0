"""What lies between a format's reader and everything else: how a user wants a capture read, and what was found.

A format is one module with a `Reader`; `readers.py` lists them. A reader looks at files and poses. It neither reads
pixels through nor checks what is checked for all formats alike (`read.py` does that).
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ..errors import BadInputError
from ..scene.model import Frame, KnownMirror
from ..scene.stored_light import LitTexture, LitTiles
from .files import EscapesError


@dataclass(frozen=True)
class Reading:
    """How a capture is to be read: what its folder does not tell, or tells wrongly.

    Attributes
    ----------
    format : str
        Name of a `Reader`; '' finds it from the folder's content.
    mesh : Path or None
        The mesh, where it is not the one that the format names.
    outside : bool
        Whether paths in the capture may lead out of its folder.
    transfer : str
        Curve of 8 and 16-bit pictures ('srgb', 'linear', or a gamma such as '2.2'); '' refuses such pictures.
    exposures : Path or None
        CSV of exposures, one line a frame.
    convention : str
        Name of a correction of all poses; '' takes them as they are.
    segments : Path or str
        What tells the mesh's objects: a file of ids (`segments.py`), 'materials' or 'shape'; '' takes what is there.
    import_mesh : callable(Path) -> RawMesh, or None
        Reads what the core has no reader for (glTF, OBJ and others through Blender); None refuses such meshes.
    """

    format: str = ""
    mesh: Path | None = None
    outside: bool = False
    transfer: str = ""
    exposures: Path | None = None
    convention: str = ""
    segments: Path | str = ""
    import_mesh: Callable[[Path], RawMesh] | None = field(default=None, compare=False)


AS_FOUND = Reading()


class Faces(NamedTuple):
    """How a mesh's file counts its faces.

    Attributes
    ----------
    total : int
        How many it has, those without triangles too; -1 where their order can't be told.
    of_triangle : (t,) int
        The face that each triangle is part of.
    own_vertices : bool
        Whether the mesh has the file's vertices in the file's order.
    corner : (t, 3) int32 or None
        Of PLY: which of its face's corners each of a triangle's is.
    """

    total: int
    of_triangle: np.ndarray
    own_vertices: bool
    corner: np.ndarray | None = None


@dataclass(frozen=True)
class RawMesh:
    """A mesh as its file holds it, unrepaired; metres, +Z up where the format fixes an axis.

    Attributes
    ----------
    vertices : (v, 3) float64
    triangles : (t, 3) int32
        Each index is within the vertices.
    object_id : (t,) int64 or None
    uv : (t, 3, 2) float32 or None
    names : dict of int to str, or None
        Class name of each `object_id`, where the mesh itself tells.
    name : str
        The file, for messages.
    lit : LitTiles or LitTexture or None
        Light stored on it.
    material : (t,) int32 or None
        Number of each triangle's material in the file, as `base_colour` counts them; -1 none. Only for readers.
    material_names : tuple of str
        In the file; '' for none.
    faces : Faces or None
        None: each triangle is a face of the file, and the vertices are its own.
    far : (t,) bool or None
        As in `Mesh`.
    """

    vertices: np.ndarray
    triangles: np.ndarray
    object_id: np.ndarray | None = None
    uv: np.ndarray | None = None
    names: dict[int, str] | None = None
    name: str = "mesh"
    lit: LitTiles | LitTexture | None = None
    material: np.ndarray | None = None
    material_names: tuple[str, ...] = ()
    faces: Faces | None = None
    far: np.ndarray | None = None


@dataclass(frozen=True)
class Layout:
    """What a reader found in a capture's folder.

    Attributes
    ----------
    frames : list of Frame
        In capture order; only what is usable as far as the poses tell.
    mesh : RawMesh
        In the frames' coordinates.
    names : dict of int to str, or None
        Class name of each object by what the mesh's faces carry; None takes those of `info_semantic.json`, if any.
    names_file : str
        Where `names` come from, for messages; '' for that file.
    problems : list of str
        One sentence for each frame that can't be used.
    notes : list of str
        Sentences on what is used, but may mean something else.
    mirrors : list of KnownMirror
        By the mesh's own object ids.
    """

    frames: list[Frame]
    mesh: RawMesh
    names: dict[int, str] | None = None
    names_file: str = ""
    problems: list[str] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    mirrors: list[KnownMirror] = field(default_factory=list)


def usable(make: Callable[[Any], Frame], entries: Iterable[Any]) -> tuple[list[Frame], list[str]]:
    """The frames that `make` makes of what is told of each, in their order, and a sentence on each that can't be made.

    Raises `EscapesError` where a path leads out of the capture: no slip of one frame.
    """
    frames, problems = [], []
    for entry in entries:
        try:
            frames.append(make(entry))
        except EscapesError:
            raise
        except BadInputError as error:
            problems.append(str(error))
    return frames, problems


def holding(*names: str) -> Callable[[Path], bool]:
    """A `Reader.find`: whether a folder has all of these files, or folders."""
    return lambda root: all((root / name).exists() for name in names)


class Reader(NamedTuple):
    """One format.

    Attributes
    ----------
    name : str
        As `--format` takes it.
    wants : str
        The files by which a user knows the format, for messages.
    find : callable(root) -> bool
        Whether the folder has this format; cheap, and never raises for what is in it.
    read : callable(root, reading) -> Layout
        Raises `BadInputError` for what is wrong with the whole capture.
    """

    name: str
    wants: str
    find: Callable[[Path], bool]
    read: Callable[[Path, Reading], Layout]
