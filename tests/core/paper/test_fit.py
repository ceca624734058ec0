"""Target frame, A and B, psi in closed form, the grid: against observations made by brute force."""

from __future__ import annotations

import numpy as np
import pytest

from addon.core.paper.brdf import f_nd
from addon.core.paper.fit import PHI, best_psi, fit_lobe
from addon.core.paper.reflection import reflected_parts
from addon.core.paper.target_frame import frame_scores, mirrored, target_frame
from tests.core.glossy_box import Box
from tests.core.paper.test_light import captured
from tests.core.rooms import box_sides, make_room


def schlick(cosine):
    """The paper's rise of the reflectance with the angle."""
    return (1 - cosine) ** 5


@pytest.fixture(scope="module")
def box():
    return Box()


def parts(box, element, direction, rays=4000, grid=PHI):
    atlas = box.room.atlas
    where = atlas.position[element], atlas.normal[element], direction
    return reflected_parts(captured(box.room, box.field.radiance), *where, grid, rays, threads=2)


@pytest.mark.slow
def test_f_nd_is_reciprocal_and_takes_no_more_than_it_gets():
    """Swapping w and wo changes nothing; under a white sky no lobe sends back more than what came."""
    rng = np.random.default_rng(0)
    w, wo = (v / np.linalg.norm(v, axis=1, keepdims=True) for v in rng.normal(size=(2, 500, 3)) * [1, 1, 0.1])
    w[:, 2], wo[:, 2] = np.abs(w[:, 2]), np.abs(wo[:, 2])
    w, wo = (v / np.linalg.norm(v, axis=1, keepdims=True) for v in (w, wo))
    h = (w + wo) / np.linalg.norm(w + wo, axis=1, keepdims=True)
    for phi in (0.05, 0.3, 1.0):
        one = f_nd(w[:, 2], wo[:, 2], h[:, 2], (w * h).sum(1), phi, 0.04)
        assert np.allclose(one, f_nd(wo[:, 2], w[:, 2], h[:, 2], (wo * h).sum(1), phi, 0.04))
    room = make_room(box_sides(), 0.5)
    light = captured(room, room.by_object({}, default=(1, 1, 1)))
    n = room.atlas.normal[:1].repeat(200, 0)
    tangent = np.cross(n, [0.3, 0.5, 0.8])
    wo = n * np.linspace(0.2, 1, 200)[:, None] + tangent / np.linalg.norm(tangent, axis=1, keepdims=True) * np.sqrt(
        1 - np.linspace(0.2, 1, 200)[:, None] ** 2
    )
    A, B = reflected_parts(light, room.atlas.position[:1].repeat(200, 0), n, wo.astype(np.float32), PHI[6:], 20_000)
    sent = (A + B)[..., 0]  # psi = 1: nothing is absorbed
    assert sent.max() < 1.05 and sent[:, 0].mean() > 0.9 and (np.diff(sent.mean(0)) < 0).all()


@pytest.mark.parametrize("phi", [0.11, 0.41])
def test_a_and_b_are_the_lobes_integrals(box, phi):
    element, direction, _ = box.views(40, 1)
    A, B = parts(box, element, direction, 40_000, np.float32([phi]))
    true_A, true_B = box.lobe(element, direction, phi, 80, schlick)
    assert A[:, 0].mean(0) == pytest.approx(true_A.mean(0), rel=0.05)
    assert B[:, 0].mean(0) == pytest.approx(true_B.mean(0), rel=0.08)


@pytest.mark.parametrize("psi", [0.0, 0.04, 0.3, 1.0])
def test_psi_in_closed_form_is_the_least_squares(psi):
    rng = np.random.default_rng(1)
    A, B = rng.random((2, 200, 3, 3)).astype(np.float32)
    seen = psi * A[:, 1] + B[:, 1]
    assert best_psi(A, B, seen)[1] == pytest.approx(psi, abs=1e-5)
    noisy = seen + rng.normal(0, 0.02, seen.shape)
    found = fit_lobe(A, B, noisy, np.float32([0.1, 0.2, 0.3]))
    assert found.phi == pytest.approx(0.2) and found.psi == pytest.approx(psi, abs=0.01)
    costs = [
        np.square(noisy - p * A[:, 1] - B[:, 1]).sum() for p in np.clip([found.psi - 0.01, found.psi + 0.01], 0, 1)
    ]
    assert np.square(found.residual).sum() <= min(costs) + 1e-9


def test_psi_stays_physical():
    A = np.ones((4, 1, 3), np.float32)
    assert best_psi(A, 0 * A, np.full((4, 3), 7.0)) == 1 and best_psi(A, 0 * A, np.full((4, 3), -7.0)) == 0
    assert best_psi(0 * A, 0 * A, np.ones((4, 3))) == 0


@pytest.mark.slow
@pytest.mark.parametrize(("phi", "psi"), [(0.11, 0.1), (0.2, 0.2), (0.41, 0.2), (0.2, 0.04)])
def test_the_lobe_of_one_frame_comes_back(box, phi, psi):
    element, direction, _ = box.views(400, 1, seed=4)
    A, B = box.lobe(element, direction, phi, rise=schlick)
    seen = (psi * A + B) * np.exp(np.random.default_rng(0).normal(0, 0.02, A.shape))
    found = fit_lobe(*parts(box, element, direction), seen)
    steps = abs(int(np.argmin(np.abs(PHI - found.phi))) - int(np.argmin(np.abs(PHI - phi))))
    assert steps <= 1 and found.psi == pytest.approx(psi, rel=0.2)


def test_the_target_frame_shows_the_lamps_highlight(box):
    """Of many eyes, the best sees the lamp mirrored in the floor from most places."""
    element, direction, frame = box.views(300, 12)
    atlas = box.room.atlas
    position, normal = atlas.position[element], atlas.normal[element]
    scores = frame_scores(captured(box.room, box.field.radiance), position, normal, direction, frame, 12)
    mirror = mirrored(direction, normal)
    assert np.allclose(mirror, direction * [-1, -1, 1], atol=1e-6)
    met = box.arriving(position.astype(float), mirror.astype(float)).mean(1) > 10
    assert target_frame(scores) == np.argmax(np.bincount(frame, met, 12))
    assert target_frame(np.zeros(3)) == -1 and target_frame(np.zeros(0)) == -1
