"""Work in slices: a generator that yields the share done, so that a window can be drawn in between."""

from collections.abc import Generator


def whole(slices: Generator):
    """Do all slices of a piece of work at once; returns what the generator returns."""
    while True:
        try:
            next(slices)
        except StopIteration as end:
            return end.value
