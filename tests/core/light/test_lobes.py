"""Reflected light against integrals that share no rays with it."""

from __future__ import annotations

import numpy as np
import pytest

from addon.core.brdf.ggx import GGX
from addon.core.light.emitters import bright_triangles
from addon.core.light.lobes import GRID, highlight, reflected_light
from addon.core.paper import brdf as paper
from tests.core.brdf.test_brdf import sphere
from tests.core.glossy_box import Box, fresnel_rise
from tests.core.rooms import box_sides, make_room, quad

PHIS = np.float32([0.02, 0.09, 0.137, 0.3, 0.47, 0.8, 1.0])  # none of the proposals' widths


def albedo_of_lobe(cosine: float, phi: float) -> tuple[float, float]:
    """Integrals of G D (1 - s) cos and of G D s cos over directions, taken over normals."""
    wo = np.array([np.sqrt(1 - cosine**2), 0, cosine])
    u = (np.arange(400) + 0.5) / 400
    angle, turn = np.meshgrid(np.arctan(phi * np.sqrt(u / (1 - u))), 2 * np.pi * u, indexing="ij")
    h = np.stack([np.sin(angle) * np.cos(turn), np.sin(angle) * np.sin(turn), np.cos(angle)], -1).reshape(-1, 3)
    c = h @ wo
    w_z = 2 * c * h[:, 2] - wo[2]
    up = (w_z > 0) & (c > 0)
    c, n_h, n_w = c[up], h[up, 2], w_z[up]
    share = paper.G(n_w, np.full(len(n_w), cosine), phi) * 4 * c * n_w / n_h / len(h)
    s = fresnel_rise(c)
    return float(((1 - s) * share).sum()), float((s * share).sum())


@pytest.mark.parametrize("cosine", [0.95, 0.6, 0.3])
def test_a_furnace_gives_the_lobes_own_albedo(cosine):
    room = make_room(box_sides(), 0.25)
    field = room.field(room.by_object({}, default=(1, 2, 0.5)))
    element = np.flatnonzero(room.atlas.object_id == 0)[::4]
    assert len(element) > 40
    turn = np.linspace(0, 2 * np.pi, len(element), endpoint=False)
    sine = np.sqrt(1 - cosine**2)
    direction = np.stack([sine * np.cos(turn), sine * np.sin(turn), np.full(len(turn), cosine)], -1).astype(np.float32)
    found = reflected_light(field, bright_triangles(field), element, direction, rays=256, grid=PHIS, threads=2)
    assert np.allclose(found.A[..., 1], 2 * found.A[..., 0], rtol=1e-4)
    for i, phi in enumerate(PHIS):
        A, B = albedo_of_lobe(cosine, float(phi))
        assert found.A[:, i, 0].mean() == pytest.approx(A, rel=0.01), phi
        assert found.B[:, i, 0].mean() == pytest.approx(B, rel=0.03, abs=1e-4), phi
        assert found.A[:, i, 0].std() < 0.1 * A, phi


def test_the_reference_is_sound():
    """Lobes in a furnace by directions, not by normals."""
    w, step = sphere(600, 200)
    wo = np.array([0.8, 0, 0.6])
    h = (w + wo) / np.linalg.norm(w + wo, axis=1, keepdims=True)
    f = paper.f_nd(w[:, 2], np.full(len(w), 0.6), h[:, 2], (w * h).sum(1), 0.47, 1.0)
    assert sum(albedo_of_lobe(0.6, 0.47)) == pytest.approx((f * w[:, 2] * step).sum(), rel=2e-3)


@pytest.mark.parametrize("phi", [0.09, 0.3])
def test_a_small_lamps_highlight(phi):
    """Dark room, one lamp of 10 cm: against a sum over points of the lamp, from beside the highlight into it."""
    lamp = quad((-0.05, -0.05, 2), (0, 0.1, 0), (0.1, 0, 0), 1)
    room = make_room([quad((-2, -2, 0), (4, 0, 0), (0, 4, 0), 0), lamp], 0.1)
    field = room.field(room.by_object({1: (100, 50, 25)}), None)
    position = room.atlas.position
    line = (room.atlas.object_id == 0) & (np.abs(position[:, 1] - 0.05) < 0.01) & (np.abs(position[:, 0] - 1) < 0.9)
    element = np.flatnonzero(line)
    way = np.array([2.0, 0, 2]) - position[element]  # the mirror image of the lamp lies at x = 1
    direction = (way / np.linalg.norm(way, axis=1, keepdims=True)).astype(np.float32)
    found = reflected_light(
        field, bright_triangles(field), element, direction, rays=640, grid=np.float32([phi]), threads=2
    )
    side = (np.arange(20) + 0.5) / 200 - 0.05
    points = np.stack([*(g.ravel() for g in np.meshgrid(side, side)), np.full(400, 2.0)], -1)
    A, B = np.zeros(len(element)), np.zeros(len(element))
    for i, (x, wo) in enumerate(zip(position[element].astype(float), direction.astype(float), strict=True)):
        w = points - x
        r2 = (w**2).sum(1)
        w /= np.sqrt(r2)[:, None]
        h = (w + wo) / np.linalg.norm(w + wo, axis=1, keepdims=True)
        f = paper.G(w[:, 2], np.full(len(w), wo[2]), phi) * paper.D(h[:, 2], phi)
        s = fresnel_rise((w * h).sum(1))
        step = w[:, 2] * w[:, 2] / r2 * 100 * 0.01 / 400
        A[i], B[i] = (f * (1 - s) * step).sum(), (f * s * step).sum()
    bright = A > 0.02 * A.max()
    assert bright.sum() > 5 and np.abs(position[element][A.argmax(), 0] - 1) < 0.2
    assert np.allclose(found.A[bright, 0, 0], A[bright], rtol=0.05)
    assert np.allclose(found.B[bright, 0, 0], B[bright], rtol=0.06)
    assert np.allclose(found.A[..., 1], found.A[..., 0] / 2, rtol=1e-3, atol=1e-6)


