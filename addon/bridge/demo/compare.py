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

    Base colours are means over the surface that the frames see, of all parts of an object; what they don't see nobody
    can recover. Model, roughness, F0 and lamp are the main part's.
    """
    truth = json.loads((capture / "truth" / "materials.json").read_text())
    true_colours = seen_albedo(read_capture(capture))
    entries = json.loads((result / "materials.json").read_text())["objects"]
    recovered = {entry["object_id"]: entry for entry in entries}
    rows = [("object", "model", "base colour", "(true)", "roughness", "(true)", "F0", "(true)", "lamp", "(true)")]
    for true in truth:
        if true["id"] not in recovered:
            rows.append([true["class_name"], "missing", *[""] * 8])
            continue
        entry, glossy = recovered[true["id"]], true["alpha"] is not None
        material = from_json(entry)
        colour = base_color([part for part in entries if true["id"] in (part["object_id"], part.get("part_of"))])
        pairs = (
            (None if material.model.gives_light else colour, None if true["emission"] else true_colours[true["id"]]),
            (None if material.alpha is None else material.alpha**0.5, true["alpha"] ** 0.5 if glossy else None),
            (material.f0, true["f0"] if glossy else None),
            (material.emission, true["emission"]),
        )
        rows.append([true["class_name"], material.model.name, *(numbers(value) for pair in pairs for value in pair)])
    widths = [max(map(len, column)) for column in zip(*rows)]
    return "\n".join("  ".join(cell.ljust(width) for cell, width in zip(row, widths)).rstrip() for row in rows)


def base_color(parts: list[dict]) -> np.ndarray:
    """Mean base colour of an object's parts, entries of materials.json, over what the frames see of them."""
    colours = []
    for part in parts:
        material = from_json(part)
        colours.append(material.model.base_color(np.float32([part["evidence"]["albedo"]]), material)[0])
    seen = [part["evidence"]["area"] * part["evidence"]["seen_share"] for part in parts]
    return np.average(colours, axis=0, weights=seen if any(seen) else None)


def numbers(value) -> str:
    """One number or several, or nothing."""
    return "" if value is None else " ".join(f"{x:.2f}" for x in np.atleast_1d(value))


def seen_albedo(capture: Capture) -> dict[int, np.ndarray]:
    """True base colour of each object, averaged over what the capture's frames see of it; NaN if nothing."""
    scene = RayScene(capture.mesh.vertices, capture.mesh.triangles)
    means = {}
    for obj in room():
        points, colours, share = obj.samples()
        normals = np.repeat(obj.normals(), points.shape[1], 0)
        normals /= np.linalg.norm(normals, axis=1, keepdims=True)
        points = points.reshape(-1, 3) + 1e-4 * normals
        visible = np.zeros(len(points), bool)
        for frame in capture.frames:
            camera = frame.camera
            pixels, depth = camera.project(points)
            ray = camera.centre - points
            distance = np.linalg.norm(ray, axis=1)
            facing = (ray * normals).sum(1) > VISIBILITY.min_cosine * distance
            inside = ((pixels >= 0) & (pixels < (camera.width, camera.height))).all(1) & (depth > 0)
            indices = np.flatnonzero(facing & inside & ~visible)
            rays = points[indices], ray[indices] / distance[indices, None], distance[indices]
            visible[indices] = ~scene.occluded(*(values.astype(np.float32) for values in rays))
        weight = share.ravel() * visible
        means[obj.object_id] = weight @ colours.reshape(-1, 3) / weight.sum() if visible.any() else np.full(3, np.nan)
    return means
