"""The saved scene: complete, movable, renders when opened; nothing of the user's is touched."""

import shutil

import numpy as np
import pytest

from addon.core.brdf.emitter import EMITTER, LAMP_ALBEDO
from addon.core.brdf.lambertian import LAMBERTIAN
from addon.core.brdf.material import ObjectMaterial
from addon.core.brdf.metal import METAL
from addon.core.errors import StorageError
from addon.core.io.exr import write_exr
from addon.core.pipeline.parts import Parts
from addon.core.results.room_file import write_room
from addon.core.scene.model import Camera, Capture, Frame, Instance, Mesh

bpy = pytest.importorskip("bpy")

from addon.bridge.room.bring import bringing  # noqa: E402
from addon.bridge.scene import write as bridge_scene  # noqa: E402
from addon.bridge.scene.write import write_scene  # noqa: E402

KINDS = ("scenes", "collections", "objects", "meshes", "cameras", "materials", "worlds", "images")


@pytest.fixture
def result(tmp_path):
    folder = tmp_path / "result"
    folder.mkdir()
    write_exr(folder / "base_color.exr", np.broadcast_to(np.float32([0.2, 0.5, 0.8]), (8, 8, 3)))
    write_exr(folder / "albedo.exr", np.full((8, 8, 3), 0.25, np.float32))
    write_exr(folder / "shading.exr", np.full((8, 8, 3), 3, np.float32))
    write_exr(folder / "environment.exr", np.ones((4, 8, 3), np.float32))
    return folder


@pytest.fixture
def capture(tmp_path):
    """A floor and a lamp, seen from straight above by a camera whose picture is half floor, half lamp."""
    quad = np.array([[-1, -1, 0], [0, -1, 0], [0, 1, 0], [-1, 1, 0]], float)
    pose = np.eye(4)
    pose[2, 3] = 1
    triangles = np.array([[0, 1, 2], [0, 2, 3], [4, 5, 6], [4, 6, 7]], np.int32)
    mesh = Mesh(np.concatenate([quad, quad + (1, 0, 0)]), triangles, np.array([4, 4, 9, 9], np.int32))
    frames = tuple(Frame(f"frame {i}", tmp_path, Camera(8, 4, 8, 8, 4, 2, pose)) for i in range(2))
    return Capture(tmp_path, mesh, (Instance(4, "Floor"), Instance(9, "Lamp")), frames)


ATLAS = np.tile(np.float32([[0, 0], [1, 0], [1, 1]]), (4, 1, 1))
MATERIALS = [ObjectMaterial(4, "Floor", LAMBERTIAN), ObjectMaterial(9, "Lamp", EMITTER, emission=(6.0, 3.0, 1.5))]


def counts():
    return {kind: sorted(x.name for x in getattr(bpy.data, kind)) for kind in KINDS}


def rendered(scene, path, samples):
    """What the scene's camera sees, (h, w, 3), linear Rec.709."""
    scene.cycles.samples, scene.cycles.use_denoising, scene.cycles.use_adaptive_sampling = samples, False, False
    scene.render.image_settings.file_format, scene.render.image_settings.color_depth = "OPEN_EXR", "32"
    scene.render.filepath = str(path)
    bpy.ops.render.render(write_still=True)
    image = bpy.data.images.load(str(path))
    return np.array(image.pixels[:]).reshape(image.size[1], image.size[0], 4)[..., :3]


