"""A small room, recovered by one process; what farms do of it has to be the same, byte by byte."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from addon import cli
from addon.core.stages import RUN_STAGES
from tests.core.on_disk import OnDisk

pytest.importorskip("xatlas")
ROOT = Path(__file__).resolve().parent.parent.parent
OPTIONS = (
    "--no-scene --unwrap xatlas --texel-size 0.2 --shading-rays 64 --emitter-rays 16 --specular-rays 16 --threads 1"
).split()
PROGRAM = f"import sys; sys.path.insert(0, {str(ROOT)!r}); from addon import cli"
WORKER = [sys.executable, "-c", f"{PROGRAM}; sys.exit(cli.main())"]
"""A process of its own for one command, wherever it is started."""


@pytest.fixture(scope="session")
def capture(tmp_path_factory) -> Path:
    return OnDisk(tmp_path_factory.mktemp("farm") / "capture").root


@pytest.fixture(scope="session")
def whole(capture, tmp_path_factory) -> Path:
    """The result of a run on one machine."""
    result = tmp_path_factory.mktemp("whole") / "result"
    assert cli.main(["recover", str(capture), "--out", str(result), "--quiet", *OPTIONS]) == 0
    return result


def unit(capture: Path, result: Path, stage: str, *more: str) -> list[str]:
    return ["stage", str(capture), "--out", str(result), "--stage", stage, "--quiet", *OPTIONS, *more]


def do(capture: Path, result: Path, *stages: str) -> None:
    """Do units of work in this process."""
    for stage in stages or RUN_STAGES:
        name, _, block = stage.partition(" ")
        assert cli.main(unit(capture, result, name, *(["--block", block] if block else []))) == 0, stage


def start(*argv: str, before: str = "", **how) -> subprocess.Popen:
    """Start a command in a process of its own; `before` is run in it first."""
    program = [sys.executable, "-c", f"{PROGRAM}\n{before}\nsys.exit(cli.main())"]
    return subprocess.Popen([*program, *argv], cwd=ROOT, stderr=subprocess.PIPE, text=True, **how)


def contents(result: Path) -> dict[str, bytes]:
    """All files of a result but those that tell the time."""
    files = [path for path in sorted(result.rglob("*")) if path.is_file() and "farm" not in path.parts]
    told = {path.relative_to(result).as_posix(): path.read_bytes() for path in files}
    return {name: content for name, content in told.items() if name not in ("report.json", "capture.json", ".lock")}


def assert_same(result: Path, whole: Path) -> None:
    """What a farm left is what one machine leaves: the same files, the same bytes, and nothing else."""
    found, wanted = contents(result), contents(whole)
    assert found.keys() == wanted.keys()
    assert not [name for name in wanted if found[name] != wanted[name]]
    assert len(wanted) > 10
