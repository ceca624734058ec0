"""The choice of model, and what objects take over from their class."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from addon.core.brdf.dielectric import DIELECTRIC, MAX_F0
from addon.core.brdf.lambertian import LAMBERTIAN
from addon.core.brdf.metal import METAL
from addon.core.fit.lobe_fit import element_costs, fit_lobe
from addon.core.fit.problem import DenseProblem
from addon.core.passes.specular import models, of_class
from addon.core.passes.specular.models import Choice, choose_model, metal_f0
from addon.core.passes.specular.of_class import adopt_from_class, share_paint
from addon.core.passes.specular.one_colour import OneColour
from tests.core.fit.test_fit import paint, steps
from tests.core.glossy_box import Box

COPPER = np.array([0.9, 0.6, 0.3])


@pytest.fixture(scope="module")
def seen():
    """Problems of four floors in the same box: as good as diffuse, glossy, metal, and glossy but hardly seen."""
    box = Box()
    element, direction, _ = box.views(60, 10)
    few = element == element[0]
    for one in np.unique(element)[:7]:
        few |= element == one
    glossy = box.problem(element, direction, 0.11, 0.08, paint(element))
    return {
        "diffuse": box.problem(element, direction, None, 0, paint(element)),
        "glossy": glossy,
        "metal": box.problem(element, direction, 0.11, COPPER, np.zeros((len(element), 3))),
        "few": glossy.part(few),
    }


def test_each_gets_the_simplest_model(seen):
    chosen = {name: choose_model(problem) for name, problem in seen.items()}
    models = {name: choice.model for name, choice in chosen.items()}
    assert models == {"diffuse": LAMBERTIAN, "glossy": DIELECTRIC, "metal": METAL, "few": LAMBERTIAN}
    assert chosen["few"].fit is None and chosen["few"].note and chosen["diffuse"].note
    assert not chosen["glossy"].note and not chosen["metal"].note
    assert steps(chosen["glossy"].fit.phi, 0.11) <= 1 and 0.06 < chosen["glossy"].fit.psi[0] < 0.09
    assert chosen["glossy"].gain > 0.02 and chosen["glossy"].sigmas > 3
    assert chosen["diffuse"].gain < 0.02


def test_a_part_needs_less_evidence_and_is_never_metal(seen):
    """A weak highlight in noisy frames: likely, not sure."""
    box = Box()
    element, direction, _ = box.views(60, 8)
    faint = box.problem(element, direction, 0.11, 0.02, paint(element))
    noise = np.exp(0.14 * np.random.default_rng(0).normal(size=(len(element), 1)))
    faint = replace(faint, radiance=(faint.radiance * noise).astype(np.float32))
    assert (choose_model(faint).model, choose_model(faint, part=True).model) == (LAMBERTIAN, DIELECTRIC)
    assert choose_model(seen["diffuse"], part=True).model == LAMBERTIAN
    assert choose_model(seen["metal"], part=True).model != METAL


@pytest.mark.parametrize("seed", range(3))
def test_a_rug_on_a_varnished_floor_says_less_than_all_the_floor(seed):
    """It lies on the tenth of the elements where highlights would be strongest."""
    box, rng = Box(), np.random.default_rng(seed)
    element, direction, _ = box.views(200, 8)
    varnish = box.problem(element, direction, 0.11, 0.04, paint(element))
    bare = box.problem(element, direction, None, 0, paint(element))
    number = np.unique(element, return_inverse=True)[1]
    highlight = np.zeros(200)
    np.maximum.at(highlight, number, (varnish.radiance / bare.radiance).mean(1))
    rug = (highlight > np.quantile(highlight, 0.9))[number]
    noise = np.exp(0.1 * rng.normal(size=(len(element), 1)))
    radiance = np.where(rug[:, None], bare.radiance, varnish.radiance) * noise
    mixed = replace(varnish, radiance=radiance.astype(np.float32))
    found = choose_model(mixed, part=True)
    assert found.model == DIELECTRIC and found.sigmas > 1.1 * choose_model(mixed).sigmas
    all_bare = replace(bare, radiance=(bare.radiance * noise).astype(np.float32))
    assert choose_model(all_bare, part=True).model == LAMBERTIAN


def test_a_broad_lobe_has_to_gain_much():
    """Over dark wood it is most of what is seen; over white paint a diffuse surface is as likely."""
    box = Box()
    element, direction, _ = box.views(60, 10)
    wood, white = (
        choose_model(box.problem(element, direction, 0.6, 0.04, share * paint(element))) for share in (0.1, 1.5)
    )
    assert (wood.model, white.model) == (DIELECTRIC, LAMBERTIAN)
    assert wood.fit.phi > 0.5 and wood.gain > 0.1 > white.gain


def test_no_lobe_saves_more_than_there_is(seen):
    """By few rays the noise of a broad lobe is known badly, and may be told to be many times what it is."""
    problem = seen["glossy"]
    fit = fit_lobe(problem)
    for name in ("glossy", "metal"):
        light = seen[name].light
        noisy = replace(seen[name], light=replace(light, A_noise=30 * light.A_noise, B_noise=30 * light.B_noise))
        strong = replace(fit, psi=np.full(3, 0.3))
        dense, scale = models._weighted(DenseProblem(noisy), strong)
        assert models._gain(*element_costs(dense, strong, scale))[0] <= 1


def test_a_metals_colour(seen):
    assert np.allclose(metal_f0(seen["metal"], 0.11), COPPER, rtol=0.05)


def test_a_metal_has_no_diffuse_part(seen):
    """The same coloured lobe over a strong diffuse part is no metal's, however well it fits."""
    box = Box()
    element, direction, _ = box.views(60, 10)
    choice = choose_model(box.problem(element, direction, 0.11, COPPER / 4, 3 * paint(element)))
    assert choice.model == DIELECTRIC and choice.fit.psi.max() <= MAX_F0


