"""Selection to capture to recovery to the same objects, and back to exactly what they wore before."""

import json
import math
import shutil

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from tests.blender.artist.artist_room import SIZE, add_cameras, bridge, build_room, show  # noqa: E402

QUICK = {"shading_rays": 16, "specular_rays": 4, "emitter_rays": 2, "refine": 0, "texel_size": 0.08, "atlas_size": 512}
OURS = "ScanRelight"


def state(things):
    """Everything that restoring has to bring back."""
    found = {}
    for name, thing in things.items():
        data = thing.data
        entry = {
            "hidden": (thing.hide_viewport, thing.hide_render),
            "keys": sorted(thing.keys()),
            "modifiers": [modifier.name for modifier in thing.modifiers],
            "matrix": tuple(map(tuple, thing.matrix_world)),
            "slots": [(slot.link, slot.material and slot.material.name) for slot in thing.material_slots],
        }
        if data is not None:
            index = np.empty(len(data.polygons), np.int32)
            data.polygons.foreach_get("material_index", index)
            layers = {}
            for layer in data.uv_layers:
                layers[layer.name] = np.empty(2 * len(data.loops), np.float32)
                layer.uv.foreach_get("vector", layers[layer.name])
            active = data.uv_layers.active
            entry |= {
                "mesh": data.name,
                "indices": index.tolist(),
                "active": active and active.name,
                "render": [layer.name for layer in data.uv_layers if layer.active_render],
                "uv": {name: uv.tolist() for name, uv in layers.items()},
                "corners": [loop.vertex_index for loop in data.loops],
                "attributes": sorted(a.name for a in data.attributes),
            }
        found[name] = entry
    return found


@pytest.fixture(scope="module")
def finished(tmp_path_factory):
    """The stages of the first run, which all others but one are repetitions of."""
    return tmp_path_factory.mktemp("finished") / "stages"


@pytest.fixture
def room(ops, tmp_path, finished):
    stages = tmp_path / "result" / "stages"
    if finished.exists():
        shutil.copytree(finished, stages)
    things = build_room()
    add_cameras(tmp_path)
    things["table"].material_slots[1].link = "OBJECT"
    things["table"].material_slots[1].material = bpy.data.materials["grey"]
    yield things
    if not finished.exists() and stages.exists():
        shutil.copytree(stages, finished)


def recover(ops, tmp_path, **more):
    assert ops.capture_from_scene(result_folder=str(tmp_path / "result")) == {"FINISHED"}
    return again(ops.recover, tmp_path, **more)


def again(operator, tmp_path, **more):
    """The report's warnings after a run of an operator, `recover` or `write`."""
    folder = tmp_path / "result"
    folders = {"capture_folder": str(folder / "scene_capture"), "result_folder": str(folder)}
    assert operator(**folders, **QUICK, **more) == {"FINISHED"}
    return json.loads((folder / "report.json").read_text())["warnings"]


def models(thing):
    return [slot.material and slot.material.get("scan_relight_model") for slot in thing.material_slots]


@pytest.mark.slow
def test_there_and_back(ops, room, tmp_path):
    before = state(room)
    count = len(bpy.data.objects)
    warnings = recover(ops, tmp_path)
    assert len(bpy.data.objects) == count  # nothing is imported beside one's own objects
    assert any("'round', 'shelf/board 0', 'shelf/board 1': modifiers or instances" in one for one in warnings)
    for name, thing in room.items():
        if name in ("round", "shelf"):
            assert state({name: thing}) == {name: before[name]}
            continue
        assert models(thing) and all(models(thing)), name
        layers = thing.data.uv_layers
        assert [layer.name for layer in layers][-1] == OURS and layers[OURS].name == OURS
        if before[name]["uv"]:
            assert layers.active.name == "UVMap" and layers["UVMap"].active_render
            assert state({name: thing})[name]["uv"]["UVMap"] == before[name]["uv"]["UVMap"]
        assert state({name: thing})[name]["indices"] == before[name]["indices"]
        assert state({name: thing})[name]["corners"] == before[name]["corners"]
    assert room["chair"].data != room["chair.001"].data
    assert len({slot.material for slot in room["table"].material_slots}) == 3  # each slot is a part
    old = bpy.data.materials["red"]
    assert ops.restore_materials() == {"FINISHED"}
    assert state(room) == before
    assert room["chair"].data == room["chair.001"].data and bpy.data.materials["red"] == old
    assert not [m for m in bpy.data.materials if "scan_relight_model" in m]
    assert not [image for image in bpy.data.images if "scan_relight_image" in image]
    with pytest.raises(RuntimeError, match="wears a recovered material"):
        ops.restore_materials()


@pytest.mark.slow
def test_saved_and_opened_between(ops, room, tmp_path):
    names = list(room)
    before = state(room)
    recover(ops, tmp_path, copies=True)
    bpy.data.materials["red"].name = "renamed"
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "file.blend"))
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "file.blend"))
    assert ops.restore_materials() == {"FINISHED"}
    after = state({name: bpy.context.scene.objects[name] for name in names})
    assert json.loads(json.dumps(after).replace('"renamed"', '"red"')) == json.loads(json.dumps(before))


@pytest.mark.slow
def test_copies_of_what_modifiers_and_instances_make(ops, room, tmp_path):
    before = state(room)
    warnings = recover(ops, tmp_path, copies=True)
    assert not any("modifiers" in one for one in warnings)
    copy = bpy.data.objects["round (Scan Relight)"]
    assert len(copy.data.polygons) == 24 and not copy.modifiers and all(models(copy))
    assert copy.matrix_world == room["round"].matrix_world and copy.data.uv_layers.keys() == ["UVMap", OURS]
    assert room["round"].hide_render and room["round"].hide_viewport and room["shelf"].hide_render
    board = bpy.data.objects["shelf/board 1 (Scan Relight)"]
    assert min((board.matrix_world @ vertex.co).z for vertex in board.data.vertices) == pytest.approx(1.6)
    count = len(bpy.data.objects)
    again(ops.write, tmp_path, copies=True)
    assert len(bpy.data.objects) == count and "round (Scan Relight)" in bpy.data.objects
    for thing in bpy.context.scene.objects:
        thing.select_set(thing.name == "round (Scan Relight)")
    assert ops.restore_materials(selected_only=True) == {"FINISHED"}  # a copy stands for its object
    assert "round (Scan Relight)" not in bpy.data.objects and all(models(room["table"]))
    assert state({"round": room["round"]})["round"] == before["round"]
    ops.restore_materials()
    assert state(room) == before


@pytest.mark.slow
def test_what_changed_since_is_told_and_left(ops, room, tmp_path):
    recover(ops, tmp_path)
    ops.restore_materials()
    room["bare"].data.clear_geometry()
    room["bent"].name = "other"
    room["room"].data.vertices[0].co.x -= 0.01  # moved, not rebuilt
    warnings = " ".join(again(ops.write, tmp_path))
    assert "Object 'bare': edited since" in warnings and "Object 'bent': deleted or renamed" in warnings
    assert not models(room["bare"]) and not any(models(room["bent"])) and all(models(room["room"]))


@pytest.mark.slow
def test_slots_and_shapes_that_changed_after_writing(ops, room, tmp_path):
    recover(ops, tmp_path)
    room["chair"].data.vertices[0].co.z += 0.1
    edited = room["chair"].data
    room["mirrored"].data.materials.append(None)
    restore = bridge("own_scene.restore").restore
    count, warnings = restore([room["chair"], room["mirrored"]])
    assert count == 2 and "Object 'chair': edited since" in warnings[0] and "slots were added" in warnings[1]
    assert edited.use_fake_user and room["chair"].data == bpy.data.meshes["chair"]
    assert room["mirrored"].material_slots[0].material.name == "green"


@pytest.mark.slow
def test_an_earlier_result_on_the_object_comes_back(ops, room, tmp_path):
    """Texture coordinates of our name that were there before are moved aside, and come back."""
    layer = room["bent"].data.uv_layers.new(name=OURS)
    layer.uv.foreach_set("vector", np.full(2 * len(room["bent"].data.loops), 0.25, np.float32))
    before = state(room)
    recover(ops, tmp_path)
    assert sorted(room["bent"].data.uv_layers.keys()) == ["ScanRelight", "ScanRelight before", "UVMap"]
    ops.restore_materials()
    assert state(room) == before


@pytest.mark.slow
@pytest.mark.parametrize("where", ["RESULT", "FOLDER", "PACK"])
def test_images_and_their_colour_spaces(ops, room, tmp_path, where):
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "file.blend"))
    room = {name: bpy.context.scene.objects[name] for name in room}
    recover(ops, tmp_path, images=where)
    found = {image.name: image for image in bpy.data.images if "scan_relight_image" in image}
    files = {
        "scene_capture base color": "base_color.exr",
        "scene_capture albedo": "albedo.exr",
        "scene_capture shading": "shading.exr",
    }
    assert set(found) == set(files)
    for image in found.values():
        assert image.colorspace_settings.name == "Linear Rec.709"
        assert bool(image.packed_file) == (where == "PACK")
        layout = json.loads((tmp_path / "result" / "materials.json").read_text())["layout"]
        folder = {"RESULT": "//result/", "FOLDER": f"//file images/{layout}/"}.get(where)
        assert folder is None or image.filepath == folder + files[image.name]
    again(ops.write, tmp_path, images=where)
    assert {image.name for image in bpy.data.images if "scan_relight_image" in image} == set(found)
    bpy.ops.wm.save_mainfile()
    if where == "PACK":
        (tmp_path / "result").rename(tmp_path / "elsewhere")
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "file.blend"))
    nodes = bpy.data.objects["room"].active_material.node_tree.nodes
    image = next(node for node in nodes if node.type == "TEX_IMAGE").image
    assert len(image.pixels) and image.has_data and image.size[0] > 0


@pytest.mark.slow
def test_images_beside_a_file_that_was_never_saved(ops, room, tmp_path):
    assert ops.capture_from_scene(result_folder=str(tmp_path / "result")) == {"FINISHED"}
    before = state(room)
    with pytest.raises(RuntimeError, match="never saved; save it first"):
        ops.recover(
            capture_folder=str(tmp_path / "result" / "scene_capture"),
            result_folder=str(tmp_path / "result"),
            images="FOLDER",
            **QUICK,
        )
    assert state(room) == before


def render_photos(folder, cameras, samples=16):
    """What the cameras see, as EXR, behind them."""
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    scene.cycles.samples, scene.cycles.use_denoising, scene.cycles.device = samples, False, "CPU"
    scene.cycles.max_bounces = scene.cycles.diffuse_bounces = 6
    image = scene.render.image_settings
    image.file_format, image.color_mode, image.color_depth = "OPEN_EXR", "RGB", "32"
    for k, camera in enumerate(cameras):
        scene.camera, scene.render.filepath = camera, str(folder / f"shot_{k}.exr")
        bpy.ops.render.render(write_still=True)
        camera.data.background_images.clear()
        show(camera, folder / f"shot_{k}.exr")


@pytest.mark.slow
@pytest.mark.once
def test_the_albedo_of_a_rendered_room(ops, room, tmp_path):
    """The paint that Cycles rendered with is what comes back onto each face, through n-gons, mirrors and instances."""
    cameras = [thing for thing in bpy.context.scene.objects if thing.type == "CAMERA"] + more_cameras()
    for paint in ("red", "green", "grey", "glow"):
        inputs = bpy.data.materials[paint].node_tree.nodes["Principled BSDF"].inputs
        inputs["Specular IOR Level"].default_value = 0
    render_photos(tmp_path, cameras)
    recover(ops, tmp_path, copies=True)
    told = json.loads((tmp_path / "result" / "materials.json").read_text())["objects"]
    materials = {one["object_id"]: one for one in told}
    assert [one["class_name"] for one in materials.values() if one["model"] == "emitter"] == ["lamp"]
    for name, wanted in (("chair", (0.7, 0.1, 0.1)), ("mirrored", (0.1, 0.6, 0.2))):
        albedo = materials[room[name]["object_id"]]["evidence"]["albedo"]
        assert np.argmax(albedo) == np.argmax(wanted) and max(albedo) > 2 * min(albedo), (name, albedo)


def more_cameras():
    """A second ring of cameras, lower."""
    things = []
    for k in range(8):
        data = bpy.data.cameras.new(f"low {k}")
        data.lens = 16
        thing = bpy.data.objects.new(f"low {k}", data)
        angle = 2 * math.pi * k / 8
        thing.location = (1.2 * math.cos(angle), 0.9 * math.sin(angle), 1.1)
        thing.rotation_euler = (math.radians(60), 0, angle + math.pi / 2 + 0.3)
        bpy.context.scene.collection.objects.link(thing)
        things.append(thing)
    assert SIZE == (bpy.context.scene.render.resolution_x, bpy.context.scene.render.resolution_y)
    return things
