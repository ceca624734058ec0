"""Diffuse, dielectric or metal, each of one colour: told apart with a single view of each element."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from addon.core.brdf.dielectric import DIELECTRIC
from addon.core.brdf.lambertian import LAMBERTIAN
from addon.core.brdf.metal import METAL
from addon.core.passes.specular.by_looks import coated_by_looks, metal_by_looks
from addon.core.passes.specular.intervals import gloss_interval
from addon.core.passes.specular.models import Choice
from addon.core.passes.specular.of_class import adopt_from_class
from addon.core.passes.specular.one_colour import compare, compare_coat
from tests.core.fit.test_fit import paint, steps
from tests.core.glossy_box import WALLS, Box

COPPER = np.array([0.9, 0.6, 0.3])
CONTRAST = WALLS * np.array([1, 1, 0.2, 2.5, 0.3, 1.5])[:, None]
"""A room to be seen in a metal: walls bright and dark."""
UNSURE = Choice(LAMBERTIAN, None, note="Too few observations to look for a highlight.")


@pytest.fixture(scope="module")
def box():
    return Box(CONTRAST)


@pytest.fixture(scope="module")
def irradiance(box):
    return box.irradiance


@pytest.fixture(scope="module")
def floor(box, irradiance):
    """Makes the problem of a floor of which each element is seen once."""

    def make(phi, psi, rho, elements=120):
        element, direction, _ = box.views(elements, 1)
        return box.problem(element, direction, phi, psi, rho * irradiance[element] / np.pi, noise=0.05)

    return make


def test_a_metal(floor, irradiance):
    problem = floor(0.11, COPPER, 0.0)
    looks = compare(problem, irradiance)
    assert looks.ratio < 0.5 and looks.sigmas > 4 and steps(looks.phi, 0.11) <= 1
    choice = metal_by_looks(UNSURE, looks, problem)
    assert choice.model == METAL and choice.looks is looks and "metal" in choice.note
    assert np.allclose(choice.fit.psi, COPPER, rtol=0.1)
    low, high = gloss_interval(choice, problem).roughness
    assert low < np.sqrt(0.11) < high and high - low > 0.4, "it is told from one view each: wide"


@pytest.mark.parametrize(
    ("phi", "psi", "rho"),
    [(None, 0, 0.5), (0.06, 0.04, 0.5), (0.11, 0.04, 0.1), (0.06, 0.05, 0.01), (0.11, 0.05, 0.0)],
    ids=["diffuse", "coated", "dark and coated", "black and coated", "nothing but a coat"],
)
def test_what_is_no_metal(floor, irradiance, phi, psi, rho):
    """Least clear is black gloss: it shows the room as a metal does; a dielectric explains it as well."""
    problem = floor(phi, psi, rho)
    looks = compare(problem, irradiance)
    assert metal_by_looks(UNSURE, looks, problem) is UNSURE


def test_texture_speaks_for_none(floor, irradiance):
    problem = floor(None, 0, 0.5)
    painted = replace(problem, radiance=problem.radiance * paint(problem.element) / 0.3)
    assert metal_by_looks(UNSURE, compare(painted, irradiance), painted) is UNSURE


def test_what_follows_matt_light_stays_matt(floor, irradiance):
    """A spread that errors of E explain says nothing, however much smaller the metal's is."""
    problem = floor(0.11, COPPER, 0.0)
    looks = compare(problem, irradiance)
    flat = replace(looks, diffuse=0.12, other=0.12, spread=0.03)
    assert metal_by_looks(UNSURE, flat, problem) is UNSURE


def test_too_little_of_it(floor, irradiance):
    assert compare(floor(0.11, COPPER, 0.0, elements=20), irradiance) is None


def test_likely_metals_follow_their_class(floor, irradiance):
    problem = floor(0.11, COPPER, 0.0)
    looks = compare(problem, irradiance)
    sure, likely = metal_by_looks(UNSURE, looks, problem), metal_by_looks(UNSURE, replace(looks, sigmas=0.0), problem)
    assert likely.model == LAMBERTIAN and likely.metal is not None
    result = adopt_from_class({0: sure, 1: likely}, {0: problem, 1: problem}, dict.fromkeys(range(2), "tap"))
    assert result[1].model == METAL
    alone = adopt_from_class({1: likely}, {1: problem}, {1: "tap"})
    assert alone[1].model == LAMBERTIAN


