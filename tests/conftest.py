"""Captures of the demo's room for every layer: with flat grey frames at once, or rendered with Cycles."""

from __future__ import annotations

import os
import sys
import tempfile
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # as the programs set it before NumPy: another number, other bits

import numpy as np
import pytest

os.environ.setdefault("BLENDER_USER_EXTENSIONS", tempfile.mkdtemp())  # no installed extension shadows the checkout

ROOT = Path(__file__).resolve().parent.parent

_STATUS = pytest.StashKey[int]()


@pytest.fixture(scope="session")
def root() -> Path:
    """The checkout."""
    return ROOT


@pytest.fixture(scope="session")
def grey_capture(tmp_path_factory) -> Path:
    """The demo's room seen by three frames of flat grey: a valid capture, made in no time."""
    from addon.bridge.demo.room import frame_path, room, tour, write_all_but_frames
    from addon.core.io.exr import write_exr

    folder = tmp_path_factory.mktemp("grey") / "capture"
    write_all_but_frames(folder, room(), tour(3), (32, 24))
    for k in range(3):
        write_exr(folder / frame_path(k), np.full((24, 32, 3), 0.5, np.float32), half=True)
    return folder


@pytest.fixture(scope="session")
def tiny_capture(tmp_path_factory) -> Path:
    """The demo's room in its smallest size, rendered with Cycles."""
    pytest.importorskip("bpy")
    from addon.bridge.demo.render import render_capture

    return render_capture(tmp_path_factory.mktemp("tiny") / "capture", "tiny")


SLOW_FIXTURES = {"archive", "office", "recovered", "same", "tiny_capture"}
"""Rooms that are rendered or recovered, and the built zip: whoever asks for them is slow."""
ON_BOTH = ("tests/core/io/", "tests/core/results/")
"""Parts of the core that depend on more than arithmetic."""


def pytest_collection_modifyitems(items):
    """Mark what is slow by its fixtures, and as `arithmetic` what depends on nothing but that."""
    for item in items:
        place = item.path.relative_to(ROOT).as_posix()
        if SLOW_FIXTURES & set(getattr(item, "fixturenames", ())):
            item.add_marker(pytest.mark.slow)
        of_core = place.startswith(("tests/core/", "tests/hard_cases/")) and not place.startswith(ON_BOTH)
        if of_core and not item.get_closest_marker("once"):  # that one is left out where this is done
            item.add_marker(pytest.mark.arithmetic)


def pytest_sessionfinish(session, exitstatus):
    """Keep the status for `pytest_unconfigure`."""
    session.config.stash[_STATUS] = int(exitstatus)


def pytest_unconfigure(config):
    """End at once, all being told: Blender 4.5 as a module can wait for ever for a thread of its own."""
    if "bpy" in sys.modules and not hasattr(config, "workerinput") and _STATUS in config.stash:
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(config.stash[_STATUS])
