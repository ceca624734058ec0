"""The command `relight`: pictures that differ as they should, a scene that is not touched, one sentence for errors."""

import hashlib

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from addon import cli  # noqa: E402
from addon.core.io.exr import read_exr  # noqa: E402
from addon.core.io.pictures import picture_size  # noqa: E402

QUICK = ("--samples", "4", "--quiet")


def relight(result, out, *options):
    return cli.main(["relight", str(result), "--out", str(out), *QUICK, *options])


def mean(path):
    return read_exr(path).rgb.mean((0, 1))


def files(folder):
    return {p.name: hashlib.md5(p.read_bytes()).hexdigest() for p in folder.iterdir() if p.is_file()}


@pytest.mark.slow
def test_lamps_change_the_picture_and_the_result_stays(result, tmp_path):
    before = files(result)
    half = ("--lamps", "ceiling lamp=0.5,lamp shade=off")
    for name, options in (
        ("on", ()),
        ("off", ("--lamps", "off")),
        ("half", half),
        ("spot", ("--lamps", "off", "--spot")),
        ("bright", ("--lamps", "off", "--spot", "3")),
    ):
        assert relight(result, tmp_path / f"{name}.exr", *options) == 0
    on, off, half, spot, bright = (mean(tmp_path / f"{n}.exr") for n in ("on", "off", "half", "spot", "bright"))
    assert off.max() < 1e-6 < half.min() and np.all(half < 0.55 * on)
    assert np.allclose(bright, 3 * spot, rtol=1e-3) and spot.min() > 0
    assert files(result) == before and len(list(tmp_path.glob("*.exr"))) == 5


@pytest.mark.slow
@pytest.mark.parametrize("camera", ["3", None])
def test_before_and_after_beside_each_other(result, tmp_path, camera):
    name = camera and bpy_camera_name(result, 3)
    assert (
        relight(
            result,
            tmp_path / "a.png",
            "--before-after",
            "--lamps",
            "off",
            "--softbox",
            *(("--camera", name) if name else ()),
            "--size",
            "50",
        )
        == 0
    )
    width, height = picture_size(tmp_path / "a.png")
    assert height == 24 and width == 2 * 32 + 1
    image = bpy.data.images.load(str(tmp_path / "a.png"))
    pixels = np.array(image.pixels[:]).reshape(24, 65, 4)[..., :3]
    assert np.abs(pixels[:, :32].mean((0, 1)) - pixels[:, 33:].mean((0, 1))).max() > 0.02
    assert [p.name for p in tmp_path.iterdir()] == ["a.png"]


def bpy_camera_name(result, index):
    bpy.ops.wm.open_mainfile(filepath=str(result / "scene.blend"), load_ui=False)
    return sorted(thing.name for thing in bpy.context.scene.objects if "frame_path" in thing)[index]


@pytest.mark.slow
def test_a_number_and_a_name_are_the_same_camera(result, tmp_path):
    name = bpy_camera_name(result, 4)
    for out, camera in (("n.exr", "4"), ("m.exr", name), ("o.exr", "1")):
        assert relight(result, tmp_path / out, "--camera", camera) == 0
    n, m, o = (read_exr(tmp_path / f).rgb for f in ("n.exr", "m.exr", "o.exr"))
    assert np.array_equal(n, m) and not np.array_equal(n, o)


@pytest.mark.parametrize(
    "options, says",
    [
        (("--lamps", "sun=2"), "no lamp 'sun'; known are 'ceiling lamp 3'"),
        (("--lamps", "ceiling lamp=-1"), "factors of at least 0, not '-1'"),
        (("--lamps", "brighter"), "takes on, off or NAME=FACTOR"),
        (("--world", "left"), "angle in degrees, not 'left'"),
        (("--hdri", "nowhere.hdr"), "no picture"),
        (("--camera", "99"), "take a number from 0 to 9"),
        (("--camera", "kitchen"), "There is no camera 'kitchen'"),
        (("--samples", "-1"), "--samples"),
        (("--spot", "-1"), "--spot"),
        (("--world-strength", "nan"), "--world-strength"),
    ],
)
def test_errors_are_one_sentence_and_no_picture(result, tmp_path, capsys, options, says):
    says = says.replace("ceiling lamp 3", first_lamp(result))
    capsys.readouterr()
    assert relight(result, tmp_path / "x.png", *options) == 2
    err = capsys.readouterr().err
    assert says in err and err.count("\n") == 1 and "Traceback" not in err
    assert not list(tmp_path.iterdir())


def first_lamp(result):
    from addon.bridge.light.lamps import find_lamps

    bpy.ops.wm.open_mainfile(filepath=str(result / "scene.blend"), load_ui=False)
    return find_lamps(bpy.context.scene)[0].name


def test_no_scene_is_told(tmp_path, capsys):
    assert relight(tmp_path, tmp_path / "x.png") == 2
    assert "holds no scene.blend; run 'recover" in capsys.readouterr().err


def test_a_scene_that_is_none_is_told(tmp_path, capsys):
    (tmp_path / "scene.blend").write_bytes(b"BLENDER-nonsense")
    assert relight(tmp_path, tmp_path / "x.png") == 2
    assert "can't be opened" in capsys.readouterr().err


def test_an_unknown_ending_is_told_before_the_work(result, tmp_path, capsys):
    assert relight(result, tmp_path / "x.tiff") == 2
    assert "has to end in .png, .exr or .jpg" in capsys.readouterr().err


def test_a_place_that_cant_be_written_is_told(result, tmp_path, capsys):
    (tmp_path / "file").write_text("")
    assert relight(result, tmp_path / "file" / "x.png") == 1
    assert "can't be written" in capsys.readouterr().err


@pytest.mark.slow
def test_eevee_without_a_graphics_card_is_told_instead_of_a_black_picture(result, tmp_path, capsys):
    """Where there is one, there is a picture."""
    code = relight(result, tmp_path / "x.png", "--engine", "eevee")
    err = capsys.readouterr().err
    if code:
        assert code == 2 and "take Cycles" in err and not list(tmp_path.iterdir())
    else:
        image = bpy.data.images.load(str(tmp_path / "x.png"))
        assert max(image.pixels[:]) > 0.05
