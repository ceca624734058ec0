"""The operators and properties of the artist's side, in the background."""

import importlib

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

OPERATORS = (
    "switch_lamps",
    "restore_lamp",
    "restore_light",
    "add_light",
    "remove_lights",
    "use_hdri",
    "use_studio_light",
    "match_frame",
    "add_virtual",
    "place_object",
    "virtual_look",
    "pick_place",
    "before_after",
    "export",
)


@pytest.fixture
def ops(package, result):
    """`bpy.ops.scan_relight` over the recovered room."""
    bpy.ops.wm.open_mainfile(filepath=str(result / "scene.blend"), load_ui=False)
    bpy.context.scene.cycles.samples = 2
    return bpy.ops.scan_relight


def lamps():
    return [m for m in bpy.data.materials if m.get("scan_relight_model") == "emitter"]


@pytest.mark.parametrize("name", OPERATORS)
def test_every_operator_and_property_says_what_it_does(package, name):
    kind = getattr(bpy.ops.scan_relight, name).get_rna_type()
    for one in kind.properties:
        if one.identifier not in ("rna_type", "filter_glob", "check_existing"):
            assert one.description, one.identifier
    own = next(c for c in package.operators.classes() if getattr(c, "bl_idname", "") == f"scan_relight.{name}")
    assert kind.description or hasattr(own, "description")
    assert kind.name


@pytest.mark.parametrize("group", ["ScanRelightLamp", "ScanRelightOutside", "ScanRelightStudio"])
def test_every_choice_has_a_tooltip(package, group):
    props = importlib.import_module("scan_relight.operators.relight.props")
    for one in getattr(props, group).bl_rna.properties:
        if one.identifier not in ("rna_type", "name"):
            assert one.description and not one.description.endswith("."), one.identifier


@pytest.mark.parametrize("name", [name for name in OPERATORS if name not in ("match_frame", "export")])
def test_without_a_room_it_is_greyed_out(package, name):
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    assert not getattr(bpy.ops.scan_relight, name).poll()


def test_lamps_as_properties(ops):
    one, *others = lamps()
    before = one.scan_relight_lamp.colour[:]
    one.scan_relight_lamp.factor = 2.5
    one.scan_relight_lamp.colour = (1, 0.5, 0)
    others[0].scan_relight_lamp.on = False
    assert one.scan_relight_lamp.factor == 2.5 and one.scan_relight_lamp.colour[:] == (1, 0.5, 0)
    assert not others[0].scan_relight_lamp.on and one.scan_relight_lamp.on
    assert ops.switch_lamps(on=False) == {"FINISHED"} and not any(m.scan_relight_lamp.on for m in lamps())
    assert ops.restore_lamp(name=one.name) == {"FINISHED"}
    assert one.scan_relight_lamp.on and one.scan_relight_lamp.factor == 1 and one.scan_relight_lamp.colour[:] == before
    with pytest.raises(RuntimeError, match="known are"):
        ops.restore_lamp(name="sun")
    wall = next(m for m in bpy.data.materials if m.get("scan_relight_model") == "lambertian")
    wall.scan_relight_lamp.on = True  # no lamp: nothing happens
    assert not wall.scan_relight_lamp.on and "scan_relight_lamp_off" not in wall


def test_new_lights_and_the_way_back(ops, result, tmp_path):
    from addon.core.io.exr import write_exr

    scene = bpy.context.scene
    world = scene.world
    assert not ops.restore_light.poll() and not ops.remove_lights.poll()
    for preset in ("WINDOW", "SOFTBOX", "SPOT", "SUN"):
        assert ops.add_light(preset=preset) == {"FINISHED"} and bpy.context.object["scan_relight_light"] == preset
    assert ops.remove_lights() == {"FINISHED"} and not [t for t in scene.objects if t.type == "LIGHT"]
    ops.add_light(preset="SPOT")
    write_exr(tmp_path / "sky.exr", np.ones((8, 16, 3), np.float32))
    assert ops.use_hdri(filepath=str(tmp_path / "sky.exr")) == {"FINISHED"} and scene.world != world
    scene.world.scan_relight_outside.rotation = 1.0
    scene.world.scan_relight_outside.factor = 0.5
    assert scene.world.scan_relight_outside.rotation == pytest.approx(1.0)
    assert ops.restore_light() == {"FINISHED"}
    assert scene.world == world and not [t for t in scene.objects if t.type == "LIGHT"] and not ops.restore_light.poll()
    with pytest.raises(RuntimeError, match="no picture"):
        ops.use_hdri(filepath=str(tmp_path / "none.exr"))


