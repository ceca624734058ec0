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


def without_excess(recovery: Recovery) -> np.ndarray:
    """The albedo had glossy things thrown what their medians say."""
    other = copy.copy(recovery)
    found = recovery.specular()
    other.done = recovery.done | {"specular": dataclasses.replace(found, excess=np.zeros_like(found.excess))}
    for name in ("irradiance", "albedo"):
        other.__dict__.pop(name, None)
    return other.albedo.rho


def main() -> int:
    capture, result = Path(sys.argv[1]), Path(sys.argv[2])
    settings = Settings(**json.loads((result / "report.json").read_text())["settings"])
    with Store(result) as store:
        recovery = Recovery(read_capture(capture), store, settings, Progress(), None)
        lit, shading = recovery.lit_diffuse(), recovery.shading()
        seen = views(capture, recovery)
        base, albedo = recovery.base_color(), recovery.albedo
        specular = recovery.specular().specular
        raw, _ = quotient(np.maximum(lit.radiance - specular, 0), recovery.irradiance)
        medians = without_excess(recovery)
        measured = albedo.origin == MEASURED
        good = measured & (lit.tier == 0) & (lit.count >= 6)
        limit = projected_truth(seen, len(lit.count), albedo.rho)
        rows = (
            ("Base Color as written", psnr(seen, base)),
            ("without the compensation for Principled's layering", psnr(seen, albedo.rho)),
            ("that, and glossy things lighting by their median", psnr(seen, medians)),
            ("... and the specular part left in the median", psnr(seen, recovery.albedo_under(shading.irradiance).rho)),
            ("plain quotient: neither filled in nor shrunk, unseen black", psnr(seen, np.nan_to_num(raw))),
            ("albedo on measured elements only", psnr(seen, albedo.rho, measured)),
            ("albedo on elements with six or more clean observations", psnr(seen, albedo.rho, good)),
            ("the truth itself through the texels (limit of the sampling)", psnr(seen, limit)),
        )
    for name, value in rows:
        sys.stdout.write(f"{value:6.2f} dB  {name}\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
