"""Held-out views predicted from a result without rendering: each element's diffuse light and its lobe's.

It is no render: light goes no further than the recovered light field. But what a wrong model, lobe or albedo makes of a
view shows, in a second.
"""

import numpy as np

from ..core.kinds import Workload
from ..core.light.emitters import bright_triangles
from ..core.light.lobes import highlight
from ..core.photo import MIDDLE_GREY, srgb
from ..core.pipeline.recover import Recovery

PIXELS: Workload[int] = 1500
"""Of each view."""
RAYS: Workload[int] = 64


def rerender_psnr(recovery: Recovery, seen: list[dict], seed: int = 0) -> float:
    """Mean PSNR (dB) in display values of `truth_views.views` as the result would show them.

    The exposure puts each view's median luminance to middle grey. Lamps, glass and pixels at edges are left out.
    """
    materials = {m.object_id: m for m in recovery.materials()}
    left_out = [i for i, m in materials.items() if m.model.gives_light or m.model.see_through]
    rng = np.random.default_rng(seed)
    element, direction, true, view = [], [], [], []
    for number, one in enumerate(seen):
        usable = np.flatnonzero(one["inside"] & ~np.isin(one["id"], left_out) & np.isfinite(one["image"]).all(1))
        chosen = rng.choice(usable, min(PIXELS, len(usable)), replace=False)
        element.append(one["element"][0][chosen])
        direction.append(one["directions"][chosen])
        true.append(one["image"][chosen] / max(float(np.median(one["image"][usable].mean(1))), 1e-12) * MIDDLE_GREY)
        view.append(np.full(len(chosen), number))
    element, direction, true, view = (np.concatenate(x) for x in (element, direction, true, view))
    shown = _shown(recovery, materials, element, np.asarray(direction, np.float32), seed)
    result = []
    for number, one in enumerate(seen):
        own = view == number
        usable = one["inside"] & ~np.isin(one["id"], left_out) & np.isfinite(one["image"]).all(1)
        level = MIDDLE_GREY / max(float(np.median(one["image"][usable].mean(1))), 1e-12)
        error = srgb(shown[own] * level) - srgb(true[own])
        result.append(-10 * np.log10(max(float(np.mean(error**2)), 1e-12)))
    return float(np.mean(result))


def _shown(recovery: Recovery, materials: dict, element: np.ndarray, direction: np.ndarray, seed: int) -> np.ndarray:
    """Radiance of elements towards a camera, (m, 3)."""
    field = recovery.field
    object_id = field.atlas.object_id[element]
    shown = recovery.albedo.rho[element] * recovery.irradiance[element] / np.float32(np.pi)
    bright = bright_triangles(field)
    for i in np.unique(object_id):
        m = materials[i]
        if not m.model.has_lobe:
            continue
        own = np.flatnonzero(object_id == i)
        lobe = highlight(
            field, bright, element[own], direction[own], m.alpha, m.f0, m.model.microfacets, rays=RAYS,
            threads=recovery.settings.threads, seed=seed,
        )  # fmt: skip
        shown[own] = shown[own] + lobe if m.model.has_diffuse else lobe
    return shown
