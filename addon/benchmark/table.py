"""A benchmark's table: runs, their errors and costs. CSV in full precision, Markdown rounded."""

import csv
import io
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ..core.atomic import write_bytes
from ..core.kinds import Workload

BASELINE = "baseline"
"""The column that says whether a row is the paper's setting, which every ratio of its case refers to."""
DIGITS: Workload[int] = 3
Cell = str | bool | int | float | None


@dataclass(frozen=True)
class Table:
    """One table of a stage.

    Attributes
    ----------
    stage : str
        Also the files' name.
    title : str
        One line, without a full stop.
    columns : tuple of str
        Names, with the unit where there is one ('seconds', 'bytes an element'). The first two are the case and the
        alternative, of which the plot has a panel and a line each; `BASELINE` marks the paper's rows.
    rows : list of tuple
        One cell a column: str, bool, int, float or None (not measured).
    cost, error : str
        The columns that the plot has for x and y; rows of one case and alternative are joined in the table's order.
    notes : tuple of str
        Sentences below the table: what the columns mean, and what was found.
    """

    stage: str
    title: str
    columns: tuple[str, ...]
    rows: list[tuple[Cell, ...]]
    cost: str
    error: str
    notes: tuple[str, ...] = ()

    def __post_init__(self):
        for row in self.rows:
            if len(row) != len(self.columns):
                raise ValueError(f"table '{self.stage}': {len(row)} cells for {len(self.columns)} columns: {row}")

    def records(self) -> list[dict[str, Any]]:
        """The rows as dictionaries, plain Python numbers."""
        return [{name: _plain(cell) for name, cell in zip(self.columns, row)} for row in self.rows]

    def write_csv(self, path: Path | str) -> None:
        """The table in full precision; empty cells are what was not measured."""
        text = io.StringIO()
        writer = csv.writer(text, lineterminator="\n")
        writer.writerow(self.columns)
        for record in self.records():
            writer.writerow(["" if cell is None else cell for cell in record.values()])
        write_bytes(path, text.getvalue().encode())

    def markdown(self) -> str:
        """Title, table and notes; floats to `DIGITS` significant digits."""
        lines = [f"## {self.title}", "", _line(self.columns), _line(["---"] * len(self.columns))]
        lines += [_line([formatted(cell) for cell in record.values()]) for record in self.records()]
        lines += [""] + [f"- {note}" for note in self.notes]
        return "\n".join(lines).rstrip() + "\n"


def _plain(cell: Any) -> Cell:
    """NumPy's scalars as Python's own, so that both NumPy 1 and 2 write '0.5'."""
    return cell.item() if hasattr(cell, "item") else cell


def _line(cells) -> str:
    return "| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |"


def formatted(cell: Cell) -> str:
    """A cell as readable text: '0.0123', '1.2e-05', '12345', 'yes'."""
    if cell is None or cell is False:
        return ""
    if cell is True:
        return "yes"
    if not isinstance(cell, float):
        return str(cell)
    if 1e-4 <= abs(cell) < 10**DIGITS or cell == 0:
        return f"{cell:.{DIGITS}g}"
    return f"{cell:.0f}" if 1 <= abs(cell) < 1e6 else f"{cell:.{DIGITS - 1}e}"
