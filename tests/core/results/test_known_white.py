"""A known albedo in one word: a part of the room, or a pixel of a frame."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from addon.core.errors import BadInputError
from addon.core.results.known_white import white_of
from addon.core.results.overrides import White
from addon.core.scene.model import Camera, Capture, Frame, Instance, Mesh

CORNERS = np.array([(0, 0, 0), (4, 0, 0), (4, 4, 0), (0, 4, 0), (0, 4, 3), (4, 4, 3)], float)
SIDES = np.array([(0, 1, 2), (0, 2, 3), (3, 2, 5), (3, 5, 4)], np.int32)
"""A floor and the wall along +Y."""
ROOM = Instance(0, "floor"), Instance(3, "ceiling"), Instance(4, "wall"), Instance(7, "wall")
POSE = np.array([[1, 0, 0, 2], [0, 0, -1, 1], [0, 1, 0, 1.5], [0, 0, 0, 1]], float)
"""In the room's middle, 3 m before the wall, towards it."""


@pytest.fixture
def capture():
    mesh = Mesh(CORNERS, SIDES, np.array([0, 0, 4, 4], np.int32))
    camera = Camera(80, 60, 40.0, 40.0, 40.0, 30.0, POSE)
    frames = tuple(Frame(name, Path(f"images/{name}.jpg"), camera) for name in ("0012", "a:b"))
    return Capture(Path("room"), mesh, ROOM, frames)


@pytest.mark.parametrize(
    "text, part, albedo", [("ceiling", 3, 0.8), ("Wall 7=0.6", 7, 0.6), ("4 = .5", 4, 0.5), ("floor 0=1", 0, 1.0)]
)
def test_a_part(capture, text, part, albedo):
    assert white_of(text, capture) == White(part, (albedo,) * 3)


@pytest.mark.parametrize(
    "text, part, place, albedo",
    [
        ("0012:39,29", 4, (2 - 0.0375, 4, 1.5 + 0.0375), 0.18),
        ("0012.jpg: 59, 29 = .6", 4, (2 + 19.5 / 40 * 3, 4, 1.5375), 0.6),
        ("a:b:39,59=0.5", 0, (2 - 0.5 / 40 * 60 / 29.5, 1 + 60 / 29.5, 0), 0.5),
    ],
)
def test_a_pixel(capture, text, part, place, albedo):
    found = white_of(text, capture)
    assert (found.object_id, found.albedo) == (part, (albedo,) * 3)
    np.testing.assert_allclose(found.at, place, atol=1e-4)


@pytest.mark.parametrize(
    "text, said",
    [
        ("wall", "wall 4, wall 7"), ("door", "ceiling 3"), ("ceiling=9", "9"), ("ceiling=white", "white"),
        ("0013:1,1", "'0013' is no frame.*0012"), ("0012:80,1", "80 x 60.*80,1"), ("0012:39,0", "no surface"),
        ("0012:1,1=0", "'0'"), ("0012:-1,1", "no part"),
    ],
)  # fmt: skip
def test_what_names_no_white_is_told(capture, text, said):
    with pytest.raises(BadInputError, match=said):
        white_of(text, capture)


def test_of_two_frames_alike_none_is_taken(capture):
    twice = replace(capture, frames=(capture.frames[0], capture.frames[0]))
    with pytest.raises(BadInputError, match="several frames"):
        white_of("0012:39,29", twice)
