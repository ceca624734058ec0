"""The command: mutated files, runs that are killed, captures that are large."""

from __future__ import annotations

import argparse
import itertools

from tests.hostile import kills, spoiled_files, table


def main() -> int:
    parser = argparse.ArgumentParser(prog="python -m tests.hostile", description=__doc__)
    parser.add_argument("--examples", type=int, default=0, help="mutated files of all kinds together")
    parser.add_argument("--seconds", type=float, default=float("inf"), help="stop with the files after so long")
    parser.add_argument("--seed", type=int, default=0, help="of the first; others give other files")
    parser.add_argument("--only", default="", help="readers, or captures, whose name holds this")
    parser.add_argument("--kills", type=int, default=0, help="runs that are killed and taken up again")
    parser.add_argument("--load", metavar="FOLDER", help="measure large captures, made in FOLDER")
    told = parser.parse_args()
    failed = 0
    if told.examples:
        tries = itertools.islice(spoiled_files.chosen(told.seed, told.only), told.examples)
        counts, wrong = spoiled_files.run(itertools.chain(spoiled_files.corpus(), tries), told.seconds)
        for one in wrong:
            print(f"{one.name} {one.seed}  # {one.how}, {one.seconds:.1f} s, {one.memory >> 20} MiB\n{one.said}\n")
        print(", ".join(f"{count} {how}" for how, count in counts.most_common()))
        failed += len(wrong)
    if told.kills:
        wrong_kills = kills.run(told.kills, told.seed)
        print(f"{told.kills} kills, {len(wrong_kills)} wrong", *wrong_kills, sep="\n")
        failed += len(wrong_kills)
    if told.load:
        table.measure(told.load, told.only)
    return failed > 0


if __name__ == "__main__":
    raise SystemExit(main())
