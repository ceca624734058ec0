"""A run in a process of its own, and the one that is going on now. No state of it is kept in Blender's data."""

from __future__ import annotations

_current = None


def current():
    """The job that is going on, or None."""
    return _current
