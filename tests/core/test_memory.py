"""Memory of this process."""

import ctypes
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from addon.core import memory
from addon.core.errors import MemoryLimitError
from addon.core.memory import Budget, free_memory, give_back, resident_memory


@pytest.mark.skipif(
    sys.platform != "linux" or not hasattr(ctypes.CDLL(None), "malloc_trim"), reason="a C library that does so itself"
)
def test_what_was_freed_goes_back_to_the_system():
    def resident() -> int:
        return int(Path("/proc/self/statm").read_text().split()[1])

    held = [np.ones(8000) for _ in range(1500)]  # 64 kB each: small enough to be kept for later
    full, last = resident(), held[-1]
    del held
    give_back()
    assert resident() < full - 1000 * 8000 * 8 // 4096 and last.all()


@pytest.mark.skipif(sys.platform != "linux" or not hasattr(ctypes.CDLL(None), "mallopt"), reason="not glibc")
def test_large_arrays_go_back_at_once():
    """In a process of its own: the options are for good. By itself glibc keeps arrays once one as large was freed."""
    script = """
import numpy as np
from addon.core.memory import give_back_at_once, resident_memory
give_back_at_once()
kept = []
for _ in range(2):
    held = []
    for _ in range(20):
        held.append(np.ones(1 << 20))
        kept.append(np.ones(1 << 12))  # between two of them
    full = resident_memory()
    del held
assert resident_memory() < full - 19 * (8 << 20)
"""
    subprocess.run([sys.executable, "-c", script], check=True, cwd=Path(__file__).parents[2])


def test_pieces_fit_into_half_of_what_is_left():
    now = resident_memory()
    if now is None:
        pytest.skip("the system does not tell")
    budget = Budget()
    assert budget.fitting(8, 1 << 40) == 8  # no limit
    budget.limit = now + (1 << 30)
    assert budget.fitting(8, 1) == 8
    assert 3 <= budget.fitting(8, 1 << 27) <= 4
    assert budget.fitting(8, 1 << 40) == 1  # one there has to be


def test_what_surely_does_not_fit_is_told_before_the_work():
    budget = Budget()
    budget.require(1 << 50, "Its elements")  # no limit
    budget.limit = 1 << 30
    with pytest.raises(
        MemoryLimitError, match=r"^Its elements need 1e\+03 GB or more, over the memory limit of 1\.1 GB; "
    ):
        budget.require(10**12, "Its elements")


def test_what_is_free_is_less_than_the_machine_has():
    free = free_memory()
    assert free is None or 0 <= free < 1 << 50


@pytest.mark.parametrize(("limit", "left"), [("8000", 6000), ("max", None), ("1000", 0)])
@pytest.mark.parametrize("prefix", ["", "total_"])
def test_what_a_control_group_holds_of_files_is_free(tmp_path, limit, left, prefix):
    told = f"anon 2000\n{prefix}inactive_file 3000\n{prefix}active_file 1500\n"
    files = tuple(tmp_path / name for name in ("limit", "used", "stat"))
    for file, text in zip(files, (limit, "6500\n", told), strict=True):
        file.write_text(text)
    assert memory._free_of_group(files) == left


def test_no_control_group_is_no_limit(tmp_path):
    assert memory._free_of_group(tuple(tmp_path / name for name in ("limit", "used", "stat"))) is None
