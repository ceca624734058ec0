"""Lenses with parameters drawn at random come back over the whole image, or say that no ray leads there."""

import numpy as np
import pytest

pytest.importorskip("hypothesis")
from hypothesis import given, settings
from hypothesis import strategies as st

from addon.core.scene.lenses_colmap import MODELS, intrinsics

WIDTH, HEIGHT = 48, 32
RANGES = {
    "FOV": [(0.0, 3.0)],
    "EUCM": [(0.0, 1.0), (0.2, 3.0)],
    "SIMPLE_DIVISION": [(-1.0, 1.0)],
    "DIVISION": [(-1.0, 1.0)],
}
POWERS = (0.5, 0.3, 0.2, 0.1, 0.05, 0.02)
OTHERS = {
    "OPENCV": [0.5, 0.3, 0.02, 0.02],
    "FULL_OPENCV": [0.5, 0.3, 0.02, 0.02, 0.2, 0.5, 0.3, 0.1],
    "THIN_PRISM_FISHEYE": [0.3, 0.2, 0.02, 0.02, 0.1, 0.05, 0.02, 0.02],
    "RAD_TAN_THIN_PRISM_FISHEYE": [*POWERS, 0.02, 0.02, 0.02, 0.005, 0.02, 0.005],
}


@st.composite
def cameras(draw):
    model = draw(st.sampled_from(MODELS))
    sizes = OTHERS.get(model.name, POWERS[: model.extra])
    ranges = RANGES.get(model.name) or [(-size, size) for size in sizes]
    focal = [draw(st.floats(12, 60)) for _ in range(1 if model.single else 2)]
    extra = [draw(st.floats(*limits)) for limits in ranges]
    return model.name, [*focal, draw(st.floats(20, 28)), draw(st.floats(13, 19)), *extra]


@pytest.mark.slow
@settings(max_examples=120, deadline=None, derandomize=True)
@given(cameras())
def test_pixels_come_back(drawn):
    fx, fy, cx, cy, lens = intrinsics(*drawn, WIDTH, HEIGHT)
    if lens is None:
        return
    y, x = np.mgrid[0.5:HEIGHT, 0.5:WIDTH]
    points = np.stack([(x.ravel() - cx) / fx, (y.ravel() - cy) / fy], -1)
    rays, seen = lens.unproject(points)
    assert np.isfinite(rays).all() and seen[np.abs(points).max(1).argmin()]
    back, again = lens.project(rays[seen])
    assert np.abs((back - points[seen]) * (fx, fy)).max() < 1e-6
    assert (~again).sum() <= 3  # on the very rim
    # What is not seen has no ray at all: none of those that the lens maps comes near it.
    theta, phi = np.meshgrid(np.linspace(0, min(lens.widest, np.pi), 150), np.linspace(0, 2 * np.pi, 120))
    if lens.widest < 1.5 or lens.widest > 1.6:
        fan = np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)], -1).reshape(-1, 3)
        reached, mapped = lens.project(fan)
        found = lens.unproject(reached[mapped])[1]
        assert found.mean() > 0.99
