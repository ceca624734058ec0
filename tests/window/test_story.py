"""From the zip to a relit, corrected, saved room by real drags, clicks and keys; then the extension is removed."""

from __future__ import annotations

import json
import subprocess

import numpy as np
import OpenEXR
import pytest

from tests.window.driver import environment
from tests.window.story import ADDON, LAMPS, OWN_SCENES, Story

RENDER = """
import bpy, os
scene = bpy.data.scenes[{scene!r}]
scene.render.engine, scene.cycles.device, scene.cycles.samples, scene.cycles.seed = "CYCLES", "CPU", 64, 0
scene.cycles.use_denoising = scene.cycles.use_adaptive_sampling = False
scene.camera = next(one for one in scene.objects
                    if one.type == "CAMERA" and one.get("frame_path", "").endswith({frame!r}))
scene.render.use_compositing = scene.render.use_sequencer = False
settings = scene.render.image_settings
settings.media_type = "IMAGE"
settings.file_format, settings.color_mode, settings.color_depth = "OPEN_EXR", "RGB", "32"
scene.render.filepath = {out!r}
bpy.ops.render.render(write_still=True, scene=scene.name)
lost = [one.filepath for one in bpy.data.images
        if one.source == "FILE" and not one.packed_file and not os.path.isfile(bpy.path.abspath(one.filepath))]
print("LOST", lost)
"""


@pytest.fixture(scope="module")
def own_user(tmp_path_factory):
    """The folder of a user who has installed nothing yet."""
    return tmp_path_factory.mktemp("artist")


@pytest.fixture(scope="module")
def story(open_window, own_user):
    """A window with the startup file."""
    window = open_window(user=own_user, tab=False)
    yield Story(window)
    window.close()


@pytest.fixture(scope="module")
def file(tmp_path_factory):
    """Where the artist saves."""
    return tmp_path_factory.mktemp("work") / "room.blend"


@pytest.fixture(scope="module")
def shot(blender, own_user, tmp_path_factory):
    """Renders a scene of a file through a frame's camera with factory settings: no extension has a say."""

    def rendered(blend, scene: str, frame: str) -> np.ndarray:
        out = tmp_path_factory.mktemp("shot") / "shot.exr"
        told = subprocess.run(
            [
                blender,
                "--background",
                "--factory-startup",
                str(blend),
                "--python-exit-code",
                "1",
                "--python-expr",
                RENDER.format(scene=scene, out=str(out), frame=frame),
            ],
            env=environment(own_user),
            capture_output=True,
            text=True,
        )
        assert told.returncode == 0, told.stdout + told.stderr
        assert "LOST []" in told.stdout, told.stdout
        return OpenEXR.File(str(out)).channels()["RGB"].pixels[..., :3]

    return rendered


def decibels(one: np.ndarray, other: np.ndarray) -> float:
    """PSNR of what a screen shows, its white four times the median of `other`."""
    one, other = (np.clip(picture / (4 * np.median(other)), 0, 1) ** (1 / 2.2) for picture in (one, other))
    return float(-10 * np.log10(max(np.mean((one - other) ** 2), 1e-12)))


def test_the_zip_is_dragged_in(story, archive, pictures):
    story.install(archive)
    story.window.picture(pictures / "20-installed.png")


def test_the_scan_is_dragged_in_and_run(story, tiny_capture, pictures, figures):
    story.window.actions.clear()
    story.drag_in(tiny_capture)
    story.window.picture(pictures / "21-dragged-in.png")
    story.run()
    story.finished()
    figures["actions_to_the_recovered_room"] = list(story.window.actions)
    assert len(story.window.actions) <= 3
    story.window.picture(pictures / "22-recovered.png")


