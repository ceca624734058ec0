"""Memory of this process: its peak, what it may take, and giving back what is free."""

import ctypes
import os
import sys
from pathlib import Path

from .errors import MemoryLimitError
from .kinds import Block, Code

SHARE: Block[float] = 0.7
"""Of what the machine has free, what a run may take where nobody says."""
LARGE: Block[int] = 1 << 22
"""Bytes of an array that gets pages of its own: those of blocks are smaller, those of all elements larger."""
M_TRIM_THRESHOLD: Code[int] = -1  # malloc.h
M_MMAP_THRESHOLD: Code[int] = -3
M_ARENA_MAX: Code[int] = -8


class Budget:
    """What this process may take. Work is done in as many pieces at once as fit; what comes out is the same.

    Attributes
    ----------
    limit : int
        Bytes; 0 for no limit.
    """

    def __init__(self) -> None:
        self.limit = 0

    def fitting(self, maximum: int, each: int) -> int:
        """How many of up to `maximum` pieces of `each` bytes may be in memory at once; at least one.

        They may take half of what is left: the rest is for what is made of them.
        """
        used = resident_memory()
        if not self.limit or not each or used is None:
            return maximum
        return max(1, min(maximum, (self.limit - used) // 2 // each))

    def require(self, need: int, what: str) -> None:
        """Before long work: raise `MemoryLimitError` where what is left is less than that surely needs, in bytes."""
        used = resident_memory()
        if self.limit and used is not None and used + need > self.limit:
            raise MemoryLimitError(
                f"{what} need {(used + need) / 1e9:.2g} GB or more, over the memory limit of "
                f"{self.limit / 1e9:.2g} GB; raise it, or take a greater texel size or a smaller atlas size."
            )

    def is_short(self) -> bool:
        """Whether less than a quarter is left: what could be found again is then not kept."""
        used = resident_memory()
        return bool(self.limit) and used is not None and used > 0.75 * self.limit


BUDGET = Budget()
"""This process's."""


def free_memory() -> int | None:
    """Bytes that this process could have: of the machine, or of the control group that it runs in; None if unknown."""
    if sys.platform == "win32":
        return _windows_free()
    figures = [_proc_bytes("/proc/meminfo", "MemAvailable:"), *map(_free_of_group, (_GROUP_V2, _GROUP_V1))]
    known_figures = [figure for figure in figures if figure is not None]
    if known_figures:
        return min(known_figures)
    try:
        return os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE") // 2  # macOS does not say what is free
    except (ValueError, OSError, AttributeError):
        return None


_GROUP_V2 = tuple(Path("/sys/fs/cgroup", name) for name in ("memory.max", "memory.current", "memory.stat"))
_GROUP_V1 = tuple(
    Path("/sys/fs/cgroup/memory", name) for name in ("memory.limit_in_bytes", "memory.usage_in_bytes", "memory.stat")
)


def _proc_bytes(file: str, name: str) -> int | None:
    """Bytes that a file of /proc gives under a name, in kB."""
    try:
        with open(file, encoding="ascii", errors="replace") as lines:
            return next((int(line.split()[1]) * 1024 for line in lines if line.startswith(name)), None)
    except OSError:
        return None


def _free_of_group(files: tuple[Path, ...]) -> int | None:
    """What is free of a control group's limit; None where it has none.

    What it holds of files counts as used there, but is given up for whoever needs it.
    """
    limit_file, used_file, stat_file = files
    try:
        limit, used = (int(file.read_text()) for file in (limit_file, used_file))
        lines = [line.split() for line in stat_file.read_text().splitlines()]
        stat = {name: int(size) for name, size in lines}
    except (OSError, ValueError):  # 'max'
        return None
    of_files = sum(stat.get(f"total_{name}", stat.get(name, 0)) for name in ("inactive_file", "active_file"))
    return max(limit - max(used - of_files, 0), 0)


def resident_memory() -> int | None:
    """Resident size now in bytes; the peak where the system gives no more, None where not even that."""
    if sys.platform == "linux":
        try:
            with open("/proc/self/statm", encoding="ascii") as file:
                return int(file.read().split()[1]) * os.sysconf("SC_PAGE_SIZE")
        except (OSError, ValueError, IndexError):
            pass
    return peak_memory()


def give_back() -> None:
    """Let the system have what was freed but is kept for later, where the C library does not by itself (glibc)."""
    if sys.platform == "linux":
        trim = getattr(ctypes.CDLL(None), "malloc_trim", None)
        if trim is not None:
            trim(0)


def give_back_at_once() -> None:
    """Let the system have large arrays as soon as they are freed: glibc would keep up to 32 MiB of each for later, and
    of smaller ones what each thread freed for itself."""
    set_option = getattr(ctypes.CDLL(None), "mallopt", None) if sys.platform == "linux" else None
    if set_option is not None:
        for option, value in (M_MMAP_THRESHOLD, LARGE), (M_TRIM_THRESHOLD, 16 * LARGE), (M_ARENA_MAX, 1):
            set_option(option, value)


def peak_memory() -> int | None:
    """Highest resident size so far in bytes; None where the system doesn't say."""
    if sys.platform == "linux":
        # Not getrusage: there a process starts with the peak of the one that started it, such as a full Blender.
        peak_of_process = _proc_bytes("/proc/self/status", "VmHWM:")
        if peak_of_process is not None:
            return peak_of_process
    if sys.platform == "win32":
        return _windows_peak()
    try:
        import resource
    except ImportError:
        return None
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return int(peak if sys.platform == "darwin" else peak * 1024)


def _windows_peak() -> int | None:
    """PeakWorkingSetSize of GetProcessMemoryInfo (psapi.h)."""
    if sys.platform != "win32":
        return None
    from ctypes import wintypes

    class Counters(ctypes.Structure):
        _fields_ = [
            ("cb", wintypes.DWORD), ("faults", wintypes.DWORD), ("peak", ctypes.c_size_t),
            ("others", ctypes.c_size_t * 7),
        ]  # fmt: skip

    counters = Counters(cb=ctypes.sizeof(Counters))
    try:
        kernel = ctypes.WinDLL("kernel32")
        kernel.GetCurrentProcess.restype = wintypes.HANDLE
        kernel.K32GetProcessMemoryInfo.argtypes = (wintypes.HANDLE, ctypes.POINTER(Counters), wintypes.DWORD)
        succeeded = kernel.K32GetProcessMemoryInfo(kernel.GetCurrentProcess(), ctypes.byref(counters), counters.cb)
    except (AttributeError, OSError):
        return None
    return int(counters.peak) if succeeded else None


def _windows_free() -> int | None:
    """ullAvailPhys of GlobalMemoryStatusEx (sysinfoapi.h)."""
    if sys.platform != "win32":
        return None
    from ctypes import wintypes

    class Status(ctypes.Structure):
        _fields_ = [
            ("length", wintypes.DWORD), ("load", wintypes.DWORD), ("total", ctypes.c_uint64),
            ("free", ctypes.c_uint64), ("others", ctypes.c_uint64 * 5),
        ]  # fmt: skip

    status = Status(length=ctypes.sizeof(Status))
    try:
        succeeded = ctypes.WinDLL("kernel32").GlobalMemoryStatusEx(ctypes.byref(status))
    except (AttributeError, OSError):
        return None
    return int(status.free) if succeeded else None