@pytest.mark.parametrize("psi, paint_of", [(COPPER, lambda element: np.zeros((len(element), 3))), (0.08, paint)])
def test_a_metal_some_of_which_is_shown_wrong(psi, paint_of):
    """A fifth of 30 elements, as at seams and edges: half of the draws are metal still, and no painted floor is."""
    box = Box()
    element, direction, _ = box.views(30, 6)
    clean = box.problem(element, direction, 0.11, psi, paint_of(element))
    called = []
    for seed in range(8):
        rng = np.random.default_rng(seed)
        wrong = np.isin(element, rng.choice(np.unique(element), 6, replace=False))[:, None]
        noise = np.exp(np.where(wrong, 1.5, 0.15) * rng.normal(size=(len(element), 1)))
        called.append(choose_model(replace(clean, radiance=(clean.radiance * noise).astype(np.float32))).model == METAL)
    assert sum(called) >= 4 if psi is COPPER else not any(called)


def test_a_metal_under_light_that_is_off(seen):
    """What each view is thought to show is off by a quarter; that draws psi down, and must not pass for a coat."""
    problem = seen["metal"]
    rng = np.random.default_rng(2)
    off = np.exp(0.25 * rng.normal(size=(len(problem.element), 1, 1))).astype(np.float32)
    wrong = replace(problem, light=replace(problem.light, A=problem.light.A * off, B=problem.light.B * off))
    choice = choose_model(wrong)
    assert choice.model == METAL and choice.fit.phi == pytest.approx(0.11, abs=0.05)
    assert np.allclose(metal_f0(wrong, choice.fit.phi), COPPER, rtol=0.15)


def test_the_others_of_its_class_are_metal(seen):
    """One that is not sure of being metal takes their roughness unless its frames are sure of another; one whose frames
    say otherwise stays."""
    sure, diffuse = choose_model(seen["metal"]), choose_model(seen["diffuse"])
    own = replace(sure.fit, phi=0.2)
    likely = Choice(LAMBERTIAN, sure.fit, 0.1, 2.5, "Not sure.", metal=own)
    classes = dict.fromkeys(range(4), "steel")
    result = adopt_from_class({0: sure, 1: likely, 2: diffuse}, {2: seen["diffuse"]}, classes)
    assert result[1].model == METAL and result[1].fit.phi == sure.fit.phi and "class" in result[1].note
    assert result[2] is diffuse
    # Frames of a metal of phi .11: those of a class that is broader (by the better judged 3) do not fit.
    broad = replace(sure, fit=replace(sure.fit, phi=0.5), sigmas=2 * sure.sigmas)
    likely = replace(likely, metal=sure.fit)
    for seen_enough in (True, False):
        problems = {1: seen["metal"]} if seen_enough else {}
        result = adopt_from_class({1: likely, 3: broad}, problems, classes)
        assert result[1].model == METAL and result[1].fit.phi == (sure if seen_enough else broad).fit.phi


