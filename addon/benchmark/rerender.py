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
SEED: Workload[int] = 0


def rerender_psnr(recovery: Recovery, seen: list[dict]) -> float:
    """Mean PSNR (dB) in display values of `truth_views.views` as the result would show them.

    The exposure puts each view's median luminance to middle grey. Lamps, glass and pixels at edges are left out. Where
    the frames don't tell their radiance's unit, the median ratio to the truth gives it.
    """
    materials = {m.object_id: m for m in recovery.materials()}
    left_out = [i for i, m in materials.items() if m.model.gives_light or m.model.see_through]
    rng = np.random.default_rng(SEED)
    element, direction, true, levels = [], [], [], []
    for view in seen:
        usable = np.flatnonzero(view["inside"] & ~np.isin(view["found"], left_out) & np.isfinite(view["image"]).all(1))
        level = MIDDLE_GREY / max(float(np.median(view["image"][usable].mean(1))), 1e-12)
        chosen = rng.choice(usable, min(PIXELS, len(usable)), replace=False)
        element.append(view["element"][0][chosen])
        direction.append(view["directions"][chosen])
        true.append(view["image"][chosen])
        levels.append(np.full(len(chosen), level, np.float32))
    number = np.repeat(np.arange(len(levels)), [len(texel_levels) for texel_levels in levels])
    element, direction, true, level = (np.concatenate(x) for x in (element, direction, true, levels))
    predicted = _predicted(recovery, materials, element, np.asarray(direction, np.float32))
    if any(frame.uncalibrated for frame in recovery.capture.frames):
        predicted = predicted * np.median(true.mean(1) / np.maximum(predicted.mean(1), 1e-12))
    error = np.mean((srgb(predicted * level[:, None]) - srgb(true * level[:, None])) ** 2, axis=1)
    return float(np.mean([-10 * np.log10(max(float(np.mean(error[number == n])), 1e-12)) for n in range(len(seen))]))


def _predicted(recovery: Recovery, materials: dict, element: np.ndarray, direction: np.ndarray) -> np.ndarray:
    """Radiance of elements towards a camera, (m, 3)."""
    field = recovery.field
    object_id = field.atlas.object_id[element]
    radiance = recovery.albedo.rho[element] * recovery.irradiance[element] / np.float32(np.pi)
    bright = bright_triangles(field)
    for i in np.unique(object_id):
        m = materials[i]
        if not m.model.has_lobe:
            continue
        indices = np.flatnonzero(object_id == i)
        lobe = highlight(
            field, bright, element[indices], direction[indices], m.alpha, m.f0, m.model.microfacets, rays=RAYS,
            threads=recovery.settings.threads, seed=SEED,
        )  # fmt: skip
        radiance[indices] = radiance[indices] + lobe if m.model.has_diffuse else lobe
    return radiance
