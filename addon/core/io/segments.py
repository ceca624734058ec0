"""Segments that the user gives: ids in a file, the materials of the mesh's file, or the mesh's shape alone.

A file of ids is text, `.npy` or PLY, with a number (or colour) for each face of the mesh's file, in its order; those of
fewer than three corners count, too. All triangles of a polygon are of its segment. Or with one for each vertex: a
triangle is of the segment that two of its corners have, else of its first's.
"""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np

from ..errors import BadInputError
from ..json_values import float_of
from ..kinds import Limit
from ..scene.model import KnownMirror
from .files import absence, read_bytes, read_text
from .formats import MATERIALS, SHAPE
from .instances import FILE, MAX_ID, read_instances
from .layout import Faces, Layout, RawMesh
from .ply import read_columns, read_ply

COLOUR = ("red", "green", "blue")
GROUPS = (("object_id",), ("segment",), ("label",), COLOUR)
"""What a PLY file's faces, else its vertices, tell segments by, the better first."""
MAX_COLOURS: Limit[int] = 1024
"""Distinct colours of a mesh that is painted by segments; a photographed one has more."""


def check_segments(segments: Path | str) -> None:
    """Raise `BadInputError` where `segments` are neither a word nor a file of a known kind; cheap."""
    if segments in ("", MATERIALS, SHAPE):
        return
    path = Path(segments)
    reason = absence(path)
    if not reason and path.suffix.lower() not in READS:
        reason = "is of no kind that is known"
    if reason:
        raise BadInputError(
            f"File of segments '{path}' {reason}; give --segments a .txt, .csv, .npy or .ply file, or the word "
            f"{MATERIALS} or {SHAPE}."
        )


def laid_on(layout: Layout, segments: Path | str, root: Path) -> Layout:
    """The layout with `segments` as its mesh's objects, in place of all else that tells of any.

    Ids of a file are called 'segment_<id>', or as the capture's `info_semantic.json` names them. Raises `BadInputError`
    where the segments can't be read or don't fit the mesh, or it has no materials.
    """
    mesh = layout.mesh
    if not segments:
        return layout
    if segments == SHAPE:
        frames = [replace(frame, id_path=None) for frame in layout.frames]
        return replace(layout, frames=frames, mesh=replace(mesh, object_id=None), mirrors=[])
    if segments == MATERIALS:
        object_id, names = _by_material(mesh)
        names_file = mesh.name
    else:
        path = Path(segments)
        object_id = _by_file(path, mesh)
        names, names_file = {int(i): f"segment_{i}" for i in np.unique(object_id)}, path.name
        if (root / FILE).exists():
            names, names_file = names | read_instances(root / FILE), FILE
    what = "materials" if segments == MATERIALS else f"'{segments}'"
    return replace(
        layout,
        mesh=replace(mesh, object_id=object_id),
        names=names,
        names_file=names_file,
        mirrors=_renumbered(layout.mirrors, mesh.object_id, object_id),
        notes=[*layout.notes, f"The mesh has {len(np.unique(object_id))} segments by {what}."],
    )


def _by_material(mesh: RawMesh) -> tuple[np.ndarray, dict[int, str]]:
    """A segment for each pair of object and material, by their numbers."""
    material = mesh.material
    if material is None or not (material >= 0).any():
        raise BadInputError(
            f"Mesh '{mesh.name}' has no materials that could be its segments; name an OBJ or glTF file that has some "
            "with --mesh, or give --segments a file of ids."
        )
    object_id = np.zeros(len(material), np.int64) if mesh.object_id is None else mesh.object_id
    base = int(material.max()) + 2
    pairs, segment = np.unique(object_id * base + material + 1, return_inverse=True)
    known = mesh.names if mesh.names and len(np.unique(object_id)) > 1 else {}
    names, of_number = {}, {0: "no material", **dict(enumerate(mesh.material_names, 1))}
    for i, (obj, number) in enumerate(divmod(int(pair), base) for pair in pairs):
        own = of_number.get(number) or f"material_{number - 1}"
        names[i] = f"{known[obj]}: {own}" if obj in known else own
    return segment, names