def test_paint_among_metals_stays_paint_however_noisy(seen):
    """A broad lobe hardly tells in noisy views; but a metal is all lobe, and this floor's paint is no lobe's."""
    broad = choose_model(seen["metal"])
    broad = replace(broad, fit=replace(broad.fit, phi=0.5, psi=broad.fit.psi / 5))
    problem = seen["diffuse"]
    noise = np.exp(0.3 * np.random.default_rng(3).normal(size=(len(problem.element), 1)))
    noisy = replace(problem, radiance=(problem.radiance * noise).astype(np.float32))
    own = choose_model(noisy)
    assert own.model == LAMBERTIAN and own.metal is None
    assert adopt_from_class({0: broad, 1: own}, {1: noisy}, dict.fromkeys(range(2), "frame"))[1] is own


@pytest.mark.parametrize(("gain", "sigmas", "model"), [(0.005, 3.5, LAMBERTIAN), (0.05, 3.5, DIELECTRIC)])
def test_a_class_has_to_gain_by_a_lobe_as_one_object_has_to(seen, gain, sigmas, model):
    """Errors of the light are alike for many of a kind: together they are sure of a lobe that hardly serves them."""
    sure, diffuse = choose_model(seen["glossy"]), choose_model(seen["diffuse"])
    others = replace(diffuse, fit=replace(sure.fit, psi=sure.fit.psi / 4), gain=gain, sigmas=sigmas, metal=None)
    weak = replace(sure, fit=others.fit, gain=0.03, sigmas=4.0)
    result = adopt_from_class({0: weak} | dict.fromkeys(range(1, 9), others), {}, dict.fromkeys(range(9), "cupboard"))
    assert {result[i].model for i in range(1, 9)} == {model} and result[0].model == DIELECTRIC


def test_the_others_of_its_class_are_no_metal(seen):
    """One hardly surer to be metal than dielectric is what the sure ones of its class are; alone it is metal."""
    sure = choose_model(seen["glossy"])
    hardly = replace(choose_model(seen["metal"]), sigmas=2 * sure.sigmas, dielectric=replace(sure.fit, phi=0.4))
    beyond = replace(hardly, dielectric=None)
    for members, model in (([hardly], METAL), ([hardly, sure], DIELECTRIC), ([beyond, sure], METAL)):
        result = adopt_from_class(dict(enumerate(members)), {}, dict.fromkeys(range(2), "key"))
        assert result[0].model == model
    both = adopt_from_class({0: hardly, 1: sure}, {}, dict.fromkeys(range(2), "key"))
    assert both[0].fit.phi == sure.fit.phi and "class" in both[0].note and both[1].fit.phi == sure.fit.phi


def test_a_metal_hardly_better_than_a_dielectric_says_so(seen, monkeypatch):
    assert choose_model(seen["metal"]).dielectric is None
    # Of the metal over diffuse and over the dielectric: share and standard errors.
    gains = iter([(0.5, 10.0), (0.1, 2.5)])
    monkeypatch.setattr(models, "_gain_of_metal", lambda with_lobe, without: next(gains))
    choice = choose_model(seen["metal"])
    assert choice.model == METAL and choice.dielectric is not None and choice.dielectric.psi.max() <= MAX_F0


