"""Hard cases of the material: lobes as narrow and as broad as can be, F0 at either end, highlights at grazing angles.

The floor of `tests.core.glossy_box` is looked at; its highlight is summed up by brute force, pixel by pixel.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from addon.core.brdf.dielectric import DIELECTRIC
from addon.core.brdf.lambertian import LAMBERTIAN
from addon.core.brdf.metal import METAL
from addon.core.light.emitters import bright_triangles
from addon.core.light.lobes import reflected_light
from tests.core.glossy_box import GLOW, WALLS, Box, fresnel_rise
from tests.core.rooms import box_sides, look_at, make_room, picture
from tests.hard_cases.rooms import DEFAULT, PAPERS

SETTINGS = replace(DEFAULT, specular_rays=128)
RHO = np.array([0.3, 0.25, 0.2])


class GlossyFloor:
    """A box of prescribed radiance whose floor, and nothing else, is what the frames look at most."""

    def __init__(self, phi: float | None, f0, rho=RHO):
        self.box = Box()
        room, walls = self.box.room, {i: WALLS[i] for i in range(1, 6)} | {6: GLOW}
        self.phi, self.f0 = phi, np.asarray(f0, float) * np.ones(3)
        self.across = 10 if phi == 0.01 else 20
        at = room.atlas
        lit = rho * self.box.irradiance / np.pi
        self.light = np.where((at.object_id == 0)[:, None], lit, room.by_object(walls))
        eyes = [(0.7, 0.7, 1.2), (3.3, 0.8, 1.6), (0.8, 2.2, 1.5), (3.1, 2.3, 1.1), (2.0, 0.4, 1.8), (2.0, 2.6, 1.0)]
        self.views = [look_at(eye, target, 30, 24, 80) for eye in eyes for target in ((1.6, 1.2, 0), (2.4, 1.8, 0))]
        self.views += [look_at((2, 1.5, 1.2), (2, 1.5, 1.2) + np.array(way), 24, 24, 100)
                       for way in ((1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0.01, 1))]  # fmt: skip

    def picture(self, camera, index: int) -> np.ndarray:
        """The diffuse picture, and the floor's highlight on top."""
        room = self.box.room
        image = picture(room, camera, self.light).radiance.reshape(-1, 3).astype(float)
        if self.phi is None:
            return image.reshape(camera.height, camera.width, 3)
        directions = camera.directions(camera.pixel_centres())
        hits = room.scene.intersect(np.broadcast_to(camera.centre.astype(np.float32), directions.shape), directions)
        floor = np.flatnonzero((hits.triangle >= 0) & (room.mesh.object_id[hits.triangle] == 0))
        where = camera.centre + hits.distance[floor, None] * directions[floor]
        where[:, 2] = 0
        A, B = self.box.lobe_at(where, -directions[floor].astype(float), self.phi, self.across)
        image[floor] += self.f0 * A + B
        return image.reshape(camera.height, camera.width, 3)

    def recover(self, capture, settings=SETTINGS):
        # The floor's own radiance, as seen in the median, is what the walls get from it: they are not looked at here.
        return capture(self.box.room, self.picture, views=self.views).recover(settings)


@pytest.mark.parametrize("cosine", [1.0, 0.5, 0.2, 0.05], ids=["straight on", "60 degrees", "78 degrees", "87 degrees"])
def test_lobe_in_a_furnace(expect, cosine):
    """All that arrives is 1. A mirror reflects F0 + (1 - F0) s of it, as Fresnel's term; no lobe more than all."""
    room = make_room(box_sides(), 0.25)
    field = room.field(np.ones((len(room.atlas), 3), np.float32))
    element = np.flatnonzero(room.atlas.object_id == 0)[:40]
    way = np.float32([np.sqrt(1 - cosine**2), 0, cosine])
    light = reflected_light(
        field, bright_triangles(field), element, np.broadcast_to(way, (len(element), 3)),
        rays=512, grid=np.float32([0.01, 0.3, 1.0]), threads=2,
    )  # fmt: skip
    assert np.isfinite(light.A).all() and np.isfinite(light.B).all() and min(light.A.min(), light.B.min()) >= 0
    A, B = light.A.mean((0, 2)), light.B.mean((0, 2))
    if cosine >= 0.2:  # beyond, even a lobe of alpha 0.01 is no mirror
        fresnel = fresnel_rise(cosine)
        expect("alpha 0.01, F0 0: Fresnel's rise, absolute", float(abs(B[0] - fresnel)), 0.01)
        expect("alpha 0.01, F0 1: all of it, absolute", float(abs(A[0] + B[0] - 1)), 0.02)
    expect("more than all light, at any alpha", float(max((A + B).max() - 1, 0)), 0.02)


