"""PNG, JPEG and TIFF files spoiled in every way, read in a process of its own: a crash of C++ takes all along."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from addon.core.io.png import write_png
from tests.core.capture.hostile.cases import png_content, tiff_content
from tests.core.capture.hostile.test_exr_spoiled import COUNT, ROOT, SEED, spoiled

pillow = pytest.importorskip("PIL.Image")
PICTURE = np.random.default_rng(5).integers(0, 256, (33, 41, 3), np.uint8)

CHILD = """
import resource, signal, sys
from addon.core.io.exif import exif_exposure
from addon.core.io.oiio import coded_header, read_coded
from addon.core.errors import BadInputError
resource.setrlimit(resource.RLIMIT_AS, (3 << 30, 3 << 30))
good = 0
for path in sys.argv[1:]:
    print(path, file=sys.stderr, flush=True)
    signal.alarm(10)  # a hang ends the process
    for read in (coded_header, exif_exposure, read_coded):
        try:
            read(path)
            good += read is read_coded
        except BadInputError as error:
            assert path in str(error) and str(error).endswith(".") and "\\n" not in str(error), str(error)
status = dict(line.split(":", 1) for line in open("/proc/self/status"))
assert int(status["VmHWM"].split()[0]) < 400_000, "too much memory"
print("all", len(sys.argv) - 1, "good", good)
"""

KINDS = {
    "png": lambda path: write_png(path, PICTURE.astype(np.uint16) * 257),
    "interlaced.png": lambda path: path.write_bytes(png_content()),
    "palette.png": lambda path: pillow.fromarray(PICTURE).convert("P").save(path),
    "jpg": lambda path: pillow.fromarray(PICTURE).save(path),
    "progressive.jpg": lambda path: pillow.fromarray(PICTURE).save(path, progressive=True),
    "tif": lambda path: path.write_bytes(tiff_content()),
    **{
        f"{name}.tif": lambda path, name=name: pillow.fromarray(PICTURE).save(path, compression=name)
        for name in ("tiff_lzw", "tiff_adobe_deflate", "packbits", "jpeg")
    },
    "float.tif": lambda path: pillow.fromarray(PICTURE[..., 0].astype(np.float32)).save(path, compression="tiff_lzw"),
}


@pytest.mark.skipif(not Path("/proc/self/status").exists(), reason="this system does not tell a process's memory")
@pytest.mark.parametrize("kind", KINDS)
def test_spoiled(kind, tmp_path):
    paths = [tmp_path / f"{i}.{kind}" for i in range(COUNT + 1)]
    KINDS[kind](paths[0])
    rng = np.random.default_rng(SEED)
    for path in paths[1:]:
        path.write_bytes(spoiled(paths[0].read_bytes(), 400, rng))
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
