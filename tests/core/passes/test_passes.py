"""Passes can be left out by name: each name is heeded, and only the stages from its own on are done again."""

from __future__ import annotations

import re
import shutil
from dataclasses import replace
from pathlib import Path

import pytest

import addon.core
from addon.core.errors import BadInputError
from addon.core.passes.registry import PASSES, check, left_out_of
from addon.core.stages import RUN_STAGES, STAGES
from tests.core.on_disk import CHEAP

pytestmark = pytest.mark.usefixtures("few_samples")


def test_every_name_is_heeded_somewhere():
    root = Path(addon.core.__file__).parent
    lines = [line for path in root.rglob("*.py") if path.name != "registry.py" for line in path.read_text().split("\n")]
    heeding = [line for line in lines if re.search(r"\b(in|set\()\s*[\w.]*(without|out)\b", line)]
    assert [one.name for one in PASSES if not any(f'"{one.name}"' in line for line in heeding)] == []


def test_every_pass_says_what_it_does_and_where():
    names = [one.name for one in PASSES]
    assert len(set(names)) == len(names)
    assert all(one.does.endswith(".") and one.stage in RUN_STAGES for one in PASSES)
    assert [RUN_STAGES.index(one.stage) for one in PASSES] == sorted(RUN_STAGES.index(one.stage) for one in PASSES)


def test_an_unknown_name_is_told():
    with pytest.raises(BadInputError, match="no pass 'moon'"):
        check(["sun", "moon"])


def test_only_its_own_stage_has_it_in_its_key():
    assert left_out_of("shading", ("sun", "grazing", "mirrors")) == ("mirrors", "sun")
    assert left_out_of("surface", ("sun",)) == ()


@pytest.mark.slow
def test_stages_before_it_are_taken_from_the_store(disk, tmp_path):
    disk.run(tmp_path / "whole")
    for left_out, kept in (("compensation", 4), ("caustics", 3), ("sun", 2)):
        shutil.copytree(tmp_path / "whole", tmp_path / left_out)
        found = disk.run(tmp_path / left_out, replace(CHEAP, without=(left_out,)))
        assert found.stored == {stage: i < kept for i, stage in enumerate(STAGES)}, left_out


@pytest.mark.slow
@pytest.mark.parametrize("stage", RUN_STAGES)
def test_a_room_is_recovered_without_any_pass_of_a_stage(disk, tmp_path, stage):
    found = disk.run(tmp_path, replace(CHEAP, without=tuple(one.name for one in PASSES if one.stage == stage)))
    assert 0 < found.albedo.rho.max() <= 1
