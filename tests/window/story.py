"""The way from the zip to a relit room, one method a step, by a hand's own clicks, keys and drags.

The tests play it on a small capture; `scripts/guide_pictures.py` plays it on a real one and takes the guide's pictures.
"""

from __future__ import annotations

import time
from contextlib import suppress
from pathlib import Path

from tests.window.driver import Window

JOB = "module('addon.bridge.job.job').current()"
ACTIVE = "module('operators.base.job_operator').active()"
LAMPS = "module('addon.bridge.light.lamps')"
OWN_SCENES = "[one.name for one in bpy.data.scenes if one.get('scan_relight_own')]"
ADDON = "[name for name in bpy.context.preferences.addons.keys() if name.endswith('.scan_relight')]"

EXPOSURE = "bpy.context.scene.view_settings.exposure"
SEEN = """
from bpy_extras.view3d_utils import location_3d_to_region_2d as shown
where, wanted = place(), bpy.data.objects[{name!r}]
region, view, graph = where["region"], where["area"].spaces.active.region_3d, bpy.context.evaluated_depsgraph_get()
eye, free, found = view.view_matrix.inverted().translation, place("UI")["region"], []
for polygon in list(wanted.data.polygons)[::max(1, len(wanted.data.polygons) // 500)]:
    point = wanted.matrix_world @ polygon.center
    at = shown(region, view, point)
    hit = bpy.context.scene.ray_cast(graph, eye, point - eye)
    if at is not None and hit[0] and hit[4] == wanted and 80 < at.x < free.x - region.x - 20:
        found.append(at)
if found:
    middle = sum((at.xy for at in found[1:]), found[0].copy()) / len(found)
    at = min(found, key=lambda at: (at - middle).length)
    height = bpy.context.window_manager.windows[0].height
    answer = [round(region.x + at.x), round(height - region.y - at.y)]
"""


ROW, VISIBLE = 20, 6
"""Pixels of a row of the results, and how many are seen at once."""


class Story:
    """What an artist does, in a window that shows Blender's startup file.

    Parameters
    ----------
    window : Window
        Opened with `tab=False`.
    patience : float
        Seconds that a run may take.
    """

    def __init__(self, window: Window, patience: float = 400.0):
        self.window, self.patience = window, patience
        self._scrolled = 0

    def install(self, archive: Path) -> None:
        """Drag the zip in and agree."""
        self.drag_zip_in(archive)
        self.agree()

    def drag_zip_in(self, archive: Path) -> None:
        """Drag the zip into the window; Blender asks."""
        self.window.drop(archive)
        self.popup()

    def agree(self) -> None:
        """OK: it is installed."""
        self.window.press("Return")
        self.window.wait_for(ADDON)

    def drag_in(self, capture: Path) -> None:
        """Drag a scan's transforms.json into the 3D view; Blender asks whether to recover it."""
        self.window.drop(capture / "transforms.json")
        self.window.wait_for("bool(bpy.context.scene.scan_relight.capture_folder)")
        self.popup()

    def run(self) -> None:
        """Press the dialog's Run."""
        self.window.press("Return")
        self.window.wait_for(f"{ACTIVE} is not None")

    def finished(self) -> None:
        """Wait until the room is there."""
        self.ended()
        self.window.wait_for(OWN_SCENES)
        self.window.ask("open_tab()")

    def lamp_off(self) -> str:
        """Switch the first lamp of the list off; its name."""
        names = self.window.ask(f"[one.name for one in {LAMPS}.find_lamps(bpy.context.scene)]")
        self.window.click("scan_relight_lamp.on", top=False, across=(0.06, 0.1))
        [off] = self.window.wait_for(f"[name for name in {names!r} if not {LAMPS}.is_on(bpy.data.materials[name])]")
        return off

    def softbox(self) -> None:
        """Add a softbox."""
        self.window.click("scan_relight.add_light(", "'SOFTBOX'", top=False, across=(0.25, 0.75, 0.5))
        self.window.wait_for("any(one.type == 'LIGHT' for one in bpy.context.scene.objects)")

    def expose(self) -> None:
        """Have the exposure follow the light that there is now."""
        before = self.window.ask(EXPOSURE)
        self.window.click("scan_relight.expose(", top=False, across=(0.25,))
        self.window.wait_for(f"{EXPOSURE} != {before!r}")

    def render_both(self) -> None:
        """Before and after, rendered beside the window."""
        self.window.click("scan_relight.before_after(", top=False, across=(0.5,))
        self.window.wait_for(f"{ACTIVE} is not None")
        self.ended()

    def ended(self) -> None:
        """Wait until a job's work is in the scene, and see that all went well."""
        self.window.wait_for(f"{ACTIVE} is None", patience=self.patience)
        time.sleep(0.5)
        told = self.window.ask(f"[{JOB}.state, {JOB}.sentence, {JOB}.facts.get('failed')]")
        assert told == ["done", "", None], told

    def close_picture(self) -> None:
        """Close the window that shows the two pictures."""
        self.window.ask("""
for extra in bpy.context.window_manager.windows[1:]:
    with bpy.context.temp_override(window=extra):
        bpy.ops.wm.window_close()
""")

    def choose(self, row: int = 1) -> str:
        """Click on a row of the results, which are scrolled to where it shows; the chosen object's name."""
        x, y = self.window.ask("find(('scan_relight_row',), across=(0.3,))")
        if self._scrolled:
            self.window.turn_wheel(x, y, -2 - self._scrolled)  # to its top, where it ends
        self._scrolled = max(row - VISIBLE + 1, 0)
        self.window.turn_wheel(x, y, self._scrolled)
        active = "getattr(bpy.context.view_layer.objects.active, 'name', '')"
        for _ in range(3):  # a loaded machine may not have drawn the rows yet
            self.window.click_at(x, y + ROW * (row - self._scrolled))
            with suppress(TimeoutError):
                return self.window.wait_for(active, patience=10)
        return self.window.wait_for(active)

    def choose_in_view(self, name: str) -> None:
        """Click on an object in the 3D view, where it is nearest to the middle of what is seen of it."""
        found = self.window.ask(SEEN.format(name=name))
        assert found, f"'{name}' is not in view"
        self.window.click_at(*found)
        self.window.wait_for(f"getattr(bpy.context.view_layer.objects.active, 'name', '') == {name!r}")

    def this_is_metal(self) -> None:
        """Say that the active object is metal; it is fitted again at once."""
        self.window.click("scan_relight.this_is(", "'metal'", across=(0.25, 0.75))
        self.window.wait_for(f"{ACTIVE} is not None")
        self.ended()

    def save_as(self, path: Path) -> None:
        """Save the file."""
        self.window.ask(f"bpy.ops.wm.save_as_mainfile(filepath={str(path)!r})")

    def popup(self, seconds: float = 2.0) -> None:
        """Give Blender the time to show a dialog: from outside it can't be asked whether it does."""
        time.sleep(seconds)
