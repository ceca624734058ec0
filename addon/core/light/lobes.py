"""Reflected light of many observations for every phi of the grid at once: one set of rays, weighted anew for each phi.

Rays are drawn from a few lobes of different width (by visible normals, weights <= 1) and from the bright triangles; the
balance heuristic over all of them makes the same rays serve any phi in between. Every observation is computed twice,
with rays of its own each time: their difference gives the noise of their mean, which the fit takes out.

Rays aimed at the openings to the outside (`portals`) were tried as well: of the same number of rays the
noise of A stayed as it was for broad lobes (0.43 to 0.40 of the radiance on the living room's floor, 0.13 to 0.14 on a
panel) and grew by 15 to 40 % for narrow ones.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike

from ..brdf import ggx
from ..brdf.fresnel import rise
from ..brdf.model import Microfacets
from ..kinds import Block, Code
from ..paper.brdf import G1
from ..parallel import for_blocks
from ..scene.tangent_frame import dot, tangent_frame
from .emitters import BrightTriangles, aimed_density, sample_bright
from .field import LightField
from .params import GATHER

GRID = np.array(
    [0.01, 0.02, 0.035, 0.055, 0.08, 0.11, 0.15, 0.2, 0.26, 0.33, 0.41, 0.5, 0.6, 0.72, 0.85, 1], np.float32
)
"""phi of the grid search: close to equal steps in its square root, which is what Blender's users see."""
RAYS_AT_ONCE: Block[int] = 1 << 16
ANY: Code[int] = -2


@dataclass(frozen=True)
class LobeLight:
    """I_nd(phi, psi) = psi * A + B for m observations.

    Attributes
    ----------
    A, B : (m, p, 3) float32
        For each phi of the grid; radiance, linear Rec.709.
    A_noise, B_noise : (m, p, 3) float32
        Half the difference between two independent halves of the rays: their products have the expectation of the
        (co)variances of A and B.
    grid : (p,) float32
        phi.
    """

    A: np.ndarray
    B: np.ndarray
    A_noise: np.ndarray
    B_noise: np.ndarray
    grid: np.ndarray = field(default_factory=lambda: GRID)

    def part(self, chosen: np.ndarray) -> LobeLight:
        """Those of the observations `chosen` ((m,) bool or indices)."""
        return LobeLight(self.A[chosen], self.B[chosen], self.A_noise[chosen], self.B_noise[chosen], self.grid)

    def widened(self, variance: np.ndarray) -> LobeLight:
        """The same, of a surface whose normal varies within each pixel.

        phi^2 grows by the variance (Kaplanyan et al. 2016, "Filtering distributions of normals for shading
        antialiasing"): A and B of the wider lobe, interpolated in the grid.

        Parameters
        ----------
        variance : (m,) float32
            Of the normal, summed over the axes, radians^2.
        """
        root = np.sqrt(self.grid)
        phi_root = np.minimum((np.square(self.grid) + variance[:, None]) ** 0.25, root[-1])
        low = np.clip(np.searchsorted(root, phi_root, "right") - 1, 0, len(root) - 2)
        share = ((phi_root - root[low]) / np.diff(root)[low])[..., None].astype(np.float32)

        def between(values: np.ndarray) -> np.ndarray:
            below, above = (np.take_along_axis(values, index[..., None], 1) for index in (low, low + 1))
            return below + share * (above - below)

        A, B, A_noise, B_noise = (between(x) for x in (self.A, self.B, self.A_noise, self.B_noise))
        return LobeLight(A, B, A_noise, B_noise, self.grid)

    def as_exact(self) -> LobeLight:
        """The same, taken to have no noise."""
        return LobeLight(self.A, self.B, 0 * self.A_noise, 0 * self.B_noise, self.grid)


def nearest(grid: np.ndarray, phi: float) -> int:
    """Index of the phi next to this one, in roughness."""
    return int(np.argmin(np.abs(np.sqrt(grid) - np.sqrt(phi))))


