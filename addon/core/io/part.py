"""A part of a building as a capture: `part.json`, the part's mesh, and the whole capture's frames that it takes.

`scan-relight divide` writes it (`scene/division.py`). Its mesh holds the part's own triangles and, marked as far, those
of other parts that send light into it or stand in its frames' view.
"""

import json
import os
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from ..atomic import write_bytes
from ..errors import BadInputError, StorageError
from ..scene.division import Division
from ..scene.model import Capture, Frame, Instance, Mesh
from .conventions import parse, upright
from .files import read_json
from .instances import FILE
from .layout import Layout, Reading
from .meshes import MESH
from .ply import ply_bytes, read_ply
from .readers import readers
from .transfer import check_transfer

PART = "part.json"
KEPT = ("format", "transfer", "convention")
"""Fields of `Reading` that hold for a part as they did for the whole, unless others are given."""
BEYOND = "beyond"
"""What the class of a far object is called, so that it is no sibling of a near one."""


@dataclass(frozen=True)
class PartOf:
    """What `PART` tells.

    Attributes
    ----------
    folder : Path
        The part's.
    whole : Path
        The whole capture's folder.
    pictures : frozenset of Path
        The frames that it takes.
    reading : dict of str to str
        How the whole was read.
    """

    folder: Path
    whole: Path
    pictures: frozenset[Path]
    reading: dict[str, str]

    def reading_of_whole(self, reading: Reading) -> Reading:
        """How the whole's frames are read; raises `BadInputError` where a mesh is given besides the part's own."""
        if reading.mesh is not None:
            raise BadInputError(f"'{self.folder}' is a part of '{self.whole}' and has its mesh; leave --mesh out.")
        given: dict[str, Any] = {name: getattr(reading, name) or self.reading.get(name, "") for name in KEPT}
        return replace(reading, mesh=self.folder / MESH, **given)

    def taken(self, layout: Layout, reading: Reading) -> Layout:
        """A layout of the whole capture, `reading_of_whole`, with the part's mesh and its frames alone.

        Raises `BadInputError` where one of them is gone.
        """
        frames = [frame for frame in layout.frames if frame.path in self.pictures]
        gone = self.pictures - {frame.path for frame in frames}
        if gone:
            raise BadInputError(
                f"Capture '{self.whole}' has no frame '{min(gone)}' any more, which its part '{self.folder}' takes; "
                "divide it again."
            )
        mesh = read_ply(self.folder / MESH)  # in the world that the convention leads to, which turns all that is read
        mesh = replace(mesh, vertices=mesh.vertices @ upright(parse(reading.convention).up))
        return replace(layout, frames=frames, problems=[], mesh=mesh, names=None, names_file="")


def part_in(folder: Path) -> PartOf | None:
    """What a folder is a part of; None where it is none. Raises `BadInputError` where its `PART` is damaged."""
    path = folder / PART
    if not path.is_file():
        return None
    content = read_json(path)
    try:
        source = Path(os.path.normpath(folder / content["capture"]))
        pictures = frozenset(source / name for name in content["frames"] if "\0" not in name)
        reading = {name: str(content["reading"][name]) for name in KEPT}
        check_transfer(reading["transfer"])
        parse(reading["convention"])
        if reading["format"] and reading["format"] not in {reader.name for reader in readers()}:
            raise ValueError
        there = source.is_dir()
    except (KeyError, TypeError, ValueError, OSError, BadInputError) as error:
        raise BadInputError(f"'{path}' does not tell what it is a part of; divide the capture again.") from error
    if not there:
        raise BadInputError(f"'{folder}' is a part of the capture '{source}', which is not there; divide it again.")
    return PartOf(folder, source, pictures, reading)


def apart(mesh: Mesh, instances: tuple[Instance, ...]) -> tuple[Mesh, tuple[Instance, ...]]:
    """A mesh with its far triangles as objects of their own, and the instances with those."""
    if mesh.far is None or not mesh.far.any():
        return mesh, instances
    known = {instance.object_id: instance for instance in instances}
    far_ids, number = np.unique(mesh.object_id[mesh.far], return_inverse=True)
    first = max(known) + 1
    object_id = mesh.object_id.copy()
    object_id[mesh.far] = first + number.ravel()
    near = set(np.unique(mesh.object_id[~mesh.far]).tolist())
    beyond = [
        Instance(first + i, f"{known[old].class_name} {BEYOND}", known[old].guess) for i, old in enumerate(far_ids)
    ]
    remaining = [instance for instance in instances if instance.object_id in near]
    return replace(mesh, object_id=object_id), (*remaining, *beyond)


def write_part(folder: Path, whole: Capture, division: Division, reading: Reading) -> None:
    """Write a part of a capture into a folder, which is made; `PART` comes last. Raises `StorageError`."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise StorageError(
            f"Part '{folder}' can't be written ({error.strerror or error}); free some space or choose another folder."
        ) from error
    mesh = whole.mesh
    used, corners = np.unique(mesh.triangles[division.triangle], return_inverse=True)
    object_id = None if mesh.whole else mesh.object_id[division.triangle]
    mesh_content = ply_bytes(mesh.vertices[used], [(corners.reshape(-1, 3), object_id)], division.far)
    write_bytes(folder / MESH, mesh_content)
    if object_id is not None:
        present = set(np.unique(object_id).tolist())
        objects = [_entry(instance) for instance in whole.instances if instance.object_id in present]
        write_bytes(folder / FILE, _json({"objects": objects}))
    frames = [whole.frames[i] for i in division.frames]
    content = {
        "capture": os.path.relpath(whole.root, folder),
        "reading": {name: getattr(reading, name) for name in KEPT},
        "frames": _names(frames, whole.root),
    }
    write_bytes(folder / PART, _json(content))


def _names(frames: Sequence[Frame], root: Path) -> list[str]:
    return [os.path.relpath(shot.path, root) for frame in frames for shot in frame.shots]


def _entry(instance: Instance) -> dict[str, Any]:
    entry = {"id": instance.object_id, "class_name": instance.class_name, "part_of": instance.part_of}
    return {name: value for name, value in entry.items() if value is not None}


def _json(value: dict[str, Any]) -> bytes:
    return (json.dumps(value, indent=1, ensure_ascii=False) + "\n").encode()
