"""A unit of work: the same bytes as on one machine, whatever happens to the workers."""

from __future__ import annotations

import json
import resource
import shutil
import signal
from pathlib import Path

import pytest

from addon import cli
from addon.core.stages import RUN_STAGES, STAGES
from tests.farm.conftest import assert_same, do, start, unit

DIES = """
import os, pathlib, signal
from addon.core import atomic
replace = os.replace
def die(source, target):
    if pathlib.Path(target).name == {target!r}:
        os.kill(os.getpid(), signal.SIGKILL)
    replace(source, target)
atomic.os.replace = die
"""
"""The worst moment: all is computed and written, and not yet in its place."""
AN_HOUR_ON = "import time; now = time.time; time.time = lambda: now() + 3600"


def test_stage_by_stage_is_as_on_one_machine(capture, whole, tmp_path):
    do(capture, tmp_path / "result")
    do(capture, tmp_path / "result")  # twice: all is there
    assert_same(tmp_path / "result", whole)


def test_nothing_is_done_before_its_time(capture, tmp_path, capsys):
    assert cli.main(unit(capture, tmp_path / "result", "shading")) == 2
    assert "no stage 'surface'" in capsys.readouterr().err
    assert not list((tmp_path / "result" / "stages").iterdir())


def test_what_other_settings_made_is_not_taken(capture, whole, tmp_path, capsys):
    result = shutil.copytree(whole, tmp_path / "result")
    assert cli.main(unit(capture, result, "specular", "--texel-size", "0.3")) == 2
    assert "no stage 'surface' of this capture, these settings" in capsys.readouterr().err


@pytest.mark.slow
@pytest.mark.once
@pytest.mark.parametrize("stage", RUN_STAGES)
def test_killed_and_done_again(capture, whole, tmp_path, stage):
    result = shutil.copytree(whole, tmp_path / "result")
    later = RUN_STAGES[RUN_STAGES.index(stage) :]
    for name in set(later) & set(STAGES):
        (result / "stages" / f"{name}.npz").unlink()
    target = "materials.json" if stage == "write" else f"{stage}.npz"
    worker = start(*unit(capture, result, stage), before=DIES.format(target=target))
    worker.communicate()
    assert worker.returncode == -signal.SIGKILL
    assert (result / "farm" / f"{stage}.lock").exists() and list(result.rglob(".partial-*"))
    do(capture, result, *later)
    assert_same(result, whole)


@pytest.mark.slow
@pytest.mark.once
def test_a_full_disk_in_one_worker(capture, whole, tmp_path):
    result = tmp_path / "result"
    do(capture, result, "surface")

    def small():
        resource.setrlimit(resource.RLIMIT_FSIZE, (1 << 15, resource.RLIM_INFINITY))

    worker = start(*unit(capture, result, "lit_diffuse"), preexec_fn=small)
    _, told = worker.communicate()
    assert worker.returncode == 1 and "can't be written" in told and told.count("\n") == 1
    assert [path.name for path in (result / "stages").iterdir()] == ["surface.npz"]
    assert "can't be written" in json.loads((result / "farm" / "lit_diffuse.json").read_text())["error"]
    do(capture, result, *RUN_STAGES[1:])
    assert_same(result, whole)


@pytest.mark.slow
@pytest.mark.once
def test_two_workers_with_the_same_unit_and_a_clock_that_is_an_hour_off(capture, whole, tmp_path):
    result = tmp_path / "result"
    for stage in RUN_STAGES:
        workers = [start(*unit(capture, result, stage), before=before) for before in ("", AN_HOUR_ON)]
        for worker in workers:
            assert worker.communicate()[1] == "" and worker.returncode == 0, stage
    assert_same(result, whole)


@pytest.mark.slow
@pytest.mark.once
def test_blocks_side_by_side_one_killed_one_twice_one_never(capture, whole, tmp_path):
    result = tmp_path / "result"
    do(capture, result, *STAGES[:3])
    blocks = [("1/4", DIES.format(target="specular-1-of-4.npz")), ("2/4", ""), ("2/4", AN_HOUR_ON), ("3/4", "")]
    workers = [start(*unit(capture, result, "specular", "--block", one), before=how) for one, how in blocks]
    told = [worker.communicate()[1] for worker in workers]
    assert [worker.returncode for worker in workers] == [-signal.SIGKILL, 0, 0, 0], told
    stored = {path.name for path in (result / "stages").glob("specular*")}
    assert stored == {"specular-2-of-4.npz", "specular-3-of-4.npz"}
    do(capture, result, "specular 1/4", "specular", "write")
    assert_same(result, whole)


@pytest.mark.slow
def test_what_blocks_found_is_what_is_taken(capture, whole, tmp_path, monkeypatch):
    """With all blocks there, what joins them looks at no object again."""
    from addon.core.pipeline import choose_models

    result = tmp_path / "result"
    do(capture, result, *STAGES[:3], "specular 1/2", "specular 2/2")
    monkeypatch.setattr(choose_models, "_look", None)
    do(capture, result, "specular")
    monkeypatch.undo()
    do(capture, result, "write")
    assert_same(result, whole)


def test_a_stage_that_is_not_divided_is_told(capture, tmp_path, capsys):
    assert cli.main(unit(capture, tmp_path / "result", "shading", "--block=1/2")) == 2
    assert "Stage 'shading' can't be divided" in capsys.readouterr().err
    assert not Path(tmp_path / "result").exists()


def test_bad_blocks_are_told(capture, tmp_path, capsys):
    for block in ("0/2", "3/2", "1", "a/b", "-1/2"):
        assert cli.main(unit(capture, tmp_path / "result", "specular", f"--block={block}")) == 2
        assert "is no block" in capsys.readouterr().err
    assert not Path(tmp_path / "result").exists()


def test_the_capture_is_no_result_folder(capture, capsys):
    assert cli.main(unit(capture, capture, "surface")) == 2
    assert "is the capture itself" in capsys.readouterr().err and not (capture / "farm").exists()
