"""What glossy things throw, against sums over all directions that share no rays with the code."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from addon.core.brdf.dielectric import DIELECTRIC
from addon.core.brdf.material import ObjectMaterial
from addon.core.brdf.metal import METAL
from addon.core.passes.glossy_light import glossy_light as glossy_light_module
from addon.core.passes.glossy_light.glossy_light import Excess, glossy_light
from addon.core.passes.glossy_light.params import GLOSSY
from addon.core.scene.tangent_frame import tangent_frame
from tests.core.glossy_box import Box, fresnel_rise
from tests.core.rooms import polygon_irradiance

PSI = 0.2


@pytest.fixture(scope="module")
def box():
    return Box()


def polished(model: str = DIELECTRIC, psi: float = PSI) -> tuple[ObjectMaterial, ...]:
    """The floor is all but a mirror, the rest is diffuse."""
    return (ObjectMaterial(0, "floor", model, alpha=0.01, f0=model.as_f0(psi)),)


def over_the_floor(box: Box, element: np.ndarray, psi: float, across: int = 120) -> np.ndarray:
    """E by way of a mirror in the floor with glass's reflectance, from directions of equal weight, (m, 3)."""
    atlas = box.room.atlas
    u, v = np.meshgrid(*[(np.arange(across) + 0.5) / across] * 2, indexing="ij")
    r, turn = np.sqrt(u.ravel()), 2 * np.pi * v.ravel()
    local = np.stack([r * np.cos(turn), r * np.sin(turn), np.sqrt(1 - r * r)])
    total = np.zeros((len(element), 3))
    for k, e in enumerate(element):
        p, n = atlas.position[e].astype(float), atlas.normal[e : e + 1]
        axes = np.stack([*tangent_frame(n), n])[:, 0].astype(float)
        w = local.T @ axes
        down = w[:, 2] < -1e-6
        hit = p + w[down] * (p[2] / -w[down, 2:])
        inside = ((hit[:, :2] > 0) & (hit[:, :2] < (4.0, 3.0))).all(1)
        w, hit = w[down][inside], hit[inside]
        s = fresnel_rise(-w[:, 2:])
        total[k] = np.pi * ((psi + (1 - psi) * s) * box.arriving(hit, w * (1, 1, -1))).sum(0) / across**2
    return total


def found(box: Box, materials, specular=0.0) -> tuple[np.ndarray, np.ndarray]:
    """The excess at the elements above the floor, and these."""
    atlas = box.room.atlas
    element = np.flatnonzero((atlas.object_id > 0) & (atlas.object_id < 6))
    inside = box.room.by_object({0: specular})
    excess = Excess(box.field, materials, inside)
    return glossy_light(excess, element, np.full((len(element), 3), 20, np.float32), threads=2), element


@pytest.mark.slow
def test_a_polished_floor(box, monkeypatch):
    """The lamp comes back from it to the ceiling and the walls, as from a lamp below the floor."""
    monkeypatch.setattr(glossy_light_module, "GLOSSY", replace(GLOSSY, rays=256))  # next to no noise
    excess, element = found(box, polished())
    some = np.random.default_rng(0).choice(len(element), 150, replace=False)
    truth = over_the_floor(box, element[some], PSI)
    assert excess[some].mean(0) == pytest.approx(truth.mean(0), rel=0.04)
    assert np.corrcoef(excess[some].mean(1), truth.mean(1))[0, 1] > 0.85


def test_what_the_median_held_is_taken_off(box):
    """A part of 0.3 that was in every view of the floor lit the room already."""
    bare, element = found(box, polished())
    held, _ = found(box, polished(), 0.3)
    floor = [q for q in box.room.quads if q.object_id == 0]
    atlas = box.room.atlas
    contribution = polygon_irradiance(atlas.position[element].astype(float), atlas.normal[element].astype(float), floor)
    assert (bare - held).mean() == pytest.approx(0.3 * contribution.sum(1).mean(), rel=0.04)


def test_a_metal_sends_nothing_but_its_lobe(box):
    """Its L_d was no light of its own: with F0 next to 0, all that it threw is taken off, but for grazing views."""
    metal, element = found(box, polished(METAL, 0.02))
    coat, _ = found(box, polished(DIELECTRIC, 0.02), box.walls[0])
    assert metal.mean() < 0 and metal.mean() == pytest.approx(coat.mean(), rel=0.05)


def test_never_more_than_there_is(box):
    excess, element = found(box, polished(METAL, 0.02), 0.0)
    assert excess.min() >= -10 - 1e-4
    nothing = Excess(box.field, (), np.zeros((len(box.room.atlas), 3), np.float32))
    assert not glossy_light(nothing, element, np.ones((len(element), 3), np.float32)).any()
