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
    """All figures of this process as Markdown, in the order in which the tests ran.

    Variants of one case that share the answer and the tolerance make one row, with the worst of their errors.
    """
    alike: dict[tuple, list[Figure]] = {}
    for f in FIGURES:
        alike.setdefault((f.case.split(" (")[0], f.known, f.within), []).append(f)
    lines = ["| case | known answer | tolerance | measured error |", "|---|---|---|---|"]
    for (case, known, within), figures in alike.items():
        variants = ", ".join(f.case.removeprefix(case).strip(" ()") for f in figures)
        label = f"{case} ({variants})" if variants else case
        lines.append(f"| {label} | {known} | {_short(within)} | {_short(max(f.error for f in figures))} |")
    return "\n".join(lines) + "\n"


def _short(value: float) -> str:
    return "0" if value == 0 else f"{value:.2g}"
