"""Every reflectance model keeps what the rest of the program takes for granted, and so does the one in the docs."""

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest
from scipy.special import erf

from addon.core.brdf import registry
from addon.core.brdf.compensation import ior_of
from addon.core.brdf.dielectric import DIELECTRIC
from addon.core.brdf.lambertian import LAMBERTIAN
from addon.core.brdf.metal import METAL
from addon.core.errors import BadInputError
from addon.core.fit.lobe_fit import fit_lobe
from addon.core.light.lobes import reflected_light
from addon.core.results.overrides import Given, parse
from tests.core.brdf.test_brdf import sphere, tilted
from tests.core.fit.test_fit import paint, steps
from tests.core.glossy_box import Box, fresnel_rise
from tests.core.passes.specular.test_given import Seen

DOCS = Path(__file__).resolve().parents[3] / "docs" / "extending.md"
OWN = [one.name for one in registry.models()]
GLOSSY = [one.name for one in registry.models() if one.has_lobe]


@dataclass(frozen=True)
class Material:
    """`model.Parameters`."""

    alpha: float | None = None
    f0: object = None
    emission: tuple | None = None
    transmission: float | None = None
    surfaces: float | None = None


@pytest.fixture
def beckmann(monkeypatch):
    """The documentation's example, as it stands there."""
    monkeypatch.setattr(registry, "_models", dict(registry._models))
    code = re.search(r"```python\n(.*?)```", DOCS.read_text(), re.DOTALL)[1]
    exec(code.replace("scan_relight.addon", "addon"), {})
    return registry.named("beckmann")


@pytest.fixture
def model(request, beckmann):
    return registry.named(request.param)


def of(model, alpha: float) -> Material:
    return Material(alpha, model.plausible_f0((0.9, 0.6, 0.3))) if model.has_lobe else Material()


def value(model, alpha, w, wo):
    """The BRDF for directions (n, 3) and one."""
    h = w + wo
    h /= np.linalg.norm(h, axis=1, keepdims=True)
    n = np.full(len(w), wo[2])
    return model.evaluate(of(model, alpha), np.array([0.9, 0.5, 0.1]), w[:, 2], n, h[:, 2], (w * h).sum(1))


@pytest.mark.parametrize("model", [*OWN, "beckmann"], indirect=True)
@pytest.mark.parametrize("alpha", [0.1, 0.5])
def test_reciprocal_and_never_negative(model, alpha):
    w, wo = tilted(65)[None], np.array([0.2, 0.5, np.sqrt(1 - 0.29)])
    there, back = value(model, alpha, w, wo), value(model, alpha, wo[None], w[0])
    assert np.allclose(there, back, rtol=1e-5) and (there >= 0).all() and there.shape == (1, 3)


@pytest.mark.parametrize("model", [*OWN, "beckmann"], indirect=True)
@pytest.mark.parametrize("alpha", [0.2, 0.6])
@pytest.mark.parametrize("degrees", [0, 50])
def test_no_more_light_than_arrives(model, alpha, degrees):
    w, step = sphere(800, 200)
    sent = (value(model, alpha, w, tilted(degrees)) * (w[:, 2] * step)[:, None]).sum(0)
    assert (sent <= 1.0).all()
    if not model.has_diffuse and not model.has_lobe:
        assert not sent.any()
    elif model is LAMBERTIAN:
        assert np.allclose(sent, [0.9, 0.5, 0.1], atol=1e-3)


@pytest.mark.parametrize("model", [*GLOSSY, "beckmann"], indirect=True)
@pytest.mark.parametrize("alpha", [0.1, 0.4])
@pytest.mark.parametrize("degrees", [0, 60])
def test_directions_are_drawn_as_the_lobe_has_them(model, alpha, degrees):
    """The weights' mean is the lobe's integral, and so is that of a part of them."""
    wi, n = tilted(degrees), 60000
    square = np.random.default_rng(0).random((2, n), np.float32)
    wo, _, weight = model.microfacets.reflect(np.repeat(np.float32(wi)[:, None], n, 1), square, alpha)
    w, step = sphere(1500, 400)
    h = w + wi
    h /= np.linalg.norm(h, axis=1, keepdims=True)
    lobe = model.microfacets.lobes(
        np.float32(w[:, 2:]),
        np.full((len(w), 1), wi[2], np.float32),
        np.float32(1 - h[:, 2:] ** 2),
        np.float32([alpha]),
    )[:, 0, 0]
    whole = lobe * w[:, 2] * step
    assert weight.mean() == pytest.approx(whole.sum(), rel=0.02)
    edge = np.cos(np.radians(degrees + 10))
    assert (weight * (wo[2] > edge)).mean() == pytest.approx(whole[w[:, 2] > edge].sum(), rel=0.04, abs=0.005)


