"""One command for the tests in a real window: finds a Blender, builds the zip, installs it and plays tests/window.

    python3.11 scripts/window_tests.py [--required] [what pytest takes]

Takes the Blender that BLENDER names, else the one on the PATH, else makes one (scripts/make_blender.sh: root, a Debian
or Ubuntu machine). Where there is none it says so and ends with 0, or with 3 where --required is given. Screenshots and
figures are left in build/window.
"""

from __future__ import annotations

import importlib.util
import os
import shutil
import subprocess
import sys

from environment import ROOT, hand_over, prepare

MAKING = 360
"""Seconds that making a Blender may take."""
SKIPPED = 3


def main() -> int:
    arguments = sys.argv[1:]
    required = "--required" in arguments
    arguments = [word for word in arguments if word != "--required"]
    blender, reason = find_blender()
    if blender is None:
        print(f"SKIPPED: THE WINDOW IS NOT TESTED HERE: {reason}")
        return SKIPPED if required else 0
    os.environ["BLENDER"] = blender
    shutil.rmtree(ROOT / "build" / "window", ignore_errors=True)
    python = sys.executable if running_inside() else str(prepare(tools=True))
    if not any("tests/window" in word for word in arguments):
        arguments = ["tests/window", *arguments]
    return hand_over([python, "-m", "pytest", *arguments])


def running_inside() -> bool:
    """Whether this Python is an environment that has the test tools already."""
    return sys.prefix != sys.base_prefix and importlib.util.find_spec("pytest") is not None


def find_blender() -> tuple[str | None, str]:
    """The executable, or None and the reason."""
    blender = os.environ.get("BLENDER") or shutil.which("blender")
    if blender:
        return (blender, "") if shutil.which(blender) else (None, f"BLENDER names '{blender}', which can't be run")
    if sys.platform != "linux":
        return None, "set BLENDER to Blender's executable"
    print("There is no Blender on the PATH; making one (four minutes the first time) ...", file=sys.stderr, flush=True)
    try:
        result = subprocess.run([ROOT / "scripts" / "make_blender.sh"], capture_output=True, text=True, timeout=MAKING)
    except subprocess.TimeoutExpired:
        return None, f"making a Blender took more than {MAKING} s"
    if result.returncode:
        errors = result.stderr.strip().splitlines() or ["it left no word"]
        return None, f"no Blender could be made ({errors[-1]})"
    return result.stdout.strip().splitlines()[-1], ""


if __name__ == "__main__":
    sys.exit(main())
