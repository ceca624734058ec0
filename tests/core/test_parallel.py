"""Work in threads: order, bounds, and that nothing that goes wrong is lost."""

from __future__ import annotations

import threading
import time

import pytest

from addon.core.errors import InterruptedRun
from addon.core.parallel import blocks, for_blocks, ordered_map, thread_count
from addon.core.progress import Progress, Rounds


def test_blocks_cover_the_range():
    assert [(b.start, b.stop) for b in blocks(10, 4)] == [(0, 4), (4, 8), (8, 10)]
    assert blocks(0, 4) == []


def test_thread_count():
    assert thread_count(3) == 3 and thread_count(0) >= 1


@pytest.mark.parametrize("threads", [1, 4])
def test_ordered_map_keeps_the_order(threads):
    def slow_first(i):
        time.sleep(0.02 if i % 4 == 0 else 0)
        return i * i

    assert list(ordered_map(slow_first, range(20), threads)) == [i * i for i in range(20)]


def test_ordered_map_holds_few_results():
    started, lock = [], threading.Lock()

    def note(i):
        with lock:
            started.append(i)
        return i

    for taken, _ in enumerate(ordered_map(note, range(50), 2, ahead=1)):
        assert len(started) <= taken + 1 + 3


def test_ordered_map_raises_what_an_item_raised():
    def fail(i):
        if i == 3:
            raise KeyError("three")
        return i

    seen = []
    with pytest.raises(KeyError, match="three"):
        for value in ordered_map(fail, range(100), 2):
            seen.append(value)
    assert seen == [0, 1, 2]


@pytest.mark.parametrize("threads", [1, 3])
def test_for_blocks_does_every_block_once(threads):
    done = [0] * 37

    def mark(part):
        for i in range(part.start, part.stop):
            done[i] += 1

    for_blocks(mark, 37, 5, threads)
    assert done == [1] * 37


def test_for_blocks_raises_what_a_block_raised():
    def fail(part):
        if part.start == 4:
            raise ValueError("four")

    with pytest.raises(ValueError, match="four"):
        for_blocks(fail, 20, 2, 2)


def test_for_blocks_stops_on_request():
    ran = []
    with pytest.raises(InterruptedRun):
        for_blocks(lambda part: ran.append(time.sleep(0.01)), 1000, 1, 2, Progress(should_stop=lambda: True))
    assert len(ran) < 900


def test_rounds_of_unknown_number_never_go_back():
    shares = []
    rounds = Rounds(Progress(lambda event: shares.append(event.share)), 0.25, 1.0)
    for _ in range(5):
        for share in (0.0, 0.5, 1.0):
            rounds.update(share)
        rounds.next()
    assert shares == sorted(shares) and shares[0] == 0.25 and 0.97 < shares[-1] < 1
    Rounds(None, 0, 1).update(0.5)  # nobody listens
