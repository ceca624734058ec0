"""A pass of another package: called, named in the key and the report, left out by name; broken, told."""

from __future__ import annotations

import importlib
import re
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from addon.core.errors import BadInputError, ScanRelightError
from addon.core.passes import registry
from addon.core.passes.registry import Pass, check, followed, passes, register
from addon.core.pipeline import surface
from addon.core.scene.unwrap import by_xatlas, own_coordinates
from tests.core.on_disk import CHEAP

pytestmark = pytest.mark.usefixtures("few_samples")
DOCS = Path(__file__).resolve().parents[3] / "docs" / "extending.md"


def documented() -> str:
    """The documentation's example, as it stands there."""
    found = re.findall(r"```python\n(.*?)```", DOCS.read_text(), re.DOTALL)
    return found[1].replace("scan_relight.addon", "addon")


@pytest.fixture
def alone(monkeypatch):
    """Nothing that a test registers stays."""
    monkeypatch.setattr(registry, "_registered", {})
    registry._register_installed.cache_clear()
    yield
    registry._register_installed.cache_clear()


@pytest.fixture
def package(alone, tmp_path, monkeypatch):
    """Makes the example a package of a version, as pip leaves it."""
    monkeypatch.syspath_prepend(tmp_path)

    def install(version: str, point: str = "my_package:LEAST_LIGHT"):
        (tmp_path / "my_package.py").write_text(documented().replace("register(LEAST_LIGHT)", ""))
        told = tmp_path / "my_package.dist-info"
        told.mkdir(exist_ok=True)
        (told / "METADATA").write_text(f"Metadata-Version: 2.1\nName: my_package\nVersion: {version}\n")
        (told / "entry_points.txt").write_text(f"[scan_relight.passes]\nleast-light = {point}\n")
        registry._registered.clear()
        registry._register_installed.cache_clear()
        importlib.invalidate_caches()

    yield install
    sys.modules.pop("my_package", None)


@pytest.mark.slow
def test_an_installed_pass_is_run_and_told_and_can_be_left_out(disk, tmp_path, package):
    before = disk.run(tmp_path / "result")
    package("1.0")
    found = disk.run(tmp_path / "result")
    assert found.stored == {"surface": True, "lit_diffuse": True, "shading": False, "specular": False}
    assert found.report["passes_of_packages"] == [
        {"name": "least-light", "stage": "shading", "package": "my_package 1.0"}
    ]
    seen = found.lit.seen
    least = 0.01 * np.median(before.shading.irradiance[seen], 0)
    assert np.array_equal(found.shading.irradiance, np.maximum(before.shading.irradiance, least))

    assert all(disk.run(tmp_path / "result").stored.values())
    package("1.1")
    assert not disk.run(tmp_path / "result").stored["shading"]

    without = disk.run(tmp_path / "result", replace(CHEAP, without=("least-light",)))
    assert np.array_equal(without.shading.irradiance, before.shading.irradiance)
    assert without.report["passes_of_packages"] == []


def test_a_broken_package_is_warned_of(package):
    package("1.0", "not_there:PASS")
    with pytest.warns(UserWarning, match="'least-light' can't be loaded"):
        assert [one.name for one in passes()] == [one.name for one in registry.PASSES]
    with pytest.raises(BadInputError, match="no pass 'least-light'"):
        check(["least-light"])


@pytest.mark.parametrize(
    ("wrong", "told"),
    [
        (Pass("sun", "Shines.", "shading", lambda value, before: value), "already"),
        (Pass("paint", "Paints.", "surface", lambda value, before: value), "one of the stages lit_diffuse"),
        (Pass("idle", "Idles.", "shading"), "needs a function"),
    ],
)
def test_what_can_be_no_pass_is_refused(alone, wrong, told):
    with pytest.raises(BadInputError, match=told):
        register(wrong)


def test_what_fails_is_named(alone):
    register(Pass("bad", "Fails.", "shading", lambda value, before: 1 / 0))
    with pytest.raises(ScanRelightError, match=r"The pass 'bad' of .* failed \(ZeroDivisionError"):
        followed("shading", 1.0, {}, ())
    assert followed("shading", 1.0, {}, ("bad",)) == followed("specular", 1.0, {}, ()) == 1.0
    registry._registered.clear()
    register(Pass("odd", "Gives text.", "shading", lambda value, before: "text"))
    with pytest.raises(ScanRelightError, match="gave a str, no float"):
        followed("shading", 1.0, {}, ())


def test_stages_know_what_laid_the_atlas_out():
    assert len({surface.laid_out_by(one) for one in (own_coordinates, by_xatlas, lambda mesh, size: mesh.uv)}) == 3
