"""Exports: what other programs read back is what the materials say; the scene has not changed."""

import json
import math
import re
import zipfile
from pathlib import Path

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from addon.bridge.custom_properties import OBJECT_ID, UV_MAP  # noqa: E402
from addon.bridge.data.arrays import make_mesh  # noqa: E402
from addon.bridge.data.images import image_array, load_image  # noqa: E402
from addon.bridge.data.materials import make_material  # noqa: E402
from addon.bridge.data.mesh_objects import ATLAS_UV, PARTS_UV  # noqa: E402
from addon.bridge.export import export as exporting  # noqa: E402
from addon.bridge.light import lamps  # noqa: E402
from addon.core.brdf.compensation import ior_of  # noqa: E402
from addon.core.brdf.dielectric import DIELECTRIC  # noqa: E402
from addon.core.brdf.emitter import EMITTER  # noqa: E402
from addon.core.brdf.lambertian import LAMBERTIAN  # noqa: E402
from addon.core.brdf.material import ObjectMaterial  # noqa: E402
from addon.core.brdf.metal import METAL  # noqa: E402
from addon.core.errors import BadInputError, StorageError  # noqa: E402
from addon.core.io.exr import write_exr  # noqa: E402
from addon.core.photo import encoded  # noqa: E402
from tests.blender.conftest import set_world  # noqa: E402

COLOUR = (0.5, 0.1, 0.02)
UV = np.float32([[0.1, 0.1], [0.9, 0.1], [0.9, 0.8]])
KNOWN = (
    ObjectMaterial(1, "wall", LAMBERTIAN),
    ObjectMaterial(2, "table", DIELECTRIC, alpha=0.09, f0=0.06),
    ObjectMaterial(3, "tap", METAL, alpha=0.04, f0=(0.9, 0.8, 0.5)),
    ObjectMaterial(4, "lamp", EMITTER, emission=(6.0, 3.0, 1.5)),
    ObjectMaterial(5, "sheet lamp", EMITTER, emission=(0.8, 0.4, 0.2)),
    ObjectMaterial(6, "pane", METAL, alpha=0.01, f0=(0.5, 0.5, 0.5)),
)


@pytest.fixture
def things(scene, tmp_path):
    """One triangle for each model, the atlas an EXR of one colour."""
    return a_room(scene, tmp_path, "kitchen")


def a_room(scene, folder, name):
    """Blender adds a '.001' to the names of the second."""
    write_exr(folder / f"{name}.exr", np.broadcast_to(np.float32(COLOUR), (8, 8, 3)))
    image = load_image(folder / f"{name}.exr", f"{name} base color")
    first = len(bpy.data.objects)
    for known in KNOWN:
        mesh = make_mesh(known.name, np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0]]), np.array([[0, 1, 2]]))
        mesh.uv_layers.new(name=ATLAS_UV).data.foreach_set("uv", UV.ravel())
        mesh.materials.append(make_material(known, image, one_sided=known.object_id == 5))
        thing = bpy.data.objects.new(known.name, mesh)
        thing.location = known.object_id, first, 0
        thing[OBJECT_ID] = known.object_id
        scene.collection.objects.link(thing)
    pane = next(n for n in mesh.materials[0].node_tree.nodes if n.type == "BSDF_PRINCIPLED")
    pane.inputs["Alpha"].default_value = 0.25
    bpy.context.view_layer.update()
    return scene


def everything():
    """Names and numbers of all that the scene holds."""
    kinds = ("objects", "meshes", "materials", "images", "collections", "scenes", "cameras", "lights")
    return (
        {kind: sorted(x.name for x in getattr(bpy.data, kind)) for kind in kinds},
        [
            (t.name, t.select_get(), t.hide_viewport, t.parent, [s.material.name + s.link for s in t.material_slots])
            for t in bpy.context.scene.objects
        ],
        {
            (m.name, n.name, s.name): (
                len(s.links),
                list(s.default_value) if hasattr(s.default_value, "__len__") else s.default_value,
            )
            for m in bpy.data.materials
            for n in m.node_tree.nodes
            for s in n.inputs
            if hasattr(s, "default_value")
        },
    )


def read_back(path):
    bpy.ops.wm.read_factory_settings(use_empty=True)
    if path.suffix in (".glb", ".gltf"):
        bpy.ops.import_scene.gltf(filepath=str(path))
    else:
        bpy.ops.wm.usd_import(filepath=str(path))
    found = {}
    for thing in bpy.context.scene.objects:
        if thing.type == "MESH":
            name = thing.name.replace("_", " ")
            assert {thing.data.name.replace("_", " "), thing.active_material.name.replace("_", " ")} == {name}
            shader = next(n for n in thing.material_slots[0].material.node_tree.nodes if n.type == "BSDF_PRINCIPLED")
            found[name] = thing, shader.inputs, thing.material_slots[0].material
    return found


