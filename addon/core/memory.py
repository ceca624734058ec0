"""Memory of this process: its peak, and giving back what is free."""

from __future__ import annotations

import ctypes
import sys


def give_back() -> None:
    """Let the system have what was freed but is kept for later, where the C library does not by itself (glibc)."""
    if sys.platform == "linux":
        trim = getattr(ctypes.CDLL(None), "malloc_trim", None)
        if trim is not None:
            trim(0)


def peak_memory() -> int | None:
    """Highest resident size so far in bytes; None where the system doesn't tell."""
    if sys.platform == "linux":
        # Not getrusage: there a process starts with the peak of the one that started it, such as a full Blender.
        try:
            with open("/proc/self/status", encoding="ascii", errors="replace") as status:
                for line in status:
                    if line.startswith("VmHWM:"):
                        return int(line.split()[1]) * 1024
        except OSError:
            pass
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

    sizes = (
        "peak",
        "now",
        "quota_peak_paged",
        "quota_paged",
        "quota_peak_nonpaged",
        "quota_nonpaged",
        "pagefile",
        "peak_pagefile",
    )

    class Counters(ctypes.Structure):
        _fields_ = [("cb", wintypes.DWORD), ("faults", wintypes.DWORD), *((name, ctypes.c_size_t) for name in sizes)]

    counters = Counters(cb=ctypes.sizeof(Counters))
    try:
        kernel = ctypes.WinDLL("kernel32")
        kernel.GetCurrentProcess.restype = wintypes.HANDLE
        kernel.K32GetProcessMemoryInfo.argtypes = (wintypes.HANDLE, ctypes.POINTER(Counters), wintypes.DWORD)
        told = kernel.K32GetProcessMemoryInfo(kernel.GetCurrentProcess(), ctypes.byref(counters), counters.cb)
    except (AttributeError, OSError):
        return None
    return int(counters.peak) if told else None
