"""Reads spoiled files, told one a line on standard input, within a limit of memory; a line of JSON answers each."""

from __future__ import annotations

import json
import os
import shutil
import sys
import tempfile
import time
import traceback
from pathlib import Path

from addon.core.errors import ScanRelightError
from tests.core.io.hostile import spoiling
from tests.hostile import formats
from tests.hostile.readers import readers


def peak() -> int:
    """Most bytes resident since the last call."""
    with open("/proc/self/status", encoding="ascii", errors="replace") as status:
        told = dict(line.split(":", 1) for line in status)
    with open("/proc/self/clear_refs", "w") as file:
        file.write("5")
    return int(told["VmHWM"].split()[0]) << 10


def attempt(reader, root: Path, victim: str) -> tuple[str, str]:
    """How reading ended, and what was said."""
    try:
        reader.read(root)
    except ScanRelightError as error:
        said = str(error)
        if (
            not said.endswith(".")
            or "\n" in said
            or len(said) > 5000
            or not any(one in said for one in (root.name, "Frame '", victim))
        ):
            return "odd sentence", said[:300]
        return "refused", said
    except Exception:
        return "traceback", traceback.format_exc()[-1500:]
    return "read", ""


def main(limit: int) -> None:
    import resource

    known, good, made = readers(), {}, {}
    place = Path(tempfile.mkdtemp(prefix="hostile-"))
    answers = os.fdopen(os.dup(1), "w")
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)  # Blender's chatter
    resource.setrlimit(resource.RLIMIT_AS, (limit, limit))
    try:
        for line in sys.stdin:
            name, seed = json.loads(line)
            root = place / name.replace(" ", "_").replace("/", "_")
            if name not in made:
                made[name] = known[name].make(root)
                good[name] = made[name].read_bytes()
                how, said = attempt(known[name], root, made[name].name)
                if how == "traceback" or how == "refused" and not name.startswith("result"):
                    raise RuntimeError(f"{name} is not good before it is spoiled: {said}")
            content = (spoiling if seed >= 0 else formats).spoiled(good[name], seed & (1 << 63) - 1)
            made[name].write_bytes(content)
            before, started = peak(), time.process_time()
            how, said = attempt(known[name], root, made[name].name)
            took, most = time.process_time() - started, max(peak() - before, 0)
            print(json.dumps([how, said, took, most, len(content)]), file=answers, flush=True)
            made[name].write_bytes(good[name])
    finally:
        shutil.rmtree(place, ignore_errors=True)


if __name__ == "__main__":
    main(int(sys.argv[1]))