def test_frames(ops):
    scene = bpy.context.scene
    assert ops.match_frame(index=4) == {"FINISHED"} and scene.scan_relight_studio.frame == 4
    ops.match_frame(step=1)
    assert scene.scan_relight_studio.frame == 5 and scene.camera.data.show_background_images
    scene.scan_relight_studio.show_frame = False
    assert not scene.camera.data.show_background_images
    scene.scan_relight_studio.frame = 99
    assert scene.scan_relight_studio.frame == 9
    with pytest.raises(RuntimeError, match="no frame 10"):
        ops.match_frame(index=10)


def test_objects(ops):
    scene = bpy.context.scene
    assert ops.add_virtual(shape="CUBE", look="GLOSSY", size=0.2) == {"FINISHED"}
    cube = bpy.context.object
    assert cube["scan_relight_virtual"] and cube.material_slots[0].material.name == "Scan Relight glossy"
    assert ops.virtual_look(look="MIRROR") == {"FINISHED"}
    assert cube.material_slots[0].material.name == "Scan Relight mirror"
    cube.location.z += 0.5
    for operator in (ops.place_object, ops.pick_place):
        assert operator() == {"FINISHED"} and cube.location.z < 2
    bpy.context.view_layer.objects.active = next(t for t in scene.objects if "object_id" in t)
    assert not ops.place_object.poll()


def settings(scene):
    groups = scene.render, scene.render.image_settings, scene.cycles, scene.view_settings, scene.eevee
    return (
        [
            (p.identifier, str(getattr(group, p.identifier)))
            for group in groups
            for p in group.bl_rna.properties
            if not p.is_readonly
        ],
        scene.camera.name,
        scene.world.name,
        [(m.name, m.scan_relight_lamp.on, m.scan_relight_lamp.factor) for m in lamps()],
        [(t.name, t.hide_render) for t in scene.objects],
    )


@pytest.mark.slow
@pytest.mark.parametrize("fails", [None, 1, 2])
def test_before_and_after_puts_every_setting_back(ops, tmp_path, fails, monkeypatch):
    scene = bpy.context.scene
    ops.switch_lamps(on=False)
    ops.add_light(preset="SOFTBOX")
    scene.render.image_settings.file_format = "JPEG"
    scene.render.use_border = True
    before = settings(scene)
    module = importlib.import_module("scan_relight.addon.bridge.relight.pictures")
    shoot, calls = module.render_to_file, []

    def maybe(*arguments):
        calls.append(arguments)
        if len(calls) == fails:
            raise RuntimeError("it fell over")
        shoot(*arguments)

    monkeypatch.setattr(module, "render_to_file", maybe)
    if fails:
        with pytest.raises(RuntimeError, match="it fell over"):
            ops.before_after(filepath=str(tmp_path / "a.png"), samples=2, percentage=50)
        assert not list(tmp_path.iterdir())
    else:
        assert ops.before_after(filepath=str(tmp_path / "a.png"), samples=2, percentage=50) == {"FINISHED"}
        assert bpy.data.images["Before and After"].size[:] == (65, 24) and (tmp_path / "a.png").stat().st_size
    assert settings(scene) == before


def test_before_and_after_needs_a_place(ops):
    bpy.context.scene.scan_relight.result_folder = ""
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    assert not ops.before_after.poll()


def test_export(ops, tmp_path):
    assert ops.export(filepath=str(tmp_path / "room"), format=".glb") == {"FINISHED"}
    assert (tmp_path / "room.glb").stat().st_size > 10000
    with pytest.raises(RuntimeError, match="Choose the file"):
        ops.export()
