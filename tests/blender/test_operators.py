"""The operators on pip's bpy, registered from the checkout as the package that Blender would install."""

from __future__ import annotations

import importlib.util
import sys

import pytest

bpy = pytest.importorskip("bpy")

NAMES = ("import_capture", "accumulate", "shade", "fit", "write", "recover")
QUICK = {"shading_rays": 16, "specular_rays": 4, "emitter_rays": 2, "refine": 0, "texel_size": 0.12, "atlas_size": 512}


@pytest.fixture(scope="module")
def package(root):
    """The checkout as the registered package `scan_relight`."""
    spec = importlib.util.spec_from_file_location("scan_relight", root / "__init__.py",
                                                  submodule_search_locations=[str(root)])
    package = importlib.util.module_from_spec(spec)
    sys.modules["scan_relight"] = package
    spec.loader.exec_module(package)
    package.register()
    yield package
    package.unregister()
    for name in [name for name in sys.modules if name.split(".")[0] == "scan_relight"]:
        del sys.modules[name]


@pytest.fixture
def ops(package):
    """`bpy.ops.scan_relight` over an empty scene."""
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    return bpy.ops.scan_relight


def things():
    return {thing["object_id"]: thing for thing in bpy.context.scene.objects if "object_id" in thing}


@pytest.mark.parametrize("name", NAMES)
def test_registered_with_its_text(ops, name):
    kind = getattr(ops, name).get_rna_type()
    assert kind.name and kind.description and "capture_folder" in kind.properties


@pytest.mark.parametrize("name", NAMES[1:])
def test_every_setting_is_a_property(ops, name):
    from addon.settings_info import setting_infos

    properties = getattr(ops, name).get_rna_type().properties
    for info in setting_infos():
        assert properties[info.name].default == pytest.approx(info.default) if info.kind is float else \
            properties[info.name].default == info.default
        assert properties[info.name].description == info.help


def test_import_brings_objects_cameras_and_frames(ops, grey_capture):
    assert ops.import_capture(capture_folder=str(grey_capture)) == {"FINISHED"}
    cameras = [thing for thing in bpy.context.scene.objects if thing.type == "CAMERA"]
    assert len(things()) == 15 and len(cameras) == 3
    assert {thing.name for thing in things().values()} >= {"floor", "sofa", "ball"}
    assert all(camera.data.background_images[0].image for camera in cameras)


@pytest.mark.parametrize("name", NAMES)
def test_an_empty_folder_is_told(ops, name):
    with pytest.raises(RuntimeError, match="Choose the capture folder first"):
        getattr(ops, name)()


def test_a_result_folder_is_needed(ops, grey_capture):
    with pytest.raises(RuntimeError, match="Choose the result folder first"):
        ops.accumulate(capture_folder=str(grey_capture))


@pytest.mark.parametrize("name", NAMES)
def test_a_missing_capture_is_told(ops, name, tmp_path):
    folders = {"capture_folder": str(tmp_path / "nowhere")}
    if name != "import_capture":
        folders["result_folder"] = str(tmp_path / "result")
    with pytest.raises(RuntimeError, match="nowhere"):
        getattr(ops, name)(**folders)
    assert len(bpy.context.scene.objects) == 0


def test_a_bad_setting_is_told(ops, grey_capture, tmp_path):
    with pytest.raises(RuntimeError, match="atlas_size"):
        ops.accumulate(capture_folder=str(grey_capture), result_folder=str(tmp_path), atlas_size=1)


def test_editing_is_told(ops, grey_capture):
    mesh = bpy.data.meshes.new("edited")
    thing = bpy.data.objects.new("edited", mesh)
    bpy.context.scene.collection.objects.link(thing)
    bpy.context.view_layer.objects.active = thing
    bpy.ops.object.mode_set(mode="EDIT")
    with pytest.raises(RuntimeError, match="object mode"):
        ops.import_capture(capture_folder=str(grey_capture))
    bpy.ops.object.mode_set(mode="OBJECT")


def test_writing_needs_the_import(ops, grey_capture, tmp_path):
    with pytest.raises(RuntimeError, match="import it first"):
        ops.write(capture_folder=str(grey_capture), result_folder=str(tmp_path))


@pytest.mark.slow
def test_step_by_step(ops, tiny_capture, tmp_path):
    folders = {"capture_folder": str(tiny_capture), "result_folder": str(tmp_path)}
    bpy.context.scene.collection.objects.link(bpy.data.objects.new("the user's own", None))
    ops.import_capture(capture_folder=str(tiny_capture))
    ops.accumulate(**folders, **QUICK)
    ops.shade(**folders, **QUICK)
    ops.fit(**folders, **QUICK)
    assert not any(thing.data.materials for thing in things().values())
    ops.write(**folders, **QUICK)
    assert all(thing.data.materials[0]["scan_relight_model"] for thing in things().values())
    assert "the user's own" in bpy.data.objects
    assert len(things()) == 15
    lamp = next(thing for thing in things().values() if thing.name == "ceiling lamp")
    assert lamp.data.materials[0]["scan_relight_model"] == "emitter"
    assert lamp.users_collection[0].name.startswith("Lamps")


@pytest.mark.slow
def test_recover_does_it_all(ops, tiny_capture, tmp_path):
    bpy.context.scene.collection.objects.link(bpy.data.objects.new("the user's own", None))
    ops.recover(capture_folder=str(tiny_capture), result_folder=str(tmp_path), **QUICK)
    assert all(thing.data.materials[0]["scan_relight_model"] for thing in things().values())
    assert "the user's own" in bpy.data.objects
    for name in ("scene.blend", "albedo.exr", "base_color.exr", "shading.exr", "materials.json", "report.json"):
        assert (tmp_path / name).stat().st_size > 0, name
