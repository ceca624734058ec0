"""Plays the guide in Blender's window and takes its pictures: from an empty scene to a relit room.

    BLENDER=... .venv/bin/python scripts/guide_pictures.py CAPTURE --zip dist/scan_relight-...zip

CAPTURE is opened under its own path, which the pictures show. The result goes beside it. Pictures are written in full
to build/guide, and scaled, in few colours, to docs/images/guide.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile
from pathlib import Path

from PIL import Image

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT))

from tests.window import driver  # noqa: E402
from tests.window.driver import Screen, Window, environment, missing  # noqa: E402

JOB = "module('addon.bridge.job').current()"
ACTIVE = "module('operators.job_operator').active()"
LAMPS = "module('addon.bridge.relight_lamps')"


def main() -> int:
    """Install, play, scale."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("capture", type=Path)
    parser.add_argument("--zip", type=Path, required=True)
    parser.add_argument("--out", type=Path, default=ROOT / "docs" / "images" / "guide")
    parser.add_argument("--preset", default="draft")
    parser.add_argument("--frame", type=int, default=5)
    options = parser.parse_args()
    blender = os.environ.get("BLENDER")
    if reason := missing(blender):
        sys.exit(f"The window can't be shown here: {reason}.")
    full = ROOT / "build" / "guide"
    driver.SIZE = 1360, 1240  # the whole sidebar at once
    with tempfile.TemporaryDirectory() as scratch:
        user = Path(scratch) / "user"
        user.mkdir()
        subprocess.run([blender, "--command", "extension", "install-file", "-r", "user_default", "--enable",
                        options.zip.resolve()], env=environment(user), check=True)
        screen = Screen(blender)
        window = Window(blender, screen, user, Path(scratch) / "talk")
        try:
            play(window, options, full)
        finally:
            window.close()
            screen.close()
    scale(full, options.out)
    return 0


def play(window: Window, options, full: Path) -> None:
    """The story, with a picture of each step."""
    count = iter(range(1, 100))

    def picture(name: str) -> None:
        path = full / f"{next(count):02d}-{name}.png"
        window.picture(path)
        print(path.name, flush=True)

    result = options.capture.with_name(options.capture.name + "-result")
    window.ask("""
for thing in list(bpy.data.objects):
    bpy.data.objects.remove(thing)
""")
    picture("empty")
    window.ask(f"setattr(bpy.context.scene.scan_relight, 'capture_folder', {str(options.capture)!r})")
    picture("reading")
    window.wait_for("isinstance(module('operators.findings').look(bpy.context.scene.scan_relight), dict)")
    window.ask(f"""
choices = bpy.context.scene.scan_relight
choices.result_folder, choices.preset = {str(result)!r}, {options.preset!r}
""")
    picture("capture")
    window.click("scan_relight.run(", "'recover'", across=(0.5,))
    for stage in ("lit_diffuse", "shading", "specular"):
        window.wait_for(f"{JOB}.stage == {stage!r} or not {JOB}.running", patience=300)
        picture(stage)
    window.wait_for(f"{ACTIVE} is None", patience=600)
    window.ask(f"""
with bpy.context.temp_override(**place()):
    bpy.ops.scan_relight.match_frame("INVOKE_DEFAULT", True, index={options.frame})
    bpy.ops.view3d.view_center_camera()
space = place()["area"].spaces.active
space.overlay.show_extras = space.overlay.show_relationship_lines = space.overlay.show_outline_selected = False
""")
    picture("done")
    x, y = window.ask("find(('scan_relight_row',), across=(0.3,))")
    window.click_at(x, y + 46)
    picture("results")
    window.click("scan_relight.look(", "'ALBEDO'", top=False, across=(0.75,))
    picture("albedo")
    window.click("scan_relight.look(", "'MATERIAL'", top=False, across=(0.25,))
    window.ask("""
shading = place()["area"].spaces.active.shading
shading.use_scene_lights = shading.use_scene_world = True
""")
    picture("material")
    window.click("scan_relight.switch_lamps(", "on=False", top=False, across=(0.75,))
    window.click("scan_relight.add_light(", "'WINDOW'", top=False, across=(0.25,))
    picture("light")
    window.ask("""
with bpy.context.temp_override(**place()):
    bpy.ops.scan_relight.add_virtual("INVOKE_DEFAULT", True, shape="MONKEY", look="GLOSSY", size=0.5)
""")
    picture("object")
    window.click("scan_relight.before_after(", top=False, across=(0.5,))
    window.wait_for(f"{ACTIVE} is not None")
    window.wait_for(f"{ACTIVE} is None", patience=500)
    picture("before-after")


def scale(full: Path, out: Path) -> None:
    """Pictures for the guide: scaled, in few colours; and all of them on one sheet."""
    out.mkdir(parents=True, exist_ok=True)
    small = []
    for path in sorted(full.glob("*.png")):
        with Image.open(path) as picture:
            picture.resize((1000, round(1000 * picture.height / picture.width)), Image.Resampling.LANCZOS).quantize(
                128, dither=Image.Dither.NONE).save(out / path.name.partition("-")[2], optimize=True)
            small.append(picture.convert("RGB").resize((400, round(400 * picture.height / picture.width)),
                                                       Image.Resampling.LANCZOS))
    rows = -(-len(small) // 3)
    sheet = Image.new("RGB", (3 * 404 - 4, rows * (small[0].height + 4) - 4), "white")
    for number, picture in enumerate(small):
        sheet.paste(picture, (number % 3 * 404, number // 3 * (small[0].height + 4)))
    sheet.quantize(128, dither=Image.Dither.NONE).save(out / "sequence.png", optimize=True)


if __name__ == "__main__":
    sys.exit(main())