def _by_file(path: Path, mesh: RawMesh) -> np.ndarray:
    """The segment of each triangle, (t,) int64."""
    count = len(mesh.triangles)
    faces = mesh.faces or Faces(count, np.arange(count), own_vertices=True)
    if faces.total < 0:
        raise BadInputError(
            f"The order of the faces of '{mesh.name}' can't be told, as Blender changes some of them when it reads the "
            f"file; name the mesh as PLY with --mesh, or give --segments {MATERIALS}."
        )
    element, ids = READS[path.suffix.lower()](path)
    if element != "vertex" and len(ids) == faces.total:
        return ids[faces.of_triangle]
    if element != "face" and faces.own_vertices and len(ids) == len(mesh.vertices):
        return _of_corners(ids, mesh.triangles)
    if element == "vertex":  # of the same mesh with its vertices listed otherwise: a face has what its own corners have
        own = read_ply(path)
        if own.faces is not None and own.faces.total == faces.total:
            of_face = np.zeros(faces.total, np.int64)
            of_face[own.faces.of_triangle[::-1]] = _of_corners(ids, own.triangles)[::-1]  # the first triangle's stays
            return of_face[faces.of_triangle]
    of = {"face": " of faces", "vertex": " of vertices"}.get(element, "")
    vertices = f" and {len(mesh.vertices)} vertices" if faces.own_vertices else ""
    raise BadInputError(
        f"File of segments '{path}' has {len(ids)} ids{of}, but mesh '{mesh.name}' has {faces.total} faces{vertices}; "
        "give one for each face, in the order of the mesh's file."
    )


def _of_corners(ids: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    first, second, third = ids[triangles].T
    return np.where(second == third, second, first)


def _from_text(path: Path) -> tuple[str, np.ndarray]:
    lines = (line.partition("#")[0].strip() for line in read_text(path).splitlines())
    words = [line for line in lines if line]
    try:
        values = np.array(words, np.float64)
    except ValueError:
        values = np.array([float_of(word) for word in words])
    return "", _checked(values, path, words)


def _from_npy(path: Path) -> tuple[str, np.ndarray]:
    values = None
    if read_bytes(path, max_bytes=6) == np.lib.format.MAGIC_PREFIX:
        try:
            values = np.load(path, mmap_mode="r", allow_pickle=False)  # mapped: what its header claims is not allocated
        except Exception as error:  # whatever a damaged header does
            raise BadInputError(f"File of segments '{path}' is damaged or cut off; save it again.") from error
    if values is None or values.dtype.kind not in "iuf" or values.size != max(values.shape, default=0):
        raise BadInputError(f"File of segments '{path}' holds no row of integers; save such with numpy.save.")
    values = np.array(values).reshape(-1)
    return "", _checked(values, path, values)


def _from_ply(path: Path) -> tuple[str, np.ndarray]:
    columns = read_columns(path, GROUPS)
    for element in ("face", "vertex"):
        values = columns.get(element)
        if values is not None:
            colour = values.shape[1] == len(COLOUR)
            return element, _colours(values, path) if colour else _checked(values[:, 0], path, values[:, 0])
    raise BadInputError(
        f"File of segments '{path}' has neither object_id, segment or label nor colours on its faces or vertices; "
        "paint it, or give ids as text."
    )


def _checked(values: np.ndarray, path: Path, written) -> np.ndarray:
    """The ids as int64; raises `BadInputError` where one is none, showing it as it is `written`."""
    good = (values >= 0) & (values <= MAX_ID) & (values == np.floor(values))
    if not good.all():
        at = int(good.argmin())
        raise BadInputError(
            f"File of segments '{path}' has '{str(written[at])[:40]}' as number {at + 1}; give whole numbers from 0 to "
            f"{MAX_ID}, one a line."
        )
    return values.astype(np.int64)


def _colours(values: np.ndarray, path: Path) -> np.ndarray:
    """A number for each colour, as pictures of ids have it: r + 256 g + 65536 b."""
    if values.dtype.kind == "f" and values.max(initial=0) <= 1:
        values = np.rint(255 * values)
    if not ((values >= 0) & (values <= 255)).all():
        raise BadInputError(f"File of segments '{path}' has colours that are not of 8 bits; save it with such.")
    ids = values.astype(np.int64) @ (1, 1 << 8, 1 << 16)
    if (count := len(np.unique(ids))) > MAX_COLOURS:
        raise BadInputError(
            f"File of segments '{path}' has {count} different colours, as a photograph has; give each segment one "
            f"colour, and {MAX_COLOURS} at most."
        )
    return ids


def _renumbered(mirrors: list[KnownMirror], old: np.ndarray | None, new: np.ndarray) -> list[KnownMirror]:
    """The mirrors that are a segment of their own, by its number."""
    found = []
    for mirror in mirrors:
        inside = old == mirror.object_id
        numbers = np.unique(new[inside])
        if len(numbers) == 1 and np.array_equal(new == numbers[0], inside):
            found.append(replace(mirror, object_id=int(numbers[0])))
    return found


READS: dict[str, Callable[[Path], tuple[str, np.ndarray]]] = {
    ".txt": _from_text,
    ".csv": _from_text,
    ".npy": _from_npy,
    ".ply": _from_ply,
}
"""What reads a file's ids and says whether they are of each 'face' or 'vertex'; '' where their number tells."""
