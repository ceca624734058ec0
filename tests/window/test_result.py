"""A result opened by an artist: its objects, its looks, its lamps, new light, before and after, new things."""

from __future__ import annotations

import shutil

import pytest
from PIL import Image

from tests.window.story import VISIBLE, Story

LAMPS = "module('addon.bridge.light.lamps')"
ACTIVE = "module('operators.base.job_operator').active()"
LOOK = "module('addon.bridge.results.look').current(bpy.context.scene)"


@pytest.fixture(scope="module")
def folder(recovered, tmp_path_factory):
    """A result folder of this module's own."""
    return shutil.copytree(recovered, tmp_path_factory.mktemp("opened") / "result")


@pytest.fixture(scope="module")
def window(open_window, folder):
    """A window with the result's scene, seen from within, drawn in its plainest way."""
    found = open_window(folder / "scene.blend")
    found.ask("""
space = place()["area"].spaces.active
space.shading.type, space.region_3d.view_perspective = "SOLID", "CAMERA"
""")
    yield found
    found.close()


def test_a_click_on_a_result_selects_its_object(window, pictures):
    window.ask("""
for thing in bpy.context.view_layer.objects.selected:
    thing.select_set(False)
bpy.context.view_layer.objects.active = None
""")
    x, y = window.ask("find(('scan_relight_row',), across=(0.3,))")
    window.click_at(x, y + 46)
    chosen = window.wait_for("getattr(bpy.context.view_layer.objects.active, 'name', '')", patience=30)
    assert window.ask("[one.name for one in bpy.context.view_layer.objects.selected]") == [chosen]
    known = window.ask(
        "[module('operators.results.summary').result_of(bpy.context.scene).objects[bpy.data.objects[name]"
        f"['object_id']]['model'] for name in {[chosen]!r}]"
    )
    assert set(known) <= {"lambertian", "specular", "metal", "emitter", "transparent"}
    window.ask("scroll(-100000)")
    window.picture(pictures / "09-results.png")
    window.picture(pictures / "09-results-sidebar.png", sidebar=True)


def test_rows_further_down_are_scrolled_to(window):
    story = Story(window)
    rows = window.ask(
        "sorted((one.name for one in module('addon.bridge.results.file').rows_of_parts(bpy.context.scene.objects)),"
        "key=module('addon.core.naming').in_order)"
    )
    for row in (len(rows) - 1, 1, VISIBLE):
        window.ask("setattr(bpy.context.view_layer.objects, 'active', None)")
        assert story.choose(row) == rows[row]


def test_lamps_are_switched_off(window, pictures):
    assert window.ask(f"all({LAMPS}.is_on(one) for one in {LAMPS}.find_lamps(bpy.context.scene))")
    window.click("scan_relight.switch_lamps(", "on=False", across=(0.75,))
    window.wait_for(f"not any({LAMPS}.is_on(one) for one in {LAMPS}.find_lamps(bpy.context.scene))")
    window.picture(pictures / "10-lamps-off-sidebar.png", sidebar=True)


def test_a_new_light_is_added_in_one_step(window, pictures):
    window.click("scan_relight.add_light(", "'WINDOW'", top=False, across=(0.25,))
    window.wait_for("sum(one.type == 'LIGHT' for one in bpy.context.scene.objects) == 1")
    window.key("ctrl+z")
    window.wait_for("sum(one.type == 'LIGHT' for one in bpy.context.scene.objects) == 0")
    window.key("ctrl+shift+z")
    window.wait_for("sum(one.type == 'LIGHT' for one in bpy.context.scene.objects) == 1")
    window.picture(pictures / "11-new-light.png")
    window.picture(pictures / "11-new-light-sidebar.png", sidebar=True)


def test_a_thing_is_set_into_the_room(window, pictures):
    window.ask("setattr(bpy.context.scene.scan_relight_studio, 'shape', 'MONKEY')")
    before = set(window.ask("bpy.data.objects.keys()"))
    # Its part of the panel is folded: what its button does, in the view's context.
    assert window.ask("""
with bpy.context.temp_override(**place()):
    answer = list(bpy.ops.scan_relight.add_virtual("INVOKE_DEFAULT", True, shape="MONKEY", look="GLOSSY", size=0.5))
""") == ["FINISHED"]
    [new] = set(window.ask("bpy.data.objects.keys()")) - before
    assert window.ask(f"bpy.data.objects[{new!r}].material_slots[0].material is not None")
    window.picture(pictures / "12-new-thing.png")


def test_the_camera_becomes_a_frames(window, pictures):
    assert window.ask("""
with bpy.context.temp_override(**place()):
    bpy.ops.scan_relight.match_frame("INVOKE_DEFAULT", True, index=3)
scene = bpy.context.scene
space = place()["area"].spaces.active
answer = [scene.render.resolution_x, scene.render.resolution_y, space.region_3d.view_perspective,
          module("addon.bridge.relight.match_frame").current(scene)]
""") == [64, 48, "CAMERA", 3]
    window.picture(pictures / "13-frame.png")


def test_before_and_after_are_rendered_beside_the_window(window, folder, pictures):
    window.ask("setattr(bpy.context.scene.scan_relight_studio, 'samples', 16)")
    window.click("scan_relight.before_after(")
    window.wait_for(f"{ACTIVE} is not None")
    window.wait_for(f"{ACTIVE} is None", patience=200)
    assert window.ask("module('addon.bridge.job.job').current().state") == "done"
    with Image.open(folder / "before_after.png") as pair:
        assert pair.size[1] == 48 and pair.size[0] >= 2 * 64
        left, right = (
            pair.convert("L").crop(box).resize((1, 1), Image.Resampling.BOX).getpixel((0, 0))
            for box in ((0, 0, 64, 48), (pair.width - 64, 0, pair.width, 48))
        )
    assert left != right, "both pictures are alike"
    assert window.ask("[one.name for one in bpy.data.images if 'before' in one.name.lower()]")
    window.picture(pictures / "14-before-after.png")
    window.ask("""
for extra in bpy.context.window_manager.windows[1:]:
    with bpy.context.temp_override(window=extra):
        bpy.ops.wm.window_close()
""")


@pytest.mark.parametrize("name", ["ALBEDO", "SHADING", "COVERAGE", "CERTAINTY", "MATERIAL"])
def test_the_view_shows_another_look(window, pictures, name):
    window.click("scan_relight.look(", f"'{name}'", across=(0.25, 0.75), top=False)
    window.wait_for(f"{LOOK} == {name!r}")
    window.picture(pictures / f"15-look-{name.lower()}.png")


def test_the_captured_light_comes_back(window):
    window.click("scan_relight.restore_light(", top=False, across=(0.5,))
    window.wait_for(f"all({LAMPS}.is_on(one) for one in {LAMPS}.find_lamps(bpy.context.scene))")
    assert window.ask("sum(one.type == 'LIGHT' for one in bpy.context.scene.objects)") == 0
