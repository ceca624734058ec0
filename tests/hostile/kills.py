"""Runs that are killed at any moment, taken up again, and compared with one that was left alone; and other bad days.

Those are a disk that fills at any byte, a network disk whose handle goes stale at any file that is read or written,
several runs into one folder at once, a clock that jumps, another room's result, and a user without rights.

All of them are forks of one process that has imported what a run takes, so that a kill costs a second.
"""

from __future__ import annotations

import builtins
import errno
import hashlib
import io
import itertools
import json
import os
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
SIGNALS = (signal.SIGKILL, signal.SIGTERM, signal.SIGINT, *([signal.SIGHUP] if hasattr(signal, "SIGHUP") else []))
IN_A_ROW = 5
"""Runs that are killed in one folder before one is left to end."""
OPTIONS = (
    "--no-scene --unwrap own --texel-size 0.25 --shading-rays 16 --emitter-rays 8 --specular target --refine 0 "
    "--specular-rays 8 --portal-rays 8 --no-mirrors --no-denoise-mesh --no-refine-poses --threads 2 --quiet"
).split()


def digest(folder: Path) -> dict[str, str]:
    """What a result's files hold, but for those that tell of times and of where they lie."""
    left_out = {"report.json", "report.html", ".lock", "capture.json", "error.log"}
    return {
        path.relative_to(folder).as_posix(): hashlib.sha256(path.read_bytes()).hexdigest()
        for path in sorted(folder.rglob("*"))
        if path.is_file() and path.name not in left_out
    }


class _Raw(io.FileIO):
    """A file on a disk that has room for `left` bytes."""

    left = 0

    def write(self, data) -> int:
        data = bytes(data)[: _Raw.left]
        if not data:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        _Raw.left -= len(data)
        return super().write(data)


def filling(room: int) -> None:
    """Let this process write so many bytes and no more."""
    real, _Raw.left = open, room

    def opened(name, mode="r", *more, **named):
        if mode in ("wb", "xb") and isinstance(name, (str, Path)):
            return io.BufferedWriter(_Raw(name, mode))
        return real(name, mode, *more, **named)

    builtins.open = opened


def failing(at: int, number: int, writing: bool, under: Path) -> None:
    """Let the file number `at` that this process opens, to read or to write, fail with the system's error `number`."""
    real, files = open, itertools.count()

    def opened(name, mode="r", *more, **named):
        ours = isinstance(name, (str, Path)) and under in Path(name).parents
        if ours and writing == any(one in mode for one in "wxa+") and next(files) == at:
            raise OSError(number, os.strerror(number), str(name))
        return real(name, mode, *more, **named)

    builtins.open = io.open = opened


def of_nobody(capture: Path, out: Path) -> None:
    """Make this process one of a user without rights, after a run that imports what that user could not."""
    from scan_relight.addon.cli import main

    main(["recover", str(capture), "--out", str(out), *OPTIONS])
    if os.geteuid() == 0:
        os.setgroups([])
        os.setgid(65534)
        os.setuid(65534)


def jumping() -> None:
    """Let this process's clock go on by hours and back, at every look."""
    real, looks = time.time, itertools.count()
    time.time = lambda: real() + (-1) ** next(looks) * 7200.0


def log_of(out: Path, child: int) -> Path:
    """What a run writes to standard error."""
    return out.with_name(f"{child}.log")


def started(capture: Path, out: Path, prepare: Callable[[], None] = lambda: None) -> int:
    """Start a run in a fork of this process, in a process group of its own; `prepare` is called there first."""
    child = os.fork()
    if child:
        return child
    code = 70
    try:
        os.setsid()
        null = os.open(os.devnull, os.O_RDWR)
        for number in (0, 1):
            os.dup2(null, number)
        os.dup2(os.open(log_of(out, os.getpid()), os.O_WRONLY | os.O_CREAT | os.O_TRUNC), 2)
        from scan_relight.addon.cli import main

        prepare()
        code = main(["recover", str(capture), "--out", str(out), *OPTIONS])
    except KeyboardInterrupt:  # before the run began, or after its end
        code = 130
    finally:
        os._exit(code)


def ended(child: int) -> tuple[int, bool]:
    """Exit code (negative: the signal) of a run, and whether a process of its group is left."""
    _, status = os.waitpid(child, 0)
    try:
        os.killpg(child, 0)
    except (ProcessLookupError, PermissionError):
        return os.waitstatus_to_exitcode(status), False
    return os.waitstatus_to_exitcode(status), True


def until(out: Path, name: str, child: int) -> None:
    """Wait until the file `name` is in a result or its run has ended."""
    while not (out / name).exists() and os.waitid(os.P_PID, child, os.WEXITED | os.WNOHANG | os.WNOWAIT) is None:
        time.sleep(0.002)


def wrong_after(child: int, out: Path, *codes: int) -> list[str]:
    """What a run that was disturbed should not leave, or say, and with which codes it may not end."""
    code, orphan = ended(child)
    log = log_of(out, child)
    said = log.read_text(errors="replace") if log.exists() else ""
    found = ["a process is left"] if orphan else []
    if code not in codes:
        found.append(f"exit code {code}")
    if any(one in said for one in ("Traceback", "Exception ignored", "Unexpected")) or len(said.splitlines()) > 1:
        found.append(f"said {said[-300:]!r}")
    return found


