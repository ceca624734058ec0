"""A capture whose names are traps: what comes of it in report.html and in the .blend."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from tests.hostile.kills import OPTIONS
from tests.hostile.load import boxes, write

bpy = pytest.importorskip("bpy")
TRAPS = (
    "<script>alert(1)</script>",
    "#frame; __import__('os').system('touch /tmp/trap')",
    "../../../../etc/passwd",
    "//../outside",
    '" onload="alert(1)',
)


@pytest.mark.slow
@pytest.mark.once
def test_names_are_only_names(tmp_path):
    from addon.cli import main

    capture = write(tmp_path / "capture", boxes(len(TRAPS)), 8, (48, 36))
    objects = [{"id": i, "class_name": name} for i, name in enumerate(TRAPS)]
    (capture / "info_semantic.json").write_text(json.dumps({"objects": objects}))
    options = [one for one in OPTIONS if one not in ("--no-scene", "--unwrap", "own")]
    assert main(["recover", str(capture), "--out", str(tmp_path / "result"), "--atlas", "object", *options]) == 0
    page = (tmp_path / "result/report.html").read_text(encoding="utf-8")
    assert "<script" not in page and "onload=" not in page.replace("&quot; onload=", "")
    assert {one.name for one in tmp_path.iterdir()} == {"capture", "result"}
    written = sorted(one for one in (tmp_path / "result").rglob("*") if one.is_file())
    assert all(one.resolve().is_relative_to(tmp_path / "result") for one in written)

    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "result/scene.blend"), use_scripts=False)
    assert len(bpy.data.texts) == 0
    names = {thing.name for thing in bpy.data.objects if thing.type == "MESH"}
    assert any(name.startswith("<script>") for name in names)
    for kind in ("objects", "meshes", "materials", "worlds", "scenes", "cameras", "lights", "node_groups"):
        for one in getattr(bpy.data, kind):
            for owner in filter(None, (one, getattr(one, "node_tree", None))):
                animation = owner.animation_data
                assert animation is None or not len(animation.drivers), one.name
    for image in bpy.data.images:
        if image.source in ("FILE", "TILED"):
            path = Path(bpy.path.abspath(image.filepath)).resolve()
            assert image.filepath.startswith("//") and path.is_relative_to(tmp_path / "result"), image.filepath
