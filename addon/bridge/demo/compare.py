"""The demo's closing table: what was recovered of each object beside what is true."""

import json
from pathlib import Path

import bpy
import numpy as np

from ...core.io.exr import read_exr
from ...core.io.read import read_capture
from ...core.kinds import Workload
from ...core.passes.albedo.albedo import MEASURED
from ...core.scene.model import Capture
from ...core.scene.rays import RayScene
from ..data.arrays import layer_of, read
from ..data.images import image_array
from ..data.materials import BASE_COLOR, METALLIC, ROUGHNESS, alpha_of, brdf_of, emission, f0_of, principled
from ..data.mesh_objects import ATLAS_UV
from ..marks import OBJECT_ID
from .room import room

MIN_COSINE: Workload[float] = 0.2
"""More slanting views count as none, as in the method."""


def comparison(capture: Path, result: Path) -> str:
    """A table of what the open scene says of each object beside what is true.

    Base colours are means over the surface that the frames see; what they don't see nobody can recover.

    Parameters
    ----------
    capture : Path
        The demo's, with its truth.
    result : Path
        The result folder whose scene is open.
    """
    truth = json.loads((capture / "truth" / "materials.json").read_text())
    true_colours = seen_albedo(read_capture(capture))
    measured = read_exr(result / "coverage.exr").rgb[::-1, :, 2] == MEASURED
    things = {thing[OBJECT_ID]: thing for thing in bpy.data.objects if OBJECT_ID in thing}
    rows = [("object", "model", "base colour", "(true)", "roughness", "(true)", "F0", "(true)", "lamp", "(true)")]
    for known in truth:
        row = [known["class_name"]]
        if known["id"] in things:
            found, gloss = describe(things[known["id"]], measured), known["alpha"] is not None
            true_colour = None if known["emission"] is not None else true_colours[known["id"]]
            row += [found["model"], numbers(found["base_color"]), numbers(true_colour)]
            row += [numbers(found["roughness"]), numbers(known["alpha"] ** 0.5 if gloss else None)]
            row += [numbers(found["f0"]), numbers(known["f0"] if gloss else None)]
            row += [numbers(found["emission"]), numbers(known["emission"])]
        else:
            row += ["missing", *[""] * 8]
        rows.append(row)
    widths = [max(map(len, column)) for column in zip(*rows)]
    return "\n".join("  ".join(cell.ljust(width) for cell, width in zip(row, widths)).rstrip() for row in rows)


def numbers(value) -> str:
    """One number or several, or nothing."""
    return "" if value is None else " ".join(f"{one:.2f}" for one in np.atleast_1d(value))


def describe(thing, measured: np.ndarray) -> dict:
    """What the material of a recovered object says: model, mean base colour, roughness, F0, radiance."""
    material = thing.data.materials[0]
    value, brdf = principled(material).inputs, brdf_of(material)
    return {
        "model": brdf.name,
        "base_color": None if brdf.gives_light else mean_base_color(thing, value[BASE_COLOR], measured),
        "roughness": None if alpha_of(material) is None else value[ROUGHNESS].default_value,
        "f0": None if value[METALLIC].default_value else f0_of(material),
        "emission": emission(material) if brdf.gives_light else None,
    }


def mean_base_color(thing, socket, measured: np.ndarray) -> np.ndarray:
    """Base colour as an object's texture shows it, averaged over its `measured` texels ((h, w) bool), (3,) float."""
    if not socket.links:
        return np.array(socket.default_value[:3])
    pixels = image_array(socket.links[0].from_node.image)
    uv, area = layer_of(thing.data, ATLAS_UV), read(thing.data.polygons, "area")
    corners = np.array([(a, b, 8 - a - b) for a in range(9) for b in range(9 - a)]) / 8
    at = np.einsum("tkc,wk->twc", uv.reshape(-1, 3, 2), 0.97 * corners + 0.01)  # clear of the islands' edges
    size = np.array(pixels.shape[1::-1])
    x, y = np.moveaxis(np.clip((at * size).astype(int), 0, size - 1), -1, 0)
    weight = area[:, None] * (measured[y, x] if measured[y, x].any() else 1)
    return (pixels[y, x, :3] * weight[..., None]).sum((0, 1)) / weight.sum()


def seen_albedo(capture: Capture) -> dict[int, np.ndarray]:
    """True base colour of each object, averaged over what the capture's frames see of it; NaN if nothing."""
    scene = RayScene(capture.mesh.vertices, capture.mesh.triangles)
    means = {}
    for thing in room():
        points, colours, share = thing.samples(max(64, 6000 // len(thing.quads)))
        normals = np.repeat(thing.normals(), points.shape[1], 0)
        normals /= np.linalg.norm(normals, axis=1, keepdims=True)
        points = points.reshape(-1, 3) + 1e-4 * normals
        seen = np.zeros(len(points), bool)
        for frame in capture.frames:
            camera = frame.camera
            pixels, depth = camera.project(points)
            ray = camera.centre - points
            distance = np.linalg.norm(ray, axis=1)
            facing = (ray * normals).sum(1) > MIN_COSINE * distance
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
