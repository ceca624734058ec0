"""Which kind of frames a capture is said to have."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from addon.core.evidence.tier import TIERS, tier
from addon.core.scene.model import AUTO, Capture, Frame, Mesh, Shot
from tests.core.rooms import all_round

FRAME = Frame("0", Path("0"), all_round((1, 1, 1))[0])
SHOT = Shot(Path("1"), 2.0)
CODES = replace(FRAME, transfer=AUTO)
CAPTURE = Capture(Path(), Mesh(np.zeros((0, 3)), np.zeros((0, 3), np.int32), np.zeros(0, np.int32)), (), ())


@pytest.mark.parametrize("frames, name", [
    ([FRAME] * 3, "hdr"),
    ([FRAME, replace(FRAME, brackets=(SHOT,)), replace(FRAME, brackets=(SHOT,))], "brackets"),
    ([replace(FRAME, transfer="srgb")], "curve"),
    ([replace(CODES, exposure=1 / 60), replace(CODES, exposure=1 / 30)], "exposures"),
    ([CODES, CODES], "codes"),
    ([], "texture"),
])  # fmt: skip
def test_the_tier_of_most_frames(frames, name):
    assert tier(replace(CAPTURE, frames=tuple(frames))) == name in TIERS
