"""Specular fit: error in roughness and F0 over their whole range, by rays, sampler, views, elements and grid.

A textured room with a lamp, its floor glossy. What frames see of the floor is made with rays of another sampler
(the distribution of normals, for the true phi alone), and then disturbed: noise, frames that are off by a shift of
their own, clipped highlights. Each alternative fits the same observations.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np

from ..core.brdf import ggx as brdf
from ..core.brdf.fresnel import rise
from ..core.fit.problem import Problem
from ..core.kinds import Workload
from ..core.light.directions import shifted, sobol
from ..core.light.emitters import bright_triangles
from ..core.light.environment import Environment
from ..core.light.field import LightField
from ..core.light.lobes import GRID, LobeLight, reflected_light
from ..core.paper.fit import fit_lobe
from ..core.paper.irradiance import uniform_hemisphere
from ..core.passes.specular.models import choose_model
from ..core.scene.tangent_frame import to_world
from .run import Options
from .synthetic import ROOM, synthetic_capture
from .table import BASELINE, Curves, Table
from .timing import once

FLOOR: Workload[int] = 4
CEILING: Workload[int] = 5
"""Objects of `synthetic_capture`."""
LAMP: Workload[float] = 30.0
PHIS: Workload[tuple[float, float, float, float]] = (0.02, 0.1, 0.3, 0.9)
F0S: Workload[tuple[float, float, float, float]] = (0.02, 0.04, 0.2, 0.9)
LARGE_PHIS: Workload[tuple[float, ...]] = (0.02, 0.05, 0.1, 0.2, 0.4, 0.9)
LARGE_F0S: Workload[tuple[float, ...]] = (0.02, 0.04, 0.1, 0.3, 0.9)
ELEMENTS: Workload[int] = 120
VIEWS: Workload[int] = 12
LARGE_ELEMENTS: Workload[int] = 350
LARGE_VIEWS: Workload[int] = 30
TRUE_RAYS: Workload[int] = 1024
LARGE_TRUE_RAYS: Workload[int] = 4096
PAPERS = "paper: one frame, uniform rays"
OURS = "default"


@dataclass(frozen=True)
class Rival:
    """A way to fit: with how many rays, of which sampler, to how much of the observations."""

    rays: int = 256
    sampler: str = "lobes"
    way: str = "frames"
    elements: float = 1.0
    views: float = 1.0
    grid: np.ndarray = field(default_factory=lambda: GRID)


RIVALS = {
    PAPERS: Rival(sampler="uniform", way="target"),
    "one frame, our rays": Rival(way="target"),
    "many frames, uniform rays": Rival(sampler="uniform"),
    OURS: Rival(),
    "64 rays": Rival(rays=64),
    "1024 rays": Rival(rays=1024),
    "a third of the views": Rival(views=1 / 3),
    "a third of the elements": Rival(elements=1 / 3),
    "8 phi in the grid": Rival(grid=GRID[1::2]),
}


@dataclass(frozen=True)
class Case:
    """What is wrong with the observations."""

    noise: float = 0.0
    shift: float = 0.0
    clipped: bool = False


CASES = {
    "clean": Case(),
    "3 % noise": Case(0.03),
    "off by 1 cm": Case(0.03, 0.01),
    "off by 2 cm": Case(0.03, 0.02),
    "clipped highlights": Case(0.03, clipped=True),
}


def run(options: Options) -> Iterator[Table]:
    """The tables of this stage: alternatives case by case, then phi and F0 one by one."""
    rows = list(_measure(options))
    alternatives = [
        (case, name, name == PAPERS, *(float(np.mean(x)) for x in zip(*found, strict=True)))
        for (case, name), found in _grouped(rows, (0, 1))
    ]
    yield Table(
        "specular",
        "Specular fit: mean error over phi and F0",
        ("case", "alternative", BASELINE, "roughness error", "relative F0 error", "CPU seconds"),
        alternatives,
        (
            "Roughness is sqrt(phi). Relative error of F0: |log(found / true)|, no more than log 10.",
            "Noise of 3 % in all cases but 'clean'. Off by: each frame by a shift of its own of that length. Clipped: "
            "observations above twice the median are left out.",
            f"phi {_listed(_sweep(options)[0])}; F0 {_listed(_sweep(options)[1])}.",
        ),
        Curves("case", "alternative", "CPU seconds", "roughness error"),
    )
    single = [row for row in rows if row[0] == "3 % noise" and row[1] in (PAPERS, OURS)]
    yield Table(
        "specular-range",
        "Specular fit: error by phi and F0, 3 % noise",
        ("phi", "F0", "alternative", BASELINE, "roughness error", "relative F0 error"),
        [(phi, f0, name, name == PAPERS, *errors[:2]) for _, name, phi, f0, *errors in single],
    )


def _sweep(options: Options) -> tuple[tuple[float, ...], tuple[float, ...]]:
    return (LARGE_PHIS, LARGE_F0S) if options.large else (PHIS, F0S)


def _listed(values) -> str:
    return ", ".join(f"{value:g}" for value in values)


def _grouped(rows, by):
    """Rows' last three cells by the cells `by`, in the rows' order."""
    found: dict = {}
    for row in rows:
        found.setdefault(tuple(row[i] for i in by), []).append(row[4:])
    return found.items()


def _measure(options: Options) -> Iterator[tuple]:
    """(case, alternative, phi, F0, roughness error, F0 error, CPU seconds)."""
    scene = Scene(options)
    phis, f0s = _sweep(options)
    lights = {}
    for rival in RIVALS.values():
        key = rival.rays, rival.sampler, len(rival.grid)
        if key not in lights:
            timing = once(lambda rival=rival: scene.light(rival))
            lights[key] = timing.value, timing.cpu_seconds
    for done, phi in enumerate(phis):
        true = {shift: scene.true_light(phi, shift) for shift in {case.shift for case in CASES.values()}}
        for f0 in f0s:
            for case_name, case in CASES.items():
                radiance, usable = scene.observed(case, true[case.shift], f0)
                for name, rival in RIVALS.items():
                    light, seconds = lights[rival.rays, rival.sampler, len(rival.grid)]
                    problem = scene.problem(radiance, usable, light, rival)
                    timing = once(lambda p=problem, r=rival: _fit(*p, r))
                    found_phi, found_f0 = timing.value
                    off = abs(np.log(max(found_f0, 1e-9) / f0))
                    share = len(problem[0].element) / len(scene.element)
                    yield (case_name, name, phi, f0, abs(np.sqrt(found_phi) - np.sqrt(phi)), min(off, np.log(10)),
                           seconds * share + timing.cpu_seconds)  # fmt: skip
        options.progress.update((done + 1) / len(phis))


def _fit(problem: Problem, lit_diffuse: np.ndarray, rival: Rival) -> tuple[float, float]:
    """phi and F0, as the product finds them; L_d of each observation is what the paper's way takes off."""
    if rival.way == "target":
        lobe = fit_lobe(problem.light.A, problem.light.B, problem.radiance - lit_diffuse, problem.light.grid)
        return lobe.phi, lobe.psi
    fit = choose_model(problem).fit
    return (fit.phi, float(fit.psi.mean())) if fit is not None else (0.25, 0.04)


