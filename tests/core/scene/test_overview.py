"""The view of a room that has no frames."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from addon.core.scene.overview import overview
from tests.core.rooms import box_sides, make_room


def test_the_view_is_from_within_and_along_the_room():
    mesh = make_room(box_sides((9.0, 3.0, 2.5))).mesh
    camera = overview(mesh)
    assert (camera.centre > 0).all() and (camera.centre < (9, 3, 2.5)).all()
    ahead = -camera.camera_to_world[:3, 2]
    assert abs(ahead[0]) > 0.9 and abs(ahead[2]) < 0.2
    np.testing.assert_allclose(camera.camera_to_world[:3, :3].T @ camera.camera_to_world[:3, :3], np.eye(3), atol=1e-9)
    assert np.linalg.det(camera.camera_to_world[:3, :3]) > 0


def test_backs_are_not_looked_at():
    room = make_room(box_sides((12.0, 3.0, 2.5))).mesh
    triangles = np.concatenate([room.triangles[:, [0, 2, 1]], room.triangles + len(room.vertices)])
    vertices = np.concatenate([room.vertices, room.vertices + (12, 0, 0)])
    both = replace(room, vertices=vertices, triangles=triangles, object_id=np.tile(room.object_id, 2))
    assert overview(both).centre[0] == 18
