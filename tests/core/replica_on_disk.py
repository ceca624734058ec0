"""A room of known light in Replica's layout: quads in any order, begun at any corner, the light in their tiles."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
from scipy.spatial import cKDTree

from tests.core.rooms import Quad, Room, make_room, split

OPENED = "ply\nformat binary_little_endian 1.0\nelement vertex {}\n"


def interleave(cell) -> int:
    """Morton code of three whole numbers, bit by bit."""
    return sum(((int(c) >> bit) & 1) << (3 * bit + axis) for axis, c in enumerate(cell) for bit in range(10))


class ReplicaOnDisk:
    """`room` cut into quads of about `edge` metres and written to `root`; `light` is its radiance by element."""

    def __init__(
        self,
        root: Path,
        room: Room,
        light: np.ndarray,
        edge: float = 0.5,
        size: int = 4,
        split_size: float = 1.6,
        seed: int = 0,
    ):
        self.root, self.size, self.split_size = root, size, split_size
        rng = np.random.default_rng(seed)
        pieces = []
        for one in room.quads:
            longest = max(np.linalg.norm(one.edge_u), np.linalg.norm(one.edge_v))
            for q in split(one, max(round(longest / edge), 1)):
                for _ in range(rng.integers(4)):
                    q = Quad(q.corner + q.edge_u, q.edge_v, -q.edge_u, q.object_id)
                pieces.append(q)
        self.quads = [pieces[i] for i in rng.permutation(len(pieces))]
        self.fine = make_room(self.quads, 0.1)
        corners = self.fine.mesh.vertices.astype(np.float32)
        faces = np.arange(4 * len(self.quads)).reshape(-1, 4)
        ids = np.array([q.object_id for q in self.quads])
        (root / "textures").mkdir(parents=True)
        (root / "habitat").mkdir()
        write_quads(root / "mesh.ply", corners, faces)
        mixed = rng.permutation(len(faces))
        write_quads(root / "habitat/mesh_semantic.ply", corners, faces[mixed], ids[mixed])
        names = {
            "classes": [{"id": 9, "name": "thing"}],
            "objects": [{"id": int(i), "class_id": 9} for i in np.unique(ids)],
        }
        (root / "habitat/info_semantic.json").write_text(json.dumps(names))
        (root / "textures/parameters.json").write_text(json.dumps({"splitSize": split_size, "tileSize": size}))
        chunks = self.chunks(corners, faces)
        if split_size:
            chunks = [rng.permutation(chunk) for chunk in chunks]
            content = np.uint64(len(chunks)).tobytes()
            for chunk in chunks:
                content += np.uint64(len(chunk)).tobytes() + chunk.astype("<u4").tobytes()
            (root / "habitat/sorted_faces.bin").write_bytes(content)
        for i, chunk in enumerate(chunks):
            self.texture(i).write_bytes(self.picture(chunk, room, light).tobytes())

    def texture(self, i: int) -> Path:
        return self.root / f"textures/{i}-color-ptex.hdr"

    def chunks(self, corners: np.ndarray, faces: np.ndarray) -> list[np.ndarray]:
        if self.split_size == 0:
            return [np.arange(len(faces))]
        cells = ((corners - corners.min(0)) / np.float32(self.split_size)).astype(int)
        code = np.array([min(interleave(cells[v]) for v in face) for face in faces])
        return [np.flatnonzero(code == one) for one in np.unique(code)]

    def picture(self, chunk: np.ndarray, room: Room, light: np.ndarray) -> np.ndarray:
        across = int(np.ceil(np.sqrt(len(chunk)))) + 1
        result = np.zeros((across * self.size, across * self.size, 3), np.float16)
        at = (np.arange(self.size) + 0.5) / self.size
        for k, face in enumerate(chunk):
            q = self.quads[face]
            points = q.corner + at[None, :, None] * q.edge_u + at[:, None, None] * q.edge_v
            own = np.flatnonzero(room.atlas.object_id == q.object_id)
            nearest = cKDTree(room.atlas.position[own]).query(points.reshape(-1, 3))[1]
            row, column = divmod(k, across)
            result[row * self.size :][: self.size, column * self.size :][:, : self.size] = light[own[nearest]].reshape(
                self.size, self.size, 3
            )
        return result

    def unwrap(self, mesh, size):
        """The fine room's own layout, by the corners that the reader's triangles have."""
        uv = self.fine.uv.reshape(-1, 2, 3, 2)
        corners = np.concatenate([uv[:, 0], uv[:, 1, 2:]], 1)
        face = mesh.triangles // 4
        return corners[face, mesh.triangles % 4].astype(np.float32)


def write_quads(path: Path, corners: np.ndarray, faces: np.ndarray, ids: np.ndarray | None = None) -> None:
    """Binary, little-endian, with colours, as Replica's are."""
    header = OPENED.format(len(corners)) + "".join(f"property float {axis}\n" for axis in "xyz")
    header += "".join(f"property uchar {name}\n" for name in ("red", "green", "blue"))
    header += f"element face {len(faces)}\nproperty list uchar int vertex_indices\n"
    header += "" if ids is None else "property int object_id\n"
    points = np.zeros(len(corners), [("at", "<f4", 3), ("colour", "u1", 3)])
    points["at"] = corners
    listed = np.zeros(len(faces), [("n", "u1"), ("v", "<i4", 4)] + ([] if ids is None else [("id", "<i4")]))
    listed["n"], listed["v"] = 4, faces
    if ids is not None:
        listed["id"] = ids
    path.write_bytes((header + "end_header\n").encode() + points.tobytes() + listed.tobytes())
