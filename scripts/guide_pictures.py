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
import time
from pathlib import Path

from PIL import Image

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT))

from tests.window import driver  # noqa: E402
from tests.window.driver import Screen, Window, environment, missing  # noqa: E402

SIZE = 1360, 1240
"""The whole sidebar at once."""
BAR = 560, 60, 1120, 960
KEPT = {"empty": None, "capture": BAR, "shading": BAR, "done": None, "results": (300, 60, 1120, 1140), "albedo": None,
        "light": None, "object": None}
"""The steps that the guide shows, and the part of the window."""
LARGEST = 149_000
TILE = 212
"""Width of a picture on the sheet."""
JOB = "module('addon.bridge.job').current()"
ACTIVE = "module('operators.job_operator').active()"


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
    driver.SIZE = SIZE
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
    with Image.open(options.capture.with_name(options.capture.name + "-result") / "before_after.png") as pair:
        save(pair.convert("RGB"), options.out / "relit.png")
    return 0


def play(window: Window, options, full: Path) -> None:
    """The story, with a picture of each step."""
    count = iter(range(1, 100))

    def picture(name: str) -> None:
        path = full / f"{next(count):02d}-{name}.png"
        window.picture(path)
        print(path.name, flush=True)

    recover(window, options, picture)
    relight(window, picture)


def recover(window: Window, options, picture) -> None:
    """From an empty scene to the recovered room, seen through a frame's camera."""
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
    look_through(window, options.frame)
    picture("done")


def look_through(window: Window, frame: int) -> None:
    """Through a frame's camera, without the signs for cameras and lamps."""
    window.ask(f"""
bpy.context.scene.scan_relight_studio.show_frame = False
with bpy.context.temp_override(**place()):
    bpy.ops.scan_relight.match_frame("INVOKE_DEFAULT", True, index={frame})
    bpy.ops.view3d.view_center_camera()
space = place()["area"].spaces.active
space.overlay.show_extras = space.overlay.show_relationship_lines = space.overlay.show_outline_selected = False
space.overlay.show_floor = space.overlay.show_axis_x = space.overlay.show_axis_y = False
""")


def relight(window: Window, picture) -> None:
    """What was found, then another light."""
    x, y = window.ask("find(('scan_relight_row',), across=(0.3,))")
    window.click_at(x, y + 46)
    picture("results")
    window.click("scan_relight.look(", "'ALBEDO'", top=False, across=(0.75,))
    compiled(window)
    picture("albedo")
    window.click("scan_relight.look(", "'MATERIAL'", top=False, across=(0.25,))
    window.ask("""
shading = place()["area"].spaces.active.shading
shading.use_scene_lights = shading.use_scene_world = True
""")
    compiled(window)
    picture("material")
    window.click("scan_relight.switch_lamps(", "on=False", top=False, across=(0.75,))
    window.click("scan_relight.add_light(", "'WINDOW'", top=False, across=(0.25,))
    compiled(window)
    picture("light")
    window.ask("""
with bpy.context.temp_override(**place()):
    bpy.ops.scan_relight.add_virtual("INVOKE_DEFAULT", True, shape="MONKEY", look="GLOSSY", size=0.5)
""")
    compiled(window)
    picture("object")
    window.click("scan_relight.before_after(", top=False, across=(0.5,))
    window.wait_for(f"{ACTIVE} is not None")
    window.wait_for(f"{ACTIVE} is None", patience=500)
    picture("before-after")


def compiled(window: Window, patience: float = 150.0) -> None:
    """Wait until the viewport has its shaders: until two pictures of it, some seconds apart, are alike."""
    time.sleep(45.0)  # nothing moves while it is at it
    until, last = time.monotonic() + patience, None
    while time.monotonic() < until:
        now = window.picture().crop((0, 200, 700, SIZE[1] - 200)).tobytes()
        if now == last:
            return
        last = now
        time.sleep(4.0)


def scale(full: Path, out: Path) -> None:
    """Pictures for the guide: cut to what they show, scaled, in few colours; and every step on one sheet."""
    out.mkdir(parents=True, exist_ok=True)
    small = []
    for path in sorted(full.glob("*.png")):
        with Image.open(path) as picture:
            picture = picture.convert("RGB")
            name = path.stem.partition("-")[2]
            if name in KEPT:
                part = picture.crop(KEPT[name] or (0, 0, *picture.size))
                width = min(part.width, 860)
                save(part.resize((width, round(width * part.height / part.width)), Image.Resampling.LANCZOS),
                     out / f"{name}.png")
            size = TILE, round(TILE * picture.height / picture.width)
            small.append(picture.resize(size, Image.Resampling.LANCZOS))
    rows = -(-len(small) // 4)
    sheet = Image.new("RGB", (4 * (TILE + 4) - 4, rows * (small[0].height + 4) - 4), "white")
    for number, picture in enumerate(small):
        sheet.paste(picture, (number % 4 * (TILE + 4), number // 4 * (small[0].height + 4)))
    save(sheet, out / "sequence.png")


def save(picture: Image.Image, path: Path) -> None:
    """In as many colours as `LARGEST` bytes allow."""
    for colours in (128, 64, 40, 24):
        picture.quantize(colours, dither=Image.Dither.NONE).save(path, optimize=True)
        if path.stat().st_size <= LARGEST:
            return


if __name__ == "__main__":
    sys.exit(main())