def test_reddish_wood_is_no_copper(floor, irradiance):
    """A dark lacquer that shows the room would need an F0 next to nothing in blue, which no metal has."""
    problem = floor(0.11, np.array([0.77, 0.19, 0.06]), 0.0)
    assert metal_by_looks(UNSURE, compare(problem, irradiance), problem) is UNSURE


def test_no_metal_sends_more_than_it_gets(floor, irradiance):
    """A bowl whose light was taken for half of what it is looks like a metal that reflects twice what it gets."""
    problem = floor(0.11, np.full(3, 2.0), 0.0)
    assert compare(problem, irradiance).ratio < 0.5
    assert metal_by_looks(UNSURE, compare(problem, irradiance), problem) is UNSURE


def test_looks_do_not_judge_others_of_the_class(floor, irradiance):
    """A table with a lobe of its own stays as it is."""
    problem = floor(0.11, COPPER, 0.0)
    metal = metal_by_looks(UNSURE, compare(problem, irradiance), problem)
    table = replace(metal, model=DIELECTRIC, looks=None, sigmas=8.0)
    result = adopt_from_class({0: metal, 1: table}, {0: problem, 1: problem}, dict.fromkeys(range(2), "wood"))
    assert result[1].model == DIELECTRIC and result[0].model == METAL


LEAF = np.array([0.03, 0.2, 0.03])
"""A saturated colour: a coat shows in its dark channels."""


@pytest.mark.parametrize("rho", [np.float64(0.01), LEAF], ids=["black", "green"])
def test_a_coat(floor, irradiance, rho):
    problem = floor(0.11, 0.04, rho)
    looks = compare_coat(problem, irradiance)
    assert looks.ratio < 0.7 and steps(looks.phi, 0.11) <= 1
    choice = coated_by_looks(UNSURE, looks)
    assert choice.model == DIELECTRIC and choice.looks is looks and np.allclose(choice.fit.psi, 0.04)
    low, high = gloss_interval(choice, problem).roughness
    assert low < np.sqrt(0.11) < high and high - low > 0.4


def test_nothing_matt_is_coated(floor, irradiance):
    problem = floor(None, 0, LEAF)
    assert coated_by_looks(UNSURE, compare_coat(problem, irradiance)) is UNSURE
    painted = replace(problem, radiance=problem.radiance * paint(problem.element) / 0.3)
    assert coated_by_looks(UNSURE, compare_coat(painted, irradiance)) is UNSURE


def test_what_a_coat_does_not_explain_either(floor, irradiance):
    """A cord as thick as a pixel shows its background: coated it is off by less, but by far too much."""
    looks = compare_coat(floor(0.11, 0.04, LEAF), irradiance)
    assert coated_by_looks(UNSURE, replace(looks, diffuse=0.65, other=0.65, spread=0.4)) is UNSURE


def test_a_coat_by_looks_gives_way_to_one_by_views(floor, irradiance):
    """The class's lobe is that of its members whose views show it; who has none takes it over."""
    problem = floor(0.11, 0.04, LEAF)
    coat = coated_by_looks(UNSURE, compare_coat(problem, irradiance))
    views = replace(coat, looks=None, fit=replace(coat.fit, phi=0.06), sigmas=3.5)
    problems = dict.fromkeys(range(3), problem)
    result = adopt_from_class({0: coat, 1: views, 2: UNSURE}, problems, dict.fromkeys(range(3), "jar"))
    assert result[1].fit.phi == result[2].fit.phi == 0.06
    alone = adopt_from_class({0: coat, 2: UNSURE}, problems, dict.fromkeys((0, 2), "jar"))
    assert alone[2].model == DIELECTRIC and alone[2].fit.phi == coat.fit.phi
