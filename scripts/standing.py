"""Where we stand: docs/accuracy.md, written from what was measured.

    .venv/bin/python scripts/standing.py
    .venv/bin/python scripts/standing.py add --capture NAME --scores scores.json --report RESULT/report.json
        [--views 12] [--spp 32]

The first writes the page from docs/benchmark/standing.jsonl, a line for each measurement, newest last; the second adds
a line first, from the scores of a recovered scene against the capture's truth (`python score_scene.py scene.blend
CAPTURE --out scores.json`) and the run's own report. Nothing on the page is written by hand.
"""

import argparse
import datetime
import json
import subprocess
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
MEASURED = ROOT / "docs" / "benchmark" / "standing.jsonl"
PAGE = ROOT / "docs" / "accuracy.md"
HEAD = """# Accuracy and time, measured

Written by `scripts/standing.py` from [benchmark/standing.jsonl](benchmark/standing.jsonl); do not edit. The newest
measurement of each capture. A script opens `scene.blend` as a user would and looks at it through held-out cameras:

- **albedo**: PSNR of Base Color in dB: unaligned, after one scale, after three (one for each channel);
- **roughness**: mean absolute error, by pixel and by object;
- **models**: objects whose model (diffuse, specular, metal, emitter) is right; of a mesh without the truth's objects,
  those whose majority of pixels shows the right one;
- **re-render**, **relight**: PSNR in dB under the recovered light, and under a lamp that the truth has; after one more
  factor where no frame's exposure is known.

"""
COLUMNS = ("capture", "albedo", "roughness", "models", "re-render", "relight", "recover", "memory", "views", "measured")
TAIL = """
Living room: 96 frames of 320x240, 132,001 triangles, 64 objects. Kitchen: as many frames, 1,009,486 triangles, 283
objects; no constant was chosen on it. Both are rendered by Mitsuba, so not by the renderer that scores. *5 mm off*:
`scripts/perturb_capture.py --poses 5 0.2 --mesh 2.887 --mesh-smooth 0 --noise 0.02 --exposure 2 --clip 4`, poses off by
5 mm and 0.2 degrees, vertices by up to 5 mm, 2 % noise, exposures over two stops, clipped lamps.
*From a phone*: 8 bits, exposure, white balance, curve and vignetting told by nobody, poses 6 mm and .25 degrees off, a
mesh of one piece fused from noisy depth. Time on two cores.
A dash: not measured. Two runs that differ by rounding alone differ by .1 to .3 dB.

Elsewhere: what each pass gains in [ablation.md](ablation.md), estimators by themselves in
[speed-against-error.md](speed-against-error.md), stated errors in [evidence.md](evidence.md), cases with a known
answer in [hard_cases.md](hard_cases.md). `scripts/error_budget.py CAPTURE RESULT` says where an albedo's error
comes from, `python -m scripts.qa_rooms` renders furnished rooms with truth, `scripts/perturb_capture.py` makes of a
capture what a scanner would have.

What is not measured: real captures with truth; more than two seeds of a perturbed room.
"""


def line_of(scores: dict, report: dict, capture: str, views: int, spp: int) -> dict:
    """One measurement, from the scoring script's scores and the run's report."""
    albedo, roughness = scores["albedo"], scores["roughness"]
    phone = report.get("tier") == "codes"
    metric = "psnr_one_exposure" if phone else "psnr"
    relight = [score[metric] for name, score in scores.items() if name.startswith("relight")]
    return {
        "capture": capture,
        "albedo": [round(albedo[f"psnr{which}"], 1) for which in ("", "_one_scale", "_three_scales")],
        "roughness": [_rounded(roughness[f"mean_abs_error_by_{which}"], 3) for which in ("pixel", "object")],
        "models": [scores["model"]["right_by_majority" if phone else "right"], scores["model"]["of"]],
        "re-render": round(scores["rerender"][metric], 1),
        "relight": round(sum(relight) / len(relight), 1) if relight else None,
        "seconds": round(report["seconds"], 1),
        "memory_gib": _rounded(report["peak_memory_bytes"] and report["peak_memory_bytes"] / 2**30, 2),
        "views": views,
        "spp": spp,
    }


def _rounded(value: float | None, digits: int) -> float | None:
    return None if value is None else round(value, digits)


def page(lines: list[dict]) -> str:
    """The document: the newest line of each capture."""
    newest = {line["capture"]: line for line in lines}
    rows = ["| " + " | ".join(COLUMNS) + " |", "|" + "---|" * len(COLUMNS)]
    rows += ["| " + " | ".join(_cells(line)) + " |" for line in newest.values()]
    return HEAD + "\n".join(rows) + "\n" + TAIL


def _cells(line: dict) -> list[str]:
    def text(value, unit: str = "") -> str:
        return "-" if value is None else f"{value}{unit}"

    return [
        line["capture"],
        " / ".join(text(value) for value in line["albedo"]) + " dB",
        " / ".join(text(value) for value in line["roughness"]),
        "{} of {}".format(*line["models"]),
        text(line["re-render"], " dB"),
        text(line["relight"], " dB"),
        text(line["seconds"], " s"),
        text(line["memory_gib"], " GiB"),
        f"{line['views']}, {line['spp']} samples",
        f"{line['date']}, {line['commit']}",
    ]


def measured() -> list[dict]:
    """All measurements, oldest first."""
    return [json.loads(line) for line in MEASURED.read_text(encoding="utf-8").splitlines()]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    commands = parser.add_subparsers(dest="command")
    add = commands.add_parser("add", help="add a measurement")
    add.add_argument("--capture", required=True, help="what it is called on the page")
    add.add_argument("--scores", type=Path, required=True)
    add.add_argument("--report", type=Path, required=True)
    add.add_argument("--views", type=int, default=12)
    add.add_argument("--spp", type=int, default=32)
    options = parser.parse_args()
    if options.command == "add":
        scores, report = (json.loads(path.read_text(encoding="utf-8")) for path in (options.scores, options.report))
        command = ["git", "rev-parse", "--short", "HEAD"]
        commit = subprocess.run(command, cwd=ROOT, check=True, capture_output=True, text=True).stdout.strip()
        line = line_of(scores, report, options.capture, options.views, options.spp)
        line |= {"date": datetime.date.today().isoformat(), "commit": commit}
        with open(MEASURED, "a", encoding="utf-8") as file:
            file.write(json.dumps(line) + "\n")
    PAGE.write_text(page(measured()), encoding="utf-8")


if __name__ == "__main__":
    main()
