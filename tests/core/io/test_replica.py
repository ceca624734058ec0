"""Replica: which tile is which face's, the objects, the mirrors; a room without frames gets its albedo."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from addon.core.brdf.metal import METAL
from addon.core.errors import BadInputError
from addon.core.io.exr import write_exr
from addon.core.io.read import describe, read_capture
from addon.core.lit_diffuse.from_texture import face_edge, lit_from_tiles
from addon.core.pipeline.recover import Recovery
from addon.core.progress import Progress
from addon.core.results.store import Store
from addon.core.scene.visibility import SATURATED
from tests.core.on_disk import ALBEDO, CHEAP, LAMP, Finished
from tests.core.replica_on_disk import ReplicaOnDisk
from tests.core.rooms import lit_box, make_room, radiosity


@pytest.fixture(scope="module")
def lit():
    room = make_room(lit_box(lamps=(((0.3, 0.7), (0.3, 0.7)),)), 0.05)
    return room, radiosity(room, ALBEDO, {6: LAMP})


@pytest.fixture
def replica(lit, tmp_path):
    return ReplicaOnDisk(tmp_path / "room", *lit)


@pytest.mark.slow
@pytest.mark.parametrize("how", [{}, {"split_size": 0.0}, {"size": 1}, {"size": 5, "edge": 0.7}])
def test_each_element_finds_its_light(lit, tmp_path, how):
    room, light = lit
    made = ReplicaOnDisk(tmp_path / "room", room, light, **how)
    capture = read_capture(made.root)
    assert capture.format == "replica" and not capture.frames and len(capture.instances) == 7
    np.testing.assert_array_equal(capture.mesh.object_id, np.repeat([q.object_id for q in made.quads], 2))
    atlas = make_room(made.quads, 0.1).atlas
    found = lit_from_tiles(capture.mesh, atlas)
    assert found.seen.all()
    for object_id in range(7):
        own, mine = room.atlas.object_id == object_id, atlas.object_id == object_id
        gap = np.linalg.norm(atlas.position[mine][:, None] - room.atlas.position[own][None], axis=2)
        # The mean of what lies within half a tile around each element.
        near = gap < 0.5 * face_edge(capture.mesh)
        wanted = (near[..., None] * light[own][None]).sum(1) / near.sum(1)[:, None]
        off = np.abs(found.radiance[mine] / wanted - 1)
        assert np.median(off) < (0.06 if made.size == 1 else 0.04) and off.max() < 0.6


@pytest.mark.slow
def test_info_tells_where_the_light_is(replica):
    told = describe(read_capture(replica.root))
    assert told["frames"] == 0 and any("no frames" in warning for warning in told["warnings"])


def test_a_room_without_frames_gets_its_albedo(replica, tmp_path):
    with Store(tmp_path / "result") as store:
        recovery = Recovery(read_capture(replica.root), store, CHEAP, Progress(), replica.unwrap)
        done = Finished(recovery)
        page = (tmp_path / "result/report.html").read_text()
    for object_id in range(6):
        assert np.median(np.abs(done.off(object_id, ALBEDO[object_id]))) < 0.05, object_id
    assert [lamp.object_id for lamp in done.shading.lamps] == [6]
    assert done.report["figures"]["lit_from"] == "textures on the mesh"
    assert "stored on the mesh" in page
    with Store(tmp_path / "result") as store:  # what is stored is found again
        again = Finished(Recovery(read_capture(replica.root), store, CHEAP, Progress(), replica.unwrap))
        assert all(again.stored.values())
        np.testing.assert_array_equal(again.albedo.rho, done.albedo.rho)


def test_the_elements_are_as_large_as_the_faces(replica, tmp_path):
    with Store(tmp_path / "result") as store:
        capture = read_capture(replica.root)
        run = Recovery(capture, store, replace(CHEAP, texel_size=0), Progress(), replica.unwrap)
        # The atlas has 64 texels along its edge at least.
        assert 0.5 < run.surface().texel_size / face_edge(capture.mesh) <= 1.05


def test_unseen_and_clipped_texels(lit, tmp_path):
    room, light = lit
    made = ReplicaOnDisk(tmp_path / "room", room, light, split_size=0.0)
    stored = np.fromfile(made.texture(0), np.float16)
    side = int(np.sqrt(stored.size / 3))
    stored = stored.reshape(side, side, 3)
    stored[:4, :4], stored[:4, 4:8], stored[:4, 8:12] = 0, np.inf, np.nan
    made.texture(0).write_bytes(stored.tobytes())
    capture = read_capture(made.root)
    atlas = make_room(made.quads, 0.1).atlas
    found = lit_from_tiles(capture.mesh, atlas)
    face = atlas.triangle // 2
    assert not found.seen[(face == 0) | (face == 2)].any() and found.seen[face > 2].all()
    assert (found.tier[face == 1] == SATURATED).all() and np.isfinite(found.radiance[found.seen]).all()


def wall_mirror(reflectivity, wall=3):
    """Replica's description of the wall at x = 4, `wall` 3."""
    ring = [(4, 0, 0), (4, 3, 0), (4, 3, 2.5), (4, 0, 2.5)]
    return {"plane_w": [-1, 0, 0, 4], "boundary_w": ring, "reflectivity": reflectivity}


