"""The benchmark's stages, their options, and the files they write."""

import importlib.metadata
import importlib.util
import os
import platform
import re
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

from ..core.atomic import write_bytes
from ..core.errors import BadInputError
from ..core.parallel import thread_count
from ..core.progress import Progress
from ..version import VERSION
from .table import Table

STAGES = ("lit_diffuse", "shading", "specular", "pipeline")
NO_PLOTS = "Plots need matplotlib, which is not installed here; the tables are complete without it."


class SkippedStage(Exception):
    """A stage can't run under the options given; its text is one sentence that says why."""


@dataclass(frozen=True)
class Options:
    """Options of a stage.

    Attributes
    ----------
    capture : Path or None
        The capture to measure on; the demo's room where None.
    large : bool
        The real size, which may take hours; else what finishes in minutes.
    seed : int
        Of every pseudo-random choice: errors are the same from run to run.
    threads : int
        0 takes all cores.
    out : Path
        Where the files go.
    progress : Progress
        Receives the share of the stage that is done; raises `InterruptedRun` when the user wants to stop.
    """

    capture: Path | None = None
    large: bool = False
    seed: int = 0
    threads: int = 0
    out: Path = Path()
    progress: Progress = field(default_factory=Progress)


def check_stages(stages: Sequence[str]) -> tuple[str, ...]:
    """The requested stages in their order, all where none is named; raises `BadInputError` for an unknown one."""
    for name in stages:
        if name not in STAGES:
            raise BadInputError(f"There is no benchmark '{name}'; choose among {', '.join(STAGES)}.")
    return tuple(name for name in STAGES if name in stages or not stages)


@contextmanager
def room_and_scratch(options: Options) -> Iterator[tuple[Path, Path]]:
    """The capture to measure, by default the demo's room, and a temporary folder."""
    with tempfile.TemporaryDirectory(dir=options.out, prefix="tmp-") as scratch:
        folder = options.capture
        if folder is None:
            if importlib.util.find_spec("bpy") is None:
                raise SkippedStage(
                    "It renders a room with Blender; run it where bpy can be imported, or give --capture."
                )
            from ..bridge.demo.render import render_capture

            folder = render_capture(Path(scratch) / "capture", "large" if options.large else "small")
        yield folder, Path(scratch)


def run_benchmark(stages: Sequence[str], options: Options) -> dict[str, Table | str]:
    """Run stages and write their tables, plots and `index.md` into `options.out`.

    What is finished is written at once: an interrupted run keeps it.

    Parameters
    ----------
    stages : sequence of str
        Names out of `STAGES`; empty for all.

    Returns
    -------
    dict of str to (Table or str)
        For each stage its table, or the sentence why it was skipped.

    Raises
    ------
    BadInputError
        Unknown stage, no such capture, or a folder that can't be made.
    InterruptedRun
        From the progress.
    """
    stages = check_stages(stages)
    if options.capture is not None and not options.capture.is_dir():
        raise BadInputError(f"There is no capture folder '{options.capture}'; give one that holds transforms.json.")
    make_folder(options.out)
    from .stages import run as measure  # not earlier: it takes what the command's help needs not

    plots = plots_are_possible()
    results: dict[str, Table | str] = {}
    seconds: dict[str, float] = {}
    for stage in stages:
        started = time.monotonic()
        options.progress.stage(stage)
        try:
            results[stage] = table = measure(stage, options)
            table.write_csv(options.out / f"{table.stage}.csv")
            write_bytes(options.out / f"{table.stage}.md", table.markdown().encode())
            if plots:
                from .plot import write_plot

                write_plot(table, options.out / f"{table.stage}.png")
        except SkippedStage as reason:
            results[stage] = str(reason)
        options.progress.done()
        seconds[stage] = time.monotonic() - started
        write_bytes(options.out / "index.md", _index(results, seconds, options, plots).encode())
    return results


def make_folder(folder: Path) -> None:
    """Make a folder; raises `BadInputError`."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise BadInputError(f"Folder '{folder}' can't be made ({error.strerror or error}); choose another.") from error


def plots_are_possible() -> bool:
    """Whether matplotlib is there."""
    return importlib.util.find_spec("matplotlib") is not None


def _index(results: dict[str, Table | str], seconds: dict[str, float], options: Options, plots: bool) -> str:
    lines = ["# Benchmark", "", *(f"- {name}: {text}" for name, text in describe_machine().items()), ""]
    lines += [
        f"- capture: {options.capture.resolve().name if options.capture else 'none given'}",
        f"- size: {'large' if options.large else 'default'}",
        f"- seed: {options.seed}",
        f"- threads: {options.threads or 'all cores'}",
        "",
    ]
    if not plots:
        lines += [NO_PLOTS, ""]
    for stage, table in results.items():
        lines += [f"# {stage.capitalize()}", "", f"{seconds[stage]:.0f} s", ""]
        if isinstance(table, str):
            lines += [f"Skipped: {table}", ""]
            continue
        lines += [table.markdown()]
        if plots:
            lines += [f"![{table.title}]({stage}.png)", ""]
    return "\n".join(lines).rstrip() + "\n"


def describe_machine() -> dict[str, str]:
    """Processor, cores, memory, system and versions, without host or path; what can't be determined is left out."""
    bpy = sys.modules.get("bpy")
    facts = {
        "processor": _processor(),
        "cores": str(thread_count(0)),
        "memory": _memory(),
        "system": f"{platform.system()} {platform.machine()}",
        "Python": platform.python_version(),
        "NumPy": _version("numpy"),
        "embreex": _version("embreex"),
        "Blender": bpy.app.version_string if bpy is not None else _version("bpy"),
        "Scan Relight": VERSION,
    }
    return {name: text for name, text in facts.items() if text}


def _processor() -> str:
    """The processor's model, where the system has it in a file; else its kind."""
    try:
        named = re.search(r"^model name\s*: (.*)$", Path("/proc/cpuinfo").read_text(errors="replace"), re.MULTILINE)
    except OSError:
        named = None
    return named[1] if named else platform.processor() or platform.machine()


def _memory() -> str:
    try:
        return f"{os.sysconf('SC_PAGE_SIZE') * os.sysconf('SC_PHYS_PAGES') / 2**30:.0f} GiB"
    except (AttributeError, OSError, ValueError):  # Windows has no sysconf
        return ""


def _version(package: str) -> str:
    try:
        return importlib.metadata.version(package)
    except importlib.metadata.PackageNotFoundError:
        return ""
