"""Truth seen through a capture's held-out cameras, against what surface elements hold. Never read by the pipeline."""

import json
from pathlib import Path

import numpy as np

from ..core.io.exr import read_exr
from ..core.kinds import Workload
from ..core.pipeline.recover import Recovery
from ..core.scene.elements import ElementLookup
from ..core.scene.model import Camera

SHIFTS: Workload[tuple[tuple[float, float], ...]] = ((-0.25, -0.25), (0.25, 0.25), (-0.25, 0.25), (0.25, -0.25))


def views(capture: Path, recovery: Recovery) -> list[dict]:
    """For each held-out view: the element under each of four points a pixel, truth, and the pixels that count.

    'truth' is the albedo, 'image' the radiance, 'id' the object, 'found' the one that the result has there; 'counts'
    are the pixels of one object with an albedo, 'inside' those of any one object; 'directions' lead to the camera.
    """
    surface = recovery.surface()
    lookup = ElementLookup(surface.mesh, surface.atlas)
    spec = json.loads((capture / "truth" / "transforms.json").read_text())
    objects = {o["id"]: o for o in json.loads((capture / "truth" / "materials.json").read_text())}
    plain = {i for i, o in objects.items() if not (o["emission"] or o["metallic"] or o["masked"])}
    result = []
    for frame in spec["frames"]:
        name = Path(frame["file_path"]).name
        camera = Camera(*(spec[k] for k in ("w", "h", "fl_x", "fl_y", "cx", "cy")), np.array(frame["transform_matrix"]))
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
        inside = np.ones(ids.shape, bool)
        inside[1:] &= ids[1:] == ids[:-1]
        inside[:, 1:] &= ids[:, 1:] == ids[:, :-1]
        truth = read_exr(capture / "truth" / "albedo" / name).rgb.reshape(-1, 3)
        element = np.stack(elements)
        inside = inside.ravel() & (element >= 0).all(0)
        result.append({
            "element": element, "truth": truth, "counts": inside & np.isin(ids.ravel(), list(plain)),
            "id": ids.ravel(), "found": surface.atlas.object_id[element[0]], "inside": inside,
            "image": read_exr(capture / "truth" / "image" / name).rgb.reshape(-1, 3),
            "directions": -camera.directions(camera.pixel_centres()),
        })  # fmt: skip
    return result


def psnr(seen: list[dict], value: np.ndarray, only: np.ndarray | None = None) -> float:
    """Mean PSNR over the views of elements' values ((n, 3)); `only` ((n,) bool) restricts it to some elements."""
    result = []
    for view in seen:
        counts = view["counts"] if only is None else view["counts"] & only[view["element"]].all(0)
        image = value[view["element"]].mean(0)
        error = np.clip(image[counts], 0, 1) - np.clip(view["truth"][counts], 0, 1)
        if counts.sum() > 100:
            result.append(-10 * np.log10(np.mean(error**2)))
    return float(np.mean(result))


def pairs(seen: list[dict]) -> dict[tuple[int, int], int]:
    """How many pixels of each true object show which object of the result: the same one, unless parts were found."""
    true_ids, result_ids, inside = (np.concatenate([view[key] for view in seen]) for key in ("id", "found", "inside"))
    pairs_of_ids, count = np.unique(np.stack([true_ids, result_ids], 1)[inside], axis=0, return_counts=True)
    return {(true, recovered): n for (true, recovered), n in zip(pairs_of_ids.tolist(), count.tolist(), strict=True)}
