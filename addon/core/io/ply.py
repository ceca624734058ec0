"""PLY meshes: text or binary, any order of properties, polygons split into triangles.

A body is bytes: those of the file where it is binary, those of all its numbers as float64 where it is text. So both
kinds are read alike. Nothing is allocated before the counts that the header claims were compared with the file's size.
"""

from __future__ import annotations

import struct
import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ..errors import BadInputError
from ..kinds import Limit
from .files import absence, read_bytes
from .layout import Faces, RawMesh

UV_NAMES = (("s", "t"), ("u", "v"), ("texture_u", "texture_v"), ("texture_s", "texture_t"))
INDEX_NAMES = ("vertex_indices", "vertex_index")
MAX_HEADER: Limit[int] = 1 << 20
KINDS = {
    "char": "i1", "int8": "i1", "uchar": "u1", "uint8": "u1", "short": "i2", "int16": "i2", "ushort": "u2",
    "uint16": "u2", "int": "i4", "int32": "i4", "uint": "u4", "uint32": "u4", "float": "f4", "float32": "f4",
    "double": "f8", "float64": "f8",
}  # fmt: skip
FORMATS = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}


class Property(NamedTuple):
    """One property; `count_kind` is the type of a list's length, empty where it is no list."""

    name: str
    kind: str
    count_kind: str = ""


@dataclass(frozen=True)
class Element:
    """One element: `count` records, each with all `properties` in their order."""

    name: str
    count: int
    properties: list[Property]


def read_ply(path: Path) -> RawMesh:
    """Read the mesh `path`.

    Polygons become triangles: quads along their shorter diagonal, longer ones as a fan; faces of fewer than 3 corners
    vanish. Vertex `s t`, `u v` or `texture_u texture_v` become corner texture coordinates.

    Raises
    ------
    BadInputError
        The file is absent, damaged, cut off, holds no mesh, or points to vertices that it doesn't hold.
    """
    with _one_sentence(path):
        if what := absence(path):
            raise BadInputError(f"Mesh '{path}' {what}; a capture needs its mesh there.")
        return _mesh(_records(read_bytes(path, "Mesh ")), path.name)


def read_columns(path: Path, groups: Sequence[tuple[str, ...]]) -> dict[str, np.ndarray | None]:
    """The first of several `groups` of scalar properties that vertices and faces have. Raises as `read_ply`.

    Returns
    -------
    dict of str to (n, k) or None
        Of 'vertex' and 'face': a group's properties side by side, None where they have none; without what is absent.
    """
    with _one_sentence(path):
        found = {}
        for name, records in _records(read_bytes(path)).items():
            columns = (records.columns(group) for group in groups)
            found[name] = next((column for column in columns if column is not None), None)
        return found


@contextmanager
def _one_sentence(path: Path) -> Iterator[None]:
    try:
        yield
    except ValueError as error:  # its text is the second half of a sentence
        raise BadInputError(f"Mesh '{path}' {error}; export it again.") from error
    except MemoryError as error:
        raise BadInputError(f"Mesh '{path}' does not fit in memory; simplify it.") from error


def _records(content: bytes) -> dict[str, _Records]:
    """The file's elements by their names, as far as the later of vertices and faces."""
    order, elements, at = parse_header(content)
    if order:
        data = np.frombuffer(content, np.uint8)
    else:
        data, at = _numbers(content[at:]).view(np.uint8), 0
    records_of: dict[str, _Records] = {}
    for element in elements:
        records_of[element.name] = records = _Records(data, order, element, at)
        at = records.end
        if {"vertex", "face"} <= records_of.keys():
            break
    return records_of


