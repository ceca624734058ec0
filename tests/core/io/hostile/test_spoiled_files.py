"""Every file of a capture spoiled in every way: a good result, or one sentence, soon and in little memory.

HOSTILE_EXAMPLES=2000 tries as many of each kind, other ones each time.
"""

from __future__ import annotations

import contextlib
import json
import math
import os
import signal
import time
import tracemalloc
from pathlib import Path

import pytest

pytest.importorskip("hypothesis", reason="hypothesis is not installed: spoiled files are not tried")
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from addon.core.errors import BadInputError
from addon.core.io.layout import Reading
from addon.core.io.pixels import read_pixels
from addon.core.io.read import describe, read_capture
from tests.core.io.hostile.cases import CASES, fresh
from tests.core.io.hostile.spoiling import spoiled, words_spoiled

WIDER = int(os.environ.get("HOSTILE_EXAMPLES", "0"))
EXAMPLES = WIDER or 15
HANG = 10
"""Seconds from which on reading a file of a few thousand bytes is a hang."""
MEMORY = 200 << 20
"""Bytes that a capture of a few thousand may take: headers may claim 64 MiB of pixels before they are doubted."""
SETTINGS = settings(
    max_examples=EXAMPLES, deadline=None, derandomize=not WIDER, database=None, suppress_health_check=list(HealthCheck)
)


@contextlib.contextmanager
def bounded():
    """Fail on a hang, and on memory out of all proportion."""

    def hang(*_):
        pytest.fail(f"no answer within {HANG} s")

    before = signal.signal(signal.SIGALRM, hang) if hasattr(signal, "SIGALRM") else None
    if before is not None:
        signal.alarm(HANG)
    tracemalloc.start()
    try:
        yield
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
        if before is not None:
            signal.alarm(0)
            signal.signal(signal.SIGALRM, before)
    assert peak < MEMORY, f"{peak >> 20} MiB"


def attempt(root: Path, victim: Path, reading: Reading) -> None:
    """Read all that a run would read; whatever is wrong has to be told as it should."""
    with bounded():
        try:
            capture = read_capture(root, reading)
        except BadInputError as error:
            check_sentence(str(error), root, victim)
            return
        for warning in capture.warnings:
            assert "\n" not in warning and len(warning) < 5000, warning
        facts = describe(capture)
        assert math.isfinite(facts["area_m2"])
        assert len(capture.mesh.triangles) and (capture.frames or capture.mesh.lit is not None)
        for frame in capture.frames:
            try:
                pixels = read_pixels(frame)
            except BadInputError as error:
                check_sentence(str(error), root, victim)
            else:
                assert pixels.radiance.shape == (frame.camera.height, frame.camera.width, 3)
                assert ((pixels.radiance >= 0) & (pixels.radiance < math.inf)).all()


def check_sentence(text: str, root: Path, victim: Path) -> None:
    assert text.endswith(".") and "\n" not in text and len(text) < 5000, text[:500]
    assert victim.name in text or str(root) in text or "Frame '" in text, text


@pytest.mark.slow
@pytest.mark.once
@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
def test_spoiled(case, tmp_path):
    root = tmp_path / "capture"
    victim, reading = fresh(case, root)
    good = victim.read_bytes()
    read_capture(root, reading)  # good, before it is spoiled
    attempt(root, victim, reading)
    first = time.time_ns() if WIDER else 0
    contents = (spoil(good, seed) for seed in range(first, first + EXAMPLES) for spoil in (spoiled, words_spoiled))
    for content in (b"", *contents):
        victim.write_bytes(content)
        attempt(root, victim, reading)


@pytest.mark.once
@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
@pytest.mark.parametrize("what", ["folder", "loop", "absent", "dangling", "zeros", "pipe"])
def test_what_is_no_file(case, what, tmp_path):
    root = tmp_path / "capture"
    victim, reading = fresh(case, root)
    victim.unlink()
    try:
        if what == "folder":
            victim.mkdir()
        elif what == "loop":
            victim.symlink_to(victim)
        elif what == "dangling":
            victim.symlink_to(tmp_path / "absent")
        elif what == "zeros":
            victim.write_bytes(bytes(100_000))
        elif what == "pipe":
            os.mkfifo(victim)
    except (OSError, AttributeError) as error:
        pytest.skip(f"this system makes no {what}: {error}")
    attempt(root, victim, reading)


@pytest.mark.slow
@pytest.mark.once
def test_any_name_of_a_picture(tmp_path):
    root = tmp_path / "capture"
    victim, reading = fresh(CASES[0], root)
    value = json.loads(victim.read_bytes())

    @SETTINGS
    @given(st.text(min_size=1, max_size=300))
    def name(text):
        value["frames"][1]["file_path"] = text
        victim.write_bytes(json.dumps(value).encode())
        attempt(root, victim, reading)

    name()