def all_kills(count: int, seed: int, place: Path) -> list[str]:
    """Kill `count` runs, then a bad day of each kind for every ten of them; what was wrong, a line each."""
    from addon.core.stages import STAGES
    from tests.hostile.load import boxes, write

    rng, wrong = random.Random(seed), []
    capture = write(place / "capture", boxes(4), 8, (48, 36), uv=True)
    began = time.monotonic()
    code, _ = ended(started(capture, place / "whole"))
    whole = time.monotonic() - began
    if code:
        return [f"the run that was left alone: {code}, {[one.read_text()[-500:] for one in place.glob('*.log')]}"]
    expected, out = digest(place / "whole"), place / "result"
    for k in range(count):
        number = SIGNALS[k % len(SIGNALS)]
        child = started(capture, out)
        what = ("moment", *STAGES)[k // len(SIGNALS) % (1 + len(STAGES))]  # each signal in each stage
        if what == "moment":
            time.sleep(rng.random() * whole)
        else:  # as it is stored, or a little later, when the next has begun
            until(out, f"stages/{what}.npz", child)
            time.sleep(rng.choice((0, rng.random() * whole / 5)))
        try:
            os.killpg(child, number)
        except ProcessLookupError:  # not yet of a group of its own, or ended
            os.kill(child, number)
        found = wrong_after(child, out, 0, 130, -number)
        wrong += [f"kill {k} by {number.name} at {what}: {one}" for one in found]
        if (k + 1) % IN_A_ROW and k + 1 < count:
            continue
        code, _ = ended(started(capture, out))
        if code or digest(out) != expected:
            names = {name for name in {*digest(out), *expected} if digest(out).get(name) != expected.get(name)}
            wrong.append(f"after kill {k}: exit code {code}, other content of {sorted(names)}")
        shutil.rmtree(out)
    size = sum(path.stat().st_size for path in (place / "whole").rglob("*"))
    for k in range(max(count // 10, 1)):
        room = rng.randrange(size)
        found = wrong_after(started(capture, out, lambda room=room: filling(room)), out, 0, 1)
        several = [started(capture, out) for _ in range(rng.choice((2, 4)))]
        found += [one for child in several for one in wrong_after(child, out, 0, 2)]
        if digest(out) != expected:
            found += ["of several runs at once, none ended well"]
        shutil.rmtree(out / "stages", ignore_errors=True)
        found += wrong_after(started(capture, out, jumping), out, 0)
        if digest(out) != expected:
            found += ["a clock that jumps changes the result"]
        shutil.rmtree(out)
        for writing, number in ((False, errno.ESTALE), (True, errno.ESTALE), (True, errno.ENOSPC)):
            at = rng.randrange(19 if writing else 128)  # so many files a run opens
            prepare = partial(failing, at, number, writing, place)
            disturbed = wrong_after(started(capture, out, prepare), out, 0, 1, 2)
            report = out / "report.json"
            if report.exists() and "be read (" not in report.read_text() and digest(out) != expected:
                disturbed.append("another result, and nothing said")
            found += [f"{errno.errorcode[number]} at file {at}: {one}" for one in disturbed]
            shutil.rmtree(out, ignore_errors=True)
        wrong += [f"bad day {k}, room for {room} bytes: {one}" for one in found]
    return wrong + strange_folders(capture, place, expected)


def strange_folders(capture: Path, place: Path, expected: dict[str, str]) -> list[str]:
    """A result of another room is made anew as a whole; what a user may not read or write is told."""
    from tests.hostile.load import boxes, write

    out, prepare = place / "other", partial(of_nobody, capture, place / "imports")
    place.chmod(0o755)
    other = write(place / "capture of others", boxes(6), 8, (48, 36), uv=True)
    wrong = wrong_after(started(other, out), out, 0) + wrong_after(started(capture, out), out, 0)
    if digest(out) != expected:
        wrong.append("a folder that held another room's result holds another one than an empty folder")
    for path in (out, out / "stages"):
        path.chmod(0o555)
    wrong += wrong_after(started(capture, out, prepare), out, 2)
    if digest(out) != expected:
        wrong.append("a folder without rights was changed")
    (other / "mesh.ply").chmod(0)
    (place / "of all").mkdir()
    (place / "of all").chmod(0o777)
    return wrong + wrong_after(started(other, place / "of all/result", prepare), place / "of all/result", 2)


def run(count: int, seed: int = 0) -> list[str]:
    """Kill `count` runs in a process of its own; what was wrong, a line each."""
    with tempfile.TemporaryDirectory(prefix="hostile-") as place:
        done = subprocess.run(
            [sys.executable, "-m", "tests.hostile.kills", str(count), str(seed), place],
            cwd=ROOT, capture_output=True, text=True,
        )  # fmt: skip
    return json.loads(done.stdout) if done.returncode == 0 else [done.stderr[-2000:]]


if __name__ == "__main__":
    import scan_relight.addon.core.pipeline.recover
    import scan_relight.addon.core.pipeline.run  # noqa: F401

    print(json.dumps(all_kills(int(sys.argv[1]), int(sys.argv[2]), Path(sys.argv[3]))))
