"""The atlas's layout: nothing overlaps, nothing of the user's changes."""

import subprocess
import sys

import numpy as np
import pytest

from addon.core.scene.model import Mesh

bpy = pytest.importorskip("bpy")

from addon.bridge.data.unwrap import unwrap  # noqa: E402
from addon.core.scene.uv_islands import areas, connected, corner_ids  # noqa: E402
from addon.core.scene.uv_overlap import overlapping_pairs  # noqa: E402

SIZE = 512


def room(vertices, triangles, object_id=None):
    triangles = np.asarray(triangles, np.int32)
    ids = np.zeros(len(triangles), np.int32) if object_id is None else np.asarray(object_id, np.int32)
    return Mesh(np.asarray(vertices, np.float64), triangles, ids)


def spiral():
    """A winding ramp: three turns lie over each other in any projection along the axis."""
    angle = np.linspace(0, 6 * np.pi, 90)
    inner = np.stack([0.5 * np.cos(angle), 0.5 * np.sin(angle), 0.03 * angle], -1)
    i = np.arange(89)
    faces = np.concatenate([np.stack([i, i + 90, i + 1], -1), np.stack([i + 1, i + 90, i + 91], -1)])
    return room(np.concatenate([inner, inner * (2, 2, 1)]), faces)


def soup():
    rng = np.random.default_rng(0)
    return room(rng.standard_normal((200, 3)), np.stack([rng.permutation(200)[:3] for _ in range(300)]))


def rectangles(count):
    rng = np.random.default_rng(0)
    quads = [
        np.array([[0, 0, 0], [w, 0, 0], [w, h, 0], [0, h, 0]]) + (3 * i, 0, i)
        for i, (w, h) in enumerate(rng.uniform(0.5, 2, (count, 2)))
    ]
    faces = np.arange(count)[:, None, None] * 4 + [[0, 1, 2], [0, 2, 3]]
    return room(np.concatenate(quads), faces.reshape(-1, 3), np.repeat(np.arange(count), 2))


@pytest.mark.parametrize("make", [spiral, soup, lambda: rectangles(20)])
def test_no_texel_belongs_to_two_triangles(scene, make):
    mesh = make()
    uv = unwrap(mesh, SIZE)
    assert uv.shape == (len(mesh.triangles), 3, 2) and uv.dtype == np.float32
    assert uv.min() >= 0 and uv.max() <= 1
    assert not len(overlapping_pairs(uv, 0.05 / SIZE))
    assert areas(uv).sum() > 0.25


def test_the_spiral_would_overlap_in_one_island(scene):
    flat = spiral().vertices[spiral().triangles][..., :2] / 2.2 + 0.5
    assert len(overlapping_pairs(flat, 0.05 / SIZE)) > 100


def test_islands_keep_their_margin(scene):
    uv = unwrap(rectangles(30), SIZE, margin_texels=8).reshape(30, 6, 2) * SIZE
    low, high = uv.min(1), uv.max(1)
    gap = np.maximum(low[:, None] - high, low - high[:, None]).max(-1)
    np.fill_diagonal(gap, np.inf)
    assert 7.5 < gap.min() < 12


def test_scale_is_one_for_all(scene):
    mesh = rectangles(20)
    corners = mesh.vertices[mesh.triangles]
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1) / 2
    ratio = np.sqrt(areas(unwrap(mesh, SIZE)) / area)
    assert ratio.max() / ratio.min() < 1.01


def test_no_island_spans_two_objects(scene):
    mesh = room([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 3]], [4, 9])
    uv = unwrap(mesh, SIZE)
    assert len(np.unique(connected(corner_ids(mesh.triangles, uv)))) == 2
    one = unwrap(room(mesh.vertices, mesh.triangles), SIZE)
    assert len(np.unique(connected(corner_ids(mesh.triangles, one)))) == 1


def test_degenerate_triangles_are_tolerated(scene):
    mesh = room([[0, 0, 0], [1, 0, 0], [0, 1, 0], [2, 0, 0]], [[0, 1, 2], [1, 1, 2], [0, 1, 3], [0, 1, 2], [3, 3, 3]])
    uv = unwrap(mesh, SIZE)
    assert np.isfinite(uv).all() and not len(overlapping_pairs(uv, 0.05 / SIZE))
    area = areas(uv)
    assert (area[[0, 3]] > 1e-3).all() and (area[[1, 2, 4]] < 1e-6).all()


@pytest.mark.parametrize("faces", [np.empty((0, 3)), [[0, 1, 2]], [[0, 0, 0]]])
def test_tiny_meshes(scene, faces):
    uv = unwrap(room([[0, 0, 0], [1, 0, 0], [0, 1, 0]], np.reshape(faces, (-1, 3))), SIZE)
    assert np.isfinite(uv).all() and len(uv) == len(faces)


CROWD = """
import sys, threading
import bpy
from addon.bridge.data.shown import in_window

end = threading.Event()

def read():
    while not end.is_set():
        open(sys.argv[1], "rb").close()  # lets go of the interpreter's lock and takes it again

threads = [threading.Thread(target=read) for _ in range(2)]
for one in threads:
    one.start()
with in_window(bpy.data.scenes.new("Other")):
    for _ in range(60000):
        bpy.ops.object.select_all(action="SELECT")
end.set()
"""


@pytest.mark.slow
def test_operators_bear_threads_that_run_python_meanwhile(root):
    """With an overridden context Blender looked it up in a dict of Python's without the interpreter's lock: a crash."""
    assert subprocess.run([sys.executable, "-c", CROWD, __file__], cwd=root, timeout=300).returncode == 0


def test_the_users_view_layer_stays(scene):
    scene.view_layers.new("Mine")
    window = bpy.context.window_manager.windows[0]
    window.view_layer = scene.view_layers["Mine"]
    unwrap(rectangles(3), SIZE)
    assert window.scene == scene and window.view_layer.name == "Mine"


def test_the_users_scene_selection_and_mode_stay(scene):
    bpy.ops.mesh.primitive_cube_add()
    other = bpy.context.object
    bpy.ops.mesh.primitive_plane_add()
    mine = bpy.context.object
    other.select_set(True)
    bpy.ops.object.mode_set(mode="EDIT")
    names = {kind: [x.name for x in getattr(bpy.data, kind)] for kind in ("scenes", "objects", "meshes")}
    unwrap(rectangles(3), SIZE)
    assert bpy.context.scene == scene and bpy.context.object == mine and mine.mode == "EDIT"
    assert set(bpy.context.selected_objects) == {other, mine}
    assert names == {kind: [x.name for x in getattr(bpy.data, kind)] for kind in names}
    bpy.ops.object.mode_set(mode="OBJECT")
