"""The built zip: what is in it, and that Blender installs, enables and runs it under its installed name."""

from __future__ import annotations

import json
import os
import platform
import subprocess
import sys
import tomllib
import zipfile
from pathlib import Path

import pytest

pytest.importorskip("bpy")

PLATFORMS = {
    ("Linux", "x86_64"): "linux-x64",
    ("Windows", "AMD64"): "windows-x64",
    ("Darwin", "arm64"): "macos-arm64",
    ("Darwin", "x86_64"): "macos-x64",
}
INSTALLED = """
import importlib, sys
from pathlib import Path
import bpy

archive, capture = sys.argv[-2:]
bpy.ops.extensions.package_install_files(filepath=archive, repo="user_default", enable_on_install=True)
name = "bl_ext.user_default.scan_relight"
assert name in bpy.context.preferences.addons, list(bpy.context.preferences.addons.keys())
resources = Path(bpy.utils.resource_path("USER"))
# Blender looks here first; pip's bpy looks into its own environment first, which has the same packages.
[local] = (resources / "extensions" / ".local" / "lib").glob("python*/site-packages")
assert str(local) in sys.path
sys.path.insert(0, str(local))
for package in ("scipy", "embreex", "OpenEXR"):
    where = Path(importlib.import_module(package).__file__)
    assert resources in where.parents, f"{package} comes from {where}, not from the zip"
import numpy
assert resources not in Path(numpy.__file__).parents
assert bpy.ops.scan_relight.import_capture(capture_folder=capture) == {"FINISHED"}
assert sum("object_id" in thing for thing in bpy.context.scene.objects) == 15
try:
    bpy.ops.scan_relight.recover(capture_folder=capture + "-not-there", result_folder=capture + "-result")
except RuntimeError as error:
    assert "not-there" in str(error), error
else:
    raise AssertionError("a missing capture was not told")
handler = importlib.import_module(name + ".addon.cli").main
assert handler(["info", capture]) == 0
assert handler(["info", capture + "-not-there"]) == 2
import addon_utils
assert hasattr(bpy.types, "SCAN_RELIGHT_OT_recover")
addon_utils.disable(name)
assert not hasattr(bpy.types, "SCAN_RELIGHT_OT_recover")
addon_utils.enable(name)
assert hasattr(bpy.types, "SCAN_RELIGHT_OT_recover")
print("INSTALLED AND RUN")
"""
REFUSED = """
import sys
import bpy
try:
    bpy.ops.extensions.package_install_files(filepath=sys.argv[-1], repo="user_default", enable_on_install=True)
except RuntimeError as error:
    print("REFUSED:", error)
"""


PYTHON = f"{sys.version_info[0]}.{sys.version_info[1]}"


@pytest.fixture(scope="module")
def dist(root, tmp_path_factory) -> Path:
    """Where the zips lie: the folder that SCAN_RELIGHT_DIST names, or a fresh one with the zip of this Python."""
    if given := os.environ.get("SCAN_RELIGHT_DIST"):
        return Path(given).resolve()
    key = platform.system(), platform.machine()
    if key not in PLATFORMS:
        pytest.skip(f"no wheels for {' '.join(key)}")
    out = tmp_path_factory.mktemp("dist")
    command = [sys.executable, root / "scripts" / "build_extension.py", "--platform", PLATFORMS[key]]
    subprocess.run([*command, "--python", PYTHON, "--out", out], check=True)
    return out


@pytest.fixture(scope="module")
def archive(dist) -> Path:
    """The zip for this Python."""
    return next(dist.glob(f"*-py{PYTHON.replace('.', '')}.zip"))


@pytest.fixture(scope="module")
def cli() -> Path:
    """Blender's own command for extensions."""
    import bpy

    return next(Path(bpy.utils.system_resource("SCRIPTS")).glob("addons_core/bl_pkg/cli/blender_ext.py"))


def install(script: str, tmp_path: Path, *arguments) -> subprocess.CompletedProcess:
    """Runs `script` in a Blender whose user has no folder yet."""
    environment = {key: value for key, value in os.environ.items() if not key.startswith(("BLENDER_", "PYTHONPATH"))}
    environment["BLENDER_USER_RESOURCES"] = str(tmp_path)
    command = [sys.executable, "-c", script, *arguments]
    return subprocess.run(command, env=environment, cwd=tmp_path, capture_output=True, text=True)


@pytest.mark.slow
def test_content(archive, root):
    with zipfile.ZipFile(archive) as content:
        names = content.namelist()
        manifest = tomllib.loads(content.read("blender_manifest.toml").decode())
    code = [name for name in names if not name.endswith(".whl")]
    assert {"__init__.py", "LICENSE", "addon/cli/__init__.py", "operators/recover/stages.py"} <= set(code)
    assert {name.split("/")[0] for name in code} == {
        "__init__.py",
        "LICENSE",
        "README.md",
        "CHANGELOG.md",
        "blender_manifest.toml",
        "addon",
        "operators",
        "docs",
    }
    wheels = {name for name in names if name.endswith(".whl")}
    assert wheels == {wheel.removeprefix("./") for wheel in manifest["wheels"]}
    assert {name.split("-")[2] for name in wheels} == {f"cp{PYTHON.replace('.', '')}"}
    assert not any("numpy" in name for name in wheels)
    assert not any("__pycache__" in name for name in names)
    assert {"docs/panel.html", "docs/guide.html", "docs/images/guide/recovered.jpg"} <= set(names)
    tracked = {
        path.relative_to(root).as_posix() for part in ("addon", "operators") for path in (root / part).rglob("*.py")
    }
    farm = {name for name in tracked if name.startswith("addon/farm/")}
    assert farm and tracked - farm <= set(code)
    assert not [name for name in names if "farm" in name and not name.startswith("docs/")]


def test_blender_takes_it_as_valid(archive, cli):
    done = subprocess.run([sys.executable, cli, "validate", archive], capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr


@pytest.mark.slow
def test_installs_enables_and_runs(archive, grey_capture, tmp_path):
    done = install(INSTALLED, tmp_path, archive, grey_capture)
    assert done.returncode == 0 and "INSTALLED AND RUN" in done.stdout, done.stdout + done.stderr


def test_the_zip_for_another_python_is_refused(dist, archive, tmp_path):
    others = sorted(set(dist.glob("*.zip")) - {archive})
    if not others:
        pytest.skip("no other zip was built")
    done = install(REFUSED, tmp_path, others[0])
    assert "REFUSED: Error: Extension bl_ext.user_default.scan_relight is incompatible" in done.stdout, done.stdout
    assert f"This Python version ({PYTHON}) isn't compatible" in done.stdout


def test_one_repository_offers_all_of_them(dist, cli, tmp_path):
    for archive in dist.glob("*.zip"):
        (tmp_path / archive.name).symlink_to(archive)
    done = subprocess.run(
        [sys.executable, cli, "server-generate", "--repo-dir", tmp_path], capture_output=True, text=True
    )
    assert done.returncode == 0 and "WARN" not in done.stdout.upper(), done.stdout + done.stderr
    offered = json.loads((tmp_path / "index.json").read_text())["data"]
    named = [(*one["platforms"], *one["python_versions"]) for one in offered]
    assert len(set(named)) == len(named) == len(list(dist.glob("*.zip")))
    assert all(len(name) == 2 for name in named) and PYTHON in {python for _, python in named}