def floor_albedo(run) -> np.ndarray:
    return np.median(run.albedo.rho[run.measured(0)], 0)


def test_f0_of_0(capture, expect):
    """No highlight at all: none may be found."""
    run = GlossyFloor(None, 0).recover(capture)
    floor = run.materials[0]
    expect("a Lambertian floor", float(floor.model != LAMBERTIAN), 0)
    expect("its albedo", float(np.abs(floor_albedo(run) / RHO - 1).max()), 0.02)
    assert floor.f0 is None and floor.alpha is None


@pytest.mark.parametrize("phi", [0.01, 0.1, 1.0], ids=["alpha 0.01", "alpha 0.1", "alpha 1"])
def test_dielectric_over_diffuse(capture, expect, phi):
    """F0 0.04. At alpha 1 the lobe looks diffuse: said to be not identifiable, and its 1 % counted into the albedo."""
    run = GlossyFloor(phi, 0.04).recover(capture)
    floor = run.materials[0]
    off = float(np.abs(floor_albedo(run) / RHO - 1).max())
    if phi == 1.0:
        expect("no lobe is made up", float(floor.model != LAMBERTIAN), 0)
        assert "not identifiable" in floor.note
        expect("albedo, the lobe's 0.012 on top", off, 0.1)
        return
    expect("a lobe is found", float(floor.model != DIELECTRIC), 0)
    expect("roughness (root of alpha), absolute", abs(np.sqrt(floor.alpha) - np.sqrt(phi)), 0.06)
    expect("F0 0.04, absolute", abs(floor.f0 - 0.04), 0.015)
    expect("albedo", off, 0.05)


@pytest.mark.parametrize("phi", [0.01, 1.0], ids=["alpha 0.01", "alpha 1"])
def test_f0_of_1(capture, expect, phi):
    """A mirror, and a metal so rough that it can't be told from a diffuse surface."""
    run = GlossyFloor(phi, 1.0, rho=np.zeros(3)).recover(capture)
    floor = run.materials[0]
    if phi == 1.0:
        expect("no lobe is made up", float(floor.model != LAMBERTIAN), 0)
        assert "not identifiable" in floor.note
        return
    expect("a metal is found", float(floor.model != METAL), 0)
    expect("F0 of 1", float(np.abs(np.array(floor.f0) - 1).max()), 0.1)
    expect("roughness (root of alpha), absolute: 0 for what is sharper than the frames", np.sqrt(floor.alpha), 0.1)


@pytest.mark.parametrize("phi", [0.01, 1.0], ids=["alpha 0.01", "alpha 1"])
def test_the_papers_single_frame_gives_numbers(capture, expect, phi):
    """One target frame, always a lobe: right or not, phi and psi lie within their bounds."""
    run = GlossyFloor(phi, 0.04).recover(capture, replace(PAPERS, shading_rays=256, specular_rays=64))
    floor = run.materials[0]
    assert floor.model == DIELECTRIC and floor.target_frame
    expect("F0 in 0...1", float(max(-floor.f0, floor.f0 - 1, 0)), 0)
    expect("alpha in 0...1", float(max(-floor.alpha, floor.alpha - 1, 0)), 0)


def test_black_glossy_plastic(capture, expect):
    """Albedo 0.02 under a highlight that most frames see some of: the plain median takes it for albedo."""
    black = np.full(3, 0.02)
    run = GlossyFloor(0.09, 0.04, rho=black).recover(capture)
    floor = run.materials[0]
    expect("a lobe is found", float(floor.model != DIELECTRIC), 0)
    expect("albedo 0.02, absolute", float(np.abs(floor_albedo(run) - black).max()), 0.01)
    plain = GlossyFloor(0.09, 0.04, rho=black).recover(capture, replace(SETTINGS, refine=0))
    left = float(np.abs(floor_albedo(plain) - black).max())
    assert left > 0.01, "the median alone does as well: this case tests nothing"
