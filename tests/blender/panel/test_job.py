"""Jobs: what they hear, how they stop, and whole runs through the command line of the checkout."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time

import pytest

pytest.importorskip("bpy")

from addon.bridge.job import job as jobs
from addon.bridge.job.command import command
from addon.bridge.job.job import DONE, FAILED, STOPPED, Job
from addon.core.results.room_file import read_room

QUICK = (
    "--shading-rays 16 --specular-rays 4 --emitter-rays 2 --portal-rays 0 --refine 0 --texel-size 0.12 --atlas-size 512"
    " --no-mirrors --threads 1"
).split()
DEAF = "import signal, sys, time; signal.signal(signal.SIGINT, signal.SIG_IGN); print('up', flush=True); time.sleep(60)"


def python(code):
    return [sys.executable, "-c", code]


def until(true, seconds=60):
    """Wait until `true()`; fail if that never comes."""
    end = time.monotonic() + seconds
    while not true():
        assert time.monotonic() < end, "it never came"
        time.sleep(0.02)


def recover(capture, result, *more):
    return command(
        ["recover", str(capture), "--out", str(result), *QUICK, "--progress", "json", "--stop-with-stdin", *more]
    )


def alive(pid):
    try:
        with open(f"/proc/{pid}/stat") as stat:
            return stat.read().rsplit(")", 1)[1].split()[0] != "Z"
    except FileNotFoundError:
        return False


def test_events_arrive_and_other_words_are_kept():
    lines = [
        {"event": "progress", "stage": "shading", "share": 0.5, "overall": 0.25, "seconds_left": 7.0},
        {"event": "warning", "text": "This was odd."},
        {"event": "done", "seconds": 3.0, "result": "there"},
    ]
    code = "print('Blender 5.2'); print('{\"event\": broken')\n" + "".join(
        f"print({json.dumps(line)!r})\n" for line in lines
    )
    job = Job(python(code), capture_folder="here")
    assert job.wait(30) and job.state == DONE and job.sentence == ""
    assert (job.stage, job.share, job.overall) == ("shading", 0.5, 0.25) and 0 <= job.seconds_left <= 7
    assert job.warnings == ["This was odd."] and job.answer == {"seconds": 3.0, "result": "there"}
    assert "Blender 5.2" in job.text and job.facts == {"capture_folder": "here"} and not job.running


def test_a_failure_is_the_command_lines_own_sentence():
    job = Job(
        python(
            "import sys; print('noise\\nscan-relight: The mesh is empty; scan again.\\n', file=sys.stderr);sys.exit(2)"
        )
    )
    assert job.wait(30) and (job.state, job.sentence) == (FAILED, "The mesh is empty; scan again.")


@pytest.mark.parametrize(
    ("code", "sentence"),
    [
        ("import os; os._exit(7)", "The run ended with code 7: it left no word"),
        ("import os, signal; os.kill(os.getpid(), signal.SIGKILL)", "most likely because memory ran out"),
    ],
)
@pytest.mark.skipif(os.name == "nt", reason="signals")
def test_an_end_without_a_word_is_told(code, sentence):
    job = Job(python(code))
    assert job.wait(30) and job.state == FAILED and sentence in job.sentence


def test_a_polite_job_ends_itself():
    job = Job(python("import sys; sys.exit(130 if sys.stdin.readline() == 'stop\\n' else 3)"))
    job.stop()
    assert job.stopping or not job.running
    assert job.wait(30) and job.state == STOPPED and "finished stages are kept" in job.sentence


def test_a_deaf_job_is_ended():
    job = Job(python(DEAF))
    job.stop()
    job.stop()  # a second wish changes nothing
    assert job.wait(30) and job.state == STOPPED and not alive(job._process.pid)


def test_there_is_one_current_run():
    try:
        first = jobs.begin(python(DEAF))
        assert jobs.current() is jobs.running() is first
        with pytest.raises(RuntimeError, match="a run is going on"):
            jobs.begin(python(DEAF))
        jobs.forget()
        assert jobs.current() is None and first.wait(30)
    finally:
        jobs.forget()


def test_end_all_leaves_none():
    some = [Job(python(DEAF)) for _ in range(2)]
    jobs.end_all()
    assert all(one.wait(30) and not alive(one._process.pid) for one in some)


@pytest.mark.slow
def test_no_setting_of_this_blender_reaches_a_job(grey_capture):
    """It finds package and wheels wherever it is started, and knows the capture."""
    job = Job(command(["info", str(grey_capture), "--json"]))
    assert job.wait(60) and job.state == DONE
    assert json.loads(job.text)["frames"] == 3


@pytest.mark.slow
def test_stopped_in_the_middle_then_finished(grey_capture, tmp_path):
    """What was finished stays and the next run does not do it again; its result can be brought into a scene."""
    first = Job(recover(grey_capture, tmp_path))
    until(lambda: first.stage == "shading" or not first.running)
    assert first.running
    first.stop()
    assert first.wait(30) and first.state == STOPPED
    stored = sorted(path.stem for path in (tmp_path / "stages").glob("*.npz"))
    assert {"surface", "lit_diffuse"} <= set(stored) and "specular" not in stored
    assert not (tmp_path / "report.json").exists()
    second = Job(recover(grey_capture, tmp_path))
    assert second.wait(300) and second.state == DONE, second.sentence
    report = json.loads((tmp_path / "report.json").read_text())
    assert {name: report["stages"][name]["stored"] for name in ("surface", "lit_diffuse")} == {
        "surface": True,
        "lit_diffuse": True,
    }
    assert second.answer["until"] == "write" and second.warnings == report["warnings"]
    room = read_room(tmp_path)
    assert len(room.materials) == len(room.capture.instances) == 15 and room.atlas_uv.any()
    again = Job(recover(grey_capture, tmp_path, "--from-stage", "shading", "--until", "shading"))
    assert again.wait(300) and again.state == DONE, again.sentence
    assert (tmp_path / "stages" / "shading.npz").stat().st_mtime > room_time(tmp_path)
    assert not (tmp_path / "stages" / "specular.npz").exists()


def room_time(folder):
    return (folder / "room.npz").stat().st_mtime


@pytest.mark.skipif(sys.platform != "linux", reason="/proc")
def test_a_job_ends_with_its_starter(grey_capture, tmp_path):
    """A Blender that crashes leaves nothing that goes on for hours."""
    code = (
        "import json, os, sys, time\nfrom addon.bridge.job.job import Job\nimport bpy\n"
        "job = Job(json.loads(sys.argv[1]))\n"
        "while not job.stage: time.sleep(0.02)\n"
        "print(job._process.pid, flush=True)\nos.kill(os.getpid(), 9)"
    )
    done = subprocess.run(
        [sys.executable, "-c", code, json.dumps(recover(grey_capture, tmp_path))], capture_output=True, text=True
    )
    pid = int(done.stdout.split()[-1])
    until(lambda: not alive(pid), 30)
    assert not (tmp_path / "report.json").exists()


@pytest.mark.slow
def test_the_memory_limit_ends_a_job(grey_capture, tmp_path):
    job = Job(recover(grey_capture, tmp_path, "--memory-limit", "0.05"))
    assert job.wait(120) and job.state == FAILED
    assert "memory limit of 0.05 GB" in job.sentence and len(job.sentence.splitlines()) == 1
