"""The microfacet lobe against values by hand and its own normalisations."""

from __future__ import annotations

import numpy as np
import pytest

from addon.core.brdf import ggx
from addon.core.brdf.fresnel import fresnel, rise
from addon.core.paper import brdf as paper

PHIS = [0.05, 0.2, 0.5, 1.0]


def sphere(count: int = 1500, wide: int = 400):
    """Directions (n, 3) of the upper hemisphere and their solid angles, denser towards the pole."""
    edges = np.linspace(0, 1, count + 1) ** 3 * np.pi / 2
    theta, step = (edges[1:] + edges[:-1]) / 2, -np.diff(np.cos(edges))
    turn = (np.arange(wide) + 0.5) / wide * 2 * np.pi
    theta, turn = np.meshgrid(theta, turn, indexing="ij")
    w = np.stack([np.sin(theta) * np.cos(turn), np.sin(theta) * np.sin(turn), np.cos(theta)], -1).reshape(-1, 3)
    return w, np.repeat(step * 2 * np.pi / wide, wide)


def tilted(degrees: float) -> np.ndarray:
    return np.array([np.sin(np.radians(degrees)), 0, np.cos(np.radians(degrees))])


def test_g1_by_hand():
    assert paper.G1(np.array([1.0]), 0.3)[0] == pytest.approx(0.5)  # head-on nothing is masked: 1 / (2 x)
    assert paper.G1(np.array([0.4]), 0.0)[0] == pytest.approx(1 / 0.8)  # nor on a mirror
    assert paper.G1(np.array([0.5]), 1.0)[0] == pytest.approx(1 / 1.5)
    assert paper.G1(np.array([0.6]), 0.5)[0] == pytest.approx(1 / (0.6 + np.sqrt(0.36 + 0.25 * 0.64)))
    assert paper.G(np.array([0.5]), np.array([1.0]), 1.0)[0] == pytest.approx(0.5 / 1.5)


def test_masking_is_smiths():
    """2 x G1(x) is Smith's masking, between 0 and 1, and falls with roughness and towards grazing views."""
    x = np.linspace(0.01, 1, 50)
    masks = np.stack([2 * x * paper.G1(x, phi) for phi in PHIS])
    assert (masks > 0).all() and (masks <= 1 + 1e-6).all()
    assert (np.diff(masks, axis=0) <= 1e-9).all() and (np.diff(masks, axis=1) >= -1e-9).all()
    tan2 = 1 / x**2 - 1
    assert np.allclose(masks[1], 2 / (1 + np.sqrt(1 + 0.04 * tan2)), rtol=1e-6)


def test_d_by_hand():
    assert paper.D(np.array([1.0]), 0.2)[0] == pytest.approx(1 / (np.pi * 0.04))
    assert paper.D(np.array([0.3, 0.9]), 1.0) == pytest.approx([1 / np.pi] * 2)
    c = 0.8
    assert paper.D(np.array([c]), 0.5)[0] == pytest.approx(0.25 / (np.pi * (c * c * (0.25 - 1) + 1) ** 2))


def test_d_keeps_its_digits_in_float32():
    angle = np.linspace(0, 0.05, 200)
    exact = 1e-4 / (np.pi * (np.sin(angle) ** 2 + 1e-4 * np.cos(angle) ** 2) ** 2)
    found = paper.D(np.cos(angle).astype(np.float32), 0.01)
    # The cosine itself is rounded to 6e-8, which is 1.2e-7 in sin^2 beside phi^2 = 1e-4.
    assert np.abs(found / exact - 1).max() < 0.005


def test_f_by_hand():
    assert paper.F(np.array([1.0, 0.0, 0.5]), 0.04) == pytest.approx([0.04, 1.0, 0.04 + 0.96 / 32])
    assert paper.F(np.array([0.2]), 1.0)[0] == 1


@pytest.mark.parametrize("phi", PHIS)
def test_normals_fill_the_projected_hemisphere(phi):
    h, step = sphere(wide=4)
    assert (paper.D(h[:, 2], phi) * h[:, 2] * step).sum() == pytest.approx(1, abs=1e-3)


