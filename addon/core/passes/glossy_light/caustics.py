"""Light of bright surfaces by way of glossy ones, followed from its source (photon mapping, Jensen 1996).

A lamp's highlight on a metal is a point of light that one ray in thousands meets by chance, and it may throw a good
part of a room's light. So photons are sent from the bright triangles; the glossy elements that they meet scatter
them by their lobe, and where they land they are irradiance. Each carries pi L / (number * density) at first, and then

    f <n,wo> / p(wo),    of GGX 2 G1(n.wo) F <n,wo>,

as directions are drawn from the lobe's visible normals (Heitz, JCGT 2018; f = G D F of `paper.brdf`). A glossy surface
that is itself bright was taken to send its L_d; the lobe's part of that goes by photons of negative power.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from ...brdf.fresnel import fresnel
from ...brdf.ggx import GGX, LEAST
from ...brdf.model import Microfacets
from ...kinds import Block
from ...light.directions import cosine_hemisphere, sobol
from ...light.emitters import BrightTriangles, sample_bright
from ...light.field import LightField
from ...light.less_noise import cells
from ...light.params import LESS_NOISE
from ...parallel import ordered_map
from ...scene.atlas import Atlas
from ...scene.tangent_frame import tangent_frame, to_world
from ...significance import LEVELS
from .params import GLOSSY

AT_ONCE: Block[int] = 1 << 15


@dataclass(frozen=True)
class Gloss:
    """What each of the n elements reflects besides its diffuse part.

    Attributes
    ----------
    alpha : (n,) float32
        0: nothing.
    f0 : (n, 3) float32
    inside : (n, 3) float32
        The lobe's part of the L_d that it is taken to send.
    kind : (n,) int8 or int
        Which of the `microfacets`.
    """

    alpha: np.ndarray
    f0: np.ndarray
    inside: np.ndarray
    microfacets: tuple[Microfacets, ...] = (GGX,)
    kind: np.ndarray | int = 0

    def by_lobe(self, element: np.ndarray) -> Iterator[tuple[np.ndarray, Microfacets, float]]:
        """Glossy elements by lobe: indices into `element`, microfacets, alpha."""
        alpha = self.alpha[element]
        kind = np.broadcast_to(self.kind, self.alpha.shape)[element]
        for width in np.unique(alpha[alpha > 0]):
            for number, microfacets in enumerate(self.microfacets):
                index = np.flatnonzero((alpha == width) & (kind == number))
                if len(index):
                    yield index, microfacets, float(width)


@dataclass(frozen=True)
class _Light:
    """Photons on their way: where each is, where it goes, what it carries (radiance * steradian * square metre)."""

    origin: np.ndarray
    direction: np.ndarray
    power: np.ndarray

    def part(self, index: np.ndarray) -> _Light:
        return _Light(self.origin[index], self.direction[index], self.power[index])


def caustics(
    room: LightField,
    bright: BrightTriangles,
    gloss: Gloss,
    seed: int = 0,
    photons: int = GLOSSY.photons,
    threads: int = 0,
) -> np.ndarray:
    """E by way of glossy reflections of what bright triangles send, less what was taken for it.

    Parameters
    ----------
    room : LightField
        With its lamps. Mirrors stop photons.

    Returns
    -------
    (n, 3) float32
        Radiance * steradian, for every element.
    """
    if not len(bright) or not gloss.alpha.any():
        return np.zeros((len(room.atlas), 3), np.float32)
    cube = sobol(photons, seed, 5)
    rng = np.random.default_rng([seed, 2])
    landed, power = [], []
    for start in range(0, photons, AT_ONCE):
        part = cube[start : start + AT_ONCE]
        pick = sample_bright(bright, part[None, :, :3])
        normal = bright.normal[pick.index]
        direction = to_world(cosine_hemisphere(part[:, None, 3:]), normal)[:, 0]
        share = (np.float32(np.pi) / (photons * pick.density))[:, None]
        sender = room.lookup(pick.triangle, pick.u, pick.v)
        origin = room.scene.off_surface(pick.point, normal)
        # The lobe's part of a bright surface's light comes by photons from elsewhere.
        diffuse = np.maximum(room.radiance[sender] - gloss.inside[sender], 0)
        outgoing = _Light(origin, direction, np.concatenate([diffuse, -gloss.inside[sender]], 1) * share)
        element, place, index = _traced(room, outgoing)
        landed.append(element)
        power.append(outgoing.power[index, 3:])
        for _ in range(GLOSSY.bounces):
            incoming = _Light(place, outgoing.direction[index], outgoing.power[index, :3])
            outgoing = _scattered(room, gloss, element, incoming, rng)
            if not len(outgoing.origin):
                break
            element, place, index = _traced(room, outgoing)
            landed.append(element)
            power.append(outgoing.power[index])
    return _over_cells(room.atlas, np.concatenate(landed), np.concatenate(power), threads)


def _traced(room: LightField, light: _Light) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The elements that photons meet from the front, the places there, and which photons those are."""
    hits = room.scene.intersect(light.origin, light.direction)
    element = room.elements(hits)
    front = np.einsum("ij,ij->i", light.direction, room.normal[hits.triangle]) < -LEAST
    index = np.flatnonzero((element >= 0) & front)
    place = light.origin[index] + hits.distance[index, None] * light.direction[index]
    return element[index], place, index


