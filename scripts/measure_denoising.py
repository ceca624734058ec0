#!/usr/bin/env python3
"""What each part of the mesh denoising gains: meshes without noise are given some, denoised, and compared.

    python scripts/measure_denoising.py CAPTURE... [--noise 5] [--seeds 0 1] [--smooth 0 0.5] [--out FILE.md]

Noise in millimetres along the normal; `smooth` is the share of its variance that is a smooth field, the rest is
independent from vertex to vertex (scripts/perturb_capture.py). Each part is left out by itself (`--without`). For every
triangle: how far its middle is off, root mean square over the surface, and how far its normal is turned, mean over the
surface. No Blender is needed.
"""

from __future__ import annotations

import argparse
import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from addon.core.io.read import read_capture
from addon.core.passes.mesh_denoising.denoise import without_noise
from addon.core.scene.elements import triangle_geometry
from addon.core.scene.model import Mesh
from scripts.perturb_capture import SEAM, offsets, vertex_normals

PARTS = ("", "unfolding", "angle-variance", "sheets", "cracks")
"""'' has all of them."""


def with_noise(mesh: Mesh, metres: float, share: float, seed: int) -> Mesh:
    """The mesh as a scanner has it."""
    _, first, place = np.unique(
        np.round(mesh.vertices / SEAM).astype(np.int64), axis=0, return_index=True, return_inverse=True
    )
    place = place.ravel()
    off = offsets(mesh.vertices[first], metres, share, np.random.default_rng([seed, 1]))
    normal = vertex_normals(mesh.vertices, mesh.triangles, place)
    return replace(mesh, vertices=mesh.vertices + (normal * off[:, None])[place])


def errors(mesh: Mesh, truth: Mesh) -> tuple[float, float]:
    """Millimetres and degrees by which a mesh is off."""
    normal, area = triangle_geometry(truth)
    turned, _ = triangle_geometry(mesh)
    middle = (mesh.vertices - truth.vertices)[mesh.triangles].mean(1)
    angle = np.degrees(np.arccos(np.clip((normal * turned).sum(1), -1, 1)))
    return float(np.sqrt(np.average((middle**2).sum(1), weights=area)) * 1e3), float(np.average(angle, weights=area))


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("captures", nargs="+", type=Path)
    parser.add_argument("--noise", type=float, default=5.0)
    parser.add_argument("--seeds", type=int, nargs="+", default=[0, 1])
    parser.add_argument("--smooth", type=float, nargs="+", default=[0.0, 0.5])
    parser.add_argument("--out", type=Path)
    given = parser.parse_args()
    lines = [
        f"Noise of {given.noise:g} mm; seeds {', '.join(map(str, given.seeds))}. Gain: the error without the part less "
        "the error with it, mean ± standard deviation over the seeds.",
        "",
        "| mesh | smooth share | noisy | denoised | seconds | " + " | ".join(f"gain of {p}" for p in PARTS[1:]) + " |",
        "|" + " --- |" * (5 + len(PARTS) - 1),
    ]
    for capture in given.captures:
        truth = read_capture(capture).mesh
        for share in given.smooth:
            before, found, seconds = [], {part: [] for part in PARTS}, {part: 0.0 for part in PARTS}
            for seed in given.seeds:
                noisy = with_noise(truth, given.noise / 1e3, share, seed)
                before.append(errors(noisy, truth))
                for part in PARTS:
                    started = time.process_time()
                    mesh, _ = without_noise(noisy, (part,) if part else ())
                    seconds[part] += (time.process_time() - started) / len(given.seeds)
                    found[part].append(errors(mesh, truth))
            lines.append(row(capture.name, share, before, found, seconds))
            sys.stdout.write(lines[-1] + "\n")
            sys.stdout.flush()
    if given.out:
        given.out.write_text("\n".join(lines) + "\n")
    return 0


def row(name: str, share: float, before: list, found: dict[str, list], seconds: dict[str, float]) -> str:
    """A line of the table."""
    whole = np.array(found[""])
    cells = [name, f"{share:g}"]
    cells += [f"{millimetres:.2f} mm, {degrees:.2f}°" for millimetres, degrees in (np.mean(before, 0), whole.mean(0))]
    cells.append(f"{seconds['']:.1f}")
    for part in PARTS[1:]:
        gain = np.array(found[part]) - whole
        spread = gain.std(0, ddof=1) if len(gain) > 1 else np.full(2, np.nan)
        cost = seconds[""] - seconds[part]
        cells.append(
            f"{gain[:, 0].mean():+.2f} ± {spread[0]:.2f} mm, {gain[:, 1].mean():+.2f} ± {spread[1]:.2f}°, {cost:+.1f} s"
        )
    return f"| {' | '.join(cells)} |"


if __name__ == "__main__":
    sys.exit(main())
