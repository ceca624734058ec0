"""A table's curves as a picture. The only module that imports matplotlib, which is there for development only."""

import math
from collections.abc import Sequence
from pathlib import Path

from matplotlib.figure import Figure

from ..core.atomic import replacing
from ..core.kinds import Workload
from .table import BASELINE, Table

PANEL: Workload[float] = 4.2
"""Edge of a panel in inches."""
ACROSS: Workload[int] = 3
"""Panels side by side."""
COLOURS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#7f7f7f", "#8c564b", "#b2a000", "#17202a")
"""Okabe and Ito's, which colour-blind readers can tell apart, and a few more."""


def write_plot(table: Table, path: Path | str) -> None:
    """Error over cost, both logarithmic: a panel for each case, a line for each alternative, the paper's dashed.

    An error of zero has no place on a logarithmic axis: it stands at the bottom of its panel with a hollow mark.
    """
    records, (case_column, name_column) = table.records(), table.columns[:2]
    cases = list(dict.fromkeys(record[case_column] for record in records))
    names = list(dict.fromkeys(record[name_column] for record in records))
    across = min(ACROSS, max(len(cases), 1))
    down = -(-len(cases) // across)
    figure = Figure(figsize=(PANEL * across, PANEL * down + 0.3 * len(names) ** 0.5 + 0.6), layout="constrained")
    panels = figure.subplots(max(down, 1), across, squeeze=False).ravel()
    handles = {}
    for panel, case in zip(panels, cases):
        drawn = [record for record in records if record[case_column] == case and _is_drawn(record, table)]
        errors = [record[table.error] for record in drawn if record[table.error] > 0]
        bottom = min(errors, default=1.0) / 4
        panel.set(xscale="log", yscale="log", title=str(case), xlabel=table.cost, ylabel=table.error)
        panel.grid(alpha=0.3)
        for name in names:
            rows = [record for record in drawn if record[name_column] == name]
            if not rows:
                continue
            paper = any(record.get(BASELINE) for record in rows)
            x = [record[table.cost] for record in rows]
            y = [record[table.error] or bottom for record in rows]
            colour = COLOURS[names.index(name) % len(COLOURS)]
            label = f"{name} (paper)" if paper and "paper" not in str(name) else str(name)
            (line,) = panel.plot(x, y, "--" if paper else "-", color=colour, label=label)
            exact = [record[table.error] == 0 for record in rows]
            for a, b, hollow in zip(x, y, exact):
                panel.plot(a, b, "s" if paper else "o", color=colour, markerfacecolor="none" if hollow else colour)
            handles.setdefault(name, line)
    for panel in panels[len(cases) :]:
        panel.remove()
    figure.suptitle(table.title)
    figure.legend(handles=list(handles.values()), loc="outside lower center", ncols=min(3, max(len(handles), 1)))
    with replacing(path) as temporary:
        # No date or version in the file: the same figures give the same bytes.
        figure.savefig(temporary, format="png", dpi=110, metadata={"Software": None})


def write_points(points: Sequence[tuple[str, float, float, float]], x: str, y: str, path: Path | str) -> None:
    """Named points (name, x, y, error of y) with the names beside them; linear within 1 and logarithmic beyond."""
    figure = Figure(figsize=(2.2 * PANEL, 1.6 * PANEL), layout="constrained")
    panel = figure.subplots()
    panel.axhline(0, color=COLOURS[6], linewidth=0.8)
    panel.axvline(0, color=COLOURS[6], linewidth=0.8)
    panel.set(xlabel=x, ylabel=y)
    panel.set_xscale("symlog", linthresh=1)
    panel.set_yscale("symlog", linthresh=1)
    panel.grid(alpha=0.3)
    for name, cost, value, error in points:
        panel.errorbar(cost, value, error, fmt="o", color=COLOURS[0], markersize=4, linewidth=0.8)
        panel.annotate(name, (cost, value), xytext=(4, 3), textcoords="offset points", fontsize=6)
    with replacing(path) as temporary:
        figure.savefig(temporary, format="png", dpi=110, metadata={"Software": None})


def _is_drawn(record: dict, table: Table) -> bool:
    """Whether a row can be plotted: a positive cost, and an error that was measured."""
    cost, error = record[table.cost], record[table.error]
    return cost is not None and error is not None and cost > 0 and math.isfinite(cost) and math.isfinite(error)
