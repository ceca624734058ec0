"""A short run of `python -m tests.hostile`: what once failed, some other files of every kind, runs that are killed."""

from __future__ import annotations

import itertools
import os
import sys

import pytest

from tests.hostile import kills, spoiled_files

pytestmark = [pytest.mark.slow, pytest.mark.once, pytest.mark.skipif(sys.platform != "linux", reason="limits of Linux")]


def test_what_once_failed_and_some_more():
    tries = itertools.islice(spoiled_files.chosen(int(os.environ.get("HOSTILE_SEED", "0"))), 220)
    counts, failed = spoiled_files.run(itertools.chain(spoiled_files.corpus(), tries))
    assert not failed, failed[:3]
    assert counts["read"] > 50 and counts["refused"] > 50


def test_runs_that_are_killed():
    assert kills.run(20, seed=0) == []
