"""Which square of Replica's textures belongs to which face of its mesh.

The faces are cut into chunks; chunk N's squares are the picture `N-color-ptex.hdr`, row by row in the chunk's order.
That order is what an unstable sort happened to leave, so it comes in a file of its own, `sorted_faces.bin`.
Source: Habitat, `PTexMeshData.cpp`.
"""

from pathlib import Path

import numpy as np

from ..errors import BadInputError
from .files import read_bytes


def read_sorted_faces(path: Path, faces: int) -> list[np.ndarray]:
    """Faces of each chunk in its order, from a file: how many chunks (u64); of each, how many faces (u64), which (u32).

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
