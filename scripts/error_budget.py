#!/usr/bin/env python3
"""Where a recovered albedo's error comes from: PSNR with one part after another taken out or put right.

    python scripts/error_budget.py CAPTURE RESULT

CAPTURE has held-out views with truth in CAPTURE/truth (object_id/, albedo/, transforms.json, materials.json), which
only this script reads. RESULT is what `scan-relight recover` left there, with its stages. No Blender is needed: the
views are traced with embree and show the nearest surface element.
"""

import copy
import dataclasses
import json
import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from addon.benchmark.truth_views import psnr, views
from addon.core.io.read import read_capture
from addon.core.passes.albedo.albedo import MEASURED, quotient
from addon.core.pipeline.recover import Recovery
from addon.core.progress import Progress
from addon.core.results.store import Store
from addon.core.settings import Settings
from scripts.qa_rooms.held import projected_truth


def albedo_with(recovery: Recovery, **changed) -> np.ndarray:
    """The albedo if the specular stage had given something else."""
    variant = copy.copy(recovery)
    variant.done = recovery.done | {"specular": dataclasses.replace(recovery.specular(), **changed)}
    for name in ("irradiance", "albedo"):
        variant.__dict__.pop(name, None)
    return variant.albedo.rho


def main() -> None:
    capture, result = Path(sys.argv[1]), Path(sys.argv[2])
    settings = Settings(**json.loads((result / "report.json").read_text())["settings"])
    with Store(result) as store:
        recovery = Recovery(read_capture(capture), store, settings, Progress(), None)
        lit = recovery.lit_diffuse()
        held_out = views(capture, recovery)
        base, albedo = recovery.base_color(), recovery.albedo
        specular = recovery.specular().specular
        raw, _ = quotient(np.maximum(lit.radiance - specular, 0), recovery.irradiance)
        by_medians = {"excess": np.zeros_like(recovery.specular().excess)}
        measured = albedo.origin == MEASURED
        well_observed = measured & (lit.tier == 0) & (lit.count >= 6)
        limit = projected_truth(held_out, len(lit.count), albedo.rho)
        rows = (
            ("Base Color as written", psnr(held_out, base)),
            ("without the compensation for Principled's layering", psnr(held_out, albedo.rho)),
            ("that, and glossy things lighting by their median", psnr(held_out, albedo_with(recovery, **by_medians))),
            (
                "... and the specular part left in the median",
                psnr(held_out, albedo_with(recovery, **by_medians, rest=lit)),
            ),
            ("plain quotient: neither filled in nor shrunk, unseen black", psnr(held_out, np.nan_to_num(raw))),
            ("albedo on measured elements only", psnr(held_out, albedo.rho, measured)),
            ("albedo on elements with six or more clean observations", psnr(held_out, albedo.rho, well_observed)),
            ("the truth itself through the texels (limit of the sampling)", psnr(held_out, limit)),
        )
    for name, value in rows:
        sys.stdout.write(f"{value:6.2f} dB  {name}\n")


if __name__ == "__main__":
    main()