@np.errstate(over="ignore", invalid="ignore")  # what is not finite is the repair's, which tells of it
def _mesh(records_of: dict[str, _Records], name: str) -> RawMesh:
    if "vertex" not in records_of:
        raise ValueError("holds no vertices")
    vertices, *pairs = (records_of["vertex"].columns(names) for names in (("x", "y", "z"), *UV_NAMES))
    if vertices is None:
        raise ValueError("has vertices without x, y and z")
    vertices = vertices.astype(np.float64, copy=False)
    if "face" not in records_of:
        none = np.zeros((0, 3), np.int32)
        return RawMesh(vertices, none, name=name, faces=Faces(0, np.zeros(0, np.int64), True, none))

    faces = records_of["face"]
    index = next((n for n in INDEX_NAMES if n in faces.counts), None)
    if index is None:
        raise ValueError("has faces without vertex_indices")
    triangles, source, corner = _triangles(faces.counts[index], faces.entries(index), vertices)
    ids = faces.columns(("object_id",))
    if ids is not None:
        # What is no whole number, or larger than any, is no object's; NaN is less than nothing.
        whole = np.where(np.abs(ids) < float(1 << 62), ids, -1) if ids.dtype.kind == "f" else ids
        ids = whole[source, 0].astype(np.int64)
    far = faces.columns(("far",))
    far = None if far is None else far[:, 0][source] > 0
    pair = next((pair for pair in pairs if pair is not None), None)
    uv = None if pair is None else pair.astype(np.float32)[triangles]
    counted = Faces(len(faces.counts[index]), source, True, corner)
    return RawMesh(vertices, triangles, ids, uv, name=name, faces=counted, far=far)


def parse_header(content: bytes) -> tuple[str, list[Element], int]:
    """Parse the head of `content`; the text of a `ValueError` is the second half of a sentence about the file.

    Returns
    -------
    order : str
        '<', '>' or '' for text.
    elements : list of Element
    start : int
        Position of the first byte behind the header.
    """
    if content[:3] != b"ply":
        raise ValueError("is empty" if not content else "is not a PLY file")
    end = content.find(b"end_header", 0, MAX_HEADER)
    start = content.find(b"\n", end) + 1
    if end < 0 or not start:
        raise ValueError("ends within its header, or has none")
    order = None
    elements: list[Element] = []
    for line in content[3:end].decode("latin-1").splitlines():
        words = line.split()
        if not words or words[0] in ("comment", "obj_info"):
            continue
        try:
            if words[0] == "format":
                order = FORMATS[words[1]]
            elif words[0] == "element":
                elements.append(Element(words[1], int(words[2]), []))
                if elements[-1].count < 0:
                    raise ValueError
            elif words[0] == "property" and words[1] == "list":
                if KINDS[words[2]][0] == "f":
                    raise ValueError
                elements[-1].properties.append(Property(words[4], KINDS[words[3]], KINDS[words[2]]))
            elif words[0] == "property":
                elements[-1].properties.append(Property(words[2], KINDS[words[1]]))
            else:
                raise ValueError
        except (IndexError, KeyError, ValueError):
            raise ValueError(f"has a header line that means nothing: '{line.strip()[:60]}'") from None
    if order is None:
        raise ValueError("does not say whether it is text or binary")
    return order, elements, start


def _numbers(text: bytes) -> np.ndarray:
    """All numbers of `text`, up to the first thing that is none, as (n,) float64."""
    with warnings.catch_warnings():
        # What stops the parser early is told by the count of numbers, with the file's name.
        warnings.simplefilter("ignore", DeprecationWarning)
        try:
            return np.fromstring(text.decode("latin-1"), np.float64, sep=" ")
        except ValueError as error:  # newer NumPy raises where the older stops
            raise ValueError("holds something that is no number") from error


