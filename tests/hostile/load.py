"""Captures that are large in one way: many frames, many objects, huge frames, tiny frames, many triangles."""

from __future__ import annotations

import base64
import json
from collections.abc import Callable
from pathlib import Path

import numpy as np

from addon.core.io.exr import write_exr

SIDE = 6.0
"""Metres of the room, a cube whose boxes stand on its floor."""


def box(low: np.ndarray, high: np.ndarray, inside: bool = False) -> tuple[np.ndarray, np.ndarray]:
    """Corners (8, 3) and quads (6, 4) of a box, seen from outside or from inside."""
    corners = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], float)
    quads = np.array([[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]])
    return low + corners * (high - low), quads[:, ::-1] if inside else quads


def boxes(objects: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The room and `objects` - 1 boxes in it: vertices (v, 3), quads (q, 4), the object of each (q,)."""
    found = [box(np.zeros(3), np.full(3, SIDE), inside=True)]
    across = max(int(np.ceil(np.sqrt(objects))), 1)
    size = np.random.default_rng(1).uniform(0.2, 0.8, objects) * SIDE / across  # of no two is one the same again
    for k in range(objects - 1):
        at = np.array([*np.divmod(k, across), 0.0]) / across * SIDE
        found.append(box(at, at + size[k]))
    vertices = np.concatenate([one for one, _ in found])
    quads = np.concatenate([one + 8 * k for k, (_, one) in enumerate(found)])
    return vertices, quads, np.repeat(np.arange(len(found)), 6)


def grid(triangles: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The room's six sides in so many triangles or a few more, as one object."""
    side = int(np.ceil(np.sqrt(triangles / 12)))
    u, v = np.mgrid[0 : side + 1, 0 : side + 1].reshape(2, -1) * (SIDE / side)
    first = (np.arange(side)[:, None] * (side + 1) + np.arange(side)).ravel()
    quad = np.stack([first, first + 1, first + side + 2, first + side + 1], -1)
    vertices, quads = [], []
    for axis in range(3):
        for end in (0.0, SIDE):
            place = np.insert(np.stack([u, v], -1), axis, end, 1)
            vertices.append(place)
            quads.append((quad if (end == 0) != (axis == 1) else quad[:, ::-1]) + len(quads) * len(place))
    quads = np.concatenate(quads)
    return np.concatenate(vertices), quads, np.zeros(len(quads), int)


def write(
    root: Path, mesh: tuple[np.ndarray, np.ndarray, np.ndarray], frames: int, size: tuple[int, int], uv: bool = False
) -> Path:
    """A capture with a PLY mesh and frames of noise, as every pixel of a real one differs.

    With `uv` the mesh brings an atlas: a cell for each quad.
    """
    vertices, quads, owner = mesh
    if uv:
        vertices, quads = vertices[quads.ravel()], np.arange(quads.size).reshape(-1, 4)
        across = int(np.ceil(np.sqrt(len(quads))))
        cell = np.stack(np.divmod(np.arange(len(quads)), across), -1)[:, None]
        corners = np.array([[0.1, 0.1], [0.9, 0.1], [0.9, 0.9], [0.1, 0.9]])
        vertices = np.concatenate([vertices, ((cell + corners) / across).reshape(-1, 2)], -1)
    (root / "images").mkdir(parents=True)
    head = (
        f"ply\nformat binary_little_endian 1.0\nelement vertex {len(vertices)}\n"
        + "".join(f"property float {axis}\n" for axis in ("xyzst" if uv else "xyz"))
        + f"element face {len(quads)}\nproperty list uchar int vertex_indices\nproperty int object_id\nend_header\n"
    )
    records = np.empty(len(quads), np.dtype([("n", "u1"), ("corners", "<i4", 4), ("owner", "<i4")]))
    records["n"], records["corners"], records["owner"] = 4, quads, owner
    (root / "mesh.ply").write_bytes(head.encode() + vertices.astype("<f4").tobytes() + records.tobytes())
    names = [{"id": int(one), "class_name": f"box {one}" if one else "room"} for one in np.unique(owner)]
    (root / "info_semantic.json").write_text(json.dumps({"objects": names}))
    rng, entries = np.random.default_rng(0), []
    width, height = size
    for k in range(frames):
        turn = 2 * np.pi * k / frames
        back = np.array([np.cos(turn), np.sin(turn), 0.25]) / np.hypot(1, 0.25)
        right = np.array([-np.sin(turn), np.cos(turn), 0.0])
        pose = np.eye(4)
        pose[:3] = np.stack([right, np.cross(back, right), back, np.full(3, SIDE / 2)], 1)
        name = f"images/{k:05d}.exr"
        write_exr(root / name, rng.random((height, width, 3), np.float32) * 0.2 + 0.3, half=True)
        entries.append({"file_path": name, "transform_matrix": pose.tolist()})
    told = {"w": width, "h": height, "fl_x": width / 2, "fl_y": width / 2, "cx": width / 2, "cy": height / 2}
    (root / "transforms.json").write_text(json.dumps(told | {"frames": entries}))
    return root


def obj(root: Path, objects: int) -> Path:
    """A capture whose mesh is an OBJ file of so many objects."""
    vertices, quads, _ = boxes(objects)
    write(root, boxes(1), 4, (64, 48))
    lines = []
    for k in range(objects):
        lines.append(f"o box {k}")
        lines += [f"v {x:.5f} {y:.5f} {z:.5f}" for x, y, z in vertices[8 * k : 8 * k + 8]]
        lines += ["f " + " ".join(map(str, quad + 1)) for quad in quads[6 * k : 6 * k + 6]]
    return _instead_of_ply(root, "mesh.obj", "\n".join(lines))


def gltf(root: Path, instances: int) -> Path:
    """A capture whose mesh is a glTF file that has one box in so many places."""
    write(root, boxes(1), 4, (64, 48))
    corners, quads = box(np.zeros(3), np.full(3, SIDE), inside=True)
    triangles = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]]).astype("<u2")
    buffer = corners.astype("<f4").tobytes() + triangles.tobytes()
    across = int(np.ceil(np.sqrt(instances)))
    nodes: list[dict] = [{"mesh": 0, "name": "room"}]
    for k in range(1, instances):
        x, y = np.divmod(k, across)
        nodes.append(
            {"mesh": 0, "scale": [0.5 / across] * 3, "translation": [x * SIDE / across, y * SIDE / across, 0.1]}
        )
    top = {
        "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": list(range(instances))}], "nodes": nodes,
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 8, "type": "VEC3", "min": [0] * 3, "max": [SIDE] * 3},
            {"bufferView": 1, "componentType": 5123, "count": 36, "type": "SCALAR"},
        ],
        "bufferViews": [{"buffer": 0, "byteLength": 96}, {"buffer": 0, "byteOffset": 96, "byteLength": 72}],
        "buffers": [{"byteLength": len(buffer), "uri": f"data:;base64,{base64.b64encode(buffer).decode()}"}],
    }  # fmt: skip
    return _instead_of_ply(root, "mesh.gltf", json.dumps(top))


