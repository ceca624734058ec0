"""What a stage's key follows from: what it declares, and its source."""

from __future__ import annotations

import dataclasses
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from addon.core.io.read import read_capture
from addon.core.pipeline import stage as stage_module
from addon.core.pipeline import stages
from addon.core.pipeline.source import CORE, digest
from addon.core.pipeline.stages import STAGES, Stages
from addon.core.progress import Progress
from addon.core.results.overrides import parse
from addon.core.scene.params import FRAME_CHOICE
from addon.core.settings import PAPER, Settings
from tests.core.on_disk import CHEAP

NAMES = [stage.name for stage in STAGES]
DEFAULT = Settings()
OTHER = {bool: lambda value: not value, int: lambda value: value + 3, float: lambda value: value + 0.5}


@pytest.fixture(scope="module")
def capture(disk):
    return read_capture(disk.root)


def keys(capture, settings: Settings = DEFAULT, **given) -> dict[str, str]:
    run = Stages(capture, None, settings, Progress(), lambda mesh, size: None, **given)
    return run.keys | {"run": run.run_key}


def changed(capture, settings: Settings) -> list[str]:
    before, after = keys(capture), keys(capture, settings)
    return [name for name in before if before[name] != after[name]]


def other_value(field: dataclasses.Field):
    choices = Settings.CHOICES.get(field.name)
    if choices:
        return next(one for one in choices if one != field.default)
    return ("sun",) if field.name == "without" else OTHER[type(field.default)](field.default)


@pytest.mark.parametrize("field", dataclasses.fields(Settings), ids=lambda field: field.name)
def test_no_setting_is_forgotten(capture, field):
    """A changed setting changes the key of its stage and of all after it, so that none of them is taken for done."""
    found = changed(capture, dataclasses.replace(Settings(), **{field.name: other_value(field)}))
    if field.name == "threads":
        assert found == []
    else:
        assert found and found == [*NAMES, "run"][-len(found) :]


@pytest.mark.parametrize(
    "name, first", [("two-sides", 0), ("sharpening", 1), ("sun", 2), ("caustics", 3), ("compensation", 4)]
)
def test_a_pass_left_out_changes_its_stage_and_those_after(capture, name, first):
    assert changed(capture, Settings(without=(name,))) == [*NAMES, "run"][first:]


def test_a_long_video_goes_without_frames_that_add_nothing(capture):
    """Not where that pass is left out, nor in the paper's way."""
    video = dataclasses.replace(capture, frames=capture.frames * (2 * FRAME_CHOICE.enough))
    assert len(video.frames) > FRAME_CHOICE.few

    def taken(settings: Settings) -> int:
        return len(Stages(video, None, settings, Progress(), lambda mesh, size: None).capture.frames)

    assert taken(DEFAULT) < len(video.frames)
    assert taken(Settings(without=("frame-choice",))) == taken(PAPER) == len(video.frames)
    assert changed(video, Settings(without=("frame-choice",))) == [*NAMES, "run"]


def test_what_is_given_of_highlights_changes_the_fit_alone(capture):
    known = {one.object_id for one in capture.instances}
    metal = parse({"objects": {"3": {"model": "metal"}}}, "test", known)
    before, after = keys(capture), keys(capture, overrides=metal)
    assert [name for name in before if before[name] != after[name]] == ["specular", "run"]


def test_a_stage_sees_nothing_that_it_does_not_declare():
    asked = Settings(
        texel_size=0.3, median="mean", specular_rays=7, threads=3, without=("two-sides", "sun", "caustics")
    )
    seen = stages.surface.STAGE.settings(asked)
    assert seen == Settings(texel_size=0.3, threads=3, without=("two-sides",))
    assert stages.shading.STAGE.settings(asked).without == ("two-sides", "sun")
    for one in STAGES:
        assert one.settings(asked).threads == 3


@pytest.fixture
def copy(tmp_path):
    """A copy of the core's source."""
    return Path(shutil.copytree(CORE, tmp_path / "core", ignore=shutil.ignore_patterns("__pycache__")))


def sources(root: Path) -> dict[str, str]:
    return {one.name: digest(root / one.source.relative_to(CORE), root) for one in STAGES}


def test_the_digest_is_the_same_wherever_the_source_lies(copy):
    for path in copy.rglob("*.py"):
        path.write_bytes(path.read_bytes().replace(b"\n", b"\r\n"))
    (copy / "pipeline" / "notes.txt").write_text("no source")
    assert sources(copy) == sources(CORE)


def test_the_source_may_lie_behind_a_link(tmp_path):
    """As an extension that is linked into Blender's folder."""
    link = tmp_path / "link"
    try:
        link.symlink_to(CORE.parent.parent, target_is_directory=True)
    except OSError:
        pytest.skip("no links here")
    told = "from addon.core.pipeline.stages import code; print(code())"
    done = subprocess.run([sys.executable, "-P", "-c", told], env=os.environ | {"PYTHONPATH": str(link)},
                          capture_output=True, text=True, check=True)  # fmt: skip
    assert done.stdout.strip() == stages.code()


@pytest.mark.parametrize(
    "module, concerned",
    [
        ("passes/mesh_denoising/planes.py", NAMES[:1]),
        ("passes/pose_refinement/poses.py", NAMES[1:2]),
        ("passes/sun/sun_fit.py", NAMES[2:3]),
        ("fit/problem.py", NAMES[3:]),
        ("scene/rays.py", NAMES),
        ("io/exr.py", NAMES),  # the surface's texel may come from pictures on the mesh
        ("evidence/page.py", []),
    ],
)
def test_a_changed_source_concerns_the_stages_that_are_made_of_it(copy, module, concerned):
    path = copy / module
    path.write_text(path.read_text() + "\nMORE = 1\n")
    before, after = sources(CORE), sources(copy)
    found = [name for name in NAMES if before[name] != after[name]]
    # What a later stage has in common with an earlier one is in its key already.
    assert found[: len(concerned)] == concerned and bool(found) == bool(concerned)


def test_a_changed_source_is_done_again(disk, tmp_path, monkeypatch):
    first = disk.run(tmp_path / "result", CHEAP)
    assert first.stored == dict.fromkeys(NAMES, False)
    changed = stages.shading.STAGE.source
    monkeypatch.setattr(stage_module, "digest", lambda path: digest(path) + ("changed" if path == changed else ""))
    again = disk.run(tmp_path / "result", CHEAP)
    assert again.stored == {"surface": True, "lit_diffuse": True, "shading": False, "specular": False}
