"""Pixels pass through images unchanged."""

import numpy as np
import pytest

from addon.core.errors import BadInputError
from addon.core.io.exr import write_exr

bpy = pytest.importorskip("bpy")

from addon.bridge.data.images import DATA, RADIANCE, array_image, image_array, load_image, relative_to  # noqa: E402

PIXELS = np.random.default_rng(0).uniform(0, 40, (5, 7, 3)).astype(np.float32)


@pytest.mark.parametrize("space", [RADIANCE, DATA])
def test_a_file_comes_back(scene, tmp_path, space):
    write_exr(tmp_path / "albedo.exr", PIXELS)
    image = load_image(tmp_path / "albedo.exr", colour_space=space)
    np.testing.assert_array_equal(image_array(image)[::-1, :, :3], PIXELS)
    assert image.name == "albedo" and image.use_fake_user and image.packed_file is None


@pytest.mark.parametrize("space", [RADIANCE, DATA])
def test_an_array_comes_back_and_is_kept_in_the_blend(scene, tmp_path, space):
    image = array_image("data", PIXELS, space)
    image.use_fake_user = True
    np.testing.assert_array_equal(image_array(image)[..., :3], PIXELS)
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "x.blend"))
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "x.blend"))
    np.testing.assert_allclose(image_array(bpy.data.images["data"])[..., :3], PIXELS, rtol=1e-3)
    assert bpy.data.images["data"].colorspace_settings.name == space


def test_grey_and_alpha(scene):
    grey = image_array(array_image("grey", PIXELS[..., 0]))
    np.testing.assert_array_equal(grey, np.concatenate([np.repeat(PIXELS[..., :1], 3, 2), np.ones((5, 7, 1))], 2))
    rgba = np.concatenate([PIXELS, PIXELS[..., :1] / 40], 2)
    np.testing.assert_array_equal(image_array(array_image("rgba", rgba)), rgba)


def test_relative_paths(scene, tmp_path):
    write_exr(tmp_path / "albedo.exr", PIXELS)
    image = load_image(tmp_path / "albedo.exr")
    relative_to(image, tmp_path / "sub")
    assert image.filepath == "//../albedo.exr"


def test_what_is_no_image_is_told(scene, tmp_path):
    with pytest.raises(BadInputError, match=r"albedo\.exr can't be opened"):
        load_image(tmp_path / "albedo.exr")
