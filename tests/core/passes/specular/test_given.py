"""What is given of an object is held, and the rest is fitted under it; in a box whose reflections are known."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from addon.core.brdf.dielectric import DIELECTRIC
from addon.core.brdf.emitter import EMITTER
from addon.core.brdf.lambertian import LAMBERTIAN
from addon.core.brdf.metal import METAL
from addon.core.light.lamps import Lamp
from addon.core.passes.specular.given import fit_given
from addon.core.passes.specular.problems import Problems
from addon.core.pipeline.choose_models import Room
from addon.core.pipeline.specular import Held, Pictures, fit_specular
from addon.core.results.overrides import Given
from addon.core.scene.lit_diffuse import LitDiffuse
from addon.core.scene.samples import Samples
from addon.core.scene.visibility import CLEAN
from addon.core.settings import Settings
from tests.core.fit.test_fit import paint, steps
from tests.core.glossy_box import GLOW, Box
from tests.core.lit_diffuse.test_accumulate import frames_of
from tests.core.rooms import look_at, pixels_of

COPPER = np.array([0.9, 0.6, 0.3])
RAYS = 256
FLOOR, LAMP = 0, 6


class Seen:
    """The box, whose floor has a lobe that many frames show; nothing else of it was looked at twice."""

    def __init__(self, phi, psi, coloured=False):
        self.box = Box()
        self.field = self.box.field
        atlas = self.field.atlas
        element, direction, frame = self.box.views(60, 10)
        diffuse = np.zeros((len(element), 3)) if coloured else paint(element)
        order = np.argsort(element, kind="stable")
        radiance = self.box.problem(element, direction, phi, psi, diffuse).radiance.astype(np.float32)
        self.samples = Samples(
            element[order].astype(np.int32), frame[order].astype(np.int32), radiance[order], direction[order],
            np.zeros(len(element), bool), np.zeros(len(element), np.float32),
        )  # fmt: skip
        n = len(atlas)
        values = self.field.radiance
        self.lit = LitDiffuse(values, np.zeros_like(values), np.full(n, 9, np.int32), np.full(n, CLEAN, np.int8),
                              np.zeros(n, np.float32))  # fmt: skip
        self.maker = Problems(self.field, self.samples, threads=2)
        self.irradiance = self.box.irradiance.astype(np.float32)
        cameras = [look_at((0.5 + 0.3 * i, 1, 1.5), (2, 1.5, 0), 16, 12, 80) for i in range(10)]
        grey = pixels_of(np.ones((12, 16, 3)))
        self.pictures = Pictures(frames_of(cameras), lambda frame: grey, Path())

    def fit(self, given):
        return fit_given(given, self.maker, FLOOR, self.irradiance, RAYS)[0]

    def all(self, given=None, held=None):
        lamp = Lamp(LAMP, np.float32(GLOW), True)
        names = [f"{i:03d}" for i in range(10)]
        room = Room(
            self.box.room.instances, self.field, self.lit, self.irradiance, self.samples, names, (lamp,),
            given=given or {}, settings=Settings(specular_rays=64, refine=1, threads=2),
        )  # fmt: skip
        return fit_specular(room, self.pictures, held)


@pytest.fixture(scope="module")
def glossy():
    return Seen(0.11, 0.08)


@pytest.fixture(scope="module")
def metal():
    return Seen(0.11, COPPER, coloured=True)


def test_a_given_model_alone(glossy, metal):
    found = glossy.fit(Given("specular"))
    assert found.model == DIELECTRIC and steps(found.fit.phi, 0.11) <= 1
    assert found.fit.psi[0] == pytest.approx(0.08, rel=0.2)
    copper = metal.fit(Given("metal"))
    assert copper.model == METAL and steps(copper.fit.phi, 0.11) <= 1
    assert np.allclose(copper.fit.psi, COPPER, rtol=0.08)
    assert glossy.fit(Given("lambertian")).model == LAMBERTIAN


def test_a_given_roughness_is_held_and_f0_fitted(glossy, metal):
    right = glossy.fit(Given(roughness=0.11**0.5))
    assert right.model == DIELECTRIC and right.fit.phi == pytest.approx(0.11)
    assert right.fit.psi[0] == pytest.approx(0.08, rel=0.2)
    off = glossy.fit(Given("specular", roughness=0.2))
    assert off.fit.phi == pytest.approx(0.04) and off.fit.psi[0] < right.fit.psi[0]
    copper = metal.fit(Given("metal", roughness=0.11**0.5))
    assert copper.fit.phi == pytest.approx(0.11) and np.allclose(copper.fit.psi, COPPER, rtol=0.08)


def test_a_given_roughness_makes_a_metal_no_dielectric(metal):
    assert metal.fit(Given(roughness=0.33)).model == METAL


def test_a_given_f0_is_held_and_roughness_fitted(glossy, metal):
    found = glossy.fit(Given(f0=0.08))
    assert found.model == DIELECTRIC and (found.fit.psi == 0.08).all() and steps(found.fit.phi, 0.11) <= 1
    copper = metal.fit(Given(f0=tuple(COPPER)))
    assert copper.model == METAL and np.allclose(copper.fit.psi, COPPER) and steps(copper.fit.phi, 0.11) <= 1


def test_all_given_leaves_nothing_to_fit(glossy):
    found = glossy.fit(Given("metal", 0.0, (0.5, 0.6, 0.7)))
    assert found.model == METAL and found.fit.phi == 0 and np.allclose(found.fit.psi, (0.5, 0.6, 0.7))


def test_descriptions_say_what_was_given(glossy):
    found = glossy.all(
        {
            FLOOR: Given("specular", 0.3),
            1: Given("metal"),
            2: Given("emitter"),
            3: Given("lambertian"),
            4: Given(same_as=5),
            5: Given(same_as=FLOOR),
            LAMP: Given("lambertian"),
        }
    )
    by_id = {m.object_id: m for m in found.materials}
    floor = by_id[FLOOR]
    assert floor.alpha == pytest.approx(0.09) and (floor.roughness_low, floor.roughness_high) == (0.3, 0.3)
    assert floor.f0_low < floor.f0 < floor.f0_high
    assert "given by the user" in floor.note.lower() and floor.observations == 600
    assert by_id[1].model == METAL and by_id[1].observations == 0 and min(by_id[1].f0) > 0.3  # nothing seen: plausible
    assert by_id[2].model == EMITTER and np.all(np.array(by_id[2].emission) > 0)
    assert np.all(np.array(by_id[2].emission) < glossy.box.walls[2])  # what it reflects is not its own
    assert "light" in by_id[2].note
    assert by_id[3].model == LAMBERTIAN and by_id[3].roughness_high is None and by_id[3].f0_high == 0
    for i in (4, 5):  # along the chain
        assert (by_id[i].model, by_id[i].alpha, by_id[i].f0) == (DIELECTRIC, floor.alpha, floor.f0)
        assert by_id[i].object_id == i and by_id[i].roughness_high == floor.roughness_high
    assert by_id[LAMP].model == LAMBERTIAN


def test_all_of_it_given_has_no_interval(glossy):
    floor = glossy.all({FLOOR: Given("specular", 0.3, 0.05)}).materials[FLOOR]
    assert (floor.f0, floor.f0_low, floor.f0_high) == (0.05, 0.05, 0.05)
    assert (floor.roughness_low, floor.roughness_high) == (0.3, 0.3)


def test_a_few_fitted_again_are_what_a_whole_fit_gives(glossy):
    given = {FLOOR: Given("specular", 0.3), 4: Given(same_as=FLOOR)}
    before = glossy.all()
    whole = glossy.all(given)
    few = glossy.all(given, Held(before, {FLOOR, 4}))
    assert before.materials[FLOOR] != whole.materials[FLOOR] == few.materials[FLOOR]
    assert whole.materials[4] == few.materials[4]
    floor = glossy.field.atlas.object_id == FLOOR
    assert np.array_equal(whole.specular[floor], few.specular[floor])
    assert not np.array_equal(before.specular[floor], few.specular[floor])
    assert [m for m in few.materials if m.object_id not in (FLOOR, 4)] == [
        m for m in before.materials if m.object_id not in (FLOOR, 4)
    ]
    assert glossy.all(None, Held(few, {FLOOR})).materials[FLOOR] == before.materials[FLOOR]  # taken back
