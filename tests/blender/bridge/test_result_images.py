"""Images of a result that are in the file: referred to, copied beside it, packed; two results never mix."""

import numpy as np
import pytest

from addon.core.errors import BadInputError
from addon.core.io.exr import read_exr, write_exr

bpy = pytest.importorskip("bpy")

from addon.bridge.corrections import refitted  # noqa: E402
from addon.bridge.custom_properties import IMAGE  # noqa: E402
from addon.bridge.data.images import load_image  # noqa: E402
from addon.bridge.results.images import settle  # noqa: E402

VALUES = {"hall": 0.25, "attic": 0.5}


@pytest.fixture
def two(scene, tmp_path):
    """An image named alike of each of two results, in an open file that was saved."""
    for name, value in VALUES.items():
        (tmp_path / name).mkdir()
        write_exr(tmp_path / name / "base_color.exr", np.full((4, 4, 3), value, np.float32))
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "file.blend"))
    return [load_image(tmp_path / name / "base_color.exr") for name in VALUES]


def opened_again(tmp_path):
    """The first pixel of each image, by its result, after saving, moving the file's folder and opening."""
    bpy.ops.wm.save_mainfile()
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "file.blend"))
    return {
        one["scan_relight_image"].replace("\\", "/").split("/")[-2]: one.pixels[0]
        for one in bpy.data.images
        if "scan_relight_image" in one
    }


@pytest.mark.parametrize("where", ["RESULT", "FOLDER", "PACK"])
def test_each_image_shows_its_own_result(two, tmp_path, where):
    settle(two, where)
    if where != "RESULT":
        for name in VALUES:
            (tmp_path / name).rename(tmp_path / f"{name} gone")
    assert opened_again(tmp_path) == VALUES
    if where != "PACK":
        assert all(one.filepath.startswith("//") for one in bpy.data.images if "scan_relight_image" in one)


def test_a_file_that_was_never_saved(scene, tmp_path):
    write_exr(tmp_path / "base_color.exr", np.zeros((4, 4, 3), np.float32))
    bpy.ops.wm.read_homefile(use_empty=True)
    image = load_image(tmp_path / "base_color.exr")
    with pytest.raises(BadInputError, match="never saved; save it first, or pack them"):
        settle([image], "FOLDER")
    settle([image], "RESULT")
    assert image.filepath == str(tmp_path / "base_color.exr") and not image.packed_file


def test_a_newer_image_of_the_same_file_takes_the_place_of_the_older(two, tmp_path):
    hall, attic = two
    material = bpy.data.materials.new("wall")
    if material.node_tree is None:  # before Blender 5.0
        material.use_nodes = True
    node = material.node_tree.nodes.new("ShaderNodeTexImage")
    node.image = hall
    newer = load_image(tmp_path / "hall" / "base_color.exr")
    settle([newer, newer, hall], "RESULT")
    assert node.image == newer and newer.name == "base_color"
    assert [one for one in bpy.data.images if one.get("scan_relight_image") == newer["scan_relight_image"]] == [newer]
    assert attic.name in bpy.data.images


def test_what_is_gone_is_told(two, tmp_path):
    (tmp_path / "hall" / "base_color.exr").unlink()
    with pytest.raises(BadInputError, match="base_color.exr' is missing"):
        settle(two, "PACK")


def test_tiles_copied_beside_the_file_are_renewed(tmp_path):
    result, copies = tmp_path / "result", tmp_path / "copies"
    for folder, grey in ((result, 0.25), (copies, 0.75)):
        folder.mkdir()
        for number in (1001, 1002):
            write_exr(folder / f"base_color.{number}.exr", np.full((8, 8, 3), grey, np.float32))
    image = load_image(copies / "base_color.<UDIM>.exr", "tiles")
    image[IMAGE] = str(result / "base_color.<UDIM>.exr")
    refitted._renew_images(result)
    assert [float(read_exr(copies / f"base_color.{number}.exr").rgb.max()) for number in (1001, 1002)] == [0.25, 0.25]
