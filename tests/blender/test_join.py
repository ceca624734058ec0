"""Parts of a building put together: each surface once, with its own images, in one scene that renders."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("bpy")
import bpy

from addon import cli
from addon.bridge.data.cameras import frame_cameras, track_cameras
from addon.bridge.data.mesh_objects import FAR
from addon.bridge.light.lamps import find_lamps
from addon.bridge.scene.as_made import is_edited, is_renamed
from addon.bridge.scene.join import join
from addon.bridge.scene.write import write_scene
from addon.core.brdf.emitter import EMITTER
from addon.core.brdf.lambertian import LAMBERTIAN
from addon.core.brdf.material import ObjectMaterial
from addon.core.errors import BadInputError, StorageError
from addon.core.io.exr import read_exr, write_exr
from addon.core.io.part import PART
from addon.core.light.environment import Environment
from addon.core.passes.pose_refinement.poses import Poses
from addon.core.pipeline.frames import Calibration, Observed
from addon.core.pipeline.parts import Parts
from addon.core.results.result_folders import write_capture
from addon.core.results.room_file import OPENINGS
from addon.core.results.store import Store
from addon.core.results.values import to_store
from addon.core.scene.lit_diffuse import LitDiffuse
from addon.core.scene.model import Camera, Capture, Frame, Instance, Mesh
from addon.core.scene.samples import Samples
from addon.version import VERSION
from tests.farm.conftest import WORKER

WALL, BOX, LAMP, TILES = 1, 2, 3, 4
INSTANCES = (Instance(WALL, "wall"), Instance(BOX, "box"), Instance(LAMP, "lamp"), Instance(TILES, "tiles", 0, WALL))
MATERIALS = (
    *(ObjectMaterial(i.object_id, i.class_name, LAMBERTIAN) for i in INSTANCES if i.object_id != LAMP),
    ObjectMaterial(LAMP, "lamp", EMITTER, emission=(6.0, 3.0, 1.5)),
)
ABOVE_EAST = [[1.0, 0.0, 0.5], [1.0, 1.0, 0.5], [2.0, 1.0, 0.5], [2.0, 0.0, 0.5]]
ABOVE_WEST = [[-2.0, 0.0, 0.5], [-2.0, 1.0, 0.5], [-1.0, 1.0, 0.5], [-1.0, 0.0, 0.5]]
WEST = {"frames": ("a", "b"), "colour": (0.8, 0.1, 0.1), "outside": 0, "median": 0.36}
EAST = {"frames": ("b", "c"), "colour": (0.1, 0.8, 0.1), "outside": 3, "median": 1.44}


def building() -> tuple[Mesh, np.ndarray]:
    """A wall of four squares in a row along x, the last tiled, a box west and a lamp east of x = 0; who is east."""
    squares = [(x, 0.0, 0.0, 1.0) for x in (-2.0, -1.0, 0.0, 1.0)] + [(-1.5, 1.5, 0.2, 0.5), (1.5, 1.5, 0.2, 0.5)]
    corners = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)], float)
    vertices = np.concatenate([corners * side + (x, y, z) for x, y, z, side in squares])
    quads = np.arange(len(vertices)).reshape(-1, 4)
    triangles = quads[:, [0, 1, 2, 0, 2, 3]].reshape(-1, 3).astype(np.int32)
    owner = np.repeat([WALL, WALL, WALL, TILES, BOX, LAMP], 2).astype(np.int32)
    return Mesh(vertices, triangles, owner), vertices[triangles].mean(1)[:, 0] > 0


def make_result(folder: Path, capture: Path, far, frames, colour, outside, median, parts=None) -> Path:
    """What a part's recovery leaves, as far as it matters."""
    mesh, _ = building()
    folder.mkdir(parents=True, exist_ok=True)
    capture.mkdir(parents=True)
    (capture / PART).write_text(json.dumps({"capture": "../../house", "reading": {}, "frames": []}))
    write_capture(folder, capture)
    rows = [{"name": m.name, **m.as_dict()} for m in MATERIALS]
    (folder / "materials.json").write_text(json.dumps({"run": "0" * 16, "capture": capture.name, "objects": rows}))
    (folder / "report.json").write_text(json.dumps({"versions": {"scan_relight": VERSION}}))
    openings = [{"radiance": [3, 3, 3], "corners": quads} for quads in ([ABOVE_WEST, ABOVE_EAST], [ABOVE_EAST])]
    (folder / OPENINGS).write_text(json.dumps({"openings": openings}))
    for name in ("albedo", "base_color", "shading"):
        write_exr(folder / f"{name}.exr", np.broadcast_to(np.float32(colour), (8, 8, 3)))
    write_exr(folder / "environment.exr", np.full((4, 8, 3), outside, np.float32))
    poses = {name: np.eye(4) for name in frames}
    for place, pose in poses.items():
        pose[:3, 3] = "abc".index(place), 0.5, 3
    seen = tuple(
        Frame(name, capture.parent / f"{name}.exr", Camera(32, 24, 20, 20, 16, 12, poses[name])) for name in frames
    )
    whole = Capture(capture, replace(mesh, far=far), INSTANCES, seen)
    atlas = np.tile(np.float32([[0, 0], [1, 0], [1, 1]]), (len(mesh.triangles), 1, 1))
    write_scene(folder / "scene.blend", whole, atlas, MATERIALS, folder, median, parts=parts)
    return folder