class _Records:
    """The records of an element that begin at `at`: how long their lists are, and where each of their values lies.

    Attributes
    ----------
    counts : dict of str to (n,) int64
        Entries of each list property.
    places : dict of str to (n,) int64
        Where each property's value, or its first entry, begins; (1,), of the first, where all records have one size.
    end : int
        Where the records end.
    """

    def __init__(self, data: np.ndarray, order: str, element: Element, at: int):
        self._data, self._order, self._element = data, order, element
        n, sizes = element.count, [self._kind(p.count_kind or p.kind).itemsize for p in element.properties]
        if n * max(sum(sizes), 1) > data.size - at:
            what = f"claims {n} of '{element.name}' but ends before them"
            raise ValueError(f"{what}: it is cut off, or its header is wrong")
        lists = [p for p in element.properties if p.count_kind]
        scalars = {p.name for p in element.properties if not p.count_kind}
        if len(scalars.union(p.name for p in lists)) < len(scalars) + len(lists):
            raise ValueError(f"gives a list of '{element.name}' a name that it gives twice")
        lengths = self._lengths(lists, at)
        self.counts = {p.name: np.broadcast_to(column, n) for p, column in zip(lists, lengths.T)}
        entries = {p.name: column * self._kind(p.kind).itemsize for p, column in zip(lists, lengths.T)}
        size = sum(sizes) + sum(entries.values(), np.zeros(len(lengths), np.int64))
        self._step = int(size[0]) if len(size) == 1 else 0
        place = at + np.cumsum(size) - size
        self.end = at + int(np.broadcast_to(size, n).sum())
        if self.end > data.size:
            raise ValueError(f"ends within its '{element.name}' records, or they are damaged")
        self.places: dict[str, np.ndarray] = {}
        for p, bytes_of_it in zip(element.properties, sizes):
            self.places[p.name] = place + bytes_of_it if p.count_kind else place
            place = place + bytes_of_it + entries.get(p.name, 0)

    def columns(self, names: tuple[str, ...]) -> np.ndarray | None:
        """Several scalar properties side by side, (n, k), float64 where text; None where one is absent."""
        kinds = {p.name: p.kind for p in self._element.properties if not p.count_kind}
        if not set(names) <= kinds.keys():
            return None
        return np.stack([self._take(self.places[name], kinds[name]) for name in names], -1)

    def entries(self, name: str) -> np.ndarray:
        """The entries of all lists `name`, one list after the other."""
        kind = next(p.kind for p in self._element.properties if p.name == name)
        counts = self.counts[name]
        if self._step:
            return self._take(self.places[name], kind, int(counts[0]))
        inside = np.arange(counts.sum()) - np.repeat(np.cumsum(counts) - counts, counts)
        return self._take(np.repeat(self.places[name], counts) + inside * self._kind(kind).itemsize, kind)

    def _kind(self, kind: str) -> np.dtype:
        return np.dtype(self._order + kind if self._order else np.float64)

    def _take(self, at: np.ndarray, kind: str, length: int = 1) -> np.ndarray:
        """The value at each of the positions `at` ((k,) int); of records of one size the `length` values of each."""
        dtype = self._kind(kind)
        if self._step:
            shape, strides = (self._element.count, length), (self._step, dtype.itemsize)
            return np.ndarray(shape, dtype, self._data, int(at[0]), strides).reshape(-1)
        return self._data[at[:, None] + np.arange(dtype.itemsize)].view(dtype)[:, 0]

    def _lengths(self, lists: list[Property], at: int) -> np.ndarray:
        """Entries of each list of each record, (n, lists) int64, or (1, lists) where all are as long as the first's."""
        n = self._element.count
        if not n or not lists:
            return np.zeros((min(n, 1), len(lists)), np.int64)
        first, size = self._walked(1, at)
        if size * n <= self._data.size - at:  # lists as long as the first record's, which holds for nearly every mesh
            place, same = at, True
            for p in self._element.properties:
                kind = self._kind(p.count_kind or p.kind)
                if p.count_kind:
                    count = first[0, lists.index(p)]
                    same &= bool((np.ndarray((n,), kind, self._data, place, (size,)) == count).all())
                    place += count * self._kind(p.kind).itemsize
                place += kind.itemsize
            if same:
                return first
        return self._walked(n, at)[0]

    def _walked(self, records: int, at: int) -> tuple[np.ndarray, int]:
        """The same of the first records, one after the other, and the bytes that they take."""
        begin, size, counts = at, self._data.size, []
        steps = []  # what lies before a list's length, how that is read, and how large an entry is
        gap = 0
        for p in self._element.properties:
            kind = self._kind(p.count_kind or p.kind)
            if p.count_kind:
                read = struct.Struct((self._order or "=") + kind.char)
                steps.append((gap, read.unpack_from, read.size, self._kind(p.kind).itemsize))
                gap = 0
            else:
                gap += kind.itemsize
        name = self._element.name
        try:
            for _ in range(records):
                for before, read_length, length_size, each in steps:
                    at += before
                    (count,) = read_length(self._data.data, at)
                    if not 0 <= count <= size or count != int(count):
                        raise ValueError(f"holds a list of {count} entries in '{name}': it is damaged")
                    counts.append(int(count))
                    at += length_size + int(count) * each
                at += gap
        except struct.error:
            raise ValueError(f"ends within its '{name}' records: it is cut off") from None
        return np.array(counts, np.int64).reshape(records, len(steps)), at - begin


