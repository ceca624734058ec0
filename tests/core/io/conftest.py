"""A small capture on disk, whole, which each test then spoils in its own way."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from addon.core.io.exr import write_exr

SHARED = Path(__file__).resolve().parents[4] / "shared"
WIDTH, HEIGHT = 8, 6
JPEG = bytes.fromhex(
    "ffd8ffe000104a46494600010100000100010000ffdb0043000302020302020303030304030304050805050404050a070706080c0a0c0c0b0a"
    "0b0b0d0e12100d0e110e0b0b1016101113141515150c0f171816141812141514ffc0000b080006000801011100ffc400140001000000000000"
    "00000000000000000009ffc400191000010500000000000000000000000000040006213291ffda0008010100003f003d86630f15c5ffd9"
)
"""Of that size, gray, baseline: the numbers 0 to 47 in the order of reading, about."""


def ply_text(vertices, faces, object_ids=None, uv=None) -> str:
    lines = ["ply", "format ascii 1.0", f"element vertex {len(vertices)}", *(f"property float {n}" for n in "xyz")]
    lines += ["property float s", "property float t"] if uv is not None else []
    lines += [f"element face {len(faces)}", "property list uchar int vertex_indices"]
    lines += ["property int object_id"] if object_ids is not None else []
    lines.append("end_header")
    for i, vertex in enumerate(vertices):
        lines.append(" ".join(map(str, [*vertex, *(uv[i] if uv is not None else [])])))
    for i, face in enumerate(faces):
        lines.append(" ".join(map(str, [len(face), *face, *([object_ids[i]] if object_ids is not None else [])])))
    return "\n".join(lines) + "\n"


CORNERS = [(x, y, z) for z in (0, 3) for y in (0, 4) for x in (0, 5)]
SIDES = [(0, 1, 3, 2), (4, 5, 7, 6), (0, 1, 5, 4), (2, 3, 7, 6), (0, 2, 6, 4), (1, 3, 7, 5)]


class CaptureOnDisk:
    """Writes the parts of a capture of `count` frames into `root`."""

    def __init__(self, root: Path, count: int = 10):
        self.root = root
        root.mkdir(exist_ok=True)
        (root / "images").mkdir(exist_ok=True)
        self.transforms = {
            "w": WIDTH, "h": HEIGHT, "fl_x": 6.0, "fl_y": 6.5, "cx": 4.0, "cy": 3.0,
            "frames": [{"file_path": f"images/{i:03d}.exr", "transform_matrix": self.pose(i)} for i in range(count)],
        }  # fmt: skip
        self.save()
        self.objects({"objects": [{"id": i, "class_name": f"side {i}"} for i in range(6)]})
        self.mesh(ply_text(CORNERS, SIDES, range(6)))
        for i in range(count):
            self.picture(i, np.full((HEIGHT, WIDTH, 3), 0.5))

    @staticmethod
    def pose(i: int) -> list[list[float]]:
        c, s = np.cos(0.1 * i), np.sin(0.1 * i)
        return [[c, -s, 0, 2.5], [s, c, 0, 2.0], [0, 0, 1, 1.5], [0, 0, 0, 1]]

    def save(self) -> None:
        (self.root / "transforms.json").write_text(json.dumps(self.transforms))

    def frame(self, i: int, **values) -> None:
        self.transforms["frames"][i].update(values)
        self.save()

    def top(self, **values) -> None:
        self.transforms.update(values)
        self.save()

    def objects(self, value) -> None:
        (self.root / "info_semantic.json").write_text(json.dumps(value))

    def mesh(self, text: str) -> None:
        (self.root / "mesh.ply").write_text(text)

    def picture(self, i: int, array) -> Path:
        path = self.root / "images" / f"{i:03d}.exr"
        write_exr(path, array)
        return path


@pytest.fixture
def capture(tmp_path) -> CaptureOnDisk:
    return CaptureOnDisk(tmp_path / "capture")


@pytest.fixture
def make_capture(tmp_path):
    return lambda count: CaptureOnDisk(tmp_path / f"capture{count}", count)


@pytest.fixture
def text_of_ply():
    return ply_text


@pytest.fixture(scope="session")
def shared() -> Path:
    if not SHARED.is_dir():
        pytest.skip(f"{SHARED} is absent")
    return SHARED
