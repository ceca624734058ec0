"""The demo: its capture is what it claims to be, and a run from end to end leaves what it promises."""

from __future__ import annotations

import json

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from addon.bridge.demo.compare import base_color  # noqa: E402
from addon.bridge.demo.render import SIZES, is_rendered, render_capture  # noqa: E402
from addon.bridge.demo.room import room, tour  # noqa: E402
from addon.core.errors import StorageError  # noqa: E402
from addon.core.io.exr import read_exr  # noqa: E402
from addon.core.io.pixels import read_pixels  # noqa: E402
from addon.core.io.read import read_capture  # noqa: E402
from addon.core.scene.rays import RayScene  # noqa: E402
from addon.core.settings import Settings  # noqa: E402

QUICK = Settings(shading_rays=32, specular_rays=8, emitter_rays=4, refine=0, texel_size=0.08, atlas_size=1024)


def test_the_capture_reads_without_a_warning(tiny_capture):
    capture = read_capture(tiny_capture)
    frames, width, height, _ = SIZES["tiny"]
    assert not capture.warnings
    assert len(capture.frames) == frames and len(capture.instances) == len(room())
    assert (capture.frames[0].camera.width, capture.frames[0].camera.height) == (width, height)
    assert np.allclose(capture.frames[3].camera.camera_to_world, tour(frames)[3])


def test_the_mesh_has_quads_and_triangles(tiny_capture):
    header = (tiny_capture / "mesh.ply").read_bytes()[:600].decode("ascii", "replace")
    quads = sum(len(thing.quads) for thing in room() if not thing.triangles)
    triangles = sum(2 * len(thing.quads) for thing in room() if thing.triangles)
    assert f"element face {quads + triangles}" in header and quads > 0 and triangles > 0


def test_frames_are_lit_and_show_the_room_where_the_camera_says(tiny_capture):
    """Every pixel's ray hits the mesh (the room is closed), and lamps shine with just their radiance."""
    capture = read_capture(tiny_capture)
    scene = RayScene(capture.mesh.vertices, capture.mesh.triangles)
    lamp = next(thing for thing in room() if thing.class_name == "lamp shade")
    seen = []
    for frame in capture.frames:
        pixels = read_pixels(frame)
        assert pixels.valid.all() and np.median(pixels.radiance) > 0.02
        directions = frame.camera.directions(frame.camera.pixel_centres())
        origins = np.broadcast_to(frame.camera.centre.astype(np.float32), directions.shape)
        hit = scene.intersect(np.ascontiguousarray(origins), directions).triangle
        assert (hit >= 0).all()
        ids = capture.mesh.object_id[hit].reshape(pixels.valid.shape)
        inside = ids == lamp.object_id
        for shift in ((0, 1), (0, -1), (1, 0), (-1, 0)):
            inside &= np.roll(ids, shift, (0, 1)) == lamp.object_id
        seen.append(pixels.radiance[inside])
    # The denoiser adds 2 %.
    assert np.median(np.concatenate(seen), axis=0) == pytest.approx(lamp.paints[0].emission, rel=0.04)


def test_truth_says_what_the_paints_are(tiny_capture):
    truth = {one["class_name"]: one for one in json.loads((tiny_capture / "truth" / "materials.json").read_text())}
    assert truth["ball"]["alpha"] == pytest.approx(0.09) and truth["ball"]["f0"] == 0.04
    assert truth["wall"]["base_color"] == [0.70, 0.64, 0.54] and truth["wall"]["alpha"] is None
    assert truth["ceiling lamp"]["emission"] == [20.0, 18.5, 16.5]
    assert all(0 <= c <= 1 for one in truth.values() for c in one["base_color"])


@pytest.mark.slow
def test_rendering_leaves_nothing_open_and_is_not_repeated(tmp_path):
    def there() -> list[int]:
        kinds = ("scenes", "objects", "meshes", "materials")
        # Blender's own "Render Result" comes with the first rendering of all, and stays.
        images = [image for image in bpy.data.images if image.source != "VIEWER"]
        return [*(len(getattr(bpy.data, kind)) for kind in kinds), len(images)]

    before = there()
    folder = render_capture(tmp_path / "capture", "tiny")
    assert there() == before
    stamp = (folder / "images" / "frame_0000.exr").stat().st_mtime_ns
    render_capture(folder, "tiny")
    assert (folder / "images" / "frame_0000.exr").stat().st_mtime_ns == stamp
    assert is_rendered(folder, "tiny") and not is_rendered(folder, "small")
    assert [path.name for path in tmp_path.iterdir()] == ["capture"]


def test_a_full_disk_leaves_no_capture(tmp_path, monkeypatch):
    """Blender does not always notice: a frame that was cut off is found, and nothing is left behind."""
    from addon.bridge.demo import render

    def cut_off(folder, things, poses, size, samples, progress):
        frames(folder, things, poses[:1], size, 1, progress)
        path = folder / "images" / "frame_0000.exr"
        path.write_bytes(path.read_bytes()[:-100])
        render.read_header(path)

    frames = render.render_frames
    monkeypatch.setattr(render, "render_frames", cut_off)
    with pytest.raises(StorageError, match="free some space"):
        render_capture(tmp_path / "capture", "tiny")
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("content", [b"", b"\x89PNG half of it"])
def test_half_a_picture_is_never_taken_for_a_whole_one(content, tmp_path):
    from addon.bridge.relight.pictures import saving

    with (
        pytest.raises(StorageError, match="relit.png' can't be written .No space left"),
        saving(tmp_path / "relit.png") as temporary,
    ):
        temporary.write_bytes(content)
    with (
        pytest.raises(StorageError, match="relit.png' can't be written .it fell over"),
        saving(tmp_path / "relit.png") as temporary,
    ):
        raise RuntimeError("Error: it fell over.\n")
    assert not list(tmp_path.iterdir())


def test_the_colour_of_an_object_is_its_parts_by_what_is_seen_of_them():
    def part(area, seen, albedo):
        evidence = {"area": area, "seen_share": seen, "albedo": albedo}
        return {"object_id": 0, "class_name": "sofa", "model": "lambertian", "evidence": evidence}

    red, blue, unseen = part(1.0, 1.0, [0.8, 0, 0]), part(4.0, 0.75, [0, 0, 0.4]), part(9.0, 0.0, [0, 1, 0])
    np.testing.assert_allclose(base_color([red, blue, unseen]), [0.2, 0, 0.3], rtol=1e-6)
    np.testing.assert_allclose(base_color([unseen]), [0, 1, 0])


@pytest.mark.slow
def test_from_end_to_end(tmp_path):
    from addon.bridge.demo.run import run_demo

    stages = []
    table = run_demo(tmp_path, "tiny", QUICK, lambda event: stages.append(event.stage))
    assert {"render", "write", "pictures"} <= set(stages)
    lines = table.splitlines()
    assert len(lines) == 1 + len(room()) and "missing" not in table
    assert (tmp_path / "comparison.txt").read_text() == table + "\n"
    lamp = next(line for line in lines if line.startswith("ceiling lamp"))
    assert "emitter" in lamp
    for name in ("scene.blend", "albedo.exr", "base_color.exr", "shading.exr", "materials.json", "report.json"):
        assert (tmp_path / name).stat().st_size > 0
    assert np.isfinite(read_exr(tmp_path / "albedo.exr").rgb).all()
    for name in ("before.png", "relit.png", "before_after.png"):
        image = bpy.data.images.load(str(tmp_path / name))
        pixels = np.array(image.pixels[:]).reshape(-1, 4)[:, :3]
        assert 0.1 < pixels.mean() < 0.9 and pixels.std() > 0.05, name