@pytest.fixture(scope="module")
def made(tmp_path_factory) -> Path:
    """The results 1 and 2 of a building's parts, west and east."""
    root, (_, east) = tmp_path_factory.mktemp("building"), building()
    for number, (far, part) in enumerate(((east, WEST), (~east, EAST)), 1):
        make_result(root / "results" / str(number), root / "parts" / str(number), far, **part)
    return root


@pytest.fixture
def results(made, tmp_path) -> list[Path]:
    """Copies of them, to be broken."""
    return [Path(shutil.copytree(made / "results" / name, tmp_path / "results" / name)) for name in "12"]


@pytest.fixture(scope="module")
def joined(made) -> tuple[Path, tuple[str, ...]]:
    """The folder of the joined scene, and what was told of it."""
    out = made / "joined"
    return out, join([made / "results" / "1", made / "results" / "2"], out)


@pytest.fixture
def scene(joined):
    bpy.ops.wm.open_mainfile(filepath=str(joined[0] / "scene.blend"))
    return bpy.context.scene


def places(obj) -> np.ndarray:
    """Corners of an object's triangles, (t, 3, 3)."""
    points = np.array([obj.matrix_basis @ vertex.co for vertex in obj.data.vertices])
    return points[[list(face.vertices) for face in obj.data.polygons]]


def scanned(scene) -> list:
    return [obj for obj in scene.objects if "object_id" in obj]


def as_set(triangles: np.ndarray) -> list:
    return sorted(map(tuple, np.rint(1e4 * triangles.reshape(-1, 9)).astype(int).tolist()))


def test_each_triangle_is_there_once_and_nothing_else(scene):
    mesh, _ = building()
    found = np.concatenate([places(obj) for obj in scanned(scene)])
    assert as_set(found) == as_set(mesh.vertices[mesh.triangles])
    owners = {(obj["object_id"], Path(obj["scan_relight_result"]).name) for obj in scanned(scene)}
    assert owners == {(WALL, "1"), (BOX, "1"), (WALL, "2"), (LAMP, "2")}
    assert sorted(obj.name for obj in scanned(scene)) == ["box 2", "lamp 3", "wall 1", "wall 1.001"]
    assert not any(is_edited(obj) or is_renamed(obj) or FAR in obj.data.attributes for obj in scanned(scene))
    assert not [item for kind in ("meshes", "objects", "materials", "worlds", "actions", "cameras", "libraries")
                for item in getattr(bpy.data, kind) if not item.users]  # fmt: skip
    assert len(bpy.data.materials) == 9  # of box, lamp and three panels, and two of each piece of the wall


def test_a_panel_is_where_it_is_nearer_to_the_parts_own(scene):
    panels = [obj for obj in scene.objects if obj.name.startswith("opening")]
    found = {obj.name: (Path(obj["scan_relight_result"]).name, places(obj)[..., 0].min()) for obj in panels}
    assert found == {"opening 1": ("1", -2), "opening 1.001": ("2", 1), "opening 2": ("2", 1)}
    assert [len(obj.data.polygons) for obj in panels] == [2, 2, 2] and not any(obj.visible_camera for obj in panels)


def test_what_is_in_which_collection(scene):
    [top] = scene.collection.children
    assert top.name == "Scan Relight" and Path(top["scan_relight_capture"]).name == "house"
    inside = {part.name: sorted(obj.name for obj in part.objects) for part in top.children}
    assert inside == {
        "Room": ["box 2", "wall 1", "wall 1.001"],
        "Lamps": ["lamp 3", "opening 1", "opening 1.001", "opening 2"],
        "Cameras": ["Scan Relight track", "a", "b", "c"],
    }
    assert len(bpy.data.collections) == 4 and len(bpy.data.scenes) == 1
    assert scene.view_layers[0].layer_collection.children[0].children["Cameras"].hide_viewport
    assert len(find_lamps(scene)) == 4