def _scattered(room: LightField, gloss: Gloss, element: np.ndarray, light: _Light, rng: np.random.Generator) -> _Light:
    """The photons after scattering at glossy elements."""
    glossy = np.flatnonzero(gloss.alpha[element] > 0)
    element, light = element[glossy], light.part(glossy)
    normal = room.atlas.normal[element]
    axes = np.stack([*tangent_frame(normal), normal])
    incoming = -np.einsum("amj,mj->am", axes, light.direction)
    incoming[2] = np.maximum(incoming[2], LEAST)
    outgoing, share = np.zeros_like(incoming), np.zeros((len(element), 3), np.float32)
    for index, microfacets, alpha in gloss.by_lobe(element):
        square = rng.random((2, len(index)), np.float32)
        outgoing[:, index], w_h, weight = microfacets.reflect(incoming[:, index], square, alpha)
        share[index] = fresnel(w_h[:, None], gloss.f0[element[index]]) * weight[:, None]
    alive = np.flatnonzero(share.any(1))
    direction = np.einsum("amj,am->mj", axes[:, alive], outgoing[:, alive]).astype(np.float32)
    origin = room.scene.off_surface(light.origin[alive], normal[alive])
    return _Light(origin, direction, light.power[alive] * share[alive])


def _over_cells(atlas: Atlas, at: np.ndarray, power: np.ndarray, threads: int) -> np.ndarray:
    """Power of photons over area, (n, 3) float32: means over cells of several shifted grids.

    Where a cell got too few photons for a mean, what it got is spread over a cell twice as wide, together with what
    others of that kind got there: all power stays. Few is told by Kish's effective sample size, (sum w)^2 / sum w^2.
    """
    count, weight = len(atlas), np.abs(power).sum(1)
    columns = (*power.T, weight, weight**2)
    landed = [np.bincount(at, values, count).astype(np.float32) for values in columns] + [atlas.area]
    result = np.zeros((3, count), np.float32)

    def spread(portion: tuple[np.ndarray, np.ndarray, int]) -> np.ndarray:
        """Add the means of cells with no less than the least sample; returns the elements of the others."""
        elements, group, least = portion
        *total, weights, squares, area = (np.bincount(group, values[elements]) for values in landed)
        enough = (weights**2 >= least * squares)[group]
        for row, values in zip(result, total, strict=True):
            row[elements[enough]] += (values / np.maximum(area, 1e-12))[group[enough]]
        return elements[~enough]

    for k in range(LESS_NOISE.grids):
        left = np.arange(count)
        for doubled in range(GLOSSY.doublings + 1):
            least = LEVELS.enough if doubled < GLOSSY.doublings else 0
            portions = cells(atlas.position[left], atlas.normal[left], k / LESS_NOISE.grids, 2.0**doubled)
            places = ((left[index], group, least) for index, group in portions)
            left = np.concatenate([left[:0], *ordered_map(spread, places, threads)])
    return result.T / np.float32(LESS_NOISE.grids)
