"""PNGs that are written are read as they were."""

from __future__ import annotations

import numpy as np
import pytest

from addon.core.io.oiio import coded_header, read_coded
from addon.core.io.png import write_png


@pytest.mark.parametrize("kind", [np.uint8, np.uint16])
@pytest.mark.parametrize("size", [(7, 9), (1, 1), (1, 40), (40, 1)])
def test_what_is_written_is_read(tmp_path, kind, size):
    picture = np.random.default_rng(0).integers(0, np.iinfo(kind).max + 1, (*size, 3), kind)
    write_png(tmp_path / "a.png", picture[:, ::-1])  # a view, which lies in no order
    np.testing.assert_array_equal(read_coded(tmp_path / "a.png").colour, picture[:, ::-1])
    assert coded_header(tmp_path / "a.png") == (size[1], size[0], np.iinfo(kind).bits)


@pytest.mark.parametrize("array", [np.zeros((4, 4, 3)), np.zeros((4, 4), np.uint8), np.zeros((4, 4, 4), np.uint8)])
def test_a_wrong_shape_is_the_callers_mistake(tmp_path, array):
    with pytest.raises(ValueError, match="png takes"):
        write_png(tmp_path / "a.png", array)
