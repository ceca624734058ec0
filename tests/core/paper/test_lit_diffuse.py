"""The lit diffuse texture: a stream of frames in video order."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from addon.core.paper.lit_diffuse import lit_diffuse
from addon.core.scene.model import Frame
from tests.core.rooms import all_round, box_sides, make_room, picture, pixels_of

EYES = (2, 1.5, 1.2), (1.5, 1.2, 1.4), (2.4, 1.7, 1.1), (1.2, 1.8, 1.5), (2.7, 1.1, 0.9)


def run(room, cameras, pictures, **more):
    frames = [Frame(str(i), Path(str(i)), camera) for i, camera in enumerate(cameras)]
    read = lambda frame: pictures[int(frame.name)]  # noqa: E731
    return lit_diffuse(room.mesh, room.atlas, room.scene, frames, read, threads=2, **more)


def box():
    room = make_room(box_sides(), 0.2)
    colour = room.by_object({i: (0.1 * (i + 1), 0.5, 2.0 - 0.2 * i) for i in range(6)})
    cameras = [c for eye in EYES for c in all_round(eye, 32)]
    return room, colour, cameras, [picture(room, camera, colour) for camera in cameras]


def test_matt_walls_come_back():
    room, colour, cameras, pictures = box()
    found = run(room, cameras, pictures)
    seen = found.count >= 5
    assert seen.mean() > 0.9 and np.allclose(found.median[seen], colour[seen], rtol=1e-4)


def test_a_highlight_in_few_frames_is_no_part_of_it():
    room, colour, cameras, pictures = box()
    shining = [pixels_of(one.radiance * (20 if i < 6 else 1)) for i, one in enumerate(pictures)]
    found = run(room, cameras, shining)
    seen = found.count >= 5
    assert np.median(np.abs(found.median[seen] / colour[seen] - 1)) < 1e-3


def test_frames_are_taken_as_filmed():
    room, _, cameras, pictures = box()
    order = []
    run(room, cameras, pictures, also=lambda index, view, pixels, seen: order.append(index))
    assert order == list(range(len(cameras)))
