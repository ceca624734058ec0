"""Coverage of a result's 90 % intervals, in the room's held-out views."""

import numpy as np

from addon.core.brdf.material import Z90
from addon.core.passes.albedo.albedo import MEASURED
from addon.core.pipeline.recover import Recovery

MIN_POINTS = 2
"""Pixels of the views from which on an element's true albedo is known."""
MIN_ELEMENTS = 20
"""Known and measured elements from which on an object's mean is judged."""


def interval_coverage(recovery: Recovery, held_out: list[dict], truth: dict[int, dict]) -> dict[str, float]:
    """By area: of Base Color's elements, measured and filled in; of objects' means; of roughnesses.

    Parameters
    ----------
    held_out : list of dict
        `truth_views.views` of the room.
    truth : dict
        Of `truth/materials.json`, by object_id.
    """
    atlas, albedo, evidence = recovery.surface().atlas, recovery.albedo, recovery.evidence
    materials = {m.object_id: m for m in recovery.materials()}
    base = recovery.base_color()
    true = projected_truth(held_out, len(atlas), np.full_like(base, np.nan))
    points = sum(np.bincount(v["element"][:, v["counts"]].ravel(), minlength=len(atlas)) for v in held_out)
    with_albedo = [i for i, m in materials.items() if m.model.has_albedo]
    known = np.isfinite(true).all(1) & (points >= MIN_POINTS) & np.isin(atlas.object_id, with_albedo)
    # The errors are those of the diffuse albedo; Base Color is greater by what the specular layer takes.
    scale = np.maximum(base / np.maximum(albedo.rho, 1e-3), 1)
    covered = (np.abs(base - true) <= Z90 * scale * evidence.texels.albedo + 1e-6).mean(1)
    measured = albedo.origin == MEASURED
    means = []
    for entry in evidence.objects:
        elements = known & measured & (atlas.object_id == entry.object_id)
        if elements.sum() >= MIN_ELEMENTS and entry.albedo_low is not None:
            mean, mean_scale = (np.average(x[elements], 0, atlas.area[elements]) for x in (true, scale))
            low, high = np.array(entry.albedo_low) * mean_scale, np.array(entry.albedo_high) * mean_scale
            means.append(((low <= mean) & (mean <= high)).mean())
    in_interval = [
        m.roughness_low <= np.sqrt(truth[i]["alpha"]) <= m.roughness_high
        for i, m in materials.items()
        if i in truth and m.model.has_lobe and m.roughness_low is not None and truth[i]["alpha"] is not None
    ]

    def share(chosen: np.ndarray) -> float:
        area = atlas.area[chosen]
        return float((covered[chosen] * area).sum() / area.sum()) if chosen.any() else float("nan")

    return {
        "measured": share(known & measured),
        "filled in": share(known & ~measured),
        "objects' means": float(np.mean(means)) if means else float("nan"),
        f"roughness ({len(in_interval)})": float(np.mean(in_interval)) if in_interval else float("nan"),
    }


def projected_truth(held_out: list[dict], count: int, fallback: np.ndarray) -> np.ndarray:
    """The best that elements could reach: the mean of the held-out views' true albedo at each."""
    total, hits = np.zeros((count, 3)), np.zeros(count)
    for view in held_out:
        for element in view["element"]:
            ok = view["counts"]
            for c in range(3):
                total[:, c] += np.bincount(element[ok], view["truth"][ok, c], count)
            hits += np.bincount(element[ok], minlength=count)
    return np.where(hits[:, None] > 0, total / np.maximum(hits, 1)[:, None], fallback)
