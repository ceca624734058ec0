"""Shading: the error of E for its rays and its time, in rooms lit in four ways."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np

from ..core.kinds import Workload
from ..core.light.directions import cosine_hemisphere, shifted, sobol
from ..core.light.emitters import bright_triangles
from ..core.light.field import LightField
from ..core.light.irradiance import direct, gather
from ..core.light.portals import find_portals
from ..core.paper.irradiance import irradiance as uniform
from ..core.paper.irradiance import uniform_hemisphere
from ..core.scene.tangent_frame import to_world
from .lit_rooms import ROOMS, LitRoom, make_room
from .run import Options
from .shading_reference import looked_at, relative_error
from .table import BASELINE, Curves, Table
from .timing import once

ELEMENTS: Workload[int] = 40_000
POINTS: Workload[int] = 1000
PAPER: Workload[tuple[int, int]] = (100, 10_000)
ASKED: Workload[int] = 10_000
"""Rays of the paper's finer setting, whose error the others are to reach."""


def _by_pattern(field: LightField, position, normal, rays: int, seed: int, kind: str) -> np.ndarray:
    """E by `rays` directions: 'uniform' or 'cosine', 'random' or 'Sobol' as in "cosine, Sobol"."""
    rng = np.random.default_rng(seed)
    E = np.zeros((len(position), 3), np.float32)
    pattern = sobol(rays, seed)
    step = max((1 << 18) // rays, 1)
    for start in range(0, len(position), step):
        part = slice(start, start + step)
        count = len(position[part])
        square = shifted(pattern, count, rng) if "Sobol" in kind else rng.random((count, rays, 2), np.float32)
        local = (cosine_hemisphere if "cosine" in kind else uniform_hemisphere)(square)
        directions = to_world(local, normal[part]).reshape(-1, 3)
        origins = np.repeat(field.scene.off_surface(position[part], normal[part]), rays, 0)
        radiance = field.along(origins, directions)[0].reshape(count, rays, 3)
        weight = np.float32(np.pi) if "cosine" in kind else np.float32(2 * np.pi) * local[..., 2:3]
        E[part] = (radiance * weight).mean(1)
    return E


def _aimed(field: LightField, bright, portals, position, normal, rays: int, seed: int) -> np.ndarray:
    """E by `rays` in all: without portals a quarter aimed at lamps, else half at portals and an eighth at lamps."""
    portal_rays = rays // 2 if portals else 0
    lamp_rays = (rays // 8 if portals else rays // 4) if len(bright) else 0
    around = rays - lamp_rays - portal_rays
    E, _, _ = gather(field, bright, position, normal, around, lamp_rays, seed, portals, portal_rays)
    return E + direct(field, bright, position, normal, around, lamp_rays, seed + 1)[0]


def _alternatives(room: LitRoom, seed: int) -> dict[str, tuple[tuple[int, ...], Callable]]:
    """Name -> how many rays are tried, and the estimator: (field, position, normal, rays, seed) -> E."""

    targets = bright_triangles(room.field), find_portals(room.field, seed)  # found once for a whole surface

    def pattern(kind):
        return lambda field, p, n, rays, seed: _by_pattern(field, p, n, rays, seed, kind)

    return {
        "uniform": (
            (*PAPER[:1], 1000, *PAPER[1:]),
            lambda f, p, n, rays, seed: uniform(f, p, n, rays, threads=1, seed=seed)[0],
        ),
        "uniform, Sobol": ((128, 1024, 8192), pattern("uniform, Sobol")),
        "cosine": ((64, 512, 4096), pattern("cosine, random")),
        "cosine, Sobol": ((16, 64, 256, 1024, 4096), pattern("cosine, Sobol")),
        "cosine and aimed": (
            (8, 16, 32, 64, 128, 256, 512),
            lambda f, p, n, rays, seed: _aimed(f, *targets, p, n, rays, seed),
        ),
    }


def _rays_for(rays: list[int], errors: list[float], wanted: float) -> float | None:
    """Rays at which an alternative's error falls to `wanted`, between its measured points; None if it does not."""
    for i, error in enumerate(errors):
        if error <= wanted:
            if i == 0:
                return float(rays[0])
            a, b = np.log([errors[i - 1], max(error, 1e-12)])
            share = (a - np.log(wanted)) / max(a - b, 1e-12)
            return float(np.exp(np.log(rays[i - 1]) + share * np.log(rays[i] / rays[i - 1])))
    return None


def run(options: Options) -> Iterator[Table]:
    """Tables of single points, and of what reaches the paper's error."""
    points = POINTS * (4 if options.large else 1)
    rows, needed = [], []
    for done, name in enumerate(ROOMS):
        room = make_room(name, ELEMENTS, options.seed, options.threads)
        element, true = looked_at(room, points, options)
        position, normal = room.atlas.position[element], room.atlas.normal[element]
        found: dict[str, tuple[list[int], list[float]]] = {}
        for alternative, (counts, estimate) in _alternatives(room, options.seed).items():
            for rays in counts:
                timing = once(lambda: estimate(room.field, position, normal, rays, options.seed))  # noqa: B023
                error = relative_error(timing.value, true)
                rows.append(
                    (
                        name,
                        alternative,
                        alternative == "uniform" and rays in PAPER,
                        rays,
                        error,
                        1e6 * timing.cpu_seconds / len(element),
                    )
                )
                found.setdefault(alternative, ([], []))
                found[alternative][0].append(rays)
                found[alternative][1].append(error)
        wanted = found["uniform"][1][found["uniform"][0].index(ASKED)]
        for alternative, (counts, errors) in found.items():
            rays = ASKED if alternative == "uniform" else _rays_for(counts, errors, wanted)
            needed.append((name, alternative, alternative == "uniform", wanted, rays, ASKED / rays if rays else None))
        options.progress.update((done + 1) / len(ROOMS))
    yield Table(
        "shading", "Shading: error of E at single points",
        ("room", "estimator", BASELINE, "rays", "relative RMSE", "microseconds a point"), rows,
        ("Error against a converged reference (furnace: against the exact value) at "
         f"{points} points; processor time.",),
        Curves("room", "estimator", "rays", "relative RMSE"),
    )  # fmt: skip
    yield Table(
        "shading-rays", f"Shading: rays a point for the error of {ASKED} uniform rays",
        ("room", "estimator", BASELINE, "error", "rays", "times fewer"), needed,
        ("No figure: not reached with the most rays tried.",),
    )  # fmt: skip
