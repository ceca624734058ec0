"""A sheet's two sides in Blender: laid out apart, each shown on its side in Cycles, and a whole round trip."""

import json
from dataclasses import replace

import numpy as np
import pytest

from addon.core.brdf.lambertian import LAMBERTIAN
from addon.core.brdf.material import ObjectMaterial
from addon.core.io.exr import write_exr
from addon.core.scene.model import Instance
from addon.core.scene.two_sides import laid_apart, with_backs
from tests.core.scene.test_two_sides import ROUND, laid_out, tube
from tests.hard_cases.rooms import QUICK, Captured, sheet_between_rooms

bpy = pytest.importorskip("bpy")

from addon.bridge.data.images import load_image  # noqa: E402
from addon.bridge.data.materials import make_material  # noqa: E402
from addon.bridge.data.mesh_objects import each_object  # noqa: E402
from addon.bridge.data.unwrap import Polygons, unwrap  # noqa: E402
from addon.bridge.job.run import run  # noqa: E402
from addon.bridge.room.bring import bringing  # noqa: E402
from addon.bridge.slices import whole  # noqa: E402
from addon.core.progress import Progress  # noqa: E402
from addon.core.scene.uv_islands import areas  # noqa: E402
from addon.core.scene.uv_overlap import overlapping_pairs  # noqa: E402


@pytest.mark.parametrize("in_faces", [False, True])
def test_both_sides_have_a_place_in_the_atlas(scene, in_faces):
    mesh = with_backs(tube(), np.arange(2 * ROUND))
    polygons = None
    if in_faces:  # each two triangles are one quad of the artist's
        a, b = np.arange(ROUND), (np.arange(ROUND) + 1) % ROUND
        quads = np.stack([a, b, b + ROUND, a + ROUND], 1)
        first = 4 * np.arange(ROUND)[:, None]
        polygons = Polygons(np.arange(ROUND + 1) * 4, quads.ravel(), np.r_[first + [0, 1, 2], first + [0, 2, 3]])
    uv = unwrap(mesh, 512, polygons=polygons)
    assert uv.shape == (4 * ROUND, 3, 2) and not len(overlapping_pairs(uv, 0.05 / 512))
    assert (areas(uv) > 5e-5).all()


@pytest.mark.parametrize("shift", [0.0, 2000.0])
def test_cycles_shows_each_side_on_its_own(scene, shoot, look, white_world, tmp_path, shift):
    """Green outside, red inside, under a white sky: no pixel of one side holds any of the other."""
    mesh = with_backs(tube(flip=(4,)), np.arange(2 * ROUND))
    uv = laid_out(mesh, 256)
    mesh = laid_apart(mesh, mesh.vertices[: 2 * ROUND] + (shift, 0, 0))
    corners = mesh.vertices[mesh.triangles] - (shift, 0, 0)
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    outside = (normal[:, :2] * corners.mean(1)[:, :2]).sum(1) > 0
    edge = int(np.ceil(np.sqrt(len(uv))))
    cells = np.zeros((edge * edge, 3), np.float32)
    cells[: len(uv)] = np.where(outside[:, None], np.float32([0, 0.8, 0]), np.float32([0.8, 0, 0]))
    image = cells.reshape(edge, edge, 3).repeat(16, 0).repeat(16, 1)
    write_exr(tmp_path / "base.exr", image[::-1])
    [thing] = dict(each_object(mesh, [Instance(0, "shade")], uv, scene.collection)).values()
    described = ObjectMaterial(0, "shade", LAMBERTIAN)
    thing.data.materials.append(make_material(described, load_image(tmp_path / "base.exr")))
    scene.render.film_transparent = True
    look((shift + 3, 0, 0.5), (np.pi / 2, 0, np.pi / 2), width=0.8)  # at its outside
    from_without = shoot(48, 48, 16)
    look((shift, 0, 3), width=0.8)  # down into it, perspective: all around the opening is inside
    scene.camera.data.type, scene.camera.data.angle = "PERSP", 0.45
    from_within = shoot(48, 48, 16)
    for picture, own, other in ((from_without, 1, 0), (from_within, 0, 1)):
        there = picture[..., 3] == 1
        assert there.sum() > 300
        assert picture[there][:, own].min() > 0.1
        assert picture[there][:, other].max() < 0.01 * picture[there][:, own].min()