def base_colour(socket):
    if not socket.links:
        return np.array(socket.default_value[:3])
    node = socket.links[0].from_node
    while node.type != "TEX_IMAGE":
        node = next(s for s in node.inputs if s.links).links[0].from_node
    value = image_array(node.image)[..., :3].mean((0, 1))
    assert node.image.colorspace_settings.name == "sRGB"
    return np.where(value <= 0.04045, value / 12.92, ((value + 0.055) / 1.055) ** 2.4)


def light(inputs):
    return inputs["Emission Strength"].default_value * np.array(inputs["Emission Color"].default_value[:3])


@pytest.mark.parametrize("ending", [".glb", ".gltf", ".usdc", ".usda"])
def test_what_is_read_back_is_what_the_materials_say(things, tmp_path, ending):
    before = everything()
    told = exporting.export(things, tmp_path / "out" / f"room{ending}", lights=False)
    assert any("opaque" in one for one in told) == ending.startswith(".usd")
    assert everything() == before
    found = read_back(tmp_path / "out" / f"room{ending}")
    assert set(found) == {known.name for known in KNOWN}
    usd = ending.startswith(".usd")
    for name in ("wall 1", "table 2"):
        thing, inputs, _ = found[name]
        assert np.allclose(base_colour(inputs["Base Color"]), COLOUR, atol=0.004)
        uv = np.array([item.vector[:] for item in thing.data.uv_layers.active.uv])
        assert np.allclose(sorted(uv.tolist()), sorted(UV.tolist()), atol=1e-4)
    table, wall, tap, pane = (found[name][1] for name in ("table 2", "wall 1", "tap 3", "pane 6"))
    assert table["Roughness"].default_value == pytest.approx(0.3, abs=1e-3)
    assert table["IOR"].default_value == pytest.approx(ior_of(0.06), abs=1e-3)
    f0 = ((wall["IOR"].default_value - 1) / (wall["IOR"].default_value + 1)) ** 2
    assert 2 * wall["Specular IOR Level"].default_value * f0 == pytest.approx(0, abs=1e-6)
    assert tap["Metallic"].default_value == 1 and tap["Roughness"].default_value == pytest.approx(0.2, abs=1e-3)
    assert np.allclose(base_colour(tap["Base Color"]), (0.9, 0.8, 0.5), atol=1e-3)
    for name, radiance in (("lamp 4", (6.0, 3.0, 1.5)), ("sheet lamp 5", (0.8, 0.4, 0.2))):
        assert np.allclose(light(found[name][1]), radiance, rtol=1e-3)
    assert light(wall).max() == 0
    assert tap["Alpha"].default_value == pytest.approx(1)
    if not usd:
        assert pane["Alpha"].default_value == pytest.approx(0.25, abs=1e-3)
    if not usd:
        assert found["sheet lamp 5"][2].use_backface_culling and not found["lamp 4"][2].use_backface_culling
    place = found["table 2"][0].matrix_world.translation
    assert place.x == pytest.approx(2, abs=1e-5)


def test_the_extensions_are_named_in_the_file(things, tmp_path):
    exporting.export(things, tmp_path / "room.gltf")
    file = json.loads((tmp_path / "room.gltf").read_text())
    used = set(file["extensionsUsed"])
    assert {"KHR_materials_emissive_strength", "KHR_materials_ior", "KHR_materials_specular"} <= used
    assert all(image["mimeType"] == "image/png" for image in file["images"]) and len(file["images"]) == 1


def gltf(path):
    """The JSON of a glTF file."""
    data = path.read_bytes()
    return json.loads(data if path.suffix == ".gltf" else data[20 : 20 + int.from_bytes(data[12:16], "little")])


@pytest.mark.parametrize("ending", [".glb", ".gltf"])
def test_two_rooms_in_one_gltf_keep_their_objects_apart(things, tmp_path, ending):
    a_room(things, tmp_path, "living.room")
    before = everything()
    exporting.export(things, tmp_path / f"both{ending}")
    assert everything() == before
    told = gltf(tmp_path / f"both{ending}")
    expected = [known.name for known in KNOWN] + [f"{known.name} (2)" for known in KNOWN]
    for kind in ("nodes", "meshes", "materials"):
        assert sorted(one["name"] for one in told[kind]) == sorted(expected), kind
    assert sorted(one["name"] for one in told["images"]) == ["kitchen_base_color", "living_room_base_color"]


