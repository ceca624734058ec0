"""What the hard cases measured: each figure is held against its tolerance and kept for the table."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Figure:
    """One number of one case.

    Attributes
    ----------
    case : str
        The test's name, with the way it was run.
    known : str
        The known answer, in words.
    error : float
        How far off it was.
    within : float
        The tolerance.
    """

    case: str
    known: str
    error: float
    within: float


FIGURES: list[Figure] = []


def table() -> str:
    """All figures of this process as Markdown, in the order in which the tests ran."""
    lines = ["| case | known answer | tolerance | measured error |", "|---|---|---|---|"]
    for f in FIGURES:
        lines.append(f"| {f.case} | {f.known} | {_short(f.within)} | {_short(f.error)} |")
    return "\n".join(lines) + "\n"


def _short(value: float) -> str:
    return "exact" if value == 0 else f"{value:.2g}"
