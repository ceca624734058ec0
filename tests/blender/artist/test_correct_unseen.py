"""What no frame saw is painted and filled on the artist's own image; what was seen, and the result, stay."""

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from addon.core.passes.albedo.albedo import CLOSED, FILLED, MEASURED, NONE, TEXTURED  # noqa: E402
from tests.blender.artist.artist_room import bridge  # noqa: E402
from tests.blender.artist.corrected_room import (  # noqa: E402
    BOARD,
    ENTRIES,
    SIZE,
    TABLE,
    TAP,
    build,
    colours,
    select,
    unseen,
    write_result,
)


@pytest.fixture
def room(ops, tmp_path):
    bridge("corrections.corrections").forget()
    return build(tmp_path / "result")


def shown(thing):
    """The image that Base Color shows, and its colours (64, 64, 3)."""
    image = bridge("corrections.unseen").texture_node(thing).image
    return image, bridge("data.images").image_array(image)[..., :3]


def hole(board=True):
    """What no frame saw of one of the two objects."""
    part = unseen()
    part[SIZE // 2 :] &= not board
    part[: SIZE // 2] &= board
    return part


def test_fill_fills_what_was_not_seen_and_nothing_else(room, ops, tmp_path):
    files = {path.name: path.read_bytes() for path in (tmp_path / "result").iterdir()}
    select(room[BOARD])
    assert ops.fill_unseen() == {"FINISHED"}
    image, filled = shown(room[BOARD])
    wanted = np.broadcast_to(np.linspace(0.2, 0.6, SIZE)[:, None, None], (SIZE, SIZE, 3))
    assert np.array_equal(filled[~hole()], colours()[~hole()])
    assert np.abs(filled - wanted)[hole()].max() < 0.04, "the ramp goes on; 0.05 lie across the hole"
    assert image.packed_file and "result" not in image.filepath
    assert {path.name: path.read_bytes() for path in (tmp_path / "result").iterdir()} == files
    assert shown(room[TABLE])[0] != image, "others show what was found"


def test_both_objects_on_one_image(room, ops):
    select(room[BOARD], room[TABLE], room[TAP])
    ops.fill_unseen()
    assert shown(room[BOARD])[0] == shown(room[TABLE])[0]
    assert (shown(room[BOARD])[1][unseen()] < 0.6).all()


def test_nothing_to_fill_is_told(room, ops):
    select(room[TAP])
    with pytest.raises(RuntimeError, match="one colour, so there is nothing to fill"):
        ops.fill_unseen()
    assert "scan_relight_painted" not in room[TAP]


def test_restore(room, ops):
    select(room[BOARD])
    before = shown(room[BOARD])[0]
    ops.fill_unseen()
    assert ops.restore_painted() == {"FINISHED"}
    assert shown(room[BOARD])[0] == before and not ops.restore_painted.poll()
    image = bridge("corrections.unseen").own_image(room[BOARD])
    assert (shown(room[BOARD])[1][hole()] < 0.6).all(), "it is still there"
    ops.restore_painted(discard=True)
    bridge("corrections.unseen").own_image(room[BOARD])
    assert shown(room[BOARD])[0] == image and np.array_equal(shown(room[BOARD])[1], colours())


def test_paint_is_ready(room, ops):
    select(room[BOARD])
    assert ops.paint_unseen() == {"FINISHED"}
    settings = bpy.context.scene.tool_settings.image_paint
    assert bpy.context.mode == "PAINT_TEXTURE"
    assert settings.mode == "IMAGE" and settings.canvas == shown(room[BOARD])[0]
    assert settings.use_stencil_layer and not settings.invert_stencil
    mask = bridge("data.images").image_array(settings.stencil_image)[..., 0]
    assert np.array_equal(mask < 0.5, unseen())
    assert room[BOARD].data.uv_layer_stencil.name == "ScanRelight"
    bpy.ops.object.mode_set(mode="OBJECT")


def test_what_is_painted_is_saved(room, ops, tmp_path):
    select(room[BOARD])
    name = room[BOARD].name
    ops.paint_unseen()
    bpy.ops.object.mode_set(mode="OBJECT")
    image, pixels = shown(room[BOARD])
    pixels = bridge("data.images").image_array(image)
    pixels[12, 12, :3] = (0.1, 0.3, 0.7)
    image.pixels.foreach_set(pixels.ravel())
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "room.blend"))
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "room.blend"))
    assert shown(bpy.data.objects[name])[1][12, 12] == pytest.approx([0.1, 0.3, 0.7], abs=1e-5)


