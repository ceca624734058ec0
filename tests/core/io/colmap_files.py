"""COLMAP models written as its documentation (doc/format.rst) says, from the core's cameras."""

from __future__ import annotations

import struct
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

Numbered = dict[int, tuple[str, int, int, Sequence[float]]]
IDS = {"SIMPLE_PINHOLE": 0, "PINHOLE": 1, "SIMPLE_RADIAL": 2, "OPENCV": 4, "OPENCV_FISHEYE": 5, "EQUIRECTANGULAR": 17}


def world_to_camera(pose: np.ndarray) -> tuple[list[float], list[float]]:
    """Quaternion (w first) and translation of a camera-to-world pose in OpenGL axes."""
    rotation = (np.array(pose)[:3, :3] @ np.diag([1.0, -1, -1])).T
    x, y, z, w = Rotation.from_matrix(rotation).as_quat()
    return [w, x, y, z], (-rotation @ np.array(pose)[:3, 3]).tolist()


def images_of(poses: Sequence, camera: int = 1, name: str = "{:03d}.exr") -> list[tuple]:
    """Images as `write_text` takes them, of camera-to-world poses."""
    return [(i + 1, *world_to_camera(pose), camera, name.format(i)) for i, pose in enumerate(poses)]


def write_text(folder: Path, cameras: Numbered, images: Sequence[tuple], points: str = "10.5 20.25 -1 3 4 17") -> None:
    """`images`: (number, quaternion, translation, camera, name)."""
    folder.mkdir(parents=True, exist_ok=True)
    lines = ["# Camera list with one line of data per camera:", "#   CAMERA_ID, MODEL, WIDTH, HEIGHT, PARAMS[]"]
    lines += [
        " ".join(map(str, [number, model, width, height, *map(repr, map(float, values))]))
        for number, (model, width, height, values) in cameras.items()
    ]
    (folder / "cameras.txt").write_text("\n".join(lines) + "\n")
    lines = ["# Image list with two lines of data per image:"]
    for number, quaternion, translation, camera, name in images:
        pose = " ".join(repr(float(v)) for v in (*quaternion, *translation))
        lines += [f"{number} {pose} {camera} {name}", points]
    (folder / "images.txt").write_text("\n".join(lines) + "\n")


def write_binary(folder: Path, cameras: Numbered, images: Sequence[tuple], points: int = 2) -> None:
    """As `write_text`."""
    folder.mkdir(parents=True, exist_ok=True)
    data = struct.pack("<Q", len(cameras))
    for number, (model, width, height, values) in cameras.items():
        data += struct.pack(f"<IiQQ{len(values)}d", number, IDS[model], width, height, *values)
    (folder / "cameras.bin").write_bytes(data)
    data = struct.pack("<Q", len(images))
    for number, quaternion, translation, camera, name in images:
        data += struct.pack("<I7dI", number, *quaternion, *translation, camera) + name.encode() + b"\0"
        data += struct.pack("<Q", points) + struct.pack("<ddQ", 1.5, 2.5, 7) * points
    (folder / "images.bin").write_bytes(data)