def test_the_second_room_alone_has_plain_names(things, tmp_path):
    for thing in a_room(things, tmp_path, "hall").objects:
        thing.select_set(thing.name.endswith(".001"))
    before = everything()
    exporting.export(things, tmp_path / "hall.usda", exporting.SELECTED)
    exporting.export(things, tmp_path / "hall.glb", exporting.SELECTED)
    assert everything() == before
    for kind in ("nodes", "meshes", "materials"):
        assert {one["name"] for one in gltf(tmp_path / "hall.glb")[kind]} == {known.name for known in KNOWN}
    assert set(read_back(tmp_path / "hall.usda")) == {known.name for known in KNOWN}


def test_names_that_usd_would_make_one_stay_two(things, tmp_path):
    mesh = things.objects["wall 1"].data
    for name in ("Wall_1", "3d", "_3d"):
        things.collection.objects.link(bpy.data.objects.new(name, mesh))
    exporting.export(things, tmp_path / "room.usda", exporting.ALL)
    made = re.findall(r'def Xform "(.*?)"', (tmp_path / "room.usda").read_text())
    assert len(made) == 1 + len(KNOWN) + 3 == len({name.casefold() for name in made})


@pytest.mark.parametrize("ending", [".gltf", ".usdc", ".usda"])
def test_no_export_touches_what_another_wrote(things, tmp_path, ending):
    set_world(things, environment(tmp_path))
    out = tmp_path / "out"
    for other in (".usda", ".gltf", ".glb", ".usdz"):
        exporting.export(things, out / f"room{other}")
    exporting.export(things, out / f"first{ending}")
    kept = {path: path.read_bytes() for path in out.rglob("*") if path.is_file()}
    write_exr(tmp_path / "kitchen.exr", np.full((8, 8, 3), 0.1, np.float32))
    bpy.data.images["kitchen base color"].reload()
    exporting.export(things, out / f"second{ending}")
    assert all(path.read_bytes() == data for path, data in kept.items())
    assert np.allclose(base_colour(read_back(out / f"first{ending}")["wall 1"][1]["Base Color"]), COLOUR, atol=0.004)
    assert np.allclose(base_colour(read_back(out / f"second{ending}")["wall 1"][1]["Base Color"]), 0.1, atol=0.004)


def environment(folder):
    write_exr(folder / "environment.exr", np.ones((4, 8, 3), np.float32))
    return folder / "environment.exr"


@pytest.mark.parametrize("ending", [".gltf", ".usda"])
def test_the_same_file_again_replaces_its_own_textures(things, tmp_path, ending):
    set_world(things, environment(tmp_path))
    path = tmp_path / "out" / f"room{ending}"
    exporting.export(things, path)
    pictures = path.with_name(f"{path.name} textures")
    assert {one.stem for one in pictures.iterdir()} - {"Scan_Relight_environment"} == {"kitchen_base_color"}
    bpy.data.images["kitchen base color"].name = "kitchen colour"
    exporting.export(things, path)
    assert {one.stem for one in pictures.iterdir()} - {"Scan_Relight_environment"} == {"kitchen_colour"}
    things.world = None
    for thing in things.objects:
        thing.select_set(thing.name == "lamp 4")
    exporting.export(things, path, exporting.SELECTED)
    assert sorted(one.name for one in path.parent.iterdir()) == sorted(
        {path.name} | ({"room.bin"} if ending == ".gltf" else set())
    )


def test_where_the_disk_refuses_all_is_as_it_was(things, tmp_path, monkeypatch):
    path = tmp_path / "out" / "room.gltf"
    exporting.export(things, path)
    before = {one: one.read_bytes() for one in path.parent.rglob("*") if one.is_file()}
    bpy.data.images["kitchen base color"].name = "kitchen colour"
    replace = Path.replace

    def fail(self, target):
        if self.name == ".partial-room.gltf":
            raise OSError(28, "No space left on device")
        return replace(self, target)

    monkeypatch.setattr(Path, "replace", fail)
    with pytest.raises(StorageError, match="No space left"):
        exporting.export(things, path)
    assert {one: one.read_bytes() for one in path.parent.rglob("*") if one.is_file()} == before


