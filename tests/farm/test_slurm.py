"""Slurm, a real one of one machine: rooms as chains of jobs."""

from __future__ import annotations

import getpass
import json
import os
import secrets
import shlex
import shutil
import socket
import subprocess
import time
from pathlib import Path

import pytest

from addon import cli
from addon.farm import slurm
from addon.farm.plan import Room
from tests.farm.conftest import OPTIONS, WORKER, assert_same

DAEMONS = ("munged", "slurmctld", "slurmd", "sbatch")
CONFIGURATION = """
ClusterName=test
SlurmctldHost={host}(127.0.0.1)
SlurmUser={user}
SlurmdUser={user}
AuthType=auth/munge
AuthInfo=socket={folder}/munge.socket
CredType=cred/munge
SlurmctldPort={port}
SlurmdPort={other}
StateSaveLocation={folder}/state
SlurmdSpoolDir={folder}/spool
SlurmctldPidFile={folder}/slurmctld.pid
SlurmdPidFile={folder}/slurmd.pid
SlurmctldLogFile={folder}/slurmctld.log
SlurmdLogFile={folder}/slurmd.log
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SelectType=select/cons_tres
SelectTypeParameters=CR_Core
SchedulerParameters=sched_interval=1,batch_sched_delay=0
ReturnToService=2
MailProg=/bin/true
NodeName={host} NodeAddr=127.0.0.1 CPUs=2 RealMemory=1000 State=UNKNOWN
PartitionName=main Nodes=ALL Default=YES MaxTime=INFINITE State=UP
"""


def free_port() -> int:
    with socket.socket() as one:
        one.bind(("127.0.0.1", 0))
        return one.getsockname()[1]


def wait_for(true, what: str, seconds: float = 120) -> None:
    end = time.monotonic() + seconds
    while not true():
        assert time.monotonic() < end, what
        time.sleep(0.2)


@pytest.fixture(scope="session")
def cluster(tmp_path_factory):
    """Its folder."""
    patch = pytest.MonkeyPatch()
    patch.setenv("PATH", f"{os.environ['PATH']}{os.pathsep}/usr/sbin")
    if missing := [one for one in DAEMONS if shutil.which(one) is None]:
        pytest.skip(f"NO SLURM HERE ({', '.join(missing)} missing): SUBMITTING TO IT IS NOT TESTED")
    folder = tmp_path_factory.mktemp("slurm")
    for part in ("state", "spool"):
        (folder / part).mkdir()
    key = folder / "munge.key"
    key.write_bytes(secrets.token_bytes(128))
    key.chmod(0o600)
    told = {"folder": folder, "host": socket.gethostname().split(".")[0], "user": getpass.getuser()}
    (folder / "slurm.conf").write_text(CONFIGURATION.format(port=free_port(), other=free_port(), **told))
    patch.setenv("SLURM_CONF", str(folder / "slurm.conf"))
    files = {"key-file": "munge.key", "socket": "munge.socket", "pid-file": "munge.pid", "log-file": "munge.log"}
    munge = [f"--{name}={folder / file}" for name, file in (files | {"seed-file": "munge.seed"}).items()]
    programs = (
        ["munged", "--foreground", "--force", *munge],
        ["slurmctld", "-D"],
        ["slurmd", "-D", "-N", told["host"]],
    )
    running = []
    try:
        for command in programs:
            log = (folder / f"{command[0]}.out").open("wb")
            running.append(subprocess.Popen(command, stdout=log, stderr=log))
            log.close()
            if command[0] == "munged":
                wait_for((folder / "munge.socket").exists, "munged did not start", 20)
        try:
            wait_for(lambda: "idle" in ask("sinfo", "--noheader", "--format=%T"), "no node", 30)
        except AssertionError:
            logs = "".join(
                path.read_text(errors="replace")[-1500:] for path in folder.glob("*.*") if path.stat().st_size
            )
            pytest.skip(f"SLURM CAN'T BE STARTED HERE: SUBMITTING TO IT IS NOT TESTED\n{logs[-3000:]}")
        yield folder
    finally:
        for one in reversed(running):
            one.terminate()
            one.wait(30)
        patch.undo()


def ask(*command: str) -> str:
    return subprocess.run(command, capture_output=True, text=True, check=False).stdout


def submit(*argv: str) -> int:
    how = ["--engine", "slurm", "--program", shlex.join(WORKER), "--time", "10", "--partition", "main", "--cpus", "1"]
    return cli.main(["submit", *how, *argv, *OPTIONS])


def idle() -> bool:
    return not ask("squeue", "--noheader", "--me")


@pytest.mark.slow
@pytest.mark.once
def test_rooms_are_chains_and_one_that_fails_stops_no_other(cluster, capture, whole, tmp_path, capsys):
    broken = tmp_path / "broken"
    shutil.copytree(capture, broken)
    (broken / "mesh.ply").unlink()
    results = tmp_path / "re sults"
    assert submit(str(broken), str(tmp_path / "missing"), str(capture), "--out", str(results), "--blocks", "2") == 2
    out, err = capsys.readouterr()
    assert out.count(": jobs ") == 2 and "'missing' was not handed over" in err
    wait_for(idle, "the queue does not become empty")
    logs = "\n".join(path.read_text() for path in results.glob("*/farm/*.log"))
    assert_same(results / "capture", whole)
    assert cli.main(["status", *map(str, sorted(results.iterdir())), "--json"]) == 1
    rooms = {one["room"]: one for one in json.loads(capsys.readouterr().out)["rooms"]}
    assert rooms["capture"]["state"] == "done", logs
    assert rooms["broken"]["state"] == "failed" and rooms["broken"]["stage"] == "surface"
    assert "mesh.ply" in rooms["broken"]["error"]


def test_what_slurm_refuses_is_told(cluster, capture, tmp_path, capsys):
    assert submit(str(capture), "--out", str(tmp_path), "--partition", "nowhere") == 2
    err = capsys.readouterr().err
    assert "Slurm refused" in err and "partition" in err and err.count("\n") == 1
    assert idle()


def test_without_slurm_it_is_told(capture, tmp_path, capsys, monkeypatch):
    monkeypatch.setenv("PATH", str(tmp_path))
    assert submit(str(capture), "--out", str(tmp_path / "out")) == 2
    assert "'sbatch' can't be run" in capsys.readouterr().err


def test_the_script_holds_names_of_all_kinds(tmp_path):
    """What a shell makes of the script: the command, word by word."""
    program = tmp_path / "odd $HOME 'x'"
    program.write_text('#!/bin/sh\nfor word in "$@"; do printf "%s\\n" "$word"; done\n')
    program.chmod(0o755)
    room = Room(Path("/c a"), Path("/r `x`"), 3, (str(program),), ("--convention=$(x);\\",), ("specular",))
    for task in room.tasks():
        script = tmp_path / "script.sh"
        script.write_text(slurm.script_of(room, task, {"mem": "4G"}))
        told = subprocess.run(
            ["sh", script], capture_output=True, text=True, env={"SLURM_ARRAY_TASK_ID": "2"}, check=True
        )
        block = "2/3" if task.block else ""
        assert told.stdout.splitlines() == room.command(task.stage, block)[1:]
        assert '#SBATCH --mem="4G"' in script.read_text()
        assert ('#SBATCH --array="1-3"' in script.read_text()) == bool(task.block)