def test_beside_the_file_by_choice(room, ops, tmp_path):
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "room.blend"))
    bpy.context.scene.scan_relight.images = "FOLDER"
    select(room[BOARD])
    ops.fill_unseen()
    image, filled = shown(room[BOARD])
    assert not image.packed_file and (tmp_path / "room images").is_dir()
    image.reload()
    assert np.allclose(shown(room[BOARD])[1], filled, atol=1e-6)


def test_a_painted_image_survives_an_update(room, ops, tmp_path):
    """A later run makes the materials anew and writes other colours; what the artist filled is shown on."""
    select(room[BOARD])
    ops.fill_unseen()
    image, filled = shown(room[BOARD])
    folder = tmp_path / "result"
    write_result(folder, [one | {"alpha": 0.3} if one["object_id"] == TABLE else one for one in ENTRIES], "f" * 16)
    from addon.core.io.exr import write_exr

    write_exr(folder / "base_color.exr", np.full((SIZE, SIZE, 3), 0.25, np.float32))
    refitted = bridge("corrections.refitted")
    before = {one["object_id"]: one | ({"model": "metal"} if one["object_id"] == BOARD else {}) for one in ENTRIES}
    bridge("slices").whole(refitted.bringing(bpy.context.scene, folder, before, refitted.fitted(folder)))
    assert shown(room[BOARD])[0] == image and np.array_equal(shown(room[BOARD])[1], filled)
    assert np.allclose(shown(room[TABLE])[1], 0.25)
    ops.restore_painted()
    assert np.allclose(shown(room[BOARD])[1], 0.25)


def test_other_texture_coordinates_are_told(room, ops):
    select(room[BOARD])
    ops.fill_unseen()
    image = shown(room[BOARD])[0]
    node = bridge("corrections.unseen").texture_node(room[BOARD])
    node.image = shown(room[TABLE])[0]
    room[BOARD].data.uv_layers["ScanRelight"].uv[0].vector = (0.5, 0.5)
    [sentence] = bridge("corrections.corrections").reapply(room[BOARD])
    assert image.name in sentence and node.image != image


def test_a_result_that_is_gone_is_told(room, ops, tmp_path):
    (tmp_path / "result" / "coverage.exr").unlink()
    select(room[BOARD])
    for name in ("fill_unseen", "paint_unseen"):
        with pytest.raises(RuntimeError, match="coverage.exr' is missing"):
            getattr(ops, name)()
    assert "scan_relight_painted" not in room[BOARD] and bpy.context.mode == "OBJECT"


def test_a_moved_result_is_followed(room, ops, tmp_path):
    select(room[BOARD])
    ops.fill_unseen()
    (tmp_path / "result").rename(tmp_path / "elsewhere")
    bridge("results.find").repoint(tmp_path / "result", tmp_path / "elsewhere")
    assert bridge("corrections.unseen").coverage(room[BOARD]).shape == (SIZE, SIZE, 3)


def test_what_counts_as_measured():
    """Texture that was copied is none, nor what closes a hole and was filled in."""
    was_measured = bridge("corrections.unseen").was_measured
    told = was_measured(np.array([NONE, FILLED, MEASURED, TEXTURED]))
    assert told.tolist() == [False, False, True, False]
    assert was_measured(CLOSED + np.array([NONE, FILLED, MEASURED, TEXTURED])).tolist() == told.tolist()
