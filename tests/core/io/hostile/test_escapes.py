"""No file of a capture makes the reader look outside of the capture's folder, or run what it holds."""

from __future__ import annotations

import json
import re
import shutil
from pathlib import Path

import pytest

from addon.core.errors import BadInputError
from addon.core.io.layout import Reading
from addon.core.io.read import read_capture
from tests.core.io.colmap_files import write_text
from tests.core.io.hostile.cases import COUNT, Case, colmap, fresh, nerfstudio

OUT = (
    "../secret.exr",
    "images/../../secret.exr",
    "/etc/passwd",
    "C:\\secret.exr",
    "C:secret.exr",
    "..\\secret.exr",
    "\\\\host\\share\\a.exr",
    "//host/share/a.exr",
    "\\secret.exr",
)


@pytest.fixture
def root(tmp_path):
    (tmp_path / "capture").mkdir()
    return tmp_path / "capture"


@pytest.mark.parametrize("path", OUT)
@pytest.mark.parametrize("key", ["file_path", "mask_path", "brackets"])
def test_poses(root, key, path):
    fresh(Case("", nerfstudio, "transforms.json"), root)
    value = [{"file_path": path, "exposure": 2}] if key == "brackets" else path
    poses = root / "transforms.json"
    content = json.loads(poses.read_text())
    content["frames"][1][key] = value
    poses.write_text(json.dumps(content))
    with pytest.raises(BadInputError, match="leads out"):
        read_capture(root)


@pytest.mark.parametrize("path", OUT)
def test_colmap(root, path):
    fresh(Case("", colmap(write_text), "sparse/0/images.txt"), root)
    images = root / "sparse/0/images.txt"
    images.write_text(images.read_text().replace("001.exr", path))
    with pytest.raises(BadInputError, match="leads out"):
        read_capture(root)


@pytest.mark.parametrize("folder", [False, True])
def test_links_that_lead_out(root, tmp_path, folder):
    fresh(Case("", nerfstudio, "images/002.exr"), root)
    try:
        if folder:
            shutil.move(root / "images", tmp_path / "elsewhere")
            (root / "images").symlink_to(tmp_path / "elsewhere")
        else:
            shutil.move(root / "images/002.exr", tmp_path / "secret.exr")
            (root / "images/002.exr").symlink_to(tmp_path / "secret.exr")
    except OSError as error:
        pytest.skip(f"this system makes no links: {error}")
    with pytest.raises(BadInputError, match="link.*leads out.*--outside"):
        read_capture(root)
    assert len(read_capture(root, Reading(outside=True)).frames) == COUNT - 1


def test_links_within(root):
    fresh(Case("", nerfstudio, "images/002.exr"), root)
    try:
        shutil.move(root / "images/002.exr", root / "other.exr")
        (root / "images/002.exr").symlink_to("../other.exr")
        root.with_name("by_link").symlink_to(root)
    except OSError as error:
        pytest.skip(f"this system makes no links: {error}")
    assert len(read_capture(root).frames) == len(read_capture(root.with_name("by_link")).frames) == COUNT - 1


def test_nothing_is_unpickled_or_run():
    core = Path(__file__).resolve().parents[4] / "addon" / "core"
    wrong = re.compile(
        r"\b(pickle|marshal|shelve|dill|joblib|yaml)\b|allow_pickle\s*=\s*True|\beval\(|\bexec\("
        r"|__import__|os\.system|subprocess|np\.load\((?!.*allow_pickle=False)"
    )
    found = [
        f"{path.relative_to(core)}:{number}: {line.strip()}"
        for path in sorted(core.rglob("*.py"))
        for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), 1)
        if wrong.search(line)
    ]
    assert not found, found