@pytest.mark.slow
def test_a_room_with_a_lamp():
    """A box with coloured walls, all phi at once, against the brute-force sum."""
    box = Box()
    element, direction, _ = box.views(30, 3)
    grid = np.float32([0.08, 0.2, 0.5])
    found = reflected_light(box.field, box.bright, element, direction, rays=2048, grid=grid, threads=2)
    for i, phi in enumerate(grid):
        A, B = box.lobe(element, direction, float(phi), 60)
        off = found.A[:, i] / A - 1
        assert abs(np.median(off)) < 0.01 and np.median(np.abs(off)) < 0.05, phi
        assert found.A[:, i].mean() == pytest.approx(A.mean(), rel=0.02), phi
        assert found.B[:, i].mean() == pytest.approx(B.mean(), rel=0.05), phi


def test_the_same_seed_gives_the_same_light():
    box = Box()
    element, direction, _ = box.views(5, 2)
    one, two, other = (
        reflected_light(box.field, box.bright, element, direction, rays=32, threads=n, seed=seed)
        for n, seed in ((1, 0), (2, 0), (1, 1))
    )
    assert one.A.shape == (10, len(GRID), 3) and one.B.shape == one.A.shape
    assert np.array_equal(one.A, two.A) and np.array_equal(one.B, two.B)
    assert not np.array_equal(one.A, other.A)


def test_no_observations():
    box = Box()
    none = np.zeros(0, np.int64), np.zeros((0, 3), np.float32)
    found = reflected_light(box.field, box.bright, *none, rays=32)
    assert found.A.shape == (0, len(GRID), 3) and found.B_noise.shape == (0, len(GRID), 3)


def test_the_noise_is_known():
    """Half the difference of the halves tells how far their mean is off, on average."""
    box = Box()
    element, direction, _ = box.views(40, 4)
    exact = reflected_light(box.field, box.bright, element, direction, rays=6000, seed=99)
    told, error = np.zeros(2), np.zeros(2)
    for seed in range(12):
        few = reflected_light(box.field, box.bright, element, direction, rays=40, seed=seed)
        for i, name in enumerate(("A", "B")):
            # narrow lobes meet the lamp in a few observations only, whose noise says little of the rest
            error[i] += ((getattr(few, name) - getattr(exact, name))[:, 5:] ** 2).mean()
            told[i] += (getattr(few, f"{name}_noise")[:, 5:] ** 2).mean()
    assert np.allclose(told, error, rtol=0.3)


def test_a_lobe_of_known_width():
    """Rays of that width alone: the same mean as from all widths."""
    box = Box()
    element, direction, _ = box.views(40, 4)
    phi = (0.2,)
    one, all_ = (
        reflected_light(box.field, box.bright, element, direction, rays=n, grid=np.float32(phi), **how)
        for n, how in ((128, {"proposals": phi}), (1024, {}))
    )
    assert one.A.mean() == pytest.approx(all_.A.mean(), rel=0.03)
    assert one.B.mean() == pytest.approx(all_.B.mean(), rel=0.06)


def test_an_occluder_before_the_lamp():
    """What keeps aimed rays from the lamp must not count twice: the mean is that of rays drawn from the lobe alone."""
    lamp = quad((-0.5, -0.5, 2), (0, 1, 0), (1, 0, 0), 1)
    screen = quad((-0.6, -0.6, 1.2), (0, 1.2, 0), (0.6, 0, 0), 2)
    room = make_room([quad((-2, -2, 0), (4, 0, 0), (0, 4, 0), 0), lamp, screen], 0.1)
    field = room.field(room.by_object({1: (50, 50, 50), 2: (1, 1, 1)}), None)
    near = (room.atlas.object_id == 0) & (np.abs(room.atlas.position[:, :2]) < 0.8).all(1)
    element = np.flatnonzero(near)
    direction = np.tile(np.float32([0.6, 0, 0.8]), (len(element), 1))
    bright = bright_triangles(field)
    assert 0 < len(bright)
    some = {"rays": 600, "grid": np.float32([0.5, 1.0]), "threads": 2}
    aimed = reflected_light(field, bright, element, direction, **some)
    dark = bright_triangles(room.field(room.by_object({})))
    plain = reflected_light(field, dark, element, direction, proposals=(0.5, 1.0), **some)
    assert len(dark) == 0
    assert np.allclose(aimed.A.mean((0, 2)), plain.A.mean((0, 2)), rtol=0.02)


@pytest.mark.parametrize("phi", [0.1, 0.3])
def test_few_rays_are_right_on_average(phi):
    """What pixels nearby share is a mean over few rays of each: at fixed angles they were off by up to two fifths."""
    box = Box()
    element, direction, _ = box.views(6, 1)
    times = 4000
    repeated = np.repeat(element, times), np.repeat(direction, times, 0)
    found = highlight(box.field, box.bright, *repeated, phi, 0.04, GGX, rays=4).reshape(-1, times, 3).mean(1)
    many = reflected_light(box.field, box.bright, element, direction, rays=8192, grid=np.float32([phi]))
    assert np.allclose(found, 0.04 * many.A[:, 0] + many.B[:, 0], rtol=0.03)
