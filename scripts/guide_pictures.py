"""Plays the guide in Blender's window and takes its pictures: the tests' own story, on a real scan.

    BLENDER=... .venv/bin/python scripts/guide_pictures.py CAPTURE --zip dist/scan_relight-...zip [--home FOLDER]

CAPTURE is dragged in under its own path, which the pictures show. The home folder of the artist, with the result and
the files recovered.blend, relit.blend and room.blend, is temporary unless given. Whole pictures go to build/guide,
those of docs/guide.md, cut to what the text speaks of, to docs/images/guide. The count of what the hand did is printed.

Only two steps differ from what a reader does: buttons are looked for in Solid shading, as the search moves the mouse
over every one of them, and a picture is taken once the Rendered viewport has had time.
"""

import argparse
import os
import shutil
import sys
import tempfile
import time
from pathlib import Path

from PIL import Image

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT))

from tests.window import driver  # noqa: E402
from tests.window.driver import Screen, Window, missing  # noqa: E402
from tests.window.story import ACTIVE, JOB, Story  # noqa: E402

SIZE = 1360, 1240
"""Most of the sidebar at once."""
UPPER, TALL = (0, 0, 1120, 880), (0, 0, 1120, 1130)
"""Parts of the window, without the properties."""
PARTS = {
    "install": UPPER,
    "drag": UPPER,
    "progress": (840, 330, 1120, 640),
    "recovered": UPPER,
    "relit": TALL,
    "results": (840, 60, 1120, 640),
    "metal": UPPER,
}
"""The pictures that the guide shows, and which part of the window."""
QUALITY = 88


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("capture", type=Path)
    parser.add_argument("--zip", type=Path, required=True)
    parser.add_argument("--home", type=Path)
    parser.add_argument("--metal", default="TableWood 59", help="object that is called metal")
    parser.add_argument("--wait", type=float, default=60.0, help="seconds that a Rendered viewport is given")
    parser.add_argument("--out", type=Path, default=ROOT / "docs" / "images" / "guide")
    options = parser.parse_args()
    blender = os.environ.get("BLENDER")
    if reason := missing(blender):
        sys.exit(f"The window can't be shown here: {reason}.")
    full = ROOT / "build" / "guide"
    shutil.rmtree(full, ignore_errors=True)
    driver.SIZE = SIZE
    with tempfile.TemporaryDirectory() as scratch:
        home = options.home or Path(scratch) / "home"
        home.mkdir(exist_ok=True)
        screen = Screen(blender)
        window = Window(blender, screen, home, Path(scratch) / "talk", tab=False)
        try:
            play(Story(window, patience=1500.0), options, home, full)
        finally:
            window.close()
            screen.close()
            (full / "blender.log").write_text(window.log, encoding="utf-8")
        cut(full, options.out)


def play(story: Story, options, home: Path, full: Path) -> None:
    """The story, with a picture of each step."""
    window = story.window

    def picture(name: str, rendered: bool = False) -> None:
        if rendered:
            shade(window, "RENDERED")
            time.sleep(options.wait)
        window.picture(full / f"{name}.png")
        shade(window, "SOLID")
        print(f"{name}: {len(window.actions)} actions so far", flush=True)

    story.drag_zip_in(options.zip)
    picture("install")
    story.agree()
    window.actions.clear()  # counted from the startup file with the extension installed
    story.drag_in(options.capture)
    window.wait_for("isinstance(module('operators.recover.findings').look(bpy.context.scene.scan_relight), dict)")
    story.popup()
    picture("drag")
    story.run()
    window.wait_for(f"{JOB}.stage in ('shading', 'specular') and {JOB}.running or {ACTIVE} is None", patience=600)
    time.sleep(5)
    picture("progress")
    story.finished()
    window.wait_for("isinstance(module('operators.recover.findings').look(bpy.context.scene.scan_relight), dict)")
    picture("recovered", rendered=True)
    window.ask(f"bpy.ops.wm.save_as_mainfile(filepath={str(home / 'recovered.blend')!r}, copy=True)")
    story.lamp_off()
    story.softbox()
    story.expose()
    picture("relit", rendered=True)
    window.ask(f"bpy.ops.wm.save_as_mainfile(filepath={str(home / 'relit.blend')!r}, copy=True)")
    story.render_both()
    story.close_picture()
    print(f"a render of it: {len(window.actions)} actions so far", flush=True)
    story.choose_in_view(options.metal)
    window.ask("scroll(-100000)")
    picture("results")
    story.this_is_metal()
    picture("metal", rendered=True)
    story.save_as(home / "room.blend")
    pair = next(home.rglob("before_after.png"))
    shutil.copyfile(pair, full / "pair.png")


def shade(window: Window, kind: str) -> None:
    """The viewport's shading."""
    window.ask(f"setattr(place()['area'].spaces.active.shading, 'type', {kind!r})")


def cut(full: Path, out: Path) -> None:
    """Pictures for the guide: what they show, in full colour."""
    shutil.rmtree(out, ignore_errors=True)
    out.mkdir(parents=True)
    for name, part in {**PARTS, "pair": None}.items():
        with Image.open(full / f"{name}.png") as picture:
            picture.convert("RGB").crop(part or (0, 0, *picture.size)).save(
                out / f"{name}.jpg", quality=QUALITY, subsampling=0, optimize=True
            )


if __name__ == "__main__":
    main()
