"""Memory of this process."""

import ctypes
import sys
from pathlib import Path

import numpy as np
import pytest

from addon.core.memory import give_back


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
