"""The command `benchmark`: every stage's error and cost over its alternatives."""

import argparse
from pathlib import Path
from typing import TextIO

from ..core.errors import BadInputError
from .common import add_common, console_run, needed_packages


def add_benchmark(commands) -> None:
    """Add the command to the program's `commands`."""
    parser = commands.add_parser(
        "benchmark",
        help="measure every stage's error and cost against the paper's",
        description="Run each stage over its alternatives, the paper's setting among them, and write a table (CSV and "
        "Markdown) and a plot for each. Errors are the same from run to run; seconds are the machine's.",
    )
    stages = "lit_diffuse, shading, specular or pipeline (default all); or 'ablation ROOM ...', which has --help"
    parser.add_argument("stages", metavar="STAGE", nargs="*", help=stages)
    parser.add_argument("--capture", metavar="DIR", type=Path, help="measure on this capture (default the demo's room)")
    parser.add_argument("--out", metavar="DIR", type=Path, required=True, help="folder to write, made if missing")
    parser.add_argument("--large", action="store_true", help="the real size; takes much longer")
    parser.add_argument("--seed", type=int, metavar="INT", default=0, help="of every random choice (default 0)")
    parser.add_argument("--threads", type=int, metavar="INT", default=0, help="0 takes all cores (default 0)")
    add_common(parser, benchmark_command)


def benchmark_command(arguments: argparse.Namespace, stream: TextIO) -> None:
    """`benchmark [STAGE ...] --out DIR`."""
    if arguments.seed < 0 or arguments.threads < 0:
        raise BadInputError("Options --seed and --threads take whole numbers of at least 0.")
    with needed_packages():
        from ..benchmark.run import NO_PLOTS, Options, check_stages, plots_are_possible, run_benchmark
        from ..core.progress import Progress

        stages = check_stages(arguments.stages)
        with console_run(arguments, stream) as console:
            progress = Progress(weights=dict.fromkeys(stages, 1.0), **console)
            options = Options(
                arguments.capture, arguments.large, arguments.seed, arguments.threads, arguments.out, progress
            )
            results = run_benchmark(stages, options)
    if not arguments.quiet:
        for stage, table in results.items():
            print(f"Skipped {stage}: {table}" if isinstance(table, str) else table.markdown(), file=stream)
        if not plots_are_possible():
            print(NO_PLOTS, file=stream)
        print(f"Tables and plots: {arguments.out / 'index.md'}", file=stream)
