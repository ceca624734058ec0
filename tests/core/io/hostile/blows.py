"""Spoils a picture's file in every way, and reads what comes of it in a process of its own, as C++ may crash."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

ROOT = Path(__file__).resolve().parents[4]
COUNT, SEED = (int(os.environ.get(f"HOSTILE_{name}", usual)) for name, usual in (("EXAMPLES", "25"), ("SEED", "0")))
READERS = {
    "exr": ("from addon.core.io.exr import exr_note, read_exr, read_header", "read_header, exr_note, read_exr"),
    "coded": (
        "from addon.core.io.exif import exif_exposure\nfrom addon.core.io.oiio import coded_header, read_coded",
        "coded_header, exif_exposure, read_coded",
    ),
    "phone": (
        "from functools import partial\nfrom addon.core.io.exif import exif_exposure\n"
        "from addon.core.io.pictures import picture_orientation, picture_size, read_picture",
        "picture_size, picture_orientation, exif_exposure, partial(read_picture, transfer='linear')",
    ),
}
"""What a kind of picture is read with, the reader of its pixels last."""
CHILD = """
import resource, signal, sys
from pathlib import Path
from addon.core.errors import BadInputError
{imports}
resource.setrlimit(resource.RLIMIT_AS, (3 << 30, 3 << 30))
readers = {readers}
good = 0
for path in sys.argv[1:]:
    print(path, file=sys.stderr, flush=True)
    signal.alarm(10)  # a hang ends the process
    for read in readers:
        try:
            read(Path(path))
            good += read is readers[-1]
        except BadInputError as error:
            assert path in str(error) and str(error).endswith(".") and "\\n" not in str(error), str(error)
status = dict(line.split(":", 1) for line in open("/proc/self/status"))
assert int(status["VmHWM"].split()[0]) < 400_000, "too much memory"
print("all", len(sys.argv) - 1, "good", good)
"""

tells_memory = pytest.mark.skipif(
    not Path("/proc/self/status").exists(), reason="this system does not tell a process's memory"
)


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


def read_spoiled(path: Path, head: int, kind: str) -> None:
    """Assert that each of `COUNT` spoiled copies of the good file `path` is read or refused with one sentence.

    Parameters
    ----------
    path : Path
    head : int
        Bytes at the front that most blows go to.
    kind : str
        "exr", "coded" or "phone": the readers.
    """
    rng = np.random.default_rng(SEED)
    paths = [path, *(path.with_name(f"{i}.{path.name}") for i in range(COUNT))]
    for one in paths[1:]:
        one.write_bytes(spoiled(path.read_bytes(), head, rng))
    imports, readers = READERS[kind]
    done = subprocess.run(
        [sys.executable, "-c", CHILD.format(imports=imports, readers=readers), *map(str, paths)],
        cwd=ROOT,
        capture_output=True,
        timeout=300,
        text=True,
        errors="replace",
    )
    assert done.returncode == 0 and f"all {len(paths)}" in done.stdout, done.stderr[-2000:]
    assert " good 0" not in done.stdout  # the file as it was written, at the least
