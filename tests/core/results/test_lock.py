"""The lock on a unit of work: one owner at a time, lost by the dead, whatever the clocks say."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import threading
import time

import pytest

from addon.core.errors import InterruptedRun, StorageError
from addon.core.results.lock import LockParams, held, machine, owner

QUICK = LockParams(beat=0.05, patience=1.0, look=0.01)
ELSEWHERE = {"machine": "other-host 0000 pid:[1]", "process": 1, "token": "x"}


def stale(path, **told):
    path.write_text(json.dumps(ELSEWHERE | told) + "\n")


def test_one_at_a_time(tmp_path):
    inside, most = [], []

    def work():
        with held(tmp_path / "lock", params=QUICK):
            inside.append(1)
            most.append(len(inside))
            time.sleep(0.02)
            inside.pop()

    threads = [threading.Thread(target=work) for _ in range(8)]
    for one in threads:
        one.start()
    for one in threads:
        one.join()
    assert most == [1] * 8 and not list(tmp_path.iterdir())


def test_an_owner_that_is_gone_loses_it_at_once(tmp_path):
    dead = subprocess.Popen([sys.executable, "-c", ""])
    dead.wait()
    stale(tmp_path / "lock", machine=machine(), process=dead.pid)
    assert owner(tmp_path / "lock") == ""
    began = time.monotonic()
    with held(tmp_path / "lock", params=LockParams(patience=60)):
        assert time.monotonic() - began < 30
        assert str(os.getpid()) in owner(tmp_path / "lock")


@pytest.mark.parametrize("off", [-3600, 0, 3600])
def test_the_lock_of_another_machine_is_lost_where_it_stands_still_whatever_its_clock_says(tmp_path, off):
    lock = tmp_path / "lock"
    stale(lock)
    os.utime(lock, (time.time() + off,) * 2)
    assert owner(lock) == "other-host, process 1"
    stopped = threading.Event()
    with pytest.raises(InterruptedRun):  # not at once
        threading.Timer(0.3, stopped.set).start()
        with held(lock, stopped.is_set, QUICK):
            raise AssertionError("the lock was taken from its owner")
    with held(lock, params=QUICK):
        assert str(os.getpid()) in owner(lock)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("off", [-3600, 3600])
def test_a_living_owner_keeps_it_longer_than_patience_whatever_its_clock_says(tmp_path, off):
    lock, let_go, had = tmp_path / "lock", threading.Event(), threading.Event()

    def own():
        with held(lock, params=QUICK):
            had.set()
            let_go.wait(20)

    owning = threading.Thread(target=own)
    owning.start()
    had.wait()
    os.utime(lock, (time.time() + off,) * 2)
    began = time.monotonic()
    with pytest.raises(InterruptedRun):
        with held(lock, lambda: time.monotonic() - began > 2.5 * QUICK.patience, QUICK):
            raise AssertionError("the lock was taken from its living owner")
    let_go.set()
    owning.join()
    with held(lock, params=QUICK):
        pass


def test_an_owner_that_lost_it_takes_it_from_nobody(tmp_path):
    with held(tmp_path / "lock", params=QUICK):
        (tmp_path / "lock").unlink()
        stale(tmp_path / "lock")
        time.sleep(3 * QUICK.beat)  # its signs of life go nowhere
    assert (tmp_path / "lock").read_text() == json.dumps(ELSEWHERE) + "\n"


@pytest.mark.parametrize("content", [b"", b"garbage", b"[1]\n", b'{"process": "x"}\n'])
def test_a_lock_without_sense_is_waited_for_and_lost(tmp_path, content):
    (tmp_path / "lock").write_bytes(content)
    with held(tmp_path / "lock", params=QUICK):
        pass
    assert not list(tmp_path.iterdir())


def test_a_folder_that_is_not_there_is_told(tmp_path):
    with pytest.raises(StorageError, match="can't be written"):
        with held(tmp_path / "nowhere" / "lock"):
            pass
