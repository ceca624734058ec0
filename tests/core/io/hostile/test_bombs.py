"""Small files that claim much: told from their headers, before room is made for a pixel."""

from __future__ import annotations

import json
import struct
import subprocess
import sys
import zlib
from pathlib import Path

import numpy as np
import OpenEXR
import pytest

from addon.core.errors import BadInputError
from addon.core.io.id_pictures import check_ids
from addon.core.io.layout import Reading
from addon.core.io.oiio import read_coded
from addon.core.io.read import read_capture
from addon.core.scene.model import Camera, Frame
from tests.core.io.conftest import CaptureOnDisk

ROOT = Path(__file__).resolve().parents[4]
SIDE = 4096


def exr(path: Path, side: int = SIDE) -> None:
    planes = {c: np.zeros((side, side), np.float16) for c in "RGB"}
    OpenEXR.File({"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}, planes).write(str(path))


def chunk(kind: bytes, data: bytes) -> bytes:
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))


def png(path: Path, bits: int, colours: int) -> None:
    packer = zlib.compressobj(9)
    line = bytes(1 + SIDE * bits * colours // 8)
    lines = b"".join(packer.compress(line) for _ in range(SIDE)) + packer.flush()
    header = struct.pack(">IIBBBBB", SIDE, SIDE, bits, {1: 0, 3: 2}[colours], 0, 0, 0)
    parts = chunk(b"IHDR", header) + chunk(b"IDAT", lines) + chunk(b"IEND", b"")
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + parts)


def hdr(path: Path) -> None:
    line = bytes((2, 2, SIDE >> 8, SIDE & 255)) + (bytes((255, 0)) * (SIDE // 127) + bytes((128 + SIDE % 127, 0))) * 4
    path.write_bytes(f"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y {SIDE} +X {SIDE}\n".encode() + line * 500)


def jpeg(path: Path) -> None:
    image = pytest.importorskip("PIL.Image")
    image.new("L", (SIDE, SIDE)).save(path, quality=1)


BOMBS = {
    ".exr": exr,
    "8.png": lambda path: png(path, 8, 3),
    "1.png": lambda path: png(path, 1, 1),
    ".hdr": hdr,
    ".jpg": jpeg,
}

READ = """
import sys
from pathlib import Path
from addon.core.errors import BadInputError
from addon.core.io.id_pictures import check_ids
from addon.core.io.layout import Reading
from addon.core.io.pixels import read_pixels
from addon.core.io.read import read_capture
from addon.core.memory import peak_memory
try:
    capture = read_capture(Path(sys.argv[1]), Reading(transfer="srgb", mesh=Path(sys.argv[1]) / "mesh.ply"))
    for frame in capture.frames:
        read_pixels(frame)
except BadInputError as error:
    print(error)
print(peak_memory())
"""


def read(root: Path) -> tuple[str, int]:
    """What reading a capture says, and MiB that it took."""
    done = subprocess.run([sys.executable, "-c", READ, str(root)], cwd=ROOT, capture_output=True, text=True, timeout=60)
    assert done.returncode == 0, done.stderr
    *told, peak = done.stdout.splitlines()
    return "\n".join(told), int(peak) >> 20


@pytest.mark.slow
@pytest.mark.once
@pytest.mark.skipif(sys.platform != "linux", reason="memory is told in other units")
@pytest.mark.parametrize("kind", BOMBS)
def test_frames_as_large_as_their_camera_says(kind, tmp_path):
    capture = CaptureOnDisk(tmp_path, 2)
    for frame in capture.transforms["frames"]:
        (tmp_path / frame["file_path"]).unlink()
        frame["file_path"] = frame["file_path"].replace(".exr", kind)
        BOMBS[kind](tmp_path / frame["file_path"])
    capture.top(w=SIDE, h=SIDE, fl_x=SIDE / 2, fl_y=SIDE / 2, cx=SIDE / 2, cy=SIDE / 2)
    said, peak = read(tmp_path)
    assert "4096 x 4096 pixels" in said and said.endswith(".") and "2 bad frames of 2" in said
    assert peak < 250


def test_a_picture_of_ids_that_is_larger_than_its_frame(tmp_path):
    exr(tmp_path / "ids.exr", 2048)
    frame = Frame("one", tmp_path / "a.exr", Camera(8, 6, 4, 4, 4, 3, np.eye(4)), id_path=tmp_path / "ids.exr")
    with pytest.raises(BadInputError, match="2048 x 2048.*give them one size"):
        check_ids(frame)


def test_a_jpeg_of_many_scans(tmp_path):
    image = pytest.importorskip("PIL.Image")
    path = tmp_path / "a.jpg"
    image.fromarray(np.random.default_rng(0).integers(0, 256, (64, 64, 3), np.uint8)).save(path, progressive=True)
    content = path.read_bytes()
    last = content.rindex(b"\xff\xda")
    path.write_bytes(content[:last] + content[last:-2] * 1000 + b"\xff\xd9")
    with pytest.raises(BadInputError, match="over 256 scans"):
        read_coded(path)


@pytest.mark.slow
def test_a_hundred_thousand_frames_that_are_missing(tmp_path):
    capture = CaptureOnDisk(tmp_path, 1)
    pose = capture.transforms["frames"][0]["transform_matrix"]
    frames = [{"file_path": f"images/none{k}.exr", "transform_matrix": pose} for k in range(100_000)]
    (tmp_path / "transforms.json").write_text(json.dumps(capture.transforms | {"frames": frames}))
    with pytest.raises(BadInputError, match="100000 bad frames of 100000.*does not exist.* And 99997 more"):
        read_capture(tmp_path, Reading())


@pytest.mark.parametrize("name", ["transforms.json", "info_semantic.json"])
def test_tables_of_more_bytes_than_any_has(tmp_path, name):
    CaptureOnDisk(tmp_path, 1)
    with open(tmp_path / name, "r+b") as file:
        file.truncate(1 << 40)  # a hole, which takes no space
    with pytest.raises(BadInputError, match=f"{name}' is too large"):
        read_capture(tmp_path)