@pytest.mark.slow
@pytest.mark.parametrize("fresh", [True, False])
def test_it_renders_when_opened_elsewhere(scene, tmp_path, result, capture, fresh):
    (result / "materials.json").write_text('{"run": "0123456789abcdef", "objects": []}')
    assert write_scene(result / "scene.blend", capture, ATLAS, MATERIALS, result, 0.36, fresh=fresh) == ()
    assert sorted(p.name for p in result.iterdir()) == [
        "albedo.exr",
        "base_color.exr",
        "environment.exr",
        "materials.json",
        "scene.blend",
        "shading.exr",
    ]
    shutil.move(result, tmp_path / "moved")
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "moved" / "scene.blend"))
    opened = bpy.context.scene
    assert {i.name for i in bpy.data.images if i.size[0]} == {i.name for i in bpy.data.images}
    assert sorted(i.filepath for i in bpy.data.images) == [
        "//albedo.exr",
        "//base_color.exr",
        "//environment.exr",
        "//shading.exr",
    ]
    assert {i.name for i in bpy.data.images} == {
        f"{tmp_path.name} {what}" for what in ("albedo", "base color", "environment", "shading")
    }
    for thing in (one for one in opened.objects if one.type == "MESH"):
        name = {4: "Floor 4", 9: "Lamp 9"}[thing["object_id"]]
        assert (thing.name, thing.data.name, thing.active_material.name) == (name, name, name)
    room, lamps, eyes = (opened.collection.children["Scan Relight"].children[n] for n in ("Room", "Lamps", "Cameras"))
    assert [o["object_id"] for o in room.objects] == [4] and [o["object_id"] for o in lamps.objects] == [9]
    assert [o.name for o in eyes.objects] == ["frame 0", "frame 1", "Scan Relight track"]
    assert opened.camera == eyes.objects["frame 0"]
    top = opened.collection.children["Scan Relight"]
    for thing in (top, *room.objects, *lamps.objects):
        assert (thing["scan_relight_result"], thing["scan_relight_run"]) == (str(result), "0123456789abcdef")
    assert top["scan_relight_capture"] == str(capture.root)
    assert opened.render.engine == "CYCLES" and opened.view_settings.exposure == pytest.approx(-1)
    picture = rendered(opened, tmp_path / "render.exr", 64)
    # Floor and lamp lie in one plane: the floor sees the white world alone.
    np.testing.assert_allclose(picture[:, 1:3].mean((0, 1)), [0.2, 0.5, 0.8], rtol=0.02)
    lamp = np.array([6, 3, 1.5]) + LAMP_ALBEDO  # what it gives, and what it reflects of that world
    np.testing.assert_allclose(picture[:, 5:7].mean((0, 1)), lamp, rtol=1e-3)


@pytest.mark.slow
def test_light_over_a_mirror_is_all_there(scene, tmp_path, result, capture):
    """A floor lit over a mirror alone gets E = L A cos^2 / d^2 from a small lamp, d by way of the mirror."""

    def square(x, half, z, up):
        corners = np.array([[x - half, -half, z], [x + half, -half, z], [x + half, half, z], [x - half, half, z]])
        return corners if up else corners[::-1]

    # From below: the floor, a black plate that keeps the lamp's own light off it, the lamp, the mirror.
    sides = [square(0, 0.1, 0, True), square(1, 0.06, 0.99, False), square(1, 0.05, 1, True), square(0, 2, 1.5, False)]
    triangles = np.concatenate([np.array([[0, 1, 2], [0, 2, 3]]) + 4 * k for k in range(4)]).astype(np.int32)
    mesh = Mesh(np.concatenate(sides), triangles, np.repeat([4, 5, 9, 6], 2).astype(np.int32))
    names = {4: "floor", 5: "plate", 9: "lamp", 6: "mirror"}
    pose = np.eye(4)
    pose[2, 3] = 0.5
    frame = Frame("frame", tmp_path, Camera(8, 8, 80, 80, 4, 4, pose))
    room = Capture(tmp_path, mesh, tuple(Instance(i, name) for i, name in names.items()), (frame,))
    materials = [
        ObjectMaterial(4, "floor", LAMBERTIAN), ObjectMaterial(5, "plate", LAMBERTIAN),
        ObjectMaterial(9, "lamp", EMITTER, emission=(400.0, 400.0, 400.0), unlit=0.0),
        ObjectMaterial(6, "mirror", METAL, alpha=0.0, f0=(1.0, 1.0, 1.0)),
    ]  # fmt: skip
    color = np.zeros((8, 8, 3), np.float32)
    color[:, :4] = 0.5
    write_exr(result / "base_color.exr", color)
    write_exr(result / "environment.exr", np.zeros((4, 8, 3), np.float32))
    left = np.float32([[0.1, 0.1], [0.4, 0.1], [0.4, 0.4]])
    uv = np.stack([left, left] + [left + (0.5, 0)] * 6)
    write_scene(result / "scene.blend", room, uv, materials, result, 0.36)
    bpy.ops.wm.open_mainfile(filepath=str(result / "scene.blend"))
    picture = rendered(bpy.context.scene, tmp_path / "render.exr", 4096)[2:6, 2:6]
    assert picture.mean() == pytest.approx(0.5 / np.pi * 400 * 0.1**2 * (4 / 5) / 5, rel=0.03)