def test_the_class_helps_out(seen):
    """0 is sure; 1 was seen too little, 2 not at all: both take its lobe. 3 looks different, 4 is of another class."""
    sure = choose_model(seen["glossy"])
    weak = Choice(METAL, fit_lobe(seen["metal"], constraints=METAL.constraints), 0.1, sure.sigmas / 2)
    nothing = Choice(LAMBERTIAN, None, note="too few")
    diffuse = choose_model(seen["diffuse"])
    choices = {0: sure, 1: nothing, 2: nothing, 3: diffuse, 4: nothing, 5: weak}
    problems = {0: seen["glossy"], 1: seen["few"], 3: seen["diffuse"], 5: seen["metal"]}
    classes = dict.fromkeys([0, 1, 2, 3, 5], "floor") | {4: "wall"}
    result = adopt_from_class(choices, problems, classes)
    for i, own in ((0, sure), (5, weak)):  # what is sure of itself stays
        assert result[i].model == own.model and result[i].fit.phi == own.fit.phi and result[i].sigmas == own.sigmas
    for taker in (1, 2):
        assert result[taker].model == DIELECTRIC and result[taker].fit.phi == sure.fit.phi
        assert "object 0" in result[taker].note and result[taker].sigmas == 0
    assert result[3] is diffuse and result[4] is nothing
    assert choices[1] is nothing  # what was handed in is left alone


def test_what_looks_coated_takes_its_classs_lobe(seen):
    """Its frames fit a narrower lobe better. Where looks alone said that it is coated they don't defend that against
    what views tell of another of its class; where views did, or nobody's do, it stays."""
    own = choose_model(seen["glossy"])
    looks = OneColour(0.3, 0.3, 0.2, own.fit.phi, 4.0)
    broad = replace(own, fit=replace(own.fit, phi=0.5), sigmas=3 * own.sigmas)
    for looks_of_it, looks_of_other, phi in (
        (looks, None, 0.5),
        (None, None, own.fit.phi),
        (looks, looks, own.fit.phi),
    ):
        choices = {0: replace(own, looks=looks_of_it), 1: replace(broad, looks=looks_of_other)}
        result = adopt_from_class(choices, {0: seen["glossy"]}, dict.fromkeys(choices, "ring"))
        assert result[0].model == DIELECTRIC and result[0].fit.phi == phi


def test_how_another_darkens_says_nothing_against_its_lobe(seen, monkeypatch):
    """How the diffuse part darkens towards grazing views is an object's own matter, with a lobe as without one."""
    sure, diffuse = choose_model(seen["glossy"]), choose_model(seen["diffuse"])
    asked = []
    monkeypatch.setattr(of_class, "contradicts", lambda problem, fit, model: bool(asked.append(fit)))
    own = replace(diffuse, fit=replace(diffuse.fit, kappa=0.6))
    source = replace(sure, fit=replace(sure.fit, kappa=0.3))
    result = adopt_from_class({0: source, 1: own}, {1: seen["diffuse"]}, {0: "floor", 1: "floor"})
    assert [fit.kappa for fit in asked] == [0.6] and asked[0].phi == sure.fit.phi
    assert asked[0].kappa_lambertian == diffuse.fit.kappa_lambertian
    assert result[1].model == DIELECTRIC


def test_nobody_to_take_over_from(seen):
    choices = {0: Choice(LAMBERTIAN, None), 1: Choice(LAMBERTIAN, None)}
    assert adopt_from_class(choices, {}, {0: "a", 1: "a"}) == choices
    assert adopt_from_class({}, {}, {}) == {}


@pytest.mark.parametrize(
    ("sigmas", "model"), [((2.8, 2.6), DIELECTRIC), ((2.8, 0.5), LAMBERTIAN), ((2.9, 2.9, -4), LAMBERTIAN)],
    ids=["both nearly sure", "one nearly sure", "a third speaks against it"],
)  # fmt: skip
def test_a_class_may_be_sure_together(seen, sigmas, model):
    fit = choose_model(seen["glossy"]).fit
    choices = {i: Choice(LAMBERTIAN, fit, 0.03 if s > 1 else -0.01, s, "Not sure.") for i, s in enumerate(sigmas)}
    result = adopt_from_class(choices, {}, {i: "pot" for i in choices})
    assert {choice.model for choice in result.values()} == {model}
    if model == DIELECTRIC:
        assert "together" in result[0].note


