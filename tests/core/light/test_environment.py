"""Light from outside: directions and cells, what was seen, and what is filled in."""

from __future__ import annotations

import numpy as np
import pytest

from addon.core.light.environment import Environment, EnvironmentAccumulator
from addon.core.scene.visibility import view_frame
from tests.core.rooms import all_round, look_at, make_room, pixels_of, quad

FAR_BELOW = quad((-1, -1, -50), (2, 0, 0), (0, 2, 0), 0)


def centres(height: int) -> np.ndarray:
    """Direction of each cell's middle by docs/architecture.md: u = 0.5 - atan2(y, x) / 2 pi, v = 0.5 + asin(z) / pi."""
    v, u = ((np.arange(n) + 0.5) / n for n in (height, 2 * height))
    azimuth, z = (0.5 - u) * 2 * np.pi, np.sin((v - 0.5) * np.pi)
    ring = np.sqrt(1 - z**2)[:, None]
    grid = [ring * np.cos(azimuth), ring * np.sin(azimuth), np.broadcast_to(z[:, None], (height, 2 * height))]
    return np.stack(grid, -1).reshape(-1, 3).astype(np.float32)


def add(accumulator, room, camera, image, **masks):
    view = view_frame(camera, room.mesh, room.scene)
    accumulator.add(view, pixels_of(image, **masks))
    return view


@pytest.mark.parametrize("height", [16, 128])
def test_each_cell_is_found_by_its_middle(height):
    cells = np.arange(2 * height**2, dtype=np.float32)
    radiance = np.repeat(cells[:, None], 3, 1).reshape(height, 2 * height, 3)
    environment = Environment(radiance, np.ones((height, 2 * height), np.int32))
    assert np.array_equal(environment(centres(height))[:, 0], cells)


def test_known_directions():
    """+X is the middle column, +Y a quarter to its left, +Z the top row; row 0 is the bottom."""
    height = 8
    radiance = np.zeros((height, 16, 3), np.float32)
    radiance[..., 0], radiance[..., 1] = np.arange(16), np.arange(height)[:, None]
    environment = Environment(radiance, np.ones((height, 16), np.int32))
    x, y, right, up, down = environment(np.float32([[1, 0.1, 0.1], [0.1, 1, 0], [0.1, -1, 0], [0, 0, 1], [0, 0, -1]]))
    assert x[0] == 7 and y[0] == 4 and right[0] == 11
    assert up[1] == height - 1 and down[1] == 0
    edge = environment(np.float32([[-1, 0, 0], [-1, -0.0, 0], [-1, 1e-7, 0], [-1, -1e-7, 0]]))
    assert set(edge[:, 0]) <= {0, 15}


def test_the_sky_seen_all_round_comes_back():
    """A sky whose radiance is a linear function of the direction, seen by six cameras from the room's middle."""
    room = make_room([FAR_BELOW])
    accumulator = EnvironmentAccumulator(np.radians(100 / 48))
    for camera in all_round((0, 0, 0), 48):
        d = camera.directions(camera.pixel_centres())
        add(accumulator, room, camera, (2 + d).reshape(48, 48, 3))
    environment = accumulator.result()
    height = len(environment.radiance)
    assert environment.seen and (environment.observations > 0).mean() > 0.7  # at the poles cells are small
    off = np.abs(environment(centres(height)) - 2 - centres(height))
    cell = np.pi / height
    assert off[environment.observations.ravel() > 0].max() < 2 * cell
    assert off.mean() < cell / 2 and off.max() < 5 * cell


def test_filling_in_never_leaves_darkness():
    room = make_room([FAR_BELOW])
    accumulator = EnvironmentAccumulator(0.02)
    add(accumulator, room, look_at((0, 0, 0), (1, 0.3, 0.2), 24, 24, 30), np.full((24, 24, 3), [1.0, 2.0, 3.0]))
    environment = accumulator.result()
    assert (environment.observations == 0).mean() > 0.9  # most directions were not seen
    assert np.allclose(environment.radiance, [1, 2, 3], rtol=1e-5)


def test_filled_cells_take_after_their_neighbours():
    room = make_room([FAR_BELOW])
    accumulator = EnvironmentAccumulator(0.05)
    for sign in (1, -1):
        image = np.full((24, 24, 3), 5.0 if sign > 0 else 1.0)
        add(accumulator, room, look_at((0, 0, 0), (0, sign, 0.3), 24, 24, 60), image)
    environment = accumulator.result()
    low, high = environment(np.float32([[0.3, -0.9, -0.1], [0.3, 0.9, -0.1]]))[:, 0]
    assert low < 2 and high > 4
    assert environment.radiance.min() >= 1 - 1e-5 and environment.radiance.max() <= 5 + 1e-5


def test_what_hits_the_mesh_or_is_masked_is_not_sky():
    board = quad((1, 0.3, -0.3), (0, -0.6, 0), (0, 0, 0.6), 0)
    room = make_room([board])
    accumulator = EnvironmentAccumulator(0.05)
    camera = look_at((0, 0, 0), (1, 0, 0), 30, 30, 60)
    image = np.ones((30, 30, 3))
    valid = np.ones((30, 30), bool)
    valid[:3], image[:3] = False, 77
    view = view_frame(camera, room.mesh, room.scene)
    image[view.triangle >= 0] = 99
    accumulator.add(view, pixels_of(image, valid))
    assert (view.triangle >= 0).any()
    environment = accumulator.result()
    assert np.allclose(environment.radiance, 1)
    assert environment.observations.sum() == ((view.triangle < 0) & view.clean & valid).sum()


