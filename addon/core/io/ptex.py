"""Which square of Replica's textures belongs to which face of its mesh.

The faces are sorted by the Morton code of a grid and cut into chunks of one code; chunk N's squares are the picture
`N-color-ptex.hdr`, row by row in the chunk's order. Faces of one code are in the order that the C++ library's
`std::sort` happened to leave them in, which isn't stable. Habitat ships that order as `sorted_faces.bin`; without it
the sort of libstdc++ (bits/stl_algo.h) is done again step by step.
Replica SDK, `PTexMesh::SplitMesh`; the file: Habitat, `PTexMeshData.cpp`.
"""

from pathlib import Path

import numpy as np

from ..errors import BadInputError
from ..kinds import Code
from .files import read_bytes

THRESHOLD: Code[int] = 16
"""Up to so many elements are left to the final insertion sort."""
SPREAD: Code[tuple[tuple[int, int], ...]] = (
    (32, 0x1F00000000FFFF),
    (16, 0x1F0000FF0000FF),
    (8, 0x100F00F00F00F00F),
    (4, 0x10C30C30C30C30C3),
    (2, 0x1249249249249249),
)
"""Shifts and masks that put two zeros behind each of 21 bits."""


def morton(vertices: np.ndarray, split: float) -> np.ndarray:
    """Morton code of each vertex's cell of edge `split`, (v,) uint32: bits of x, y, z in turn, x the lowest."""
    points = vertices.astype(np.float32)
    with np.errstate(all="ignore"):
        cells = ((points - points.min(0)) / np.float32(split)).astype(np.int64).astype(np.uint64)
    code = np.zeros(len(points), np.uint64)
    for axis in range(3):
        spread = cells[:, axis] & np.uint64(0x1FFFFF)
        for shift, mask in SPREAD:
            spread = (spread | (spread << np.uint64(shift))) & np.uint64(mask)
        code += spread << np.uint64(axis)
    return code.astype(np.uint32)


def split_faces(vertices: np.ndarray, quads: np.ndarray, split: float) -> list[np.ndarray]:
    """The faces of each chunk in its order, as indices into `quads` ((f, 4) int)."""
    if split <= 0:
        return [np.arange(len(quads))]
    code = morton(vertices, split)[quads].min(1).astype(np.int64)
    order = std_sort(code)
    return np.split(order, np.flatnonzero(np.diff(code[order])) + 1)


def read_sorted_faces(path: Path, faces: int) -> list[np.ndarray]:
    """The same from Habitat's file: how many chunks (u64); of each, how many faces (u64) and which (u32 each).

    Raises
    ------
    BadInputError
        It can't be read, or does not list each of `faces` faces once.
    """
    content = read_bytes(path, most=64 + 12 * faces)  # more than a chunk for each face takes
    words = np.frombuffer(content[: len(content) // 4 * 4], "<u4").astype(np.int64)
    chunks, at = [], 2
    while at + 2 <= len(words):
        end = at + 2 + (int(words[at]) | int(words[at + 1]) << 32)
        if end > len(words):
            break
        chunks.append(words[at + 2 : end])
        at = end
    listed = np.concatenate(chunks) if chunks else np.zeros(0, np.int64)
    whole = len(listed) == faces and listed.max(initial=0) < faces and len(np.unique(listed)) == faces
    if at != len(words) or not whole or len(chunks) != words[0] + (words[1] << 32):
        raise BadInputError(
            f"'{path}' does not list each of the mesh's {faces} faces once; take it away or copy it again."
        )
    return chunks


def std_sort(code: np.ndarray) -> np.ndarray:
    """Where libstdc++'s `std::sort` by `code` ((n,) int) takes each element from, (n,) int64."""
    order = np.arange(len(code))
    values = code.copy()
    parts = [(0, len(code))]
    while parts:
        first, last = parts.pop()
        while last - first > THRESHOLD:
            cut = _partition(values, order, first, last)
            parts.append((cut, last))
            last = cut
    # Insertion does not change the order of equal elements.
    return order[np.argsort(values, kind="stable")]


def _partition(values: np.ndarray, order: np.ndarray, first: int, last: int) -> int:
    """Part [first, last) around the median of three; where the right part begins."""

    def swap(i: int, j: int) -> None:
        values[i], values[j] = values[j], values[i]
        order[i], order[j] = order[j], order[i]

    a, b, c = first + 1, first + (last - first) // 2, last - 1
    if values[a] < values[b]:
        swap(first, b if values[b] < values[c] else c if values[a] < values[c] else a)
    else:
        swap(first, a if values[a] < values[c] else c if values[b] < values[c] else b)
    pivot, part, places = values[first], values[first + 1 : last], order[first + 1 : last]
    # Two pointers walk towards each other and stop at what is not less, and not greater, than the pivot; those pairs
    # are swapped until they meet. Nothing that was swapped is looked at again, so all stops are known at once.
    left, right = np.flatnonzero(part >= pivot), np.flatnonzero(part <= pivot)[::-1]
    both = min(len(left), len(right))
    count = int(np.searchsorted(left[:both] >= right[:both], True))
    i, j = left[:count], right[:count]
    part[i], part[j] = part[j], part[i]
    places[i], places[j] = places[j], places[i]
    ends = [*left[count : count + 1], *right[count - 1 : count if count else 0]]
    return first + 1 + int(min(ends))
