"""Binary PLY meshes with an object on each face, as `ply.read_ply` reads them."""

from collections.abc import Sequence

import numpy as np


def ply_bytes(vertices: np.ndarray, faces: Sequence[tuple[np.ndarray, np.ndarray | int]]) -> bytes:
    """The content of a little-endian PLY file.

    Parameters
    ----------
    vertices : (v, 3) float32 or float64
        Stored in that precision.
    faces : sequence of (index, object_id)
        Index is (f, k) int, polygons of k corners each; the object is one of each, (f,) int, or of all.
    """
    kind = {4: "float", 8: "double"}[vertices.itemsize]
    records = []
    for index, object_id in faces:
        record = np.empty(len(index), [("n", "u1"), ("v", "<i4", index.shape[1]), ("object_id", "<i4")])
        record["n"], record["v"], record["object_id"] = index.shape[1], index, object_id
        records.append(record)
    header = (
        f"ply\nformat binary_little_endian 1.0\nelement vertex {len(vertices)}\n"
        f"property {kind} x\nproperty {kind} y\nproperty {kind} z\n"
        f"element face {sum(map(len, records))}\nproperty list uchar int vertex_indices\nproperty int object_id\n"
        "end_header\n"
    )
    places = vertices.astype(f"<f{vertices.itemsize}")
    return b"".join([header.encode(), places.tobytes(), *(record.tobytes() for record in records)])