def test_a_closed_room_has_no_sky():
    environment = EnvironmentAccumulator(0.1).result()
    assert not environment.seen and not environment.radiance.any()
    assert not environment(np.float32([[0, 0, 1]])).any()


def half_seen(height: int = 32):
    """A sky that is brighter at the horizon, of which a window showed an eighth of the way round, up to 45 degrees."""
    elevation = ((np.arange(height) + 0.5) / height - 0.5) * np.pi
    truth = np.repeat((1 + 3 * np.exp(-np.abs(elevation) / 0.3))[:, None], 2 * height, 1)
    seen = np.zeros(truth.shape, bool)
    seen[np.abs(elevation) < np.radians(45), : height // 4] = True
    radiance = np.repeat(np.where(seen, truth, truth[seen].mean())[..., None], 3, -1).astype(np.float32)
    return truth, Environment(radiance, seen.astype(np.int32)), elevation


def test_unseen_sky_goes_with_the_height_as_the_seen():
    truth, environment, elevation = half_seen()
    height = len(truth)
    zone = environment.unknown_zones()[0]
    solved = environment.with_zone(zone, environment.zone_mean(zone))
    far = np.s_[height // 2 :, height : height + height // 2]  # the other side of the window, above the horizon
    ratio = solved.radiance[far][..., 0] / truth[far]
    flat = environment.zone_mean(zone)[0] / truth[far]
    assert np.ptp(ratio[: height // 4], axis=0).max() < 0.5 * np.ptp(flat[: height // 4], axis=0).max()
    known = environment.observations > 0
    assert np.array_equal(solved.radiance[known], environment.radiance[known])


def test_a_zones_mean_is_what_was_solved():
    _, environment, elevation = half_seen()
    for zone in environment.unknown_zones():
        assert zone.pattern.min() >= 0 and (zone.pattern > 0).sum() == (zone.weight > 0).sum()
        solid = np.cos(elevation)[:, None]
        assert (zone.pattern * solid).sum() == pytest.approx((zone.weight * solid).sum(), rel=1e-4)
        level = zone.pattern[zone.weight > 0.9] / zone.weight[zone.weight > 0.9]
        assert 1.2 < level.max() / level.min() <= 9


def test_a_side_that_frames_clipped_is_one_unknown_with_the_rest_of_it_but_for_a_band_above_the_horizon():
    """Above the horizon all that frames saw is clipped; below it a few cells are, beside more that are told."""
    seen, clipped = np.zeros((16, 32), np.int32), np.zeros((16, 32), bool)
    seen[10, 4:8], clipped[10, 4:8] = 3, True
    seen[5, 4:8], clipped[5, 4] = 3, True
    environment = Environment(np.ones((16, 32, 3), np.float32), seen, clipped)
    band, above, below, rest = environment.unknown_zones()
    assert band.clipped and above.clipped and not below.clipped and rest.clipped
    assert (above.weight[10, 4:8] == 1).all() and not (band.weight * above.weight).any()
    both = band.weight + above.weight
    assert both[8:].min() > 0 and not both[:8].any() and band.weight[8].all() and above.weight[15].all()
    assert not below.weight[5, 4:8].any() and below.measured
    assert rest.weight.sum() == rest.weight[5, 4] == 1


def test_a_sky_of_one_height_has_no_profile():
    seen = np.zeros((16, 32), np.int32)
    seen[9] = 1
    environment = Environment(np.ones((16, 32, 3), np.float32), seen)
    for zone in environment.unknown_zones():
        np.testing.assert_allclose(zone.pattern, zone.weight, rtol=1e-5)


def test_the_ground_is_filled_in_from_the_ground():
    """Seen through one window: sky of 5 above the horizon, ground of 1 below."""
    room = make_room([FAR_BELOW])
    accumulator = EnvironmentAccumulator(0.05)
    camera = look_at((0, 0, 0), (1, 0, 0), 24, 24, 60)
    up = camera.directions(camera.pixel_centres())[:, 2].reshape(24, 24) > 0
    add(accumulator, room, camera, np.where(up[..., None], 5.0, 1.0) * np.ones(3))
    environment = accumulator.result()
    half = len(environment.radiance) // 2
    assert np.allclose(environment.radiance[:half], 1) and np.allclose(environment.radiance[half:], 5)


def test_what_was_seen_through_a_crack_says_nothing_of_what_is_beside_it():
    observations = np.zeros((64, 128), np.int32)
    observations[20:30, 40:60] = 5  # a window
    observations[50, 100] = 9  # a crack of one cell
    found = Environment(np.ones((64, 128, 3), np.float32), observations).unfamiliar
    assert (found[observations > 0] == 0).all()
    assert 0 < found[30, 50] < 0.7 and found[36, 50] > 0.99 and found[51, 100] == found[60, 5] == 1


def test_a_clipped_sky_stays_clipped_where_few_codes_lie_just_below():
    room = make_room([FAR_BELOW])
    accumulator = EnvironmentAccumulator(np.radians(100 / 16))
    for k in range(5):
        for camera in all_round((0, 0, 0), 16):
            shown = np.full((16, 16, 3), 0.9 if k == 0 else 1.0)
            add(accumulator, room, camera, shown, saturated=np.full((16, 16), k > 0))
    found = accumulator.result()
    seen = found.observations > 0
    assert found.clipped[seen].all() and found.radiance[seen] == pytest.approx(1)
