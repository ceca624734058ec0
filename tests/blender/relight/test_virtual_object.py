"""Virtual objects: they touch what they stand on, keep out of walls, and are lit."""

import math

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from mathutils import Vector  # noqa: E402

from addon.bridge.light.room import Hit, bounds, cast  # noqa: E402
from addon.bridge.relight import virtual_object as virtual  # noqa: E402
from addon.core.errors import BadInputError  # noqa: E402
from tests.blender.relight.sheets import sheet  # noqa: E402

UP = Vector((0, 0, 1))


def points(thing):
    thing = thing.evaluated_get(bpy.context.evaluated_depsgraph_get())
    return np.array([thing.matrix_world @ v.co for v in thing.data.vertices])


@pytest.mark.parametrize("shape", virtual.NAMES)
def test_its_lowest_point_lies_on_the_surface(scene, shape):
    floor = sheet(scene, "floor", 4, (0.3, 0.2, 0.7))
    thing = virtual.add_virtual(scene, shape, 0.4, virtual.GLOSSY, Hit(Vector((0.5, -0.4, 0.7)), UP, 1, floor))
    low, high = points(thing).min(0), points(thing).max(0)
    assert low[2] == pytest.approx(0.7, abs=1e-5)
    assert (low + high)[:2] / 2 == pytest.approx([0.5, -0.4], abs=0.02)
    assert max(high - low) == pytest.approx(0.4, rel=0.12)  # Suzanne's smoothing shrinks her


def test_on_a_slope_it_touches_and_does_not_sink_in(scene):
    sheet(scene, "slope", 4, (0, 0, 0), (0, math.radians(20), 0))
    at = cast(scene, Vector((0, 0, 1)), Vector((0, 0, -1)))
    thing = virtual.add_virtual(scene, "CUBE", 0.4, virtual.MATTE, at)
    gap = [p[2] + math.tan(math.radians(20)) * p[0] for p in points(thing)]
    assert min(gap) == pytest.approx(0, abs=1e-4)


def test_it_keeps_out_of_a_corner(scene):
    floor = sheet(scene, "floor", 4, (0, 0, 0))
    sheet(scene, "wall", 4, (2, 0, 0), (0, math.pi / 2, 0))
    sheet(scene, "wall", 4, (0, 2, 0), (math.pi / 2, 0, 0))
    thing = virtual.add_virtual(scene, "SPHERE", 0.5, virtual.MATTE, Hit(Vector((1.95, 1.95, 0)), UP, 1, floor))
    assert points(thing).max(0)[:2].max() <= 2.0 and points(thing)[:, 2].min() == pytest.approx(0, abs=1e-5)


def test_pointing_at_a_wall_means_the_floor_before_it(scene):
    sheet(scene, "floor", 4, (0, 0, 0))
    wall = sheet(scene, "wall", 4, (2, 0, 0), (0, -math.pi / 2, 0))
    at = Hit(Vector((2, 0.5, 1.2)), Vector((-1, 0, 0)), 1, wall)
    thing = virtual.add_virtual(scene, "CUBE", 0.3, virtual.MATTE, at)
    assert points(thing).max(0)[0] <= 2.0 and points(thing)[:, 2].min() == pytest.approx(0, abs=1e-5)


def test_an_object_of_ones_own_keeps_its_shape_and_stands(scene):
    sheet(scene, "floor", 4, (0, 0, 0.25))
    bpy.ops.mesh.primitive_torus_add(location=(9, 9, 9), rotation=(1, 0.3, 0))
    mine = bpy.context.object
    mine.scale = (0.2, 0.2, 0.3)
    rotation = mine.rotation_euler.copy()
    virtual.stand(scene, mine, Hit(Vector((0, 0, 0.25)), UP, 1, mine))
    assert points(mine)[:, 2].min() == pytest.approx(0.25, abs=1e-5)
    assert mine.rotation_euler == rotation and mine.scale[2] == pytest.approx(0.3) and not mine.hide_viewport
    virtual.stand(scene, mine, Hit(Vector((1, 0, 0.25)), UP, 1, mine))  # a second time: not onto itself
    assert points(mine)[:, 2].min() == pytest.approx(0.25, abs=1e-5)


@pytest.mark.parametrize("camera", range(0, 10, 3))
def test_in_the_middle_of_the_view_of_a_recovered_room(room, camera):
    room.camera = [thing for thing in room.objects if thing.type == "CAMERA"][camera]
    low, high = bounds(room)
    thing = virtual.add_virtual(room, "SPHERE", 0.25, virtual.MIRROR)
    mine = points(thing)
    assert (mine.min(0) > np.array(low) - 1e-3).all() and (mine.max(0) < np.array(high) + 1e-3).all()
    thing.hide_viewport = True
    lowest = Vector(mine[mine[:, 2].argmin()])
    below = cast(room, lowest + Vector((0, 0, 0.01)), Vector((0, 0, -1)))
    assert below.distance == pytest.approx(0.01, abs=2e-3)


def test_it_takes_light_and_throws_shadow(scene, shoot, look_down):
    floor = sheet(scene, "floor", 4, (0, 0, 0))
    sheet(scene, "lamp", 0.3, (0, 0, 2), (math.pi, 0, 0), 5, (20.0, 20.0, 20.0))
    look_down(2.0, 1.5)
    bare = shoot(scene, 32, 32, 64)
    virtual.add_virtual(scene, "CUBE", 0.4, virtual.MATTE, Hit(Vector((0, 0, 0)), UP, 1, floor))
    seen = shoot(scene, 32, 32, 64)
    assert seen[15:17, 15:17].mean() > 1.2 * bare[15:17, 15:17].mean()  # its top is nearer the lamp
    ring = [(16, 12), (12, 16), (20, 16), (16, 20)]
    assert np.mean([seen[p].mean() for p in ring]) < 0.9 * np.mean([bare[p].mean() for p in ring])


def test_without_a_surface_it_is_told(scene):
    sheet(scene, "wall", 2, (0, 0, 0), (math.pi / 2, 0, 0))
    with pytest.raises(BadInputError, match="no surface below"):
        virtual.add_virtual(scene, "CUBE")
    assert not [thing for thing in scene.objects if virtual.KIND in thing]
