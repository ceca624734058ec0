"""Time and memory of runs over captures that are large in one way."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import time
from pathlib import Path

from tests.hostile.load import LOADS

ROOT = Path(__file__).resolve().parents[2]
RUN = "import sys; from scan_relight.addon.cli import main; sys.exit(main(sys.argv[1:]))"


def measure(place: str, only: str = "") -> None:
    """Recover each of `LOADS` at the preset draft, or only read it, and print how it ended as a row of a table."""
    print("| capture | ended | processor s | wall s | peak GiB |\n|---|---|---|---|---|")
    for k, (name, make) in enumerate(LOADS.items()):
        if only not in name:
            continue
        root, out = Path(place) / f"load{k}", Path(place) / f"result{k}"
        for one in (root, out):
            shutil.rmtree(one, ignore_errors=True)
        make(root)
        began = time.monotonic()
        words = ["recover", str(root), "--out", str(out), "--preset", "draft", "--quiet"]
        words = ["info", str(root)] if "(info)" in name else words
        pipes = {"stdout": subprocess.DEVNULL, "stderr": subprocess.PIPE, "text": True}
        with subprocess.Popen([sys.executable, "-c", RUN, *words], cwd=ROOT, **pipes) as run:
            said = run.stderr.read()
            _, status, used = os.wait4(run.pid, 0)
            run.returncode = os.waitstatus_to_exitcode(status)
        ended = "finished" if run.returncode == 0 else f"exit code {run.returncode}: {said.strip()[-200:]}"
        peak = used.ru_maxrss / (1 << 20)
        seconds = used.ru_utime + used.ru_stime
        print(f"| {name} | {ended} | {seconds:.0f} | {time.monotonic() - began:.0f} | {peak:.2f} |", flush=True)
        for one in (root, out):
            shutil.rmtree(one, ignore_errors=True)
