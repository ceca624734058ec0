#!/usr/bin/env python3
"""Where a recovered albedo's error comes from: PSNR with one part after another taken out or put right.

    python scripts/error_budget.py CAPTURE RESULT

CAPTURE has held-out views with truth in CAPTURE/truth (object_id/, albedo/, transforms.json, materials.json), which
only this script reads. RESULT is what `scan-relight recover` left there, with its stages. No Blender is needed: the
views are traced with embree and show the nearest surface element.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from addon.core.capture.exr import read_exr
from addon.core.capture.model import Camera
from addon.core.capture.read import read_capture
from addon.core.progress import Progress
from addon.core.recover import Recovery
from addon.core.settings import Settings
from addon.core.shading.albedo import MEASURED, quotient
from addon.core.store import Store
from addon.core.surface.elements import ElementLookup

SHIFTS = ((-0.25, -0.25), (0.25, 0.25), (-0.25, 0.25), (0.25, -0.25))


def views(capture: Path, recovery: Recovery) -> list[dict]:
    """For each held-out view: the element under each of four points a pixel, truth, and the pixels that count."""
    surface = recovery.surface()
    lookup = ElementLookup(surface.mesh, surface.atlas)
    spec = json.loads((capture / "truth" / "transforms.json").read_text())
    objects = {o["id"]: o for o in json.loads((capture / "truth" / "materials.json").read_text())}
    plain = {i for i, o in objects.items() if not (o["emission"] or o["metallic"] or o["masked"])}
    found = []
    for frame in spec["frames"]:
        name = Path(frame["file_path"]).name
        camera = Camera(
            *(spec[k] for k in ("w", "h", "fl_x", "fl_y", "cx", "cy")), np.array(frame["transform_matrix"])
        )
        elements = []
        for shift in SHIFTS:
            directions = camera.directions(camera.pixel_centres() + shift)
            origins = np.broadcast_to(camera.centre.astype(np.float32), directions.shape)
            hits = surface.scene.intersect(origins, directions)
            element = np.full(len(directions), -1)
            hit = hits.triangle >= 0
            element[hit] = lookup(hits.triangle[hit], hits.u[hit], hits.v[hit])
            elements.append(element)
        ids = np.rint(read_exr(capture / "truth" / "object_id" / name).rgb[..., 0]).astype(int)
        counts = np.isin(ids, list(plain))
        counts[1:] &= ids[1:] == ids[:-1]
        counts[:, 1:] &= ids[:, 1:] == ids[:, :-1]
        truth = read_exr(capture / "truth" / "albedo" / name).rgb.reshape(-1, 3)
        element = np.stack(elements)
        found.append({"element": element, "truth": truth, "counts": counts.ravel() & (element >= 0).all(0)})
    return found


def psnr(seen: list[dict], value: np.ndarray, only: np.ndarray | None = None) -> float:
    """Mean PSNR over the views of elements' values ((n, 3)); `only` ((n,) bool) restricts it to some elements."""
    result = []
    for view in seen:
        counts = view["counts"] if only is None else view["counts"] & only[view["element"]].all(0)
        shown = value[view["element"]].mean(0)
        error = np.clip(shown[counts], 0, 1) - np.clip(view["truth"][counts], 0, 1)
        if counts.sum() > 100:
            result.append(-10 * np.log10(np.mean(error**2)))
    return float(np.mean(result))


def projected_truth(seen: list[dict], count: int, fallback: np.ndarray) -> np.ndarray:
    """The truth as elements could hold it at best: the mean of what the held-out views themselves show of each."""
    total, hits = np.zeros((count, 3)), np.zeros(count)
    for view in seen:
        for element in view["element"]:
            ok = view["counts"]
            for c in range(3):
                total[:, c] += np.bincount(element[ok], view["truth"][ok, c], count)
            hits += np.bincount(element[ok], minlength=count)
    return np.where(hits[:, None] > 0, total / np.maximum(hits, 1)[:, None], fallback)


def main() -> int:
    capture, result = Path(sys.argv[1]), Path(sys.argv[2])
    settings = Settings(**json.loads((result / "report.json").read_text())["settings"])
    with Store(result) as store:
        recovery = Recovery(read_capture(capture), store, settings, Progress(), None)
        lit, shading = recovery.lit_diffuse(), recovery.shading()
        seen = views(capture, recovery)
        base, albedo = recovery.base_color(), recovery.albedo
        raw, _ = quotient(np.maximum(lit.radiance - recovery.specular().specular, 0), shading.irradiance)
        measured = albedo.origin == MEASURED
        good = measured & (lit.tier == 0) & (lit.count >= 6)
        limit = projected_truth(seen, len(lit.count), albedo.rho)
        rows = (
            ("Base Color as written", psnr(seen, base)),
            ("without the compensation for Principled's layering", psnr(seen, albedo.rho)),
            ("... and the specular part left in the median", psnr(seen, shading.albedo.rho)),
            ("... and neither filled in nor steadied: plain quotient, unseen black", psnr(seen, np.nan_to_num(raw))),
            ("albedo on measured elements only", psnr(seen, albedo.rho, measured)),
            ("albedo on elements with six or more clean observations", psnr(seen, albedo.rho, good)),
            ("the truth itself through the texels (limit of the sampling)", psnr(seen, limit)),
        )
    for name, value in rows:
        sys.stdout.write(f"{value:6.2f} dB  {name}\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
