"""Elements grouped by a label."""

from __future__ import annotations

import numpy as np

from addon.core.groups import by_label


def test_groups_rise_and_keep_their_order():
    groups = by_label(np.array([7, 2, 7, 2, 5]))
    assert [group.tolist() for group in groups] == [[1, 3], [4], [0, 2]]


def test_nothing_is_one_empty_group():
    (group,) = by_label(np.zeros(0, np.int32))
    assert not len(group)