def _instead_of_ply(root: Path, name: str, content: str) -> Path:
    (root / "mesh.ply").unlink()
    (root / "info_semantic.json").unlink()
    (root / name).write_text(content)
    return root


def missing(root: Path, frames: int) -> Path:
    """A capture that tells of so many frames, and has none."""
    write(root, boxes(20), 1, (64, 48))
    told = json.loads((root / "transforms.json").read_text())
    told["frames"] = [told["frames"][0] | {"file_path": f"images/none{k}.exr"} for k in range(frames)]
    (root / "transforms.json").write_text(json.dumps(told))
    return root


LOADS: dict[str, Callable[[Path], Path]] = {
    "2,000 frames of 64 x 48": lambda root: write(root, boxes(20), 2000, (64, 48)),
    "5,000 objects, 12 frames of 160 x 120": lambda root: write(root, boxes(5000), 12, (160, 120)),
    "one object, 12 frames of 160 x 120": lambda root: write(root, boxes(1), 12, (160, 120)),
    "4 frames of 8000 x 4000": lambda root: write(root, boxes(20), 4, (8000, 4000)),
    "50 frames of 1 x 1": lambda root: write(root, boxes(20), 50, (1, 1)),
    "2 M triangles, 12 frames of 160 x 120": lambda root: write(root, grid(2_000_000), 12, (160, 120)),
    "a glTF of 20,000 instances (info)": lambda root: gltf(root, 20_000),
    "an OBJ of 20,000 objects (info)": lambda root: obj(root, 20_000),
    "100,000 frames that are missing (info)": lambda root: missing(root, 100_000),
}