@pytest.mark.slow
@pytest.mark.once
def test_round_trip_of_a_sheet_between_two_rooms(scene, shoot, tmp_path):
    """The result shows either side of the sheet as the frames did, twenty times apart in light and two in albedo."""
    case = sheet_between_rooms()
    taken = Captured(tmp_path / "capture", case.room, case.shown, views=case.views)
    run(taken.root, tmp_path / "result", replace(QUICK, shading_rays=128), Progress())
    report = json.loads((tmp_path / "result" / "report.json").read_text())
    sheet = 4.0 / (2 * 6 * 4.0 - 4.0 + 4.0)
    assert report["figures"]["two_sided_share"] == pytest.approx(sheet, rel=0.01)
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "result" / "scene.blend"))
    opened = bpy.context.scene
    opened.cycles.use_denoising = opened.cycles.use_adaptive_sampling = False
    opened.cycles.samples, opened.render.image_settings.file_format = 128, "OPEN_EXR"
    opened.render.film_transparent = False
    frames = {c.name: c for c in opened.objects if "frame_path" in c}
    # `all_round` looks along +x, -x, ...: of the first eye along +x, of the first in the dim room along -x.
    for index in (0, 5 * 6 + 1):
        camera = case.views[index]
        opened.camera = frames[sorted(frames)[index]]
        assert np.allclose(opened.camera.matrix_world.translation, camera.centre, atol=1e-5)
        opened.render.resolution_x, opened.render.resolution_y = camera.width, camera.height
        opened.render.filepath = str(tmp_path / f"seen{index}.exr")
        bpy.ops.render.render(write_still=True)
        pixels = np.array(bpy.data.images.load(opened.render.filepath).pixels[:], np.float32)
        picture = pixels.reshape(camera.height, camera.width, 4)[::-1, :, :3]
        wanted = case.shown(camera, index)
        middle = (slice(8, 20), slice(8, 20))  # the sheet alone
        ratio = _blocks(picture[middle]) / _blocks(wanted[middle])
        assert np.abs(ratio - 1).max() < 0.1, f"frame {index}: {ratio}"


@pytest.mark.slow
def test_the_room_in_an_open_scene_has_both_sides_and_a_stored_run_is_the_same(scene, tmp_path):
    """The sheet has the two layers that it has in scene.blend; a second run takes the stored stages."""
    case = sheet_between_rooms()
    taken = Captured(tmp_path / "capture", case.room, case.shown, views=case.views[::2])
    result = tmp_path / "result"
    first = run(taken.root, result, QUICK, Progress(), fresh=False)
    whole(bringing(result, scene))
    images = {name: (result / f"{name}.exr").read_bytes() for name in ("base_color", "shading")}
    [sheet] = [thing for thing in scene.objects if thing.get("object_id") == 8]
    assert len(sheet.data.polygons) == 4 and len(sheet.data.materials) == 1
    uv = np.empty(24, np.float32)
    sheet.data.uv_layers["ScanRelight"].uv.foreach_get("vector", uv)
    assert np.ptp(uv.reshape(-1, 2), axis=0).min() > 0.05
    assert not any("Object 8" in warning for warning in first["warnings"])
    again = run(taken.root, result, QUICK, Progress(), fresh=False)
    whole(bringing(result, scene, known=True))
    assert again["stages"]["surface"]["stored"] and again["figures"] == first["figures"]
    assert images == {name: (result / f"{name}.exr").read_bytes() for name in images}


def _blocks(picture: np.ndarray) -> np.ndarray:
    """Means over 2 by 2 blocks of (12, 12, 3), in which a path tracer's noise is gone."""
    return picture.reshape(2, 6, 2, 6, 3).mean((1, 3, 4))
