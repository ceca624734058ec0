"""OpenEXR files spoiled in every way, read in a process of its own: the library is C++, and a crash takes all along."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import OpenEXR
import pytest

ROOT = Path(__file__).resolve().parents[4]
COUNT, SEED = (int(os.environ.get(f"HOSTILE_{name}", usual)) for name, usual in (("EXAMPLES", "60"), ("SEED", "0")))
PICTURE = np.round(np.random.default_rng(5).random((33, 41, 3)), 1).astype(np.float16)


def planes(prefix: str = "") -> dict[str, np.ndarray]:
    """New ones each time, as the library makes its own of those that it is given."""
    return {f"{prefix}{c}": np.ascontiguousarray(PICTURE[..., i]) for i, c in enumerate("RGB")}


CHILD = """
import resource, signal, sys
from addon.core.io.exr import exr_note, read_exr, read_header
from addon.core.errors import BadInputError
resource.setrlimit(resource.RLIMIT_AS, (3 << 30, 3 << 30))
good = 0
for path in sys.argv[1:]:
    print(path, file=sys.stderr, flush=True)
    signal.alarm(10)  # a hang ends the process
    for read in (read_header, exr_note, read_exr):
        try:
            read(path)
            good += read is read_exr
        except BadInputError as error:
            assert path in str(error) and str(error).endswith(".") and "\\n" not in str(error), str(error)
status = dict(line.split(":", 1) for line in open("/proc/self/status"))
assert int(status["VmHWM"].split()[0]) < 400_000, "too much memory"
print("all", len(sys.argv) - 1, "good", good)
"""


def one_part(path, **header):
    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage} | header
    OpenEXR.File(header, planes()).write(str(path))


def tiled(path):
    tiles = OpenEXR.TileDescription()
    tiles.xSize, tiles.ySize = 16, 16
    one_part(path, type=OpenEXR.tiledimage, tiles=tiles)


def parts(path):
    both = [OpenEXR.Part({}, planes(), "rgba"), OpenEXR.Part({}, planes("diffuse."), "other")]
    OpenEXR.File(both).write(str(path))


KINDS = {
    "scanlines": one_part,
    "tiles": tiled,
    "parts": parts,
    **{
        name: lambda path, name=name: one_part(path, compression=getattr(OpenEXR, f"{name}_COMPRESSION"))
        for name in ("PIZ", "PXR24", "B44", "DWAA", "HTJ2K32", "ZSTD")
        if hasattr(OpenEXR, f"{name}_COMPRESSION")
    },
}


def spoiled(content: bytes, head: int, rng: np.random.Generator) -> bytes:
    """One to four blows, most of them within the first `head` bytes."""
    content = bytearray(content)
    for _ in range(rng.integers(1, 5)):
        if not content:
            break
        at = int(rng.integers(0, min(head, len(content)) if rng.random() < 0.7 else len(content)))
        what = rng.integers(0, 6)
        if what == 0:
            content[at] = int(rng.integers(0, 256))
        elif what == 1:
            content[at : at + 4] = (b"\xff\xff\xff\x7f", b"\xff" * 4, b"\0\0\0\x80", bytes(4))[rng.integers(0, 4)]
        elif what == 2:
            content[at : at + 8] = b"\xff" * 8
        elif what == 3:
            del content[at : at + int(rng.integers(1, 200))]
        elif what == 4:
            content[at:at] = content[: int(rng.integers(1, 200))]
        else:
            del content[max(at, 1) :]
    return bytes(content)


@pytest.mark.skipif(not Path("/proc/self/status").exists(), reason="this system does not tell a process's memory")
@pytest.mark.parametrize("kind", KINDS)
def test_spoiled(kind, tmp_path):
    KINDS[kind](tmp_path / "good.exr")
    good = (tmp_path / "good.exr").read_bytes()
    rng = np.random.default_rng(SEED)
    paths = [tmp_path / "good.exr", *(tmp_path / f"{i}.exr" for i in range(COUNT))]
    for path in paths[1:]:
        path.write_bytes(spoiled(good, 800, rng))
    done = subprocess.run(
        [sys.executable, "-c", CHILD, *map(str, paths)],
        cwd=ROOT,
        capture_output=True,
        timeout=300,
        text=True,
        errors="replace",
    )
    assert done.returncode == 0 and f"all {len(paths)}" in done.stdout, done.stderr[-2000:]
    assert " good 0" not in done.stdout  # the file as it was written, at the least