def test_what_is_no_lobe_makes_no_class_sure(seen):
    """Diffuse curtains gained by phi .87 and 1, surely; the one that gains by a lobe is not sure of it."""
    fit = choose_model(seen["glossy"]).fit
    broad = replace(fit, phi=0.9)
    choices = {i: Choice(LAMBERTIAN, broad, 0.03, s, "Not sure.") for i, s in enumerate((3.5, 6.5))}
    choices[2] = Choice(LAMBERTIAN, fit, 0.05, 2.5, "Not sure.")
    result = adopt_from_class(choices, {}, dict.fromkeys(choices, "curtain"))
    assert {choice.model for choice in result.values()} == {LAMBERTIAN}


def test_one_that_errs_does_not_make_its_class_glossy(seen):
    """One cupboard of twelve passes for glossy; the frames of the others speak against a lobe."""
    fit = choose_model(seen["glossy"]).fit
    choices = {0: Choice(DIELECTRIC, fit, 0.04, 3.2)}
    choices |= {i: Choice(LAMBERTIAN, fit, -0.01, -0.5, "Not sure.") for i in range(1, 12)}
    result = adopt_from_class(choices, {}, dict.fromkeys(choices, "cupboard"))
    assert [choice.model for choice in result.values()] == [DIELECTRIC, *[LAMBERTIAN] * 11]


@pytest.mark.parametrize(
    ("sigmas", "glossy"),
    [
        ((2.5, 1.4, 2.7, 4.2), (True, True, True, True)),  # tiles
        ((2.3, -0.5, -0.4, -1.2), (False, False, False, False)),  # matt paint
        ((13.8, 1.1, -0.4, -0.8), (True, False, False, False)),  # the first is full of cupboards
        ((2.5, 3.5, -8.0, 2.9), (True, True, False, True)),  # the third is sure that it is matt
    ],
    ids=["one is unsure", "one by chance", "one sure", "another sure"],
)
def test_walls_of_one_colour_decide_together(seen, sigmas, glossy):
    fit = choose_model(seen["glossy"]).fit
    walls = {
        i: Choice(DIELECTRIC if s > 2 else LAMBERTIAN, replace(fit, phi=fit.phi + 0.01 * i), 0.01 * s, s)
        for i, s in enumerate(sigmas)
    }
    result = share_paint(walls, {}, dict.fromkeys(walls, np.log([0.6, 0.62, 0.65])))
    assert tuple(choice.model == DIELECTRIC for choice in result.values()) == glossy


def test_walls_of_another_colour_or_not_seen_enough(seen):
    """2 was seen too little to look for a highlight; 3 is of another colour, and does not gain enough by itself."""
    fit = choose_model(seen["glossy"]).fit
    walls = {0: Choice(DIELECTRIC, fit, 0.04, 4.0), 1: Choice(DIELECTRIC, fit, 0.04, 5.0), 2: Choice(LAMBERTIAN, None)}
    walls[3] = Choice(LAMBERTIAN, fit, 0.01, 1.9)
    white, blue = np.log([0.8, 0.8, 0.8]), np.log([0.2, 0.3, 0.7])
    result = share_paint(walls, {}, {0: white, 1: white + 0.05, 2: white - 0.03, 3: blue})
    assert [choice.model for choice in result.values()] == [DIELECTRIC, DIELECTRIC, DIELECTRIC, LAMBERTIAN]
    assert result[2].fit.phi == fit.phi and "colour" in result[2].note and result[3] is walls[3]
    assert share_paint({}, {}, {}) == {} and share_paint({3: walls[3]}, {}, {3: blue}) == {3: walls[3]}


def test_walls_of_one_paint_share_its_lobe(seen):
    """The surest's, but for one whose own explains its frames significantly better."""
    own = choose_model(seen["glossy"])
    broad = replace(own, fit=replace(own.fit, phi=0.4), sigmas=4.0)
    white = dict.fromkeys((0, 1), np.log([0.8, 0.8, 0.8]))
    result = share_paint({0: replace(own, sigmas=9.0), 1: broad}, {0: seen["glossy"], 1: seen["glossy"]}, white)
    assert result[0].fit.phi == result[1].fit.phi == own.fit.phi
    result = share_paint({0: replace(own, sigmas=4.0), 1: replace(broad, sigmas=9.0)}, {0: seen["glossy"]}, white)
    assert result[0].fit.phi == own.fit.phi and result[1].fit.phi == 0.4