def test_a_frame_of_several_parts_has_one_camera(scene):
    assert [camera.name for camera in frame_cameras(scene)] == ["a", "b", "c"]
    assert scene.camera.name == "a" and (scene.render.resolution_x, scene.render.resolution_y) == (32, 24)
    [track] = track_cameras(scene)
    assert (scene.frame_start, scene.frame_end) == (1, 3) and not is_renamed(track)
    scene.frame_set(3)
    assert track.matrix_world.translation[:] == pytest.approx((2, 0.5, 3))


def test_materials_show_their_own_parts_image(joined, scene):
    for obj in scanned(scene):
        for material in obj.data.materials:
            node = next((node for node in material.node_tree.nodes if node.type == "TEX_IMAGE"), None)
            assert (node is None) == (obj["object_id"] == LAMP)
            if node is not None:
                part = Path(obj["scan_relight_result"]).name
                assert node.image.filepath == f"//../results/{part}/base_color.exr"
                assert list(node.image.pixels[:3]) == pytest.approx((WEST if part == "1" else EAST)["colour"])
    assert all((joined[0] / image.filepath.removeprefix("//")).is_file() for image in bpy.data.images)
    assert len(bpy.data.images) == 3  # base colour of each, and one environment


def test_one_world_and_the_exposure_between(joined, scene):
    [sentence] = joined[1]
    assert "results/2' was taken, which has most of it" in sentence
    assert [world.name for world in bpy.data.worlds] == ["Scan Relight"]
    node = next(node for node in scene.world.node_tree.nodes if node.type == "TEX_ENVIRONMENT")
    assert node.image.filepath == "//../results/2/environment.exr"
    assert scene.view_settings.exposure == pytest.approx(-2) == scene["scan_relight_exposure"]
    assert scene.cycles.max_bounces == 24 and scene.name == "Scan Relight: house"


def test_materials_json_names_each_object_with_its_result(joined):
    content = json.loads((joined[0] / "materials.json").read_text())
    rows = [(row["object_id"], row["name"], row["result"]) for row in content["objects"]]
    assert content["capture"] == "house" and rows == [
        (WALL, "wall 1", "../results/1"),
        (BOX, "box 2", "../results/1"),
        (WALL, "wall 1", "../results/2"),
        (TILES, "tiles 4", "../results/2"),
        (LAMP, "lamp 3", "../results/2"),
    ]
    assert sorted(path.name for path in joined[0].iterdir()) == ["materials.json", "scene.blend"]


@pytest.mark.slow
def test_it_renders(scene, tmp_path):
    scene.render.filepath, scene.cycles.samples, scene.cycles.use_denoising = str(tmp_path / "a.exr"), 1, False
    scene.render.image_settings.file_format = "OPEN_EXR"
    bpy.ops.render.render(write_still=True)
    rgb = read_exr(tmp_path / "a.exr").rgb
    assert rgb.shape == (24, 32, 3) and rgb.mean() > 0.1


def test_the_world_is_of_the_part_whose_frames_saw_most_of_the_sky(results, tmp_path):
    """Though the other's environment shows more."""
    none = np.zeros((0, 3), np.float32)
    lit_diffuse = LitDiffuse(none, none, np.zeros(0, np.int32), np.zeros(0, np.int8), np.zeros(0, np.float32))
    seen = np.zeros((4, 8), np.int32)
    seen[2:, :4] = 1
    environment = Environment(np.zeros((4, 8, 3), np.float32), seen)
    observed = Observed(lit_diffuse, environment, Samples.none(), Poses.as_read(()), Calibration.none(0))
    with Store(results[0]) as store:
        store.save("lit_diffuse", "key", *to_store((observed, [], [])))
    [sentence] = join(results, tmp_path / "out")
    assert "results/1' was taken, whose frames saw most of it (25% of all directions)" in sentence


def test_parts_that_share_nothing_are_joined_whole(made, tmp_path):
    """A single result, and one that knows of no other part."""
    mesh, _ = building()
    whole = make_result(tmp_path / "results" / "3", tmp_path / "parts" / "3", None, **WEST)
    assert join([whole], tmp_path / "out") == ()
    assert sum(len(obj.data.polygons) for obj in scanned(bpy.context.scene)) == len(mesh.triangles)
    assert "opening 1" in bpy.context.scene.objects


def test_results_that_were_moved(results, tmp_path):
    join(results, tmp_path / "out")
    assert {obj["scan_relight_result"] for obj in scanned(bpy.context.scene)} == set(map(str, results))