def test_usdz_holds_its_textures(things, tmp_path):
    set_world(things, environment(tmp_path))
    exporting.export(things, tmp_path / "out" / "room.usdz")
    assert [path.name for path in (tmp_path / "out").iterdir()] == ["room.usdz"]
    held = {Path(name).name for name in zipfile.ZipFile(tmp_path / "out" / "room.usdz").namelist()}
    assert {"kitchen_base_color.png", "Scan_Relight_environment.exr"} <= held


def test_lamps_go_as_they_shine_now(things, tmp_path):
    lamps.set_factor(lamps.lamp_named(things, "lamp 4")[0], 0.5)
    lamps.set_on(lamps.lamp_named(things, "sheet lamp")[0], False)
    exporting.export(things, tmp_path / "room.glb")
    found = read_back(tmp_path / "room.glb")
    assert np.allclose(light(found["lamp 4"][1]), (3.0, 1.5, 0.75), rtol=1e-3)
    assert light(found["sheet lamp 5"][1]).max() == 0


def test_selected_only_and_lights_that_a_format_lacks(things, tmp_path):
    things.objects["tap 3"].select_set(True)
    data = bpy.data.lights.new("soft", "AREA")
    things.collection.objects.link(bpy.data.objects.new("soft", data))
    told = exporting.export(things, tmp_path / "tap.glb", exporting.SELECTED)
    assert any("no area lights" in one for one in told)
    assert set(read_back(tmp_path / "tap.glb")) == {"tap 3"}


@pytest.mark.parametrize("name, says", [("room.obj", "ending in '.obj'"), ("room", "can't be written")])
def test_an_unknown_format_is_told(things, tmp_path, name, says):
    with pytest.raises(BadInputError, match=says):
        exporting.export(things, tmp_path / name)


def test_a_failure_leaves_the_scene_and_the_old_file(things, tmp_path, monkeypatch):
    (tmp_path / "room.glb").write_bytes(b"old")
    before = everything()

    def fail(path, ending, collection):
        raise RuntimeError("Error: it fell over.\n")

    monkeypatch.setattr(exporting, "_write", fail)
    with pytest.raises(StorageError, match="it fell over"):
        exporting.export(things, tmp_path / "room.glb")
    assert everything() == before and (tmp_path / "room.glb").read_bytes() == b"old"
    assert [p.name for p in tmp_path.iterdir() if p.suffix != ".exr"] == ["room.glb"]


def test_nothing_chosen_is_told(things, tmp_path):
    with pytest.raises(BadInputError, match="nothing to export"):
        exporting.export(things, tmp_path / "room.glb", exporting.SELECTED)


def test_without_usd_it_is_told(monkeypatch):
    class Options:
        usd = False

    class App:
        build_options = Options

    class Blender:
        app = App
        types = bpy.types

    monkeypatch.setattr(exporting, "bpy", Blender)
    assert "without USD" in exporting.can_export(".usdz") and not exporting.can_export(".glb")


def test_the_transfer_curve():
    assert encoded(np.array([0.0, 0.5, 1.0, 2.0, math.nan])).tolist() == [0, 188, 255, 255, 0]


@pytest.mark.parametrize("packed", [False, True])
def test_an_object_takes_its_tile_along(things, tmp_path, packed):
    colours = {1001: (0.1, 0.2, 0.3), 1012: (0.6, 0.5, 0.4)}
    for number, colour in colours.items():
        write_exr(tmp_path / f"tiles.{number}.exr", np.broadcast_to(np.float32(colour), (8, 8, 3)))
    tiled = load_image(tmp_path / "tiles.<UDIM>.exr", "kitchen tiles")
    tiled[UV_MAP] = PARTS_UV
    for name, number in (("wall 1", 1001), ("table 2", 1012)):
        data = things.objects[name].data
        tile = (number - 1001) % 10, (number - 1001) // 10
        layer = data.uv_layers.new(name=PARTS_UV)
        layer.data.foreach_set("uv", (UV + np.float32(tile)).ravel())
        layer.active_render = True
        data.materials[0] = make_material(KNOWN[int(name[-1]) - 1], tiled)
    if packed:
        tiled.pack()
        for number in colours:
            (tmp_path / f"tiles.{number}.exr").unlink()
    exporting.export(things, tmp_path / "out" / "room.glb")
    found = read_back(tmp_path / "out" / "room.glb")
    for name, colour in (("wall 1", colours[1001]), ("table 2", colours[1012])):
        assert np.allclose(base_colour(found[name][1]["Base Color"]), colour, atol=0.005)
        node = found[name][1]["Base Color"].links[0].from_node
        assert node.extension == "REPEAT"
