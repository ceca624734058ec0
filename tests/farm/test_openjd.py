"""Open Job Description: the template is one, and run by the reference runner gives what one machine gives."""

from __future__ import annotations

import json
import shlex
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

import pytest

from addon import cli
from tests.farm.conftest import OPTIONS, WORKER, assert_same

if find_spec("openjd") is None:
    pytest.skip("NO openjd-cli HERE: OPEN JOB DESCRIPTION IS NOT TESTED", allow_module_level=True)
OPENJD = [sys.executable, "-m", "openjd"]
ROOT = Path(__file__).resolve().parent.parent.parent


def openjd(*argv) -> str:
    done = subprocess.run([*OPENJD, *map(str, argv)], capture_output=True, text=True, cwd=ROOT, timeout=300)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@pytest.mark.slow
@pytest.mark.once
@pytest.mark.parametrize("blocks", [1, 2])
def test_checked_and_run(capture, whole, tmp_path, blocks):
    argv = ["submit", "--engine", "openjd", str(capture), "--out", str(tmp_path), "--blocks", str(blocks), *OPTIONS]
    assert cli.main([*argv, "--program", shlex.join(WORKER), "--quiet"]) == 0
    farm = tmp_path / "capture" / "farm"
    assert "passes validation" in openjd("check", farm / "openjd.json")
    if blocks == 1:
        given = f"file://{farm / 'openjd-parameters.json'}"
        openjd("run", farm / "openjd.json", "--job-param", given, "--step", "write", "--run-dependencies")
        assert_same(tmp_path / "capture", whole)


def test_what_would_be_a_template_in_a_name_is_refused(tmp_path, capsys):
    (tmp_path / "room").mkdir()
    argv = ["submit", "--engine", "openjd", str(tmp_path / "room"), "--out", str(tmp_path / "out")]
    assert cli.main([*argv, "--convention", "{{Param.X}}"]) == 2
    assert "{{" in capsys.readouterr().err
    assert cli.main([*argv, "--convention", "{x}"]) == 0
    assert "--convention={x}" in json.dumps(json.loads((tmp_path / "out/room/farm/openjd.json").read_text()))
