"""docs/ablation.md: what each pass gains and costs, from the ablation's lines of JSON."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ..core.atomic import write_bytes
from ..core.errors import BadInputError
from ..core.passes.registry import PASSES, Pass
from .ablation import TOGETHER, WHOLE, read_lines
from .run import plots_are_possible

Line = Mapping[str, Any]


@dataclass(frozen=True)
class Figure:
    """One figure: its name in the lines and in verdicts, its column, and what makes it comparable.

    Attributes
    ----------
    sign : int
        1 where more is better, -1 where less is.
    """

    name: str
    short: str
    column: str
    sign: int = 1
    scale: float = 1.0
    digits: int = 2


APPENDIX = "benchmark"
"""Folder beside docs/ablation.md that holds the other pages; such a table may be one of them."""
ALBEDO = Figure("albedo", "albedo", "albedo, dB")
FIGURES = (
    ALBEDO,
    Figure("rerender", "re-render", "re-render, dB"),
    Figure("roughness_by_pixel", "roughness by pixel", "roughness by pixel, 1/1000", -1, 1000.0, 1),
    Figure("roughness_by_object", "by object", "by object, 1/1000", -1, 1000.0, 1),
    Figure("right", "models", "right models", 1, 1.0, 1),
)


@dataclass(frozen=True)
class Gain:
    """What a pass gains in one figure over r rooms.

    Attributes
    ----------
    by_room : dict of str to float
        Mean over the seeds.
    error : float or None
        Standard error of the mean by the seeds alone; where no room in which the pass acts has two seeds, by the rooms,
        whose deviation holds that of the seeds. None for one room and seed.
    """

    by_room: dict[str, float]
    mean: float
    error: float | None

    @property
    def leave_one_out(self) -> tuple[float, float] | None:
        """Least and greatest mean over all rooms but one; None with a single room.

        A verdict whose sign changes here was taken by one room.
        """
        count = len(self.by_room)
        if count < 2:
            return None
        means = [(self.mean * count - gain) / (count - 1) for gain in self.by_room.values()]
        return min(means), max(means)


def gain_of(figure: Figure, name: str, runs: Mapping[tuple, Line]) -> Gain | None:
    """The gain of a pass, each run compared with the whole method's of the same room and seed; None without any.

    Parameters
    ----------
    runs : mapping
        Lines by (room, preset), seed and what is left out.
    """
    pairs: dict[tuple, list[float]] = {}
    for (room, seed, left_out), line in runs.items():
        whole = runs.get((room, seed, WHOLE))
        if left_out != name or whole is None:
            continue
        with_it, without = (run["figures"].get(figure.name) for run in (whole, line))
        if with_it is not None and without is not None:
            pairs.setdefault(room, []).append(figure.sign * figure.scale * (with_it - without))
    if not pairs:
        return None
    by_room = {room: float(np.mean(gains)) for room, gains in pairs.items()}
    # Where a pass does nothing it has no deviation either: what a pair of seeds tells there is no measurement of it.
    acting = [gains for gains in pairs.values() if any(gains)]
    repeated = [gains for gains in acting or pairs.values() if len(gains) > 1]
    error = None
    if repeated:
        variance = float(np.mean([np.var(gains, ddof=1) for gains in repeated]))
        error = float(np.sqrt(variance * sum(1 / len(gains) for gains in acting))) / len(pairs)
    elif len(by_room) > 1:
        error = float(np.std(list(by_room.values()), ddof=1) / np.sqrt(len(by_room)))
    return Gain(by_room, float(np.mean(list(by_room.values()))), error)


def seconds_of(name: str, runs: Mapping[tuple, Line]) -> float | None:
    """Processor seconds that a pass takes, mean over its runs: of the stages that were done again without it."""
    taken = []
    for (room, seed, left_out), line in runs.items():
        whole = runs.get((room, seed, WHOLE))
        if left_out == name and whole is not None:
            shared = [stage for stage in line["seconds"] if stage in whole["seconds"]]
            taken.append(sum(whole["seconds"][stage] - line["seconds"][stage] for stage in shared))
    return float(np.mean(taken)) if taken else None


def write_report(folder: Path, path: Path) -> None:
    """Write the table of all lines in a folder as Markdown, and the plot of gain against seconds to images/ beside it.

    Raises
    ------
    BadInputError
        There are no lines.
    """
    lines = read_lines(sorted(folder.glob("ablation*.jsonl")))
    runs = {((line["room"], line["preset"]), line["seed"], line["without"]): line for line in lines}
    if not any(left_out == WHOLE for _, _, left_out in runs):
        raise BadInputError(f"Folder '{folder}' holds no runs of the whole method (ablation*.jsonl).")
    image = path.parent / "images" / f"{path.stem}.png"
    plotted = plots_are_possible()
    if plotted:
        image.parent.mkdir(parents=True, exist_ok=True)
        _plot(runs, image)
    write_bytes(path, _markdown(runs, path, f"images/{image.name}" if plotted else None).encode())


def _markdown(runs: Mapping[tuple, Line], path: Path, image: str | None) -> str:
    rooms = sorted({room for room, _, _ in runs})
    acting = [item for item in PASSES if _acts(item.name, runs)]
    idle = [item for item in PASSES if _was_run(item.name, runs) and not _acts(item.name, runs)]
    missing = [item for item in PASSES if not _was_run(item.name, runs)]
    known = {item.name for item in PASSES}
    others = sorted({name for _, _, name in runs if name not in known and name != WHOLE})
    together, gone = ([name for name in others if (TOGETHER in name) is joined] for joined in (True, False))
    presets = sorted({preset for _, preset in rooms})
    codes = sorted({str(line["code"]) for line in runs.values() if "code" in line})
    appendix = "" if path.parent.name == APPENDIX else f"{APPENDIX}/"
    lines = [
        "# What each pass gains",
        "",
        "Every pass is left out by itself (`--without PASS`) and the room is recovered again, by `scan-relight "
        "benchmark ablation ROOM ... --out DIR`; this page is `scan-relight benchmark ablation --out DIR --table "
        f"{path.as_posix()}`.",
        "A gain is the whole method's figure less the figure without the pass, under the same seed: above 0 the pass "
        "helps. After the sign ± is the standard error of the mean over the rooms by the seeds alone (by the rooms "
        "where there is one seed); rooms differ by more, as worst and best room show. Albedo: PSNR of Base Color over "
        "held-out views. Re-render: PSNR of those views in display values, predicted from albedo, irradiance and lobes "
        "without a renderer; the plain quotient gives L_d back whatever E is, so what corrects the albedo alone can "
        "lower it. Roughness: mean absolute error of the square root of alpha. Seconds: processor time of the stages "
        "that were done again. The verdict names the figures in which the gain is more than twice its standard error, "
        "either way, and its sign stays whichever room is left out. Where one object is taken for another kind of "
        "matter, all figures jump: gains of a single seed say little.",
        "",
        "What parts of the mesh denoising gain on meshes with known noise: "
        f"[mesh_denoising.md]({appendix}mesh_denoising.md).",
        "",
        f"Rooms ({', '.join(presets)} preset): {', '.join(_room(room) for room in rooms)}. "
        f"Seeds: {', '.join(str(seed) for seed in sorted({seed for _, seed, _ in runs}))}. "
        f"Source of the stages (`code` in report.json): {', '.join(codes) or 'not recorded'}.",
        "",
    ]
    if image:
        lines += [f"![Gain of albedo against seconds]({image})", ""]
    columns = ["pass", "rooms", *(f.column for f in FIGURES), "worst room, dB", "best room, dB"]
    columns += ["leave one room out, dB", "seconds", "verdict"]
    lines += ["## All rooms together", "", *_table(columns, [_summary(item.name, runs) for item in acting]), ""]
    head = ["pass", *(_room(room) for room in rooms)]
    lines += ["## Albedo by room, dB", "", *_table(head, [_by_room(item, rooms, runs) for item in acting]), ""]
    whole = [["whole method", *(_whole(room, runs) for room in rooms)]]
    lines += ["## The whole method's albedo, dB", "", *_table(head, whole), ""]
    for title, names in (("Taken out of the method since", gone), ("Taken out together", together)):
        if names:
            lines += [f"## {title}", "", *_table(columns, [_summary(name, runs) for name in names]), ""]
    if idle:
        lines += ["## Without effect in these rooms", "", "What these look for is in none of them.", ""]
        lines += _table(
            ["pass", "does", "seconds"], [[item.name, item.does, _seconds(item.name, runs)] for item in idle]
        ) + [""]
    if missing:
        lines += ["## Not measured", "", ", ".join(item.name for item in missing) + ".", ""]
    lines += [
        "## What they do",
        "",
        *_table(["pass", "first stage", "does"], [[item.name, item.stage, item.does] for item in acting]),
        "",
    ]
    return "\n".join(lines)


def _table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> list[str]:
    return [f"| {' | '.join(row)} |" for row in (head, ["---"] * len(head), *rows)]


def _room(room: tuple[str, str]) -> str:
    name, preset = room
    return name if preset == "normal" else f"{name} ({preset})"


def _was_run(name: str, runs: Mapping[tuple, Line]) -> bool:
    return any(left_out == name for _, _, left_out in runs)


def _acts(name: str, runs: Mapping[tuple, Line]) -> bool:
    return any(left_out == name and not line["same"] for (_, _, left_out), line in runs.items())


def _seconds(name: str, runs: Mapping[tuple, Line]) -> str:
    seconds = seconds_of(name, runs)
    return "" if seconds is None else f"{seconds:.1f}"


def _summary(name: str, runs: Mapping[tuple, Line]) -> list[str]:
    cells = []
    for figure in FIGURES:
        gain = gain_of(figure, name, runs)
        cells.append("" if gain is None else _signed(gain.mean, figure.digits, gain.error))
    of = {room for room, _, left_out in runs if left_out == name}
    acts = {room for (room, _, left_out), line in runs.items() if left_out == name and not line["same"]}
    albedo = gain_of(ALBEDO, name, runs)
    by_room = albedo.by_room if albedo is not None else {}
    left_out = albedo.leave_one_out if albedo is not None else None
    ends: list[Callable] = [min, max]
    extremes = [f"{_signed(end(by_room.values()))} {_room(end(by_room, key=by_room.get))}" for end in ends if by_room]
    return [
        name,
        f"{len(acts)} of {len(of)}",
        *cells,
        *(extremes or ["", ""]),
        "" if left_out is None else " to ".join(_signed(end) for end in left_out),
        _seconds(name, runs),
        _verdict(name, runs),
    ]


def _verdict(name: str, runs: Mapping[tuple, Line]) -> str:
    """The figures in which a pass gains or costs more than twice the standard error, whichever room is left out."""
    gains = {figure.short: gain_of(figure, name, runs) for figure in FIGURES}
    known = {key: gain for key, gain in gains.items() if gain is not None and gain.error is not None}
    if not known:
        return "one run: open"
    better = [key for key, gain in known.items() if min(_ends(gain)) >= 0 and gain.mean > 2 * gain.error + 1e-9]
    worse = [key for key, gain in known.items() if max(_ends(gain)) <= 0 and gain.mean < -2 * gain.error - 1e-9]
    words = [f"{verb} {', '.join(keys)}" for verb, keys in (("gains", better), ("costs", worse)) if keys]
    return "; ".join(words) or "open"


def _ends(gain: Gain) -> tuple[float, float]:
    return gain.leave_one_out or (gain.mean, gain.mean)


def _by_room(item: Pass, rooms: Sequence[tuple[str, str]], runs: Mapping[tuple, Line]) -> list[str]:
    gain = gain_of(ALBEDO, item.name, runs)
    by_room = gain.by_room if gain is not None else {}
    return [item.name, *(_signed(by_room[room]) if room in by_room else "" for room in rooms)]


def _whole(room: tuple[str, str], runs: Mapping[tuple, Line]) -> str:
    figures = [line["figures"]["albedo"] for (r, _, name), line in runs.items() if r == room and name == WHOLE]
    return f"{np.mean(figures):.2f}" if figures else ""


def _signed(value: float, digits: int = 2, error: float | None = None) -> str:
    text = f"{value:+.{digits}f}"
    if float(text) == 0:
        text = f"{0:.{digits}f}"
    return text if error is None else f"{text} ± {error:.{digits}f}"


def _plot(runs: Mapping[tuple, Line], path: Path) -> None:
    from .plot import write_points

    points = []
    for item in PASSES:
        gain, seconds = gain_of(ALBEDO, item.name, runs), seconds_of(item.name, runs)
        if gain is not None and seconds is not None and _acts(item.name, runs):
            points.append((item.name, seconds, gain.mean, gain.error or 0.0))
    write_points(points, "processor seconds a room", "gain of albedo, dB", path)