@pytest.mark.parametrize("phi", PHIS)
@pytest.mark.parametrize("degrees", [0, 30, 60, 80])
def test_visible_normals_fill_their_density(phi, degrees):
    """G1(wo) D / (4 n.wo) over directions is G1 D (wo.h) / n.wo over normals, which integrates to 1."""
    wo = tilted(degrees)
    h, step = sphere(800, 200)
    w_h = np.maximum(h @ wo, 0)
    over_directions = ggx.visible_normal_density(np.full(len(h), wo[2]), h[:, 2], phi)
    assert (over_directions * 4 * w_h * step).sum() == pytest.approx(1, abs=0.004)


@pytest.mark.parametrize("phi", [0.05, 0.3, 1.0])
@pytest.mark.parametrize("degrees", [0, 40, 75])
def test_sampled_normals_follow_the_density(phi, degrees):
    """Share of the samples below each of a few tilts and on either side, against the density's integral."""
    wo = tilted(degrees)
    rng, n = np.random.default_rng(0), 40000
    drawn = ggx.sample_visible_normal(wo.astype(np.float32)[:, None], rng.random((2, 1, n), np.float32), phi)[:, 0].T
    assert np.allclose(np.linalg.norm(drawn, axis=1), 1, atol=1e-5) and (drawn[:, 2] > 0).all()
    assert (drawn @ wo > -1e-4).all()
    h, step = sphere(800, 200)
    density = ggx.visible_normal_density(np.full(len(h), wo[2]), h[:, 2], phi) * 4 * np.maximum(h @ wo, 0) * step
    for share in (0.2, 0.5, 0.8):
        tilt = np.quantile(drawn[:, 2], share)
        for side in (h[:, 0] > 0, h[:, 0] < 0):
            sampled = ((drawn[:, 2] < tilt) & ((drawn[:, 0] > 0) == (h[side][0, 0] > 0))).mean()
            assert sampled == pytest.approx(density[(h[:, 2] < tilt) & side].sum(), abs=0.012)
    assert abs(drawn[:, 1].mean()) < 0.01


def test_fresnels_term_is_that_of_glass():
    """By the angles of Snell's law; other F0 have the same curve between F0 and 1."""
    cosine = np.linspace(0, 1, 50)
    angle = np.arccos(cosine)
    within = np.arcsin(np.sin(angle) / 1.5)
    with np.errstate(invalid="ignore"):
        across = (np.sin(angle - within) / np.sin(angle + within)) ** 2
        along = (np.tan(angle - within) / np.tan(angle + within)) ** 2
    expected = np.where(cosine < 1, (across + along) / 2, 0.04)
    assert fresnel(cosine, 0.04) == pytest.approx(expected, abs=1e-6)
    assert fresnel(cosine, 0.5) == pytest.approx(0.5 + 0.5 * (expected - 0.04) / 0.96, abs=1e-6)
    assert (rise(np.float32([1, 1 - 1e-7])) >= 0).all()


def test_f_nd_is_the_product_and_is_reciprocal():
    w, wo = tilted(50), np.array([0.3, 0.5, np.sqrt(1 - 0.34)])
    h = (w + wo) / np.linalg.norm(w + wo)
    one = paper.f_nd(w[2], wo[2], h[2], w @ h, 0.3, 0.05)
    other = paper.f_nd(wo[2], w[2], h[2], wo @ h, 0.3, 0.05)
    assert one == pytest.approx(other)
    assert one == pytest.approx(paper.G1(w[2], 0.3) * paper.G1(wo[2], 0.3) * paper.D(h[2], 0.3) * paper.F(w @ h, 0.05))


@pytest.mark.parametrize("phi", [0.01, 0.1, 0.5, 1.0])
def test_all_phi_at_once(phi):
    """`lobes` is G times D."""
    rng = np.random.default_rng(1)
    n_w, n_wo, n_h = (rng.uniform(0.05, 1, shape).astype(np.float32) for shape in ((7, 20), (7, 1), (7, 20)))
    found = ggx.GGX.lobes(n_w, n_wo, 1 - n_h * n_h, np.float32([phi, 0.3]))
    assert found.shape == (7, 2, 20) and found.dtype == np.float32
    assert np.allclose(found[:, 0], paper.G(n_w, n_wo, phi) * paper.D(n_h, phi), rtol=2e-4)