class Scene:
    """The room, and who sees which element of its floor from where."""

    def __init__(self, options: Options):
        self.threads, self.seed = options.threads, options.seed
        self.true_rays = LARGE_TRUE_RAYS if options.large else TRUE_RAYS
        elements, views = (LARGE_ELEMENTS, LARGE_VIEWS) if options.large else (ELEMENTS, VIEWS)
        rng = np.random.default_rng(options.seed)
        room = synthetic_capture(1, (8, 6), 60_000, options.seed)
        atlas, tile = room.atlas, np.array(ROOM[:2]) / 8
        radiance = _texture(atlas.position)
        # the lamp covers whole triangles: two squares of the ceiling's sixteen either way
        over = (np.abs(atlas.position[:, :2] - 4 * tile) < tile / 2 + 1e-4).all(1) & (atlas.object_id == CEILING)
        radiance[over] = LAMP
        outside = Environment(np.zeros((4, 8, 3), np.float32), np.zeros((4, 8), np.int32))
        self.field = LightField(room.mesh, atlas, room.rays, radiance, outside)
        self.bright = bright_triangles(self.field)
        floor = rng.choice(np.flatnonzero(atlas.object_id == FLOOR), elements, replace=False)
        self.eyes = rng.uniform((0.6, 0.6, 1.2), (ROOM[0] - 0.6, ROOM[1] - 0.6, 2.0), (views, 3))
        element, frame = (i.ravel() for i in np.meshgrid(floor, np.arange(views), indexing="ij"))
        way = self.eyes[frame] - atlas.position[element]
        far = np.linalg.norm(way, axis=1)
        direction = (way / far[:, None]).astype(np.float32)
        origin = room.rays.off_surface(atlas.position[element], atlas.normal[element])
        free = ~room.rays.occluded(origin, direction, (far - 0.01).astype(np.float32)) & (direction[:, 2] > 0.2)
        self.element, self.frame, self.direction = element[free], frame[free], direction[free]

    def light(self, rival: Rival) -> LobeLight:
        """A and B of the observations by the rival's rays."""
        if rival.sampler == "lobes":
            return reflected_light(
                self.field, self.bright, self.element, self.direction, rays=rival.rays, grid=rival.grid,
                threads=self.threads, seed=self.seed,
            )  # fmt: skip
        A, B = self._by_rays(self.field.atlas.position[self.element], self.direction, rival.rays, rival.grid, True)
        return LobeLight(A, B, 0 * A, 0 * B, rival.grid)

    def true_light(self, phi: float, shift: float) -> tuple[np.ndarray, ...]:
        """A, B ((m, 3) each) and the diffuse part of what the frames show where they take each element to be."""
        rng = np.random.default_rng([self.seed, 1])
        turn = rng.uniform(0, 2 * np.pi, len(self.eyes))[self.frame]
        off = shift * np.stack([np.cos(turn), np.sin(turn), 0 * turn], -1)
        position = (self.field.atlas.position[self.element] + off).astype(np.float32)
        way = self.eyes[self.frame] - position
        direction = (way / np.linalg.norm(way, axis=1, keepdims=True)).astype(np.float32)
        A, B = self._by_rays(position, direction, self.true_rays, np.float32([phi]), False)
        return A[:, 0], B[:, 0], _texture(position)

    def observed(self, case: Case, true: tuple[np.ndarray, ...], f0: float) -> tuple[np.ndarray, np.ndarray]:
        """I of each observation, and which are not clipped; a metal has no diffuse part."""
        A, B, diffuse = true
        radiance = f0 * A + B + (diffuse if f0 < 0.15 else 0)
        noise = np.random.default_rng([self.seed, 2]).normal(0, 1, radiance.shape)
        radiance = radiance * np.exp(case.noise * noise)
        brightest = radiance.max(1)
        return radiance, (brightest < 2 * np.median(brightest)) | (not case.clipped)

    def problem(
        self, radiance: np.ndarray, usable: np.ndarray, light: LobeLight, rival: Rival
    ) -> tuple[Problem, np.ndarray]:
        """The rival's part of the observations, and L_d of each: the median of its element's."""
        names, group = np.unique(self.element, return_inverse=True)
        median = np.stack([np.median(radiance[(group == g) & usable], axis=0) if (usable & (group == g)).any()
                           else np.zeros(3) for g in range(len(names))])  # fmt: skip
        chosen = usable & (group < max(rival.elements * len(names), 12))
        chosen &= self.frame < max(rival.views * len(self.eyes), 3)
        if rival.way == "target":
            # the frame in which the highlight stands out most (A1)
            frames = [usable & (self.frame == f) for f in range(len(self.eyes))]
            above = radiance.mean(1) - median[group].mean(1)
            stands_out = [above[seen].std() if seen.sum() > 12 else 0.0 for seen in frames]
            chosen &= self.frame == int(np.argmax(stands_out))
        else:
            counts = np.bincount(group[chosen], minlength=len(names))
            chosen &= counts[group] >= 3
        whole = Problem(self.element, radiance, light, self.direction[:, 2])
        return whole.part(chosen), median[group][chosen]

    def _by_rays(self, position, direction, rays: int, grid: np.ndarray, uniform: bool):
        """A and B by uniform rays for a whole grid, or by normals drawn from GGX's distribution for its one phi."""
        m = len(position)
        A, B = (np.zeros((m, len(grid), 3), np.float32) for _ in range(2))
        rng = np.random.default_rng([self.seed, 3])
        pattern = sobol(rays, self.seed)
        up = np.float32([[0, 0, 1]])
        for start in range(0, m, 64):
            part = slice(start, start + 64)
            wo = direction[part]
            square = shifted(pattern, len(wo), rng)
            if uniform:
                w = to_world(uniform_hemisphere(square), np.repeat(up, len(wo), 0))
                h = w + wo[:, None]
                h /= np.linalg.norm(h, axis=2, keepdims=True)
            else:
                phi = float(grid[0])
                angle = np.arctan(phi * np.sqrt(square[..., 0] / (1 - square[..., 0])))
                turn = 2 * np.pi * square[..., 1]
                h = np.stack([np.sin(angle) * np.cos(turn), np.sin(angle) * np.sin(turn), np.cos(angle)], -1)
                h = h.astype(np.float32)
                w = 2 * np.einsum("mkj,mj->mk", h, wo)[..., None] * h - wo[:, None]
            cosine = np.einsum("mkj,mj->mk", h, wo)
            good = (w[..., 2] > 1e-4) & (cosine > 0)
            n_w, n_wo = np.where(good, w[..., 2], 1), wo[:, 2:]
            origin = self.field.scene.off_surface(position[part], np.repeat(up, len(wo), 0))
            L = np.zeros((*good.shape, 3), np.float32)
            L[good] = self.field.along(np.repeat(origin, rays, 0)[good.ravel()], w[good].astype(np.float32))[0]
            s = rise(np.clip(cosine, 0, 1))
            if uniform:
                f = brdf.lobes(n_w, n_wo, 1 - h[..., 2] ** 2, grid) * (n_w * np.float32(2 * np.pi / rays))[:, None]
            else:  # f cos / density; the density is D (n.h) / (4 w.h)
                f = (brdf.G(n_w, n_wo, phi) * n_w * 4 * cosine / np.maximum(h[..., 2], 1e-6) / rays)[:, None]
            A[part] = np.einsum("mpk,mkc->mpc", f, L * (1 - s)[..., None])
            B[part] = np.einsum("mpk,mkc->mpc", f, L * s[..., None])
        return A, B


def _texture(position: np.ndarray) -> np.ndarray:
    """L_d of the room's surfaces: a pattern of waves, (n, 3) float32."""
    x, y, z = position.astype(np.float64).T
    value = 0.3 + 0.15 * np.sin(9 * x) * np.sin(9 * y + 1) + 0.1 * np.sin(7 * z + x)
    return (value[:, None] * [1.0, 0.8, 0.6]).astype(np.float32)
