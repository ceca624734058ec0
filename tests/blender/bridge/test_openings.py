"""Panels in the openings of a scan as lamps of the scene."""

from __future__ import annotations

import json

import bpy
import pytest

from addon.bridge.light.lamps import find_lamps, recovered_radiance
from addon.bridge.scene.write import make_openings
from addon.core.results.room_file import OPENINGS

QUAD = [[0, 0, 2], [0, 1, 2], [1, 1, 2], [1, 0, 2]]


def test_a_panel_is_a_lamp_that_faces_the_room_and_that_no_camera_sees(tmp_path):
    told = {"openings": [{"radiance": [30, 20, 10], "corners": [QUAD]}]}
    (tmp_path / OPENINGS).write_text(json.dumps(told))
    scene = bpy.context.scene
    (made,) = make_openings(tmp_path, scene.collection)
    assert [lamp for lamp in find_lamps(scene) if lamp in list(made.data.materials)]
    assert recovered_radiance(made.data.materials[0]) == pytest.approx((30, 20, 10), rel=1e-4)
    assert all(face.normal.z == pytest.approx(-1) for face in made.data.polygons)
    assert not made.visible_camera


def test_nothing_is_made_of_a_result_without_them(tmp_path):
    assert make_openings(tmp_path, bpy.context.scene.collection) == []
