"""A room whose only file is a GLB with the light baked to its texture, as apps on phones export it."""

from __future__ import annotations

import json
import struct
from pathlib import Path

import numpy as np

from addon.core.io.png import write_png
from addon.core.photo import encoded
from tests.core.rooms import Room


def write_textured(root: Path, room: Room, light: np.ndarray, name: str = "scan.glb") -> Path:
    """Write `room` as one object; `light` is its radiance by element, 1 the greatest code."""
    root.mkdir(parents=True, exist_ok=True)
    picture = root / "texture.png"
    codes = encoded(room.atlas.image(light.astype(np.float32))[::-1])
    write_png(picture, codes)
    png = picture.read_bytes()
    picture.unlink()
    path = root / name
    path.write_bytes(glb(room, png))
    return path


def glb(room: Room, png: bytes, **texture) -> bytes:
    """The file's content: +Y up, each corner a vertex of its own; `texture` is added to the use of the picture."""
    corners = room.mesh.vertices[room.mesh.triangles].reshape(-1, 3)[:, [0, 2, 1]] * (1, 1, -1)
    corners, uv = corners.astype("<f4"), room.uv.reshape(-1, 2) * (1, -1) + (0, 1)
    parts = [corners.tobytes(), uv.astype("<f4").tobytes(), png + b"\0" * (-len(png) % 4)]
    starts = np.cumsum([0, *(len(part) for part in parts)]).tolist()
    lengths = [len(parts[0]), len(parts[1]), len(png)]
    bounds = {"min": corners.min(0).tolist(), "max": corners.max(0).tolist()}
    top = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0, "name": "scan"}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0, "TEXCOORD_0": 1}, "material": 0}]}],
        "materials": [{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0, **texture}}}],
        "textures": [{"source": 0}],
        "images": [{"bufferView": 2, "mimeType": "image/png"}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": len(corners), "type": "VEC3", **bounds},
            {"bufferView": 1, "componentType": 5126, "count": len(corners), "type": "VEC2"},
        ],
        "bufferViews": [
            {"buffer": 0, "byteOffset": at, "byteLength": length}
            for at, length in zip(starts[:3], lengths, strict=True)
        ],
        "buffers": [{"byteLength": starts[-1]}],
    }
    text = json.dumps(top).encode()
    text += b" " * (-len(text) % 4)
    binary = b"".join(parts)
    chunks = struct.pack("<I4s", len(text), b"JSON") + text + struct.pack("<I4s", len(binary), b"BIN\0") + binary
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks
