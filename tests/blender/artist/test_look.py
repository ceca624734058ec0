"""What the viewport shows: on and off leaves everything as it was, and no render ever shows a look."""

import json

import numpy as np
import pytest

from addon.core.io.exr import write_exr

bpy = pytest.importorskip("bpy")

from tests.blender.artist.artist_room import add_cameras, box, bridge, build_room, mesh_object, node_trees  # noqa: E402

QUICK = {"shading_rays": 16, "specular_rays": 4, "emitter_rays": 2, "refine": 0, "texel_size": 0.08, "atlas_size": 512}
LOOKS = ("ALBEDO", "SHADING", "LIT_DIFFUSE", "COVERAGE", "CERTAINTY")


@pytest.fixture(scope="module")
def dressed(package, tmp_path_factory):
    """A file whose objects wear recovered materials, beside its result folder."""
    folder = tmp_path_factory.mktemp("dressed")
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    build_room()
    add_cameras(folder)
    ops = bpy.ops.scan_relight
    ops.capture_from_scene(result_folder=str(folder / "result"))
    ops.recover(capture_folder=str(folder / "result" / "scene_capture"), result_folder=str(folder / "result"), **QUICK)
    bpy.context.scene.scan_relight.result_folder = str(folder / "result")
    bpy.context.scene.camera = bpy.context.scene.objects["cam 0"]
    bpy.ops.wm.save_as_mainfile(filepath=str(folder / "file.blend"))
    return folder


@pytest.fixture
def scene(dressed):
    bpy.ops.wm.open_mainfile(filepath=str(dressed / "file.blend"))
    return bpy.context.scene


def everything(scene):
    """What a look must not leave a trace on."""
    slots = {
        thing.name: [slot.material and slot.material.name for slot in thing.material_slots] for thing in scene.objects
    }
    stacks = {thing.name: [(one.name, one.show_render) for one in thing.modifiers] for thing in scene.objects}
    counts = {
        kind: sorted(one.name for one in getattr(bpy.data, kind))
        for kind in ("materials", "images", "node_groups", "meshes", "objects")
    }
    return slots, stacks, counts, node_trees()


def shown(scene, name):
    """Names of the materials that the viewport draws an object's faces with."""
    bpy.context.view_layer.update()
    data = scene.objects[name].evaluated_get(bpy.context.evaluated_depsgraph_get()).data
    index = np.empty(len(data.polygons), np.int32)
    data.polygons.foreach_get("material_index", index)
    return {data.materials[k].name for k in np.unique(index)}


def rendered(scene, tmp_path):
    scene.render.engine, scene.cycles.samples, scene.cycles.device = "CYCLES", 2, "CPU"
    scene.cycles.use_denoising = False
    scene.render.image_settings.file_format, scene.render.image_settings.color_depth = "OPEN_EXR", "32"
    scene.render.filepath = str(tmp_path / "render.exr")
    bpy.ops.render.render(write_still=True)
    image = bpy.data.images.load(scene.render.filepath)
    pixels = np.array(image.pixels[:])
    bpy.data.images.remove(image)
    return pixels


@pytest.mark.slow
@pytest.mark.parametrize("look", LOOKS)
def test_on_and_off(scene, look):
    before = everything(scene)
    assert bpy.ops.scan_relight.look(look=look) == {"FINISHED"}
    assert bridge("results.look").current(scene) == look
    for name in ("room", "table", "lamp", "chair.001", "bent"):
        assert all(one.startswith("Scan Relight look") for one in shown(scene, name)), name
    assert not any(one.startswith("Scan Relight look") for one in shown(scene, "round"))  # wears its own paint
    after = everything(scene)
    assert after[0] == before[0]
    assert {name: tree for name, tree in after[3].items() if name in before[3]} == before[3]
    assert bpy.ops.scan_relight.look(look="MATERIAL") == {"FINISHED"}
    assert everything(scene) == before and bridge("results.look").current(scene) == "MATERIAL"


@pytest.mark.slow
def test_no_render_shows_it(scene, tmp_path):
    plain = rendered(scene, tmp_path)
    bpy.ops.scan_relight.look(look="ALBEDO")
    np.testing.assert_array_equal(rendered(scene, tmp_path), plain)
    # The check itself: a look that renders could be told.
    for thing in scene.objects:
        for modifier in thing.modifiers:
            modifier.show_render = True
    assert not np.allclose(rendered(scene, tmp_path), plain)