def test_what_blender_is_told():
    glossy = DIELECTRIC.principled(Material(0.09, 0.05))
    assert (glossy.roughness, glossy.ior, glossy.specular_level) == (pytest.approx(0.3), ior_of(0.05), 0.5)
    assert glossy.metallic == 0 and glossy.base_color is None
    metal = METAL.principled(Material(0.04, (0.9, 0.6, 1.2)))
    assert (metal.metallic, metal.base_color, metal.roughness) == (1, (0.9, 0.6, 1.0), pytest.approx(0.2))
    assert LAMBERTIAN.principled(Material()).specular_level == 0


def test_a_name_is_one_models(beckmann):
    assert registry.register(beckmann) is beckmann
    with pytest.raises(BadInputError, match="'beckmann' already"):
        registry.register(replace(beckmann, label="Another"))
    with pytest.raises(BadInputError, match="no reflectance model 'velvet', only lambertian.*beckmann"):
        registry.named("velvet")
    assert registry.find("velvet") is None


class BeckmannBox(Box):
    """The floor's lobe has Beckmann's distribution: its normals in cells of equal weight, its exact masking."""

    def lobe(self, element, direction, phi: float, across: int = 40):
        u, v = np.meshgrid(*[(np.arange(across) + 0.5) / across] * 2, indexing="ij")
        angle, turn = np.arctan(phi * np.sqrt(-np.log(1 - u.ravel()))), 2 * np.pi * v.ravel()
        h = np.stack([np.sin(angle) * np.cos(turn), np.sin(angle) * np.sin(turn), np.cos(angle)], -1)
        A, B = np.zeros((len(element), 3)), np.zeros((len(element), 3))
        position = self.room.atlas.position[element].astype(float)

        def masking(x):
            a = x / (phi * np.sqrt(np.maximum(1 - x * x, 1e-12)))
            return 2 / (1 + erf(a) + np.exp(-a * a) / (a * np.sqrt(np.pi)))

        for i, wo in enumerate(direction.astype(float)):
            cosine = h @ wo
            w = 2 * cosine[:, None] * h - wo
            up = (w[:, 2] > 1e-4) & (cosine > 0)
            w, c, n_h = w[up], cosine[up], h[up, 2]
            share = masking(w[:, 2]) * masking(wo[2]) * c / (wo[2] * n_h) / across**2
            L = self.arriving(np.broadcast_to(position[i], w.shape), w)
            s = fresnel_rise(c)
            A[i], B[i] = ((1 - s) * share) @ L, (s * share) @ L
        return A, B


def test_the_examples_lobe_is_fitted_and_explains_its_frames_better(beckmann):
    box = BeckmannBox()
    element, direction, _ = box.views(60, 10)
    problem = box.problem(element, direction, 0.2, 0.1, paint(element), noise=0.01)
    light = reflected_light(
        box.field, box.bright, element, direction, rays=256, threads=2, microfacets=beckmann.microfacets
    )
    own = fit_lobe(replace(problem, light=light), constraints=beckmann.constraints)
    other = fit_lobe(problem, constraints=DIELECTRIC.constraints)
    assert steps(own.phi, 0.2) <= 1 and own.residual < other.residual


def test_the_example_can_be_given(beckmann):
    overrides = parse({"objects": {"0": {"model": "beckmann", "roughness": 0.4}}}, "overrides.json", {0, 1})
    assert overrides.of(0) == Given("beckmann", 0.4) and overrides.of(0).brdf is beckmann
    seen = Seen(0.11, 0.08)
    floor = seen.all({0: overrides.of(0)}).materials[0]
    assert floor.model is beckmann
    assert floor.alpha == pytest.approx(0.16) and 0.02 <= floor.f0 <= 0.12
    told = floor.as_dict()
    assert told["model"] == "beckmann" and beckmann.principled(floor).roughness == pytest.approx(0.4)
