"""PLY meshes: text or binary, any order of properties, polygons split into triangles.

A body is taken as one flat array: of bytes where binary, of numbers where text. So both kinds share one way of finding
the records, and only `_Body.take` knows the difference. Nothing is allocated before the counts that the header claims
were compared with the size of the file.
"""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ..errors import BadInputError
from ..kinds import Block
from .paths import absence
from .ply_header import Element, parse_header

UV_NAMES = (("s", "t"), ("u", "v"), ("texture_u", "texture_v"), ("texture_s", "texture_t"))
INDEX_NAMES = ("vertex_indices", "vertex_index")
WINDOW: Block[int] = 1 << 20
"""Entries of the body that are looked at together; bounds the memory, as each takes some dozens of bytes."""


class PlyMesh(NamedTuple):
    """What a PLY file holds, unrepaired.

    Attributes
    ----------
    vertices : (v, 3) float64
    triangles : (t, 3) int32
        In the order of the file's faces; each index is within the vertices.
    object_id : (t,) int64 or None
    uv : (t, 3, 2) float32 or None
    face : (t,) int64
        The file's face that each triangle is part of.
    corner : (t, 3) int32
        Which of that face's corners each of the triangle's is.
    """

    vertices: np.ndarray
    triangles: np.ndarray
    object_id: np.ndarray | None
    uv: np.ndarray | None
    face: np.ndarray
    corner: np.ndarray


class _Body(NamedTuple):
    """The flat array behind the header."""

    data: np.ndarray  # uint8 where binary, float64 where text
    order: str  # '<' or '>', '' where text

    def size(self, kind: str) -> int:
        """How many entries of `data` one value takes."""
        return np.dtype(kind).itemsize if self.order else 1

    def take(self, at: np.ndarray, kind: str, count: int = 1) -> np.ndarray:
        """`count` values behind each position `at` ((n,) int), as (n, count)."""
        size = self.size(kind) * count
        raw = self.data[at[:, None] + np.arange(size)]
        return raw.view(self.order + kind) if self.order else raw


class _Damaged(Exception):
    """The text is the second half of a sentence."""


def read_ply(path: Path | str) -> PlyMesh:
    """Read the mesh `path`.

    Polygons become triangles: quads along their shorter diagonal, longer ones as a fan; faces of fewer than 3 corners
    vanish. Vertex `s t`, `u v` or `texture_u texture_v` become corner texture coordinates.

    Raises
    ------
    BadInputError
        The file is absent, damaged, cut off, holds no mesh, or points to vertices that it doesn't hold.
    """
    path = Path(path)
    try:
        if what := absence(path):
            raise BadInputError(f"Mesh '{path}' {what}; a capture needs its mesh there.")
        return _parse(path.read_bytes())
    except (_Damaged, ValueError) as error:
        raise BadInputError(f"Mesh '{path}' {error}; export it again.") from error
    except MemoryError as error:
        raise BadInputError(f"Mesh '{path}' does not fit in memory; simplify it.") from error
    except OSError as error:
        reason = error.strerror or error
        raise BadInputError(f"Mesh '{path}' can't be read ({reason}); check the file and its rights.") from error


def _parse(content: bytes) -> PlyMesh:
    order, elements, start = parse_header(content)
    body = _Body(np.frombuffer(content, np.uint8, offset=start) if order else _numbers(content[start:]), order)
    at = 0
    found: dict[str, tuple[Element, np.ndarray, dict[str, np.ndarray]]] = {}
    for element in elements:
        starts, lists, at = _records(body, element, at)
        found[element.name] = element, starts, lists
        if {"vertex", "face"} <= found.keys():
            break
    if "vertex" not in found:
        raise _Damaged("holds no vertices")
    element, starts, lists = found["vertex"]
    place, *pairs = (_columns(body, element, starts, lists, names) for names in (("x", "y", "z"), *UV_NAMES))
    if place is None:
        raise _Damaged("has vertices without x, y and z")
    vertices = place.astype(np.float64)
    if "face" not in found:
        return PlyMesh(
            vertices, np.zeros((0, 3), np.int32), None, None, np.zeros(0, np.int64), np.zeros((0, 3), np.int32)
        )

    element, starts, lists = found["face"]
    name = next((n for n in INDEX_NAMES if n in lists), None)
    if name is None:
        raise _Damaged("has faces without vertex_indices")
    kinds = {p.name: p for p in element.properties}
    triangles, source, corner = _triangles(body, lists[name], kinds[name].count_kind, kinds[name].kind, vertices)
    ids = _scalars(body, element, starts, lists, "object_id")
    if ids is not None:
        whole = np.nan_to_num(ids, nan=-1.0, posinf=-1.0, neginf=-1.0) if ids.dtype.kind == "f" else ids
        ids = whole.astype(np.int64)[source]
    pair = next((pair for pair in pairs if pair is not None), None)
    uv = None if pair is None else pair.astype(np.float32)[triangles]
    return PlyMesh(vertices, triangles, ids, uv, source, corner)


