"""Build the installable zips, one for each platform and Python, with Blender's own extension builder.

    .venv/bin/python scripts/build_extension.py [--platform linux-x64 ...] [--python 3.11 ...] [--together] [--out dist]

The names of its wheels tell Blender which Python a zip is for: Blender refuses the others, and one repository may offer
them all under one id (`blender --command extension server-generate` takes them as they are). `--together` puts the
wheels of all Pythons into one zip for each platform, for places that take one archive for a platform.

Fetches into wheels/ exactly the wheels that blender_manifest.toml lists and requirements/ pins by hash; a wheel that
is there already is checked, not fetched again.
"""

import argparse
import hashlib
import importlib.util
import os
import re
import shutil
import subprocess
import sys
import tempfile
import tomllib
from pathlib import Path

from manual_pages import write_pages

ROOT = Path(__file__).resolve().parent.parent
LOCKS = tuple(ROOT / "requirements" / name for name in ("blender-5.2.txt", "extension.txt"))
WHEELS = ROOT / "wheels"
CONTENT = ("__init__.py", "LICENSE", "README.md", "CHANGELOG.md", "addon", "operators")
"""What goes into the zip, besides the manifest and the wheels."""
LEFT_OUT = "addon/farm"
"""What does not: it is of no use in Blender's window, and it connects to render managers over the network."""
PLATFORMS = {
    "linux-x64": ("manylinux_2_28_x86_64", r"manylinux.*x86_64"),
    "windows-x64": ("win_amd64", r"win_amd64"),
    "macos-arm64": ("macosx_14_0_arm64", r"macosx.*arm64"),
    "macos-x64": ("macosx_13_0_x86_64", r"macosx.*x86_64"),
}
"""What pip calls a platform, and what its wheels' names end with."""


def main() -> None:
    manifest = tomllib.loads((ROOT / "blender_manifest.toml").read_text(encoding="utf-8"))
    pythons = sorted({python_of(wheel) for wheel in manifest["wheels"]})
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--platform", action="append", choices=manifest["platforms"], help="default: all")
    parser.add_argument("--python", action="append", choices=pythons, help="default: all")
    parser.add_argument("--together", action="store_true", help="one zip for all these Pythons")
    parser.add_argument("--out", type=Path, default=ROOT / "dist")
    arguments = parser.parse_args()
    builder = blender_ext()
    hashes = locked_hashes({Path(wheel).name.split("-")[0].lower() for wheel in manifest["wheels"]})
    arguments.out.mkdir(parents=True, exist_ok=True)
    chosen = sorted(set(arguments.python or pythons))
    for platform in arguments.platform or manifest["platforms"]:
        for versions in [chosen] if arguments.together else [[version] for version in chosen]:
            wheels = [
                Path(wheel).name
                for wheel in manifest["wheels"]
                if re.search(PLATFORMS[platform][1] + r"\.whl$", wheel) and python_of(wheel) in versions
            ]
            fetch(platform, wheels, hashes)
            name = f"{manifest['id']}-{manifest['version']}-{platform.replace('-', '_')}"
            if not arguments.together:
                name += f"-py{versions[0].replace('.', '')}"
            archive = arguments.out / f"{name}.zip"
            with tempfile.TemporaryDirectory() as scratch:
                stage(Path(scratch), platform, set(wheels))
                command = [sys.executable, builder, "build", "--source-dir", scratch]
                subprocess.run([*command, "--output-filepath", archive.resolve()], check=True)
            print(f"{archive}  {archive.stat().st_size / 1e6:.1f} MB")


def python_of(wheel: str) -> str:
    """Python that a wheel of the manifest is for, such as "3.11"."""
    tag = Path(wheel).name.split("-")[2]
    return f"{tag[2]}.{tag[3:]}"


def blender_ext() -> Path:
    """Blender's extension builder, which also runs under plain Python."""
    bpy = importlib.util.find_spec("bpy")
    builders = sorted(Path(bpy.origin).parent.glob("*/scripts/addons_core/bl_pkg/cli/blender_ext.py")) if bpy else []
    if not builders:
        sys.exit(
            "This Python has no bpy, which brings the extension builder; run it as: "
            ".venv/bin/python scripts/build_extension.py"
        )
    return builders[-1]


def locked_hashes(packages: set[str]) -> dict[str, tuple[str, set[str]]]:
    """Each package's pinned requirement and its allowed hashes."""
    locked = {}
    locks = "".join(path.read_text(encoding="utf-8") for path in LOCKS)
    for block in re.split(r"^(?=\S)", locks, flags=re.MULTILINE):
        requirement = block.split(" ")[0]
        name = requirement.split("==")[0]
        if name in packages:
            locked[name] = requirement, set(re.findall(r"--hash=sha256:([0-9a-f]{64})", block))
    if missing := packages - set(locked):
        sys.exit(f"{' and '.join(path.name for path in LOCKS)} do not pin {', '.join(sorted(missing))}.")
    return locked


def fetch(platform: str, names: list[str], hashes: dict[str, tuple[str, set[str]]]) -> None:
    """Download the wheels of `names` into wheels/, unless they are there with an allowed hash."""
    WHEELS.mkdir(exist_ok=True)
    for name in names:
        package = name.split("-")[0]
        requirement, allowed = hashes[package]
        wheel = WHEELS / name
        if not (wheel.is_file() and sha256(wheel) in allowed):
            wheel.unlink(missing_ok=True)
            with tempfile.TemporaryDirectory() as scratch:
                # Hashes are taken from a requirements file alone.
                lines = [requirement, *(f"--hash=sha256:{value}" for value in sorted(allowed))]
                (Path(scratch) / "wheel.txt").write_text(" ".join(lines) + "\n")
                pip = [sys.executable, "-m", "pip", "--disable-pip-version-check", "download", "--quiet", "--no-deps"]
                only = ["--only-binary=:all:", "--require-hashes", "--platform", PLATFORMS[platform][0]]
                request = ["--python-version", python_of(name), "-r", Path(scratch) / "wheel.txt", "--dest", WHEELS]
                subprocess.run([*pip, *only, *request], check=True)
        if not wheel.is_file():
            sys.exit(f"pip fetched another wheel of {requirement} than the manifest's {name}; mend the manifest.")


def sha256(path: Path) -> str:
    with open(path, "rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def stage(folder: Path, platform: str, wheels: set[str]) -> None:
    """Copy the zip's content into `folder`, with a manifest that names only `platform` and `wheels`."""
    ignored = shutil.ignore_patterns("__pycache__", "*.pyc", ".*")
    for name in CONTENT:
        source = ROOT / name
        if source.is_dir():
            shutil.copytree(source, folder / name, ignore=ignored)
        else:
            shutil.copy2(source, folder / name)
    shutil.rmtree(folder / LEFT_OUT)
    write_pages(ROOT / "docs", folder / "docs")
    (folder / "wheels").mkdir()
    for name in sorted(wheels):
        try:
            os.link(WHEELS / name, folder / "wheels" / name)
        except OSError:
            shutil.copy2(WHEELS / name, folder / "wheels" / name)
    text = (ROOT / "blender_manifest.toml").read_text(encoding="utf-8")
    lines = [line for line in text.splitlines() if ".whl" not in line or line.strip(' ",').split("/")[-1] in wheels]
    text = re.sub(r"^platforms = .*$", f'platforms = ["{platform}"]', "\n".join(lines), flags=re.MULTILINE)
    (folder / "blender_manifest.toml").write_text(text + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