def _triangles(
    counts: np.ndarray, entries: np.ndarray, vertices: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Split polygons of so many corners (`counts`, (f,)), whose `entries` follow each other.

    Returns
    -------
    triangles : (t, 3) int32
    face : (t,) int64
        The polygon that each came from.
    corner : (t, 3) int32
        Which of its corners they are.
    """
    end, pieces = np.cumsum(counts), np.maximum(counts - 2, 0)
    bad = np.flatnonzero(~((entries >= 0) & (entries < len(vertices)) & (entries % 1 == 0)))
    face = np.searchsorted(end, bad, "right")
    bad, face = bad[pieces[face] > 0], face[pieces[face] > 0]
    if len(bad):
        raise ValueError(f"has a face ({face[0]}) that points to vertex {entries[bad[0]]} of {len(vertices)}")
    face = np.repeat(np.arange(len(counts)), pieces)
    later = (1 + np.arange(len(face)) - np.repeat(np.cumsum(pieces) - pieces, pieces)).astype(np.int32)
    corner = np.stack([0 * later, later, later + 1], -1)

    quads = np.flatnonzero(counts == 4)
    a, b, c, d = (vertices[entries[end[quads] - 4 + i].astype(np.int64)] for i in range(4))
    with np.errstate(invalid="ignore", over="ignore"):
        shorter = ((b - d) ** 2).sum(1) < ((a - c) ** 2).sum(1)
    turned = np.isin(face, quads[shorter])
    corner[turned & (later == 1)] = 0, 1, 3
    corner[turned & (later == 2)] = 1, 2, 3
    begin, triangles = (end - counts)[face], np.empty(corner.shape, np.int32)
    for i in range(3):
        triangles[:, i] = entries[begin + corner[:, i]]
    return triangles, face, corner


def ply_bytes(
    vertices: np.ndarray, faces: Sequence[tuple[np.ndarray, np.ndarray | int | None]], far: np.ndarray | None = None
) -> bytes:
    """The content of a little-endian PLY file with an object on each face, as `read_ply` reads it.

    Parameters
    ----------
    vertices : (v, 3) float32 or float64
        Stored in that precision.
    faces : sequence of (index, object_id)
        Index is (f, k) int, polygons of k corners each; the object is one of each, (f,) int, or of all; None leaves
        objects out, of all faces.
    far : (f,) bool, optional
        As in `Mesh`, of all faces.
    """
    kind = {4: "float", 8: "double"}[vertices.itemsize]
    has_objects = all(object_id is not None for _, object_id in faces)
    extra = [("object_id", "<i4")] * has_objects + [("far", "u1")] * (far is not None)
    records, start = [], 0
    for index, object_id in faces:
        record = np.empty(len(index), [("n", "u1"), ("v", "<i4", index.shape[1]), *extra])
        record["n"], record["v"] = index.shape[1], index
        if has_objects:
            record["object_id"] = object_id
        if far is not None:
            record["far"] = far[start : start + len(index)]
        start += len(index)
        records.append(record)
    header = (
        f"ply\nformat binary_little_endian 1.0\nelement vertex {len(vertices)}\n"
        f"property {kind} x\nproperty {kind} y\nproperty {kind} z\n"
        f"element face {start}\nproperty list uchar int vertex_indices\n"
        + "".join(f"property {'int' if size == '<i4' else 'uchar'} {name}\n" for name, size in extra)
        + "end_header\n"
    )
    places = vertices.astype(f"<f{vertices.itemsize}")
    return b"".join([header.encode(), places.tobytes(), *(record.tobytes() for record in records)])