def _numbers(text: bytes) -> np.ndarray:
    """All numbers of `text`, up to the first thing that is none, as (n,) float64."""
    with warnings.catch_warnings():
        # What stops the parser early is told by the count of numbers, with the file's name.
        warnings.simplefilter("ignore", DeprecationWarning)
        try:
            return np.fromstring(text.decode("latin-1"), np.float64, sep=" ")
        except ValueError as error:  # newer NumPy raises where the older stops
            raise _Damaged("holds something that is no number") from error


def _records(body: _Body, element: Element, at: int) -> tuple[np.ndarray, dict[str, np.ndarray], int]:
    """Find the records of `element`, the first of which begins at `at`.

    Returns
    -------
    starts : (n,) int64
        Where each record begins.
    lists : dict of str to (n,) int64
        Where each list property's length stands.
    end : int
    """
    n, room = element.count, body.data.size - at
    fixed = sum(body.size(p.count_kind or p.kind) for p in element.properties)
    if n * max(fixed, 1) > room:
        raise _Damaged(f"claims {n} of '{element.name}' but ends before them: it is cut off, or its header is wrong")
    lists = [p for p in element.properties if p.count_kind]
    if not n or not lists:
        return at + fixed * np.arange(n), {p.name: np.zeros(0, np.int64) for p in lists}, at + fixed * n

    # The fast path: all lists are as long as those of the first record, which holds for nearly every mesh.
    where, length = _walk_one(body, element, at)
    if n * length <= room:
        starts = at + length * np.arange(n)
        places = {p.name: starts + offset for p, (offset, _) in zip(lists, where)}
        if all(np.all(body.take(places[p.name], p.count_kind)[:, 0] == count) for p, (_, count) in zip(lists, where)):
            return starts, places, at + length * n
    return _walk(body, element, at)


def _walk_one(body: _Body, element: Element, at: int) -> tuple[list[tuple[int, int]], int]:
    """Offset and length of each list of the record at `at`, and the record's size."""
    where, begin = [], at
    for p in element.properties:
        if not p.count_kind:
            at += body.size(p.kind)
            continue
        if at + body.size(p.count_kind) > body.data.size:
            raise _Damaged(f"ends within its '{element.name}' records: it is cut off")
        count = body.take(np.array([at]), p.count_kind)[0, 0]
        if not 0 <= count <= body.data.size or count != int(count):
            raise _Damaged(f"holds a list of {count} entries in '{element.name}'")
        where.append((at - begin, int(count)))
        at += body.size(p.count_kind) + int(count) * body.size(p.kind)
    return where, at - begin


def _walk(body: _Body, element: Element, at: int) -> tuple[np.ndarray, dict[str, np.ndarray], int]:
    """As `_records`, for lists of different lengths: where a record begins is known only from the one before.

    Within a window of the body, all possible records (one beginning at each entry) are sized at once; then the chain
    of real ones is followed, doubling: who knows the first 2^k records and the jump over 2^k knows the first 2^(k+1).
    """
    found: list[np.ndarray] = []
    places: dict[str, list[np.ndarray]] = {p.name: [] for p in element.properties if p.count_kind}
    missing = element.count
    while missing:
        begin = np.arange(at, min(at + WINDOW, body.data.size))
        end, where = _possible(body, element, begin)
        outside = len(begin)
        jump = np.append(np.minimum(end - at, outside), outside)
        chain = np.zeros(1, np.int64)
        while chain[-1] < outside and len(chain) < missing:
            chain = np.concatenate([chain, jump[chain]])
            jump = jump[jump]
        chain = chain[chain < outside][:missing]
        if not len(chain) or (at := int(end[chain[-1]])) > body.data.size:
            raise _Damaged(f"ends within its '{element.name}' records, or they are damaged")
        found.append(begin[chain])
        for name, place in where.items():
            places[name].append(place[chain])
        missing -= len(chain)
    return np.concatenate(found), {name: np.concatenate(place) for name, place in places.items()}, at