def test_the_open_file_is_left_alone(scene, result, capture):
    bpy.ops.mesh.primitive_cube_add()
    before, world = counts(), scene.world
    write_scene(result / "scene.blend", capture, ATLAS, MATERIALS, result, fresh=False)
    assert counts() == before and bpy.context.scene == scene and scene.world == world and bpy.data.filepath == ""


def test_images_that_are_missing_are_left_out(scene, tmp_path, capture):
    empty = tmp_path / "empty"
    empty.mkdir()
    write_scene(empty / "scene.blend", capture, ATLAS, [], empty, fresh=False)
    assert [p.name for p in empty.iterdir()] == ["scene.blend"]


def test_an_old_file_is_replaced_whole_or_kept(scene, result, capture, monkeypatch):
    path = result / "scene.blend"
    path.write_bytes(b"old")

    def half_written(name, *_):
        with open(name, "wb") as file:
            file.write(b"half")
        raise RuntimeError("Error: No space left on device")

    with monkeypatch.context() as patch:
        patch.setattr(bridge_scene, "_save", half_written)
        with pytest.raises(StorageError, match=r"scene\.blend can't be saved \(No space left on device\); free"):
            write_scene(path, capture, ATLAS, MATERIALS, result, fresh=False)
    assert path.read_bytes() == b"old" and len(list(result.iterdir())) == 5
    write_scene(path, capture, ATLAS, MATERIALS, result, fresh=False)
    write_scene(path, capture, ATLAS, MATERIALS, result, fresh=False)
    assert path.stat().st_size > 10_000 and len(list(result.iterdir())) == 5


@pytest.mark.parametrize("fresh", [True, False])
def test_a_folder_that_cannot_be_made_is_told(scene, tmp_path, result, capture, fresh):
    (tmp_path / "file").write_text("")
    with pytest.raises(StorageError, match="can't be saved"):
        write_scene(tmp_path / "file" / "scene.blend", capture, ATLAS, MATERIALS, result, fresh=fresh)


@pytest.mark.parametrize("fresh", [True, False])
def test_a_file_that_blender_cannot_write_is_told(scene, tmp_path, result, capture, fresh):
    (tmp_path / "file.blend").mkdir()
    (tmp_path / "file.blend" / "x").write_text("")
    with pytest.raises(StorageError, match="can't be saved"):
        write_scene(tmp_path / "file.blend", capture, ATLAS, MATERIALS, result, fresh=fresh)
    assert sorted(p.name for p in tmp_path.iterdir()) == ["file.blend", "result"]


@pytest.mark.parametrize("where", ["RESULT", "FOLDER", "PACK"])
@pytest.mark.parametrize("kind", ["object", "udim"])
def test_an_objects_own_image_comes_along(scene, tmp_path, result, capture, kind, where):
    written, told = {
        "object": ("objects/Floor 4 base_color.exr",) * 2,
        "udim": ("base_color.1002.exr", "base_color.<UDIM>.exr"),
    }[kind]
    (result / "objects").mkdir()
    write_exr(result / written, np.broadcast_to(np.float32([0.9, 0.1, 0.3]), (4, 4, 3)))
    if kind == "udim":
        write_exr(result / "base_color.1001.exr", np.zeros((4, 4, 3), np.float32))
    shift = (0, 0) if kind == "object" else (1, 0)
    parts = Parts(ATLAS * np.float32(0.5) + np.float32(shift), {4: told}, () if kind == "object" else (1001, 1002))
    write_scene(result / "scene.blend", capture, ATLAS, MATERIALS, result, fresh=False, parts=parts)
    write_room(result, capture, ATLAS)
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "file.blend"))
    for _ in bringing(result, scene, where):
        pass
    thing = next(thing for thing in scene.objects if thing.get("object_id") == 4)
    assert [layer.name for layer in thing.data.uv_layers] == ["ScanRelight", "ScanRelightParts"]
    nodes = thing.active_material.node_tree.nodes
    image = next(node for node in nodes if node.type == "TEX_IMAGE").image
    assert next(node for node in nodes if node.type == "UVMAP").uv_map == "ScanRelightParts"
    assert image["scan_relight_image"] == str(result / told) and bool(image.packed_file) == (where == "PACK")
    if where == "FOLDER":
        assert (tmp_path / "file images" / written.split("/")[-1]).is_file()
    elif where == "RESULT":
        assert image.filepath == f"//result/{told}"
    assert len(image.tiles) == (1 if kind == "object" else 2)
