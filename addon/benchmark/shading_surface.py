"""Shading over the whole surface: with and without interpolation, against raw rays, more texels, and a Cycles bake."""

from __future__ import annotations

import importlib.util
from collections.abc import Iterator

import numpy as np
from scipy import ndimage

from ..core.kinds import Workload
from ..core.light.over_surface import finest_spacing, irradiance
from ..core.paper.irradiance import irradiance as uniform
from ..core.scene.atlas import Atlas
from ..core.settings import Settings
from .lit_rooms import LitRoom, make_room
from .recorded_rays import recorded
from .run import Options
from .shading_reference import looked_at, relative_error
from .table import BASELINE, Curves, Table
from .timing import Timing, alternately, once

PAPER_RAYS: Workload[int] = 100
TEXELS: Workload[tuple[int, int, int]] = (80_000, 320_000, 1_280_000)
"""Surface elements: x1, x4, x16."""
LARGE: Workload[int] = 4
BAKE_SAMPLES: Workload[tuple[int, int]] = (4, 16)


def _setting(**changes) -> dict:
    s = Settings()
    return {"rays": s.shading_rays, "emitter_rays": s.emitter_rays, "portal_rays": s.portal_rays,
            "interpolate": True} | changes  # fmt: skip


WAYS = {
    "uniform, each texel": {"rays": PAPER_RAYS},
    "aimed, each texel, few rays": _setting(rays=16, emitter_rays=8, portal_rays=8, interpolate=False),
    "the same, smoothed": _setting(rays=16, emitter_rays=8, portal_rays=8, interpolate=False),
    "aimed, each texel": _setting(interpolate=False),
    "aimed, interpolated, few rays": _setting(rays=32, emitter_rays=16, portal_rays=16),
    "aimed, interpolated (default)": _setting(),
    "aimed, interpolated, many rays": _setting(rays=512, emitter_rays=64, portal_rays=64),
}
PAPER_WAY, DEFAULT_WAY, SMOOTHED = "uniform, each texel", "aimed, interpolated (default)", "the same, smoothed"


def smoothed(atlas: Atlas, E: np.ndarray) -> np.ndarray:
    """E denoised in the plainest way: a Gaussian over the texels of each island, sigma one texel."""
    image = np.zeros((atlas.size, atlas.size, 4), np.float32)
    image.reshape(-1, 4)[atlas.texel] = np.concatenate([E, np.ones((len(E), 1), np.float32)], 1)
    image = ndimage.gaussian_filter(image, (1, 1, 0), truncate=2).reshape(-1, 4)[atlas.texel]
    return image[:, :3] / image[:, 3:]


def over(room: LitRoom, way: str, options: Options) -> tuple[np.ndarray, int]:
    """E of every element but the lamps' in one of the `WAYS`, and at how many places the hemisphere was gathered."""
    atlas = room.atlas
    if way == PAPER_WAY:
        how = {"threads": options.threads, "seed": options.seed}
        return uniform(room.field, atlas.position, atlas.normal, **WAYS[way], **how)[0], len(atlas)
    E, _, points, _ = irradiance(
        room.field, np.arange(len(atlas)), **WAYS[way], finest=finest_spacing(atlas), threads=options.threads,
        seed=options.seed,
    )  # fmt: skip
    return (smoothed(atlas, E) if way == SMOOTHED else E), points


def surface_tables(rooms: dict[str, LitRoom], options: Options) -> Iterator[Table]:
    """The tables, one by one."""

    size = LARGE if options.large else 1
    rows, best = [], {}
    for done, (name, room) in enumerate(rooms.items()):
        element, true = looked_at(room, 1000, options)
        for way in WAYS:
            with recorded(room.field.scene) as rays:
                found = once(lambda: over(room, way, options))  # noqa: B023
            E, points = found.value
            error = relative_error(E[element], true)
            timing = alternately(
                {
                    "all": lambda: over(room, way, options),  # noqa: B023
                    "raw": lambda: rays.trace(options.threads),
                },
                repeats=2,
            )
            rows.append(
                (
                    name,
                    way,
                    way == PAPER_WAY,
                    error,
                    timing["all"].seconds,
                    len(rays),
                    points,
                    timing["all"].cpu_seconds / timing["raw"].cpu_seconds,
                )
            )
            best[name, way] = error, timing["all"]
        options.progress.update(0.4 + 0.3 * (done + 1) / len(rooms))
    yield Table(
        "shading-surface", "Shading: E over a whole room",
        ("room", "way", BASELINE, "relative RMSE", "seconds", "rays", "gathering points", "time over raw rays"), rows,
        (f"{len(next(iter(rooms.values())).atlas)} texels. 'Time over raw rays': processor time of the whole step over "
         "that of tracing the same rays with embree and nothing else, on all cores.",),
        Curves("room", "way", "seconds", "relative RMSE"),
    )  # fmt: skip
    rows = []
    for name in ("lamp", "window"):
        first = None
        for texels in TEXELS:
            room = make_room(name, texels * size, options.seed, options.threads)
            element, true = looked_at(room, 600, options)
            found = once(lambda: over(room, DEFAULT_WAY, options))  # noqa: B023
            again = once(lambda: over(room, DEFAULT_WAY, options))  # noqa: B023
            seconds = min(found.cpu_seconds, again.cpu_seconds)
            first = first or seconds
            E, points = found.value
            rows.append(
                (name, len(room.atlas), False, relative_error(E[element], true), points, seconds, seconds / first)
            )
        options.progress.update(0.85 if name == "lamp" else 0.9)
    yield Table(
        "shading-texels", "Shading: time when the same surface has more texels",
        ("room", "texels", BASELINE, "relative RMSE", "gathering points", "processor seconds", "times the first"),
        rows, ("Default settings.",),
    )  # fmt: skip
    if importlib.util.find_spec("bpy") is None:
        return
    yield _bake_table(rooms, best, options)


def _bake_table(
    rooms: dict[str, LitRoom], best: dict[tuple[str, str], tuple[float, Timing]], options: Options
) -> Table:
    """Cycles baking the same E on the processor, beside ours."""
    from .cycles_bake import bake

    rows = []
    for name in ("lamp", "window"):
        room = rooms[name]
        element, true = looked_at(room, 1000, options)
        error, timing = best[name, DEFAULT_WAY]
        rows.append((name, "ours (default)", False, None, error, timing.seconds, timing.seconds, 1.0))
        for samples in BAKE_SAMPLES:
            E, seconds = bake(room, samples, options.threads, options.seed)
            theirs = relative_error(E[element], true)
            # Noise falls with the root of the samples; what is extrapolated is only the time.
            equal = seconds * max((theirs / error) ** 2, 1.0)
            rows.append((name, "Cycles bake", False, samples, theirs, seconds, equal, equal / timing.seconds))
    return Table(
        "shading-cycles", "Shading: baking the same E in Cycles on the processor",
        ("room", "tool", BASELINE, "samples", "relative RMSE", "seconds", "seconds for our error", "times ours"), rows,
        ("Diffuse, direct, one bake of the whole atlas: every face emits its L_d. 'Seconds for our error' takes "
         "Cycles' noise to fall with the root of its samples.",),
    )  # fmt: skip