@pytest.mark.slow
def test_saved_with_a_look_and_opened(scene, dressed, tmp_path):
    plain = rendered(scene, tmp_path)
    before = everything(scene)
    bpy.ops.scan_relight.look(look="SHADING")
    bpy.ops.wm.save_as_mainfile(filepath=str(dressed / "with look.blend"), copy=True)
    bpy.ops.wm.open_mainfile(filepath=str(dressed / "with look.blend"))
    scene = bpy.context.scene
    assert bridge("results.look").current(scene) == "SHADING" and "Shading" in next(iter(shown(scene, "room")))
    np.testing.assert_array_equal(rendered(scene, tmp_path), plain)
    bpy.ops.scan_relight.look(look="MATERIAL")
    assert everything(scene) == before


@pytest.mark.slow
@pytest.mark.parametrize(
    "look, space",
    [
        ("ALBEDO", "Linear Rec.709"),
        ("SHADING", "Linear Rec.709"),
        ("LIT_DIFFUSE", "Linear Rec.709"),
        ("COVERAGE", "Non-Color"),
    ],
)
def test_colour_management(scene, look, space):
    """Data as data; radiance under the scene's exposure, and an albedo independent of it, also when it changes."""
    bpy.ops.scan_relight.look(look=look)
    [material] = [one for one in bpy.data.materials if "scan_relight_look" in one]
    assert {node.image.colorspace_settings.name for node in material.node_tree.nodes if node.type == "TEX_IMAGE"} == {
        space
    }
    strengths = []
    for exposure in (0.0, -3.0):
        scene.view_settings.exposure = exposure
        bpy.context.view_layer.update()
        tree = material.evaluated_get(bpy.context.evaluated_depsgraph_get()).node_tree
        shine = next(node for node in tree.nodes if node.type == "EMISSION")
        strengths.append(shine.inputs["Strength"].default_value)
    assert strengths[1] / strengths[0] == pytest.approx(1.0 if look in ("SHADING", "LIT_DIFFUSE") else 8.0)


@pytest.mark.slow
def test_restoring_takes_the_look_along(scene):
    bpy.ops.scan_relight.look(look="ALBEDO")
    bpy.ops.scan_relight.restore_materials()
    assert not any(modifier.name.startswith("Scan Relight") for thing in scene.objects for modifier in thing.modifiers)
    with pytest.raises(RuntimeError, match="No object of this scene wears recovered"):
        bpy.ops.scan_relight.look(look="ALBEDO")


@pytest.mark.slow
def test_a_missing_image_is_told_and_changes_nothing(scene, dressed):
    image = dressed / "result" / "coverage.exr"
    image.rename(image.with_suffix(".away"))
    try:
        bpy.ops.scan_relight.look(look="ALBEDO")
        with pytest.raises(RuntimeError, match="coverage.exr' is missing"):
            bpy.ops.scan_relight.look(look="COVERAGE")
        assert bridge("results.look").current(scene) == "ALBEDO"
    finally:
        image.with_suffix(".away").rename(image)


def test_nothing_recovered_is_told(ops):
    with pytest.raises(RuntimeError, match="No object of this scene wears recovered"):
        ops.look(look="ALBEDO")


def wearing(name, folder, run, value):
    """An object of a result of its own, all of whose images are of one value."""
    folder.mkdir()
    (folder / "materials.json").write_text(json.dumps({"run": run, "objects": []}))
    write_exr(folder / "albedo.exr", np.full((4, 4, 3), value, np.float32))
    thing = mesh_object(name, *box((0, 0, 0), (1, 1, 1)), uv="ScanRelight")
    thing["object_id"], thing["scan_relight_result"], thing["scan_relight_run"] = 0, str(folder), run
    return thing


def pictured(thing):
    """First pixel of the image that the look shows on an object."""
    group = thing.modifiers["Scan Relight look"].node_group
    material = next(node for node in group.nodes if node.type == "SET_MATERIAL").inputs["Material"].default_value
    return next(node.image.pixels[0] for node in material.node_tree.nodes if node.type == "TEX_IMAGE")


def test_two_rooms_each_show_their_own_images_and_another_run_none(ops, tmp_path):
    hall = wearing("hall", tmp_path / "hall", "a" * 16, 0.25)
    attic = wearing("attic", tmp_path / "attic", "b" * 16, 0.5)
    assert ops.look(look="ALBEDO") == {"FINISHED"}
    assert (pictured(hall), pictured(attic)) == (0.25, 0.5)
    hall["scan_relight_run"] = "c" * 16
    ops.look(look="ALBEDO")
    assert not hall.modifiers and pictured(attic) == 0.5
    attic["scan_relight_run"] = "c" * 16
    with pytest.raises(RuntimeError, match="no images of the run that this scene's objects came from"):
        ops.look(look="ALBEDO")