def test_the_room_has_a_scene_of_its_own_and_the_artists_is_untouched(story, tiny_capture):
    [own] = story.window.ask(OWN_SCENES)
    assert own == f"Scan Relight: {tiny_capture.name}"
    told = story.window.ask(f"""
own, hers = bpy.data.scenes[{own!r}], next(one for one in bpy.data.scenes if not one.get("scan_relight_own"))
space = place()["area"].spaces.active
answer = [bpy.context.scene.name, sorted(one.name for one in hers.objects), hers.render.engine,
          hers.view_settings.exposure, own.render.engine, own.world is not None and own.world != hers.world,
          space.region_3d.view_perspective, space.shading.type, sum("object_id" in one for one in own.objects),
          sum(one.type == "CAMERA" and one.visible_get() for one in own.objects)]
""")
    assert told[:4] == [own, ["Camera", "Cube", "Light"], told[2], 0.0] and "EEVEE" in told[2]
    assert told[4:9] == ["CYCLES", True, "CAMERA", "RENDERED", 15]
    assert told[9] <= 2, "cameras litter the view"  # the one that is looked through, and the one along the track
    story.window.ask("setattr(place()['area'].spaces.active.shading, 'type', 'SOLID')")  # cores for what follows


def test_it_is_the_room_of_scene_blend(story, shot, tmp_path, tiny_capture, figures, pictures):
    [own] = story.window.ask(OWN_SCENES)
    story.window.ask(f"bpy.ops.wm.save_as_mainfile(filepath={str(tmp_path / 'copy.blend')!r}, copy=True)")
    result = story.window.ask(
        "next(one['scan_relight_result'] for one in bpy.context.scene.objects if 'scan_relight_result' in one)"
    )
    [theirs] = story.window.ask(f"""
with bpy.data.libraries.load({result + "/scene.blend"!r}) as (there, wanted):
    answer = list(there.scenes)
""")
    frame = json.loads((tiny_capture / "transforms.json").read_text())["frames"][2]["file_path"].split("/")[-1]
    alike = decibels(shot(tmp_path / "copy.blend", own, frame), shot(f"{result}/scene.blend", theirs, frame))
    figures["window_against_scene_blend_decibels"] = round(alike, 1)
    assert alike > 45


def test_a_lamp_goes_off_and_a_softbox_on(story, pictures, figures):
    story.lamp_off()
    story.softbox()
    story.window.picture(pictures / "23-relit.png")
    story.render_both()
    figures["actions_to_a_relit_render"] = list(story.window.actions)
    assert len(story.window.actions) <= 6
    story.window.picture(pictures / "24-before-and-after.png")
    story.close_picture()


def test_this_is_metal_and_fitted_again(story, pictures):
    name = story.choose()
    light = story.window.ask(
        "[sum(one.type == 'LIGHT' for one in bpy.context.scene.objects), "
        f"all({LAMPS}.is_on(one) for one in {LAMPS}.find_lamps(bpy.context.scene))]"
    )
    story.this_is_metal()
    thing = f"bpy.data.objects[{name!r}]"
    assert story.window.ask(f"{thing}.material_slots[0].material['scan_relight_model']") == "metal"
    assert story.window.ask("sum('object_id' in one for one in bpy.data.objects)") == 15
    assert (
        story.window.ask(
            "[sum(one.type == 'LIGHT' for one in bpy.context.scene.objects), "
            f"all({LAMPS}.is_on(one) for one in {LAMPS}.find_lamps(bpy.context.scene))]"
        )
        == light
    )
    story.window.picture(pictures / "25-metal.png")


def test_the_room_outlives_the_extension(story, file, blender, own_user, shot, tiny_capture, pictures):
    [own] = story.window.ask(OWN_SCENES)
    story.save_as(file)
    frame = json.loads((tiny_capture / "transforms.json").read_text())["frames"][2]["file_path"].split("/")[-1]
    before = shot(file, own, frame)
    story.window.ask(f"bpy.ops.wm.open_mainfile(filepath={str(file)!r})")
    story.window.ask("open_tab()")
    assert story.window.ask("sum('object_id' in one for one in bpy.context.scene.objects)") == 15
    [name] = story.window.ask(ADDON)
    story.window.close()
    told = subprocess.run(
        [blender, "--command", "extension", "remove", name.removeprefix("bl_ext.")],
        env=environment(own_user),
        capture_output=True,
        text=True,
    )
    assert told.returncode == 0, told.stdout + told.stderr
    assert not list(own_user.rglob("scan_relight/blender_manifest.toml"))
    assert decibels(shot(file, own, frame), before) > 60
