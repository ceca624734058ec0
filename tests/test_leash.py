"""What ties a run to its starter: events, the wish to stop, the limit on memory. Nothing here needs Blender."""

from __future__ import annotations

import io
import json
import os
import threading

import pytest

from addon import leash
from addon.core.errors import MemoryLimitError
from addon.core.memory import peak_memory
from addon.core.progress import Progress, ProgressEvent
from addon.leash import JsonProgress, Leash, MemoryGuard


def test_events_are_lines_of_json():
    stream = io.StringIO()
    progress = Progress(JsonProgress(stream), weights={"surface": 1, "shading": 3})
    progress.stage("surface")
    progress.done()
    progress.stage("shading")
    events = [json.loads(line) for line in stream.getvalue().splitlines()]
    assert [(one["event"], one["stage"], one["share"]) for one in events] == [
        ("progress", "surface", 0.0),
        ("progress", "surface", 1.0),
        ("progress", "shading", 0.0),
    ]
    assert [one["overall"] for one in events] == pytest.approx([0, 0.25, 0.25])


def test_not_every_event_is_told_but_every_end(monkeypatch):
    now = [0.0]
    monkeypatch.setattr(leash.time, "monotonic", lambda: now[0])
    stream = io.StringIO()
    listener = JsonProgress(stream)
    for k in range(101):
        now[0] = k * leash.EVENT_SECONDS / 10
        listener(ProgressEvent("shading", k / 100, k / 100, None))
    shares = [json.loads(line)["share"] for line in stream.getvalue().splitlines()]
    assert shares[0] == 0 and shares[-1] == 1 and 10 <= len(shares) <= 13


@pytest.mark.parametrize("message", [b"stop\n", b"st|op\n", b"stop", None])
def test_a_word_or_the_end_of_input_stops(message):
    """Once it is wished, the process is ended if the run does not come to a safe point."""
    here, there = os.pipe()
    ended, codes = threading.Event(), []
    rope = Leash(here, end=lambda code: (codes.append(code), ended.set()), grace=0.05)
    assert not rope()
    for part in (message or b"").split(b"|"):
        if part:
            os.write(there, part)
    if message is None:
        os.close(there)
    assert ended.wait(5) and rope() and codes == [130]
    if message is not None:
        os.close(there)
    os.close(here)


def test_other_words_do_not_stop():
    here, there = os.pipe()
    rope = Leash(here, end=lambda code: None, grace=0.0)
    os.write(there, b"go on\n" * 50)
    assert not threading.Event().wait(0.1) and not rope()
    os.close(there)


def test_the_memory_limit_is_one_sentence():
    guard = MemoryGuard(1e-3)
    try:
        for _ in range(100):
            if guard.exceeded:
                break
            threading.Event().wait(0.05)
        with pytest.raises(MemoryLimitError, match=r"memory limit of 0\.001 GB .* finished stages are kept"):
            guard()
        assert guard.sentence.count("\n") == 0
    finally:
        guard.close()


def test_a_run_that_does_not_heed_the_limit_is_ended(monkeypatch):
    monkeypatch.setattr(leash, "GRACE", 0.05)
    said, ended = [], threading.Event()
    guard = MemoryGuard(1e-3, end=lambda sentence: (said.append(sentence), ended.set()))
    assert ended.wait(5) and said == [guard.sentence]


def test_no_limit_is_no_limit():
    guard = MemoryGuard(0)
    assert guard() is False and not guard.exceeded


def test_the_peak_is_of_this_process_alone():
    """A process that a big one starts begins small: else the limit would end every run of a full Blender."""
    import subprocess
    import sys

    if peak_memory() is None:
        pytest.skip("the system does not tell")
    code = (
        "import subprocess, sys; big = bytearray(600_000_000); big[::4096] = b'x' * len(big[::4096]);"
        "subprocess.run([sys.executable, '-c',"
        "'from addon.core.memory import peak_memory; print(peak_memory())'], check=True)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert 1e6 < int(done.stdout) < 300e6
