"""The demo's closing table: what was recovered of each object beside what is true."""

import json
from pathlib import Path

import numpy as np

from ...core.brdf.material import from_json
from ...core.io.read import read_capture
from ...core.scene.model import Capture
from ...core.scene.params import VISIBILITY
from ...core.scene.rays import RayScene
from .room import room


def comparison(capture: Path, result: Path) -> str:
    """A table of what materials.json says of each object beside what is true.

    Base colours are means over the surface that the frames see; what they don't see nobody can recover.

    Parameters
    ----------
    capture : Path
        The demo's, with its truth.
    """
    truth = json.loads((capture / "truth" / "materials.json").read_text())
    true_colours = seen_albedo(read_capture(capture))
    recovered = {one["object_id"]: one for one in json.loads((result / "materials.json").read_text())["objects"]}
    rows = [("object", "model", "base colour", "(true)", "roughness", "(true)", "F0", "(true)", "lamp", "(true)")]
    for known in truth:
        if known["id"] not in recovered:
            rows.append([known["class_name"], "missing", *[""] * 8])
            continue
        entry, gloss = recovered[known["id"]], known["alpha"] is not None
        found = from_json(entry)
        colour = found.model.base_color(np.float32([entry["evidence"]["albedo"]]), found)[0]
        pairs = (
            (None if found.model.gives_light else colour, None if known["emission"] else true_colours[known["id"]]),
            (None if found.alpha is None else found.alpha**0.5, known["alpha"] ** 0.5 if gloss else None),
            (found.f0, known["f0"] if gloss else None),
            (found.emission, known["emission"]),
        )
        rows.append([known["class_name"], found.model.name, *(numbers(one) for pair in pairs for one in pair)])
    widths = [max(map(len, column)) for column in zip(*rows)]
    return "\n".join("  ".join(cell.ljust(width) for cell, width in zip(row, widths)).rstrip() for row in rows)


def numbers(value) -> str:
    """One number or several, or nothing."""
    return "" if value is None else " ".join(f"{one:.2f}" for one in np.atleast_1d(value))


def seen_albedo(capture: Capture) -> dict[int, np.ndarray]:
    """True base colour of each object, averaged over what the capture's frames see of it; NaN if nothing."""
    scene = RayScene(capture.mesh.vertices, capture.mesh.triangles)
    means = {}
    for thing in room():
        points, colours, share = thing.samples()
        normals = np.repeat(thing.normals(), points.shape[1], 0)
        normals /= np.linalg.norm(normals, axis=1, keepdims=True)
        points = points.reshape(-1, 3) + 1e-4 * normals
        seen = np.zeros(len(points), bool)
        for frame in capture.frames:
            camera = frame.camera
            pixels, depth = camera.project(points)
            ray = camera.centre - points
            distance = np.linalg.norm(ray, axis=1)
            facing = (ray * normals).sum(1) > VISIBILITY.min_cosine * distance
            inside = ((pixels >= 0) & (pixels < (camera.width, camera.height))).all(1) & (depth > 0)
            ask = np.flatnonzero(facing & inside & ~seen)
            seen[ask] = ~scene.occluded(
                points[ask].astype(np.float32),
                (ray[ask] / distance[ask, None]).astype(np.float32),
                distance[ask].astype(np.float32),
            )
        weight = share.ravel() * seen
        means[thing.object_id] = weight @ colours.reshape(-1, 3) / weight.sum() if seen.any() else np.full(3, np.nan)
    return means