@pytest.mark.slow
def test_mirrors_are_told_and_followed(replica, tmp_path):
    (replica.root / "glass.sur").write_text(json.dumps([wall_mirror(0.9), {"plane_w": 7}]))
    capture = read_capture(replica.root)
    [mirror] = capture.mirrors
    assert mirror.object_id == 3 and mirror.reflectivity == 0.9
    assert any("1 mirrors: thing (3) 90%" in warning for warning in capture.warnings)
    assert any("1 of 2 panes" in warning for warning in capture.warnings)
    with Store(tmp_path / "result") as store:
        done = Finished(Recovery(capture, store, replace(CHEAP, mirrors=True), Progress(), replica.unwrap))
    assert [one.object_id for one in done.shading.mirrors] == [3]
    [material] = [m for m in done.materials if m.object_id == 3]
    assert material.model == METAL and material.f0 == pytest.approx((0.9,) * 3) and material.alpha == 0


@pytest.mark.parametrize(
    "content, told",
    [
        (json.dumps([wall_mirror(0.1)]), "1 panes of glass"),
        ("{", "can't be read"),
        ("[[[", "can't be read"),
        (json.dumps([{**wall_mirror(0.9), "boundary_w": [(4, 0, 0), (4, 0.1, 0), (4, 0.1, 0.1)]}]), "part of a larger"),
        (json.dumps([{**wall_mirror(0.9), "plane_w": [-1, 0, 0, 3]}]), "part of a larger"),
        (json.dumps([{**wall_mirror(0.9), "plane_w": [0, 0, 0, 3]}]), "1 of 1 panes"),
    ],
)
def test_panes_that_are_no_mirrors(replica, content, told):
    (replica.root / "glass.sur").write_text(content)
    capture = read_capture(replica.root)
    assert not capture.mirrors and any(told in warning for warning in capture.warnings)


def test_frames_beside_it_are_taken_instead(replica):
    entry = {"file_path": "a.exr", "transform_matrix": [[1, 0, 0, 2], [0, 1, 0, 1], [0, 0, 1, 1], [0, 0, 0, 1]]}
    (replica.root / "transforms.json").write_text(json.dumps({"w": 8, "h": 6, "fl_x": 6, "frames": [entry]}))
    write_exr(replica.root / "a.exr", np.full((6, 8, 3), 0.5))
    capture = read_capture(replica.root)
    assert capture.format == "replica" and len(capture.frames) == 1 and capture.mesh.lit is None
    assert len(capture.instances) == 7


SPOILS = {
    "no texture": (lambda r: r.texture(1).unlink(), "missing"),
    "a low range": (lambda r: r.texture(1).rename(r.root / "textures/1-color-ptex.rgb"), "not HDR"),
    "a cut texture": (lambda r: r.texture(0).write_bytes(r.texture(0).read_bytes()[:-2]), "no square"),
    "a small texture": (lambda r: r.texture(0).write_bytes(bytes(6 * 16)), "room for 1 faces"),
    "one too many": (lambda r: r.texture(len(list((r.root / "textures").glob("*.hdr")))).write_bytes(b""), "more pict"),
    "no tile": (lambda r: (r.root / "textures/parameters.json").write_text('{"splitSize": 1, "tileSize": 0}'), "tileS"),
    "no split": (lambda r: (r.root / "textures/parameters.json").write_text('{"tileSize": 4}'), "splitSize None"),
    "no ids": (
        lambda r: (r.root / "habitat/mesh_semantic.ply").write_bytes((r.root / "mesh.ply").read_bytes()),
        "no object_id",
    ),
    "no order": (lambda r: (r.root / "habitat/sorted_faces.bin").unlink(), "whose texture is whose"),
    "another order": (lambda r: (r.root / "habitat/sorted_faces.bin").write_bytes(bytes(8)), "sorted_faces"),
    "a hostile order": (lambda r: (r.root / "habitat/sorted_faces.bin").write_bytes(b"\xff" * 64), "sorted_faces"),
    "a cut mesh": (lambda r: (r.root / "mesh.ply").write_bytes((r.root / "mesh.ply").read_bytes()[:-99]), "cut off"),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", SPOILS)
def test_what_is_wrong_is_one_sentence(replica, name):
    spoil, told = SPOILS[name]
    spoil(replica)
    with pytest.raises(BadInputError, match=told) as error:
        read_capture(replica.root)
    assert "\n" not in str(error.value)


def test_a_texture_that_goes_during_the_run(replica):
    capture = read_capture(replica.root)
    replica.texture(0).unlink()
    with pytest.raises(BadInputError, match="changed during the run"):
        lit_from_tiles(capture.mesh, make_room(replica.quads, 0.1).atlas)


def test_triangles_have_no_tiles(replica, text_of_ply):
    (replica.root / "mesh.ply").write_text(text_of_ply([(0, 0, 0), (1, 0, 0), (0, 1, 0)], [(0, 1, 2)]))
    with pytest.raises(BadInputError, match="quads"):
        read_capture(replica.root)
