"""The built zip, installed into a real Blender that shows its window; where there is none, all of this is skipped."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from tests.window.driver import Screen, Window, environment, missing

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture(scope="session")
def blender() -> str:
    """The executable that is tested."""
    found = os.environ.get("BLENDER")
    if reason := missing(found):
        pytest.skip(f"the window is not tested: {reason}")
    return found


@pytest.fixture(scope="session")
def pictures() -> Path:
    """Where screenshots and figures go."""
    folder = Path(os.environ.get("WINDOW_PICTURES", ROOT / "build" / "window"))
    folder.mkdir(parents=True, exist_ok=True)
    return folder


@pytest.fixture(scope="session")
def figures(pictures):
    """A dictionary of what was measured; written to figures.json beside the pictures."""
    found: dict = {}
    yield found
    (pictures / "figures.json").write_text(json.dumps(found, indent=1))


@pytest.fixture(scope="session")
def archive(blender, tmp_path_factory) -> Path:
    """The zip for this Blender's Python: from the folder that SCAN_RELIGHT_DIST names, or a fresh one."""
    asked = "import sys; print('PYTHON', *sys.version_info[:2])"
    told = subprocess.run(
        [blender, "--background", "--factory-startup", "--python-expr", asked],
        env=environment(tmp_path_factory.mktemp("bare")),
        capture_output=True,
        text=True,
        check=True,
    )
    version = next(line for line in told.stdout.splitlines() if line.startswith("PYTHON")).split()[1:]
    if given := os.environ.get("SCAN_RELIGHT_DIST"):
        return next(Path(given).resolve().glob(f"*-linux_x64-py{''.join(version)}.zip"))
    out = tmp_path_factory.mktemp("dist")
    command = [sys.executable, ROOT / "scripts" / "build_extension.py", "--platform", "linux-x64"]
    subprocess.run([*command, "--python", ".".join(version), "--out", out], check=True, capture_output=True)
    return next(out.glob("*.zip"))


@pytest.fixture(scope="session")
def user(blender, archive, tmp_path_factory) -> Path:
    """A user's folder into which Blender's own command line has installed the zip."""
    folder = tmp_path_factory.mktemp("user")
    told = subprocess.run(
        [blender, "--command", "extension", "install-file", "-r", "user_default", "--enable", str(archive)],
        env=environment(folder),
        capture_output=True,
        text=True,
    )
    assert told.returncode == 0 and "Installed" in told.stdout, told.stdout + told.stderr
    return folder


@pytest.fixture(scope="session")
def screen(blender):
    """The screen that all windows open on, one after the other."""
    found = Screen(blender)
    yield found
    found.close()


@pytest.fixture(scope="session")
def open_window(blender, screen, user, tmp_path_factory):
    """Opens a window; at the end of whoever asks it has to be closed."""

    def opened(*arguments, user: Path = user, tab: bool = True) -> Window:
        return Window(blender, screen, user, tmp_path_factory.mktemp("window") / "talk", *arguments, tab=tab)

    return opened


@pytest.fixture(scope="module")
def window(open_window):
    """One window for all tests of a module, which tell one story."""
    found = open_window()
    yield found
    found.close()


@pytest.fixture(scope="session")
def recovered(blender, user, tiny_capture, tmp_path_factory) -> Path:
    """The result of the installed extension's command line, without a window."""
    out = tmp_path_factory.mktemp("command") / "result"
    told = subprocess.run(
        [
            blender,
            "--background",
            "--command",
            "scan_relight",
            "recover",
            str(tiny_capture),
            "--out",
            str(out),
            "--preset",
            "draft",
            "--shading-rays",
            "256",
        ],
        env=environment(user),
        capture_output=True,
        text=True,
    )
    assert told.returncode == 0, told.stdout + told.stderr
    return out