def reflected_light(
    room: LightField,
    bright: BrightTriangles,
    element: np.ndarray,
    direction: np.ndarray,
    *,
    rays: int,
    grid: np.ndarray = GRID,
    proposals: Sequence[float] = GATHER.proposals,
    microfacets: Microfacets = ggx.GGX,
    turned: bool = False,
    threads: int = 0,
    seed: int = 0,
) -> LobeLight:
    """A and B of every observation.

    Parameters
    ----------
    element : (m,) int
    direction : (m, 3) float32
        Unit, from the element to the camera (w_o).
    rays : int
        For each observation, in two halves; shared evenly between the lobes and the bright triangles.
    proposals : sequence of float
        Widths of the lobes that rays are drawn from: those of the grid, where that is known to be short.
    microfacets : Microfacets
        Whose lobes; rays are drawn from GGX's for any of them.
    turned : bool
        Turn each observation's rays about the lobe by an angle of its own. At fixed angles few rays are biased, which a
        mean over neighbours keeps; of many, those at fixed angles have less noise.
    """
    m, p = len(element), len(grid)
    halves = np.zeros((m, 2, p, 6), np.float32)
    half = rays // 2
    per_proposal = max(half // (len(proposals) + bool(len(bright))), 1)

    def run(part: slice) -> None:
        rng = np.random.default_rng([seed, part.start])
        elements = np.repeat(element[part], 2)
        n, wo = room.atlas.normal[elements], np.repeat(direction[part], 2, 0)
        axes = np.stack([*tangent_frame(n), n]).transpose(0, 2, 1)[..., None]  # (3 axes, 3, m, 1): +Z is the normal
        local_wo = np.stack([dot(axis, wo.T[..., None])[:, 0] for axis in axes])
        local_wo[2] = np.maximum(local_wo[2], 1e-4)
        origin = room.scene.off_surface(room.atlas.position[elements], n)
        directions, targets = [], []  # targets: the triangle that a ray must meet, or `ANY`
        for phi in proposals:
            h = ggx.sample_visible_normal(local_wo, _stratified(len(elements), per_proposal, rng, turned), phi)
            directions.append(2 * dot(h, local_wo[..., None]) * h - local_wo[..., None])
            targets.append(np.full((len(elements), per_proposal), ANY, np.int32))
        if len(bright):
            cube = rng.random((len(elements), per_proposal, 3), np.float32)
            cube[..., 0] = (np.arange(per_proposal, dtype=np.float32) + cube[..., 0]) / per_proposal
            pick = sample_bright(bright, cube)
            aimed = pick.point.T.reshape(3, len(elements), per_proposal) - origin.T[..., None]
            aimed /= np.maximum(np.sqrt(dot(aimed, aimed)), 1e-9)
            directions.append(np.stack([dot(axis, aimed) for axis in axes]))
            targets.append(pick.triangle.reshape(len(elements), per_proposal))
        w = np.concatenate(directions, 2).astype(np.float32)
        L, density = _arriving(room, bright, origin, w, axes, np.concatenate(targets, 1).ravel())
        density *= per_proposal

        n_w, n_wo = np.maximum(w[2], 1e-4), local_wo[2][:, None]
        cosine = dot(w, local_wo[..., None])  # w.wo, from which |w + wo|, w.h and n.h follow
        hx, hy = w[0] + local_wo[0][:, None], w[1] + local_wo[1][:, None]
        sin2_h = np.minimum((hx * hx + hy * hy) / np.maximum(2 + 2 * cosine, 1e-9), 1)
        s = rise(np.sqrt(np.clip((1 + cosine) / 2, 0, 1)))
        # G1(n.wo) D / 2 is the density of `ggx.visible_normal_density`
        for phi in proposals:
            a = np.float32(phi * phi)
            base = sin2_h + a * (1 - sin2_h)
            density += per_proposal * a / (2 * np.float32(np.pi)) * G1(n_wo, phi) / (base * base)
        L *= (n_w / np.maximum(density, 1e-12))[..., None]
        weighted = np.concatenate([L * (1 - s)[..., None], L * s[..., None]], -1)
        halves[part] = (microfacets.lobes(n_w, n_wo, sin2_h, grid) @ weighted).reshape(-1, 2, p, 6)

    for_blocks(run, m, max(RAYS_AT_ONCE // max(rays, 1), 1), threads)
    mean, noise = halves.mean(1), (halves[:, 0] - halves[:, 1]) / 2
    return LobeLight(mean[..., :3], mean[..., 3:], noise[..., :3], noise[..., 3:], np.asarray(grid, np.float32))


def highlight(
    room: LightField,
    bright: BrightTriangles,
    element: np.ndarray,
    direction: np.ndarray,
    alpha: float,
    f0: ArrayLike,
    microfacets: Microfacets,
    *,
    rays: int,
    threads: int = 1,
    seed: int = 0,
) -> np.ndarray:
    """Radiance of lobes of one width, (m, 3) float32; parameters are those of `reflected_light`.

    Parameters
    ----------
    alpha : float
        Narrower ones are taken for the narrowest of `GRID`.
    f0 : float, (3,) or (m, 3) float32
    """
    width = max(alpha, float(GRID[0]))
    light = reflected_light(
        room, bright, element, direction, rays=rays, grid=np.array([width], np.float32), proposals=(width,),
        microfacets=microfacets, turned=True, threads=threads, seed=seed,
    )  # fmt: skip
    return np.asarray(f0, np.float32) * light.A[:, 0] + light.B[:, 0]


def _arriving(room, bright, origin, w, axes, targets) -> tuple[np.ndarray, np.ndarray]:
    """Radiance along local directions w ((3, m, k)) and the density with which one is aimed: (m, k, 3), (m, k).

    A ray that something keeps from what it was aimed at gives nothing: what it meets is left to the other rays, whose
    densities there do not count it.
    """
    _, m, k = w.shape
    above = np.flatnonzero(w[2].ravel() > 1e-4)
    L, density = np.zeros((m * k, 3), np.float32), np.zeros(m * k, np.float32)
    directions = np.empty((len(above), 3), np.float32)
    for j in range(3):
        directions[:, j] = dot(w, axes[:, j]).ravel().take(above)
    start = origin.take(above // k, 0)
    hits = room.scene.intersect(start, directions)
    targets = targets.take(above)
    counts = (targets == ANY) | (targets == hits.triangle)
    L[above] = room.arriving(hits, room.elements(hits), directions, origins=start) * counts[:, None]
    if len(bright):
        density[above] = aimed_density(bright, hits, directions, room.normal)
    return L.reshape(m, k, 3), density.reshape(m, k)


def _stratified(count: int, each: int, rng: np.random.Generator, turned: bool) -> np.ndarray:
    """`each` points of the unit square, one in each stratum of either axis, `count` times: (2, count, each) float32.

    Along the second axis in the middles of the strata, or off them by one offset for all points.
    """
    first = (np.arange(each, dtype=np.float32) + rng.random((count, each), np.float32)) / each
    strata = rng.permuted(np.tile(np.arange(each, dtype=np.float32), (count, 1)), axis=1)
    offset = rng.random((count, 1), np.float32) if turned else np.float32(0.5)
    return np.stack([first, (strata + offset) / each])
