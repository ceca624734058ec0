"""Values handed from one worker to another: the same types, the same bits."""

from __future__ import annotations

import dataclasses
import json
import math

import numpy as np
import pytest

from addon.core.brdf.metal import METAL
from addon.core.results.values import packed, unpacked


@dataclasses.dataclass(frozen=True)
class Thing:
    number: object
    more: object = None


def through(value):
    arrays: dict[str, np.ndarray] = {}
    return unpacked(json.loads(json.dumps(packed(value, arrays))), arrays, {"Thing": Thing})


@pytest.mark.parametrize(
    "value",
    [
        None, True, 3, 0.1, -0.0, math.inf, 5e-324, "x", "",
        np.float32(0.1), np.float64(0.1), np.int64(3), np.bool_(True),
        (1, (2.5, "a")), [], [None], {1: "a", 2: (0.5,)}, {}, frozenset({"b", "a"}), METAL,
        Thing(Thing(np.float32(1) / 3, {3: METAL}), (0.1,)),
    ],
)  # fmt: skip
def test_as_it_was(value):
    found = through(value)
    assert found == value and type(found) is type(value)
    # A set's own order goes by the seed of Python's hashes and by how it was filled.
    assert isinstance(value, frozenset) or repr(found) == repr(value)


def test_arrays_keep_type_shape_and_order():
    value = np.asfortranarray(np.arange(6, dtype=np.float32).reshape(2, 3) / 7)
    found = through((value, value[:0], np.array(2.5)))
    assert all(a.dtype == b.dtype and a.shape == b.shape for a, b in zip(found, (value, value[:0], np.array(2.5))))
    assert found[0].tobytes() == value.tobytes() and math.isnan(through(math.nan))


def test_only_what_is_named_is_made():
    arrays: dict[str, np.ndarray] = {}
    told = packed(Thing(1), arrays)
    with pytest.raises(LookupError):
        unpacked(told, arrays, {})
    with pytest.raises(LookupError):
        unpacked({"brdf": "of no package"}, arrays, {})
    with pytest.raises(TypeError):
        packed(object(), arrays)
