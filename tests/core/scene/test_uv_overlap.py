"""Overlap in texture space, against brute force."""

import numpy as np
import pytest

from addon.core.scene.uv_overlap import layers, overlapping_pairs


def brute_force(uv, depth):
    found = []
    for i in range(len(uv)):
        for j in range(i + 1, len(uv)):
            penetration = []
            for tri in (uv[i], uv[j]):
                for k in range(3):
                    edge = tri[(k + 1) % 3] - tri[k]
                    normal = np.array([-edge[1], edge[0]]) / np.linalg.norm(edge)
                    a, b = uv[i] @ normal, uv[j] @ normal
                    penetration.append(min(a.max(), b.max()) - max(a.min(), b.min()))
            if min(penetration) > depth:
                found.append((i, j))
    return np.array(found).reshape(-1, 2)


@pytest.mark.parametrize("size", [0.003, 0.05, 0.4])
def test_pairs_match_brute_force(size):
    rng = np.random.default_rng(3)
    scale = size * rng.uniform(0.05, 1, (120, 1, 1))
    uv = 0.5 + (rng.random((120, 1, 2)) - 0.5) * min(0.5, 8 * size) + scale * rng.uniform(-0.6, 0.6, (120, 3, 2))
    uv[:2] = [[0, 0], [1, 0], [0, 1]], [[1, 1], [1, 0.1], [0.1, 1]]
    expected = brute_force(uv, 1e-4)
    assert len(expected) > 3
    np.testing.assert_array_equal(overlapping_pairs(uv, 1e-4), expected)


def test_pairs_respect_islands():
    uv = np.repeat(np.array([[[0, 0], [0.5, 0], [0, 0.5]]]), 3, 0)
    np.testing.assert_array_equal(overlapping_pairs(uv, 1e-4, np.array([0, 1, 0])), [[0, 2]])


def test_neighbours_and_slivers_do_not_overlap():
    uv = np.array([[[0, 0], [0.5, 0], [0, 0.5]], [[0.5, 0], [0.5, 0.5], [0, 0.5]], [[0, 0], [0.5, 0.5], [0.25, 0.25]]])
    assert not len(overlapping_pairs(uv, 1e-6))


def test_layers_hold_no_pair_and_sheets_keep_together():
    rng = np.random.default_rng(0)
    height = np.repeat([0.0, 1.0, 2.0], 50) + rng.uniform(0, 0.1, 150)
    i = np.arange(50)
    pairs = np.concatenate([np.stack([i, i + 50], -1), np.stack([i + 50, i + 100], -1), np.stack([i, i + 100], -1)])
    layer = layers(pairs, height)
    assert (layer[pairs[:, 0]] != layer[pairs[:, 1]]).all()
    np.testing.assert_array_equal(layer, np.repeat([2, 1, 0], 50))
    assert not layers(np.empty((0, 2), np.int64), height).any()
