"""A result folder that somebody changed: no stored array is believed that is not as it was written."""

from __future__ import annotations

import shutil

import pytest

from addon.core.errors import BadInputError
from addon.core.io.read import read_capture
from addon.core.results.room_file import MATERIALS, ROOM, read_room, write_room
from addon.core.results.store import Store
from addon.core.stages import STAGES
from tests.core.results.tampering import ways

pytestmark = pytest.mark.usefixtures("few_samples")


@pytest.fixture(scope="module")
def finished(disk, tmp_path_factory):
    folder = tmp_path_factory.mktemp("finished") / "result"
    disk.run(folder)
    write_room(folder, read_capture(disk.root))
    return folder


@pytest.mark.parametrize("stage", STAGES)
def test_each_array_of_each_stage(finished, stage):
    path = finished / "stages" / f"{stage}.npz"
    good = path.read_bytes()
    with Store(finished) as store:
        key = store.stored_key(stage)
        for count, (name, change) in enumerate(ways(path)):
            change()
            store.damaged.clear()
            assert store.load(stage, key) is None and store.damaged == [stage], name
            path.write_bytes(good)
        assert count > 5 and store.load(stage, key)


def test_each_array_of_the_room(finished):
    good = (finished / ROOM).read_bytes()
    for name, change in ways(finished / ROOM):
        change()
        with pytest.raises(BadInputError, match="is damaged"):
            read_room(finished)
            pytest.fail(name)
        (finished / ROOM).write_bytes(good)
    read_room(finished)


@pytest.mark.parametrize("stage", STAGES)
def test_it_is_done_anew_and_said(disk, finished, stage, tmp_path):
    folder = shutil.copytree(finished, tmp_path / "result")
    first = disk.run(folder)
    assert all(first.stored.values()) and not first.report["warnings"]
    path = folder / "stages" / f"{stage}.npz"
    good = path.read_bytes()
    next(change for _, change in ways(path))()
    again = disk.run(folder)
    assert again.stored == {name: name != stage for name in STAGES}
    assert len(again.report["warnings"]) == 1 and f"'{stage}'" in again.report["warnings"][0]
    assert path.read_bytes() == good
    assert again.materials == first.materials and (again.albedo.rho == first.albedo.rho).all()
    assert (folder / MATERIALS).read_bytes() == (finished / MATERIALS).read_bytes()
