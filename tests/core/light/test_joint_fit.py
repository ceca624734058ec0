"""Unknown sources solved for together, by what albedo is plausible."""

from dataclasses import replace

import numpy as np
import pytest

from addon.core.light.joint_fit import Unknown, solve, solve_for_some


def test_a_few_elements_that_hold_a_lamps_light_decide_nothing():
    """Beside a lamp, as an edge that is off leaves them: one in 200 would need an albedo of a hundred."""
    rng, m = np.random.default_rng(0), 2000
    through, far = rng.uniform(0, 0.1, (m, 1)), rng.choice(m, m // 200, replace=False)
    received = np.ones((m, 3))
    sent = 0.5 / np.pi * (received + 20 * through)
    sent[far] *= 200
    unknown = Unknown(through, np.zeros((m, 0, 3)), np.full((1, 3), 1e-6), np.ones((1, 3)))
    pairs = rng.integers(0, m, (8 * m, 2))
    (found,), _ = solve(sent, received, unknown, pairs)
    assert found == pytest.approx(20, rel=0.3)


def test_where_nothing_is_unknown_nothing_is_solved_for():
    none = Unknown(np.zeros((40, 0)), np.zeros((40, 0, 3)), np.zeros((0, 3)), np.zeros((0, 3)))
    pairs = np.arange(40).reshape(-1, 2)
    found, spread = solve(np.ones((40, 3)), np.full((40, 3), 4.0), none, pairs)
    assert found.shape == (0, 3) and spread == (0, 0)


def test_any_unit_of_radiance_does():
    rng, m = np.random.default_rng(1), 500
    through = rng.uniform(0, 0.1, (m, 1))
    sent = 0.5 / np.pi * (1 + 20 * through) * np.ones(3)
    pairs = rng.integers(0, m, (8 * m, 2))
    for unit in (1, 1e6):
        unknown = Unknown(through, np.zeros((m, 0, 3)), np.full((1, 3), 1e-6), np.full((1, 3), float(unit)))
        (found,), _ = solve(unit * sent, np.full((m, 3), float(unit)), unknown, pairs)
        assert found == pytest.approx(20 * unit, rel=0.1)


def test_a_source_of_any_level_is_not_drawn_to_the_one_expected():
    rng, m = np.random.default_rng(2), 500
    through = rng.uniform(0, 0.002, (m, 1))
    sent = 0.5 / np.pi * (1 + 20 * through) * np.ones(3) * np.exp(rng.normal(0, 0.1, (m, 1)))
    unknown = Unknown(through, np.zeros((m, 0, 3)), np.full((1, 3), 1e-6), np.full((1, 3), 6.0))
    pairs = rng.integers(0, m, (8 * m, 2))
    drawn, free = (
        float(solve(sent, np.ones((m, 3)), replace(unknown, any_level=any_level), pairs)[0].mean())
        for any_level in (False, True)
    )
    assert drawn < 0.6 * 20 and free > 1.2 * drawn


def test_green_where_the_sun_throws_most_light_is_paint():
    """Many openings beside it are unknown, too: none of them has much of the prior's weight, but the sun has."""
    rng, m, cells = np.random.default_rng(2), 1000, 60
    by_sun = np.repeat(rng.uniform(0, 1, (m, 1, 1)), 3, 2)
    through = 0.02 * rng.uniform(0, 1, (m, cells))
    green = np.where(by_sun[:, 0] > 0.6, [1.0, 1.6, 1.0], 1.0)
    sent = 0.4 / np.pi * green * (1 + 2 * by_sun[:, 0] + through.sum(1, keepdims=True))
    expected = np.ones((cells + 1, 3))
    unknown = Unknown(through, by_sun, 1e-6 * expected, expected)
    pairs = rng.integers(0, m, (8 * m, 2))
    found, _ = solve(sent, np.ones((m, 3)), unknown, pairs)
    assert found[-1] == pytest.approx(found[-1].mean() * np.ones(3), rel=0.15) and 1.3 < found[-1].mean() < 3


def test_a_source_that_is_not_believed_keeps_what_was_measured_and_the_rest_makes_up_for_it():
    """A highlight lies where a lamp lights most, so it would take some of the lamp's light for its own."""
    rng, m = np.random.default_rng(3), 1000
    by_lamp = rng.uniform(0, 0.1, (m, 1))
    by_highlight = 10 * by_lamp**2
    sent = 0.4 / np.pi * (1 + 20 * by_lamp + 30 * by_highlight) * np.ones(3)
    measured = np.full((2, 3), 0.5)
    unknown = Unknown(np.concatenate([by_lamp, by_highlight], 1), np.zeros((m, 0, 3)), measured, measured)
    pairs, received = rng.integers(0, m, (8 * m, 2)), np.ones((m, 3))
    both, _ = solve(sent, received, unknown, pairs, np.ones(m))
    assert both[1].mean() > 10
    alone, _ = solve(sent, received + 0.5 * by_highlight, unknown.part(np.array([True, False])), pairs, np.ones(m))
    found, _ = solve_for_some(sent, received, unknown, pairs, lambda radiance: np.array([True, radiance[1, 0] < 2]))
    assert (found[1] == 0.5).all() and found[0] == pytest.approx(alone[0])
    all_of_them, _ = solve_for_some(sent, received, unknown, pairs, lambda radiance: np.ones(2, bool))
    assert all_of_them == pytest.approx(both)


@pytest.mark.parametrize("area_of_paper, true", [(0.001, 20), (2, 20 * 0.95 / 0.8)])
def test_the_brightest_surface_is_white_paint_where_nothing_else_tells_the_level(area_of_paper, true):
    """One lamp lights all alike, and so tells nothing of its radiance. Paper is brighter, but mostly small."""
    rng, m = np.random.default_rng(5), 1000
    albedo, area = rng.choice([0.2, 0.4, 0.8], m, p=[0.5, 0.3, 0.2]), np.ones(m)
    paper = np.arange(m) < 50
    albedo[paper], area[paper] = 0.95, area_of_paper
    unknown = Unknown(np.ones((m, 1)), np.zeros((m, 0, 3)), np.full((1, 3), 1e-6), np.full((1, 3), 60.0), True)
    sent, pairs = albedo[:, None] * 20 / np.pi * np.ones(3), rng.integers(0, m, (8 * m, 2))
    (found,), _ = solve(sent, np.full((m, 3), 1e-3), unknown, pairs, area)
    assert found == pytest.approx(true, rel=0.12)


def test_without_that_the_level_is_drawn_to_that_of_a_usual_albedo():
    rng, m = np.random.default_rng(5), 1000
    albedo = rng.choice([0.2, 0.3, 0.8], m, p=[0.8, 0.1, 0.1])
    unknown = Unknown(np.ones((m, 1)), np.zeros((m, 0, 3)), np.full((1, 3), 1e-6), np.full((1, 3), 60.0), True)
    sent, pairs = albedo[:, None] * 20 / np.pi * np.ones(3), rng.integers(0, m, (8 * m, 2))
    without, white = (
        float(solve(sent, np.full((m, 3), 1e-3), unknown, pairs, area)[0].mean()) for area in (None, np.ones(m))
    )
    assert white == pytest.approx(20, rel=0.15) and abs(without - 20) > 2 * abs(white - 20)


def test_a_channel_that_is_known_stays():
    rng, m = np.random.default_rng(6), 500
    through = rng.uniform(0, 0.1, (m, 1))
    sent = 0.5 / np.pi * (1 + 20 * through) * np.ones(3)
    known = np.array([[True, False, False]])
    unknown = Unknown(through, np.zeros((m, 0, 3)), np.full((1, 3), 5.0), np.full((1, 3), 5.0), True, known)
    (found,), _ = solve(sent, np.ones((m, 3)), unknown, rng.integers(0, m, (8 * m, 2)))
    assert found[0] == pytest.approx(5) and (found[1:] > 8).all()