@pytest.mark.parametrize("name", ["objects/wall 1 base_color.exr", "base_color.<UDIM>.exr"])
def test_images_of_single_objects_are_found(tmp_path, name):
    folder = tmp_path / "results" / "1"
    (folder / "objects").mkdir(parents=True)
    for number in (1001, 1002):
        write_exr(folder / name.replace("<UDIM>", str(number)), np.full((4, 4, 3), 0.5, np.float32))
    uv = np.full((len(building()[0].triangles), 3, 2), 0.5, np.float32)
    make_result(folder, tmp_path / "parts" / "1", None, **WEST, parts=Parts(uv, {WALL: name}, (1001, 1002)))
    join([folder], tmp_path / "out")
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "out" / "scene.blend"))
    nodes = bpy.data.materials["wall 1"].node_tree.nodes
    image = next(node.image for node in nodes if node.type == "TEX_IMAGE")
    assert image.filepath == f"//../results/1/{name}" and tuple(image.size) == (4, 4)
    assert len(image.tiles) == (2 if "UDIM" in name else 1)


def no_scene(results):
    (results[1] / "scene.blend").unlink()


def broken_scene(results):
    (results[1] / "scene.blend").write_bytes(b"BLENDER-v300 and no more")


def other_version(results):
    (results[1] / "report.json").write_text(json.dumps({"versions": {"scan_relight": "0.1.0"}}))


def broken_materials(results):
    (results[1] / "materials.json").write_text("{")


def same_folder(results):
    results[1] = results[0].parent / "2" / ".." / "1"


def same_part(results):
    shutil.copy(results[0] / "capture.json", results[1] / "capture.json")


def none_at_all(results):
    results.clear()


@pytest.mark.parametrize(
    ("spoil", "sentence"),
    [
        (no_scene, r"'.*2' holds no 'scene\.blend'; recover"),
        (broken_scene, r"'.*2/scene\.blend' can't be read by Blender"),
        (other_version, r"in '.*2' is of version 0\.1\.0 of Scan Relight, and this is"),
        (broken_materials, r"'.*2/materials\.json' is damaged"),
        (same_folder, r"'.*1' and '.*1' are results of the same part"),
        (same_part, r"'.*1' and '.*2' are results of the same part"),
        (none_at_all, r"No result is named"),
    ],
)
def test_bad_input_is_told_before_anything_is_written(results, tmp_path, spoil, sentence):
    spoil(results)
    with pytest.raises(BadInputError, match=sentence):
        join(results, tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_a_result_is_not_overwritten(results):
    before = (results[0] / "scene.blend").read_bytes()
    with pytest.raises(BadInputError, match="holds a result, whose scene.blend would be lost"):
        join(results, results[0])
    assert (results[0] / "scene.blend").read_bytes() == before


@pytest.mark.skipif(os.sep != "/", reason="it is no part of a name there")
def test_a_folder_that_blender_would_look_for_elsewhere(results, tmp_path):
    with pytest.raises(BadInputError, match="has a backslash in its path"):
        join(results, tmp_path / "o\\ut")
    assert not (tmp_path / "o\\ut").exists()


def test_what_cannot_be_written_is_told(results, tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(StorageError, match="can't be saved"):
        join(results, tmp_path / "file" / "out")


def test_the_command(results, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert cli.main(["join", "results/1", "results/2", "--out", "out"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[-1] == f"Done: {os.path.join('out', 'scene.blend')}"
    (warning,) = [line for line in lines if line.startswith("Warning")]
    assert "that of 'results/2' was taken" in warning
    assert (tmp_path / "out" / "scene.blend").is_file()


@pytest.mark.slow
def test_a_room_that_was_divided_comes_together(tiny_capture, tmp_path):
    """From end to end: the parts' surface is the room's."""
    quick = "--shading-rays 8 --specular-rays 2 --emitter-rays 2 --refine 0 --texel-size 0.2 --atlas-size 256 --quiet"
    whole, parts = tmp_path / "whole", tmp_path / "parts"
    assert cli.main(["recover", str(tiny_capture), "--out", str(whole), *quick.split()]) == 0
    assert cli.main(["divide", str(tiny_capture), "--out", str(parts), "--parts", "2", "--quiet"]) == 0
    results = [tmp_path / "results" / part.name for part in sorted(parts.iterdir())]
    for result in results:
        assert cli.main(["recover", str(parts / result.name), "--out", str(result), *quick.split()]) == 0
    # In a process of its own, where nothing has loaded Blender yet.
    command = [*WORKER, "join", *map(str, results), "--out", str(tmp_path / "out"), "--quiet"]
    assert subprocess.run(command, check=False).returncode == 0
    found = {}
    for folder in (whole, tmp_path / "out"):
        bpy.ops.wm.open_mainfile(filepath=str(folder / "scene.blend"))
        objects = scanned(bpy.context.scene)
        area = sum(face.area for obj in objects for face in obj.data.polygons)
        found[folder.name] = {obj["object_id"] for obj in objects}, area, len(frame_cameras(bpy.context.scene))
    assert found["out"][0] == found["whole"][0] and found["out"][2] == found["whole"][2]
    assert found["out"][1] == pytest.approx(found["whole"][1], rel=0.02)
