"""Where a stopped run goes on, by what it left."""

from __future__ import annotations

import os

import pytest

from addon.core.results.unfinished import goes_on_with


@pytest.mark.parametrize(
    ("times", "stage"),
    [
        ({}, ""),
        ({"surface": 1}, "lit_diffuse"),
        ({"surface": 1, "lit_diffuse": 2, "shading": 3}, "specular"),
        ({"surface": 1, "lit_diffuse": 2, "shading": 3, "specular": 4}, "write"),
        ({"surface": 1, "lit_diffuse": 2, "shading": 3, "specular": 4, "report": 5}, ""),
        # With other settings once more, and stopped: what is older than the stage before it is of the first run.
        ({"surface": 6, "lit_diffuse": 2, "shading": 3, "specular": 4, "report": 5}, "lit_diffuse"),
        ({"surface": 1, "lit_diffuse": 2, "shading": 7, "specular": 4, "report": 5}, "specular"),
        ({"lit_diffuse": 2}, ""),
    ],
)
def test_where_it_goes_on(tmp_path, times, stage):
    (tmp_path / "stages").mkdir()
    for name, time in times.items():
        path = tmp_path / "report.json" if name == "report" else tmp_path / "stages" / f"{name}.npz"
        path.write_bytes(b"")
        os.utime(path, (1000 + time, 1000 + time))
    assert goes_on_with(tmp_path) == stage


def test_no_folder_is_no_run(tmp_path):
    assert goes_on_with(tmp_path / "nowhere") == ""