def _possible(body: _Body, element: Element, begin: np.ndarray) -> tuple[np.ndarray, dict[str, np.ndarray]]:
    """Where a record that begins at each of `begin` would end, and where its lists' lengths would stand.

    What can't be a record ends behind the body, where every chain through it stops.
    """
    size = body.data.size
    end, places = begin.copy(), {}
    for p in element.properties:
        if not p.count_kind:
            end += body.size(p.kind)
            continue
        places[p.name] = end.copy()
        inside = end + body.size(p.count_kind) <= size
        count = np.full(end.shape, -1.0)
        count[inside] = body.take(end[inside], p.count_kind)[:, 0]
        good = (count >= 0) & (count <= size) & (count == np.floor(count))
        length = body.size(p.count_kind) + np.where(good, count, 0).astype(np.int64) * body.size(p.kind)
        end = np.where(good, end + length, size + 1)
    return end, places


def _scalars(
    body: _Body, element: Element, starts: np.ndarray, lists: dict[str, np.ndarray], name: str
) -> np.ndarray | None:
    """The values of the scalar property `name`, (n,) in its own type (float64 where text); None where absent."""
    at = starts
    for p in element.properties:
        if p.count_kind:
            counts = body.take(lists[p.name], p.count_kind)[:, 0].astype(np.int64)
            at = lists[p.name] + body.size(p.count_kind) + counts * body.size(p.kind)
        elif p.name == name:
            return body.take(at, p.kind)[:, 0]
        else:
            at = at + body.size(p.kind)
    return None


def _columns(
    body: _Body, element: Element, starts: np.ndarray, lists: dict[str, np.ndarray], names: tuple[str, ...]
) -> np.ndarray | None:
    """Several scalar properties side by side, (n, k); None where one is absent."""
    found = [_scalars(body, element, starts, lists, name) for name in names]
    known = [values for values in found if values is not None]
    return np.stack(known, -1) if len(known) == len(found) else None


def _triangles(
    body: _Body, at: np.ndarray, count_kind: str, kind: str, vertices: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Split the polygons whose lists stand at `at`.

    Returns
    -------
    triangles : (t, 3) int32
    face : (t,) int64
        The polygon that each came from.
    corner : (t, 3) int32
        Which of its corners they are.
    """
    counts = body.take(at, count_kind)[:, 0].astype(np.int64)
    pieces, sources, places = [np.zeros((0, 3), np.int32)], [np.zeros(0, np.int64)], [np.zeros((0, 3), np.int32)]
    for corners in np.unique(counts[counts >= 3]).tolist():
        faces = np.flatnonzero(counts == corners)
        values = body.take(at[faces] + body.size(count_kind), kind, corners)
        bad = ~((values >= 0) & (values < len(vertices)) & (values == np.floor(values)))
        if bad.any():
            face, corner = np.argwhere(bad)[0]
            raise _Damaged(
                f"has a face ({faces[face]}) that points to vertex {values[face, corner]} of {len(vertices)}"
            )
        polygon = values.astype(np.int32)
        later = np.arange(1, corners - 1)
        fan = np.broadcast_to(np.stack([0 * later, later, later + 1], -1), (len(faces), corners - 2, 3))
        if corners == 4:
            a, b, c, d = (vertices[polygon[:, i]] for i in range(4))
            with np.errstate(invalid="ignore", over="ignore"):
                shorter = ((b - d) ** 2).sum(1) < ((a - c) ** 2).sum(1)
            fan = np.where(shorter[:, None, None], [[0, 1, 3], [1, 2, 3]], fan)
        fan = fan.reshape(len(faces), -1)
        pieces.append(np.take_along_axis(polygon, fan, 1).reshape(-1, 3))
        places.append(fan.reshape(-1, 3).astype(np.int32))
        sources.append(np.repeat(faces, corners - 2))
    source = np.concatenate(sources)
    order = np.argsort(source, kind="stable")
    return np.concatenate(pieces)[order].astype(np.int32), source[order], np.concatenate(places)[order]
