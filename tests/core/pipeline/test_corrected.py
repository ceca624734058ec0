"""A run that is given colours, lamps and a white: over the small room on disk whose albedo is known."""

from __future__ import annotations

import json

import numpy as np
import pytest

from addon.core.brdf.emitter import EMITTER
from addon.core.brdf.lambertian import LAMBERTIAN
from addon.core.passes.albedo.albedo import MEASURED, NONE
from addon.core.results.overrides import parse
from tests.core.on_disk import ALBEDO, CHEAP, LAMP
from tests.core.rooms import radiosity

pytestmark = pytest.mark.usefixtures("few_samples")


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("corrected")


@pytest.fixture
def recovered(disk, folder):
    """A run with overrides; stages that they don't change are those of the first one."""

    def run(told=None):
        return disk.run(folder, CHEAP, overrides=parse(told or {}, "given", range(7)))

    return run


def mean(found, object_id):
    own = (found.atlas.object_id == object_id) & (found.albedo.origin == MEASURED)
    return np.average(found.albedo.rho[own], 0, found.atlas.area[own])


def objects(folder):
    return {one["object_id"]: one for one in json.loads((folder / "materials.json").read_text())["objects"]}


@pytest.mark.slow
def test_a_base_colour_is_the_mean_and_texture_stays(recovered, folder):
    before = recovered()
    found = recovered({"objects": {"2": {"base_color": [0.3, 0.5, 0.1]}}})
    assert found.stored["specular"]  # a colour changes no highlight
    assert np.allclose(mean(found, 2), (0.3, 0.5, 0.1), atol=1e-4)
    own = found.atlas.object_id == 2
    was, now = before.albedo.rho[own], found.albedo.rho[own]
    assert np.allclose(now / now.mean(0), was / was.mean(0), atol=1e-3)
    assert np.array_equal(found.albedo.rho[~own], before.albedo.rho[~own])
    told = objects(folder)
    assert told[2]["given"] == {"base_color": [0.3, 0.5, 0.1]} and not told[3]["given"]
    assert np.allclose(told[2]["evidence"]["albedo_low"], told[2]["evidence"]["albedo_high"])
    assert told[3]["evidence"]["albedo_low"] < told[3]["evidence"]["albedo_high"]


def test_a_given_lamp_shines_as_it_was_seen(recovered):
    found = recovered({"objects": {"2": {"model": "emitter"}}})
    own = found.atlas.object_id == 2
    assert found.materials[2].model == EMITTER and (found.albedo.origin[own] == NONE).all()
    seen = np.median(found.lit.radiance[own & found.lit.seen], 0)
    assert np.all(np.array(found.materials[2].emission) < seen) and min(found.materials[2].emission) > 0
    assert found.report["figures"]["lamps"] == [6]  # the light was not found anew


def test_a_lamp_that_is_none_has_an_albedo(recovered):
    found = recovered({"objects": {"6": {"model": "lambertian"}}})
    own = found.atlas.object_id == 6
    assert found.materials[6].model == LAMBERTIAN and (found.albedo.origin[own] != NONE).all()


@pytest.mark.slow
def test_a_white_scales_all_albedo_and_the_light_makes_up_for_it(recovered, folder):
    before = recovered()
    white = mean(before, 1) / np.float32([1.25, 1, 0.8])  # as if E were too small in red, too great in blue
    found = recovered({"white": {"object": 1, "albedo": white.tolist()}})
    scale = np.array(found.report["figures"]["white_scale"])
    assert found.stored["specular"] and np.allclose(scale, (1.25, 1, 0.8), rtol=0.01)
    assert np.allclose(mean(found, 1), white, rtol=0.01)
    for object_id in (0, 2, 4):
        assert np.allclose(mean(found, object_id), np.minimum(mean(before, object_id) / scale, 1), rtol=0.02)
    assert found.report["warnings"] == []
    # What surfaces send was measured and stays, so that lamps have to answer for more than E's part.
    lamp = np.array(found.materials[6].emission) / before.materials[6].emission
    assert lamp[0] > scale[0] > 1 and lamp[2] < scale[2] < 1 and lamp[1] == pytest.approx(1, abs=0.02)


def test_a_white_may_be_a_spot(recovered):
    before = recovered()
    atlas, albedo = before.atlas, before.albedo
    own = np.flatnonzero((atlas.object_id == 1) & (albedo.origin == MEASURED))
    spot = atlas.position[own[len(own) // 2]]
    near = own[np.linalg.norm(atlas.position[own] - spot, axis=1) < 1.5 * atlas.texel_edge]
    assert 1 < len(near) <= 9
    here = np.average(albedo.rho[near], 0, atlas.area[near])
    found = recovered({"white": {"object": 1, "albedo": (here / 1.1).tolist(), "at": spot.tolist()}})
    assert np.allclose(found.report["figures"]["white_scale"], 1.1, rtol=0.01)
    assert np.allclose(np.average(found.albedo.rho[near], 0, atlas.area[near]), here / 1.1, rtol=0.01)
    nowhere = recovered({"white": {"object": 1, "albedo": 0.5, "at": [50, 50, 50]}})
    assert any("No albedo of the spot" in one for one in nowhere.report["warnings"])
    assert np.allclose(nowhere.report["figures"]["white_scale"], 1)


@pytest.mark.slow
def test_the_room_under_the_whites_light_looks_as_before(recovered, disk):
    """Radiosity, which knows nothing of the run, under the scaled lamps and albedos."""
    truth = {i: np.broadcast_to(np.float32(rho), 3) for i, rho in ALBEDO.items()}
    found = recovered({"white": {"object": 4, "albedo": (np.float32(truth[4]) / 1.2).tolist()}})
    light = np.array(found.materials[6].emission) / recovered().materials[6].emission
    scale = np.array(found.report["figures"]["white_scale"])
    again = radiosity(disk.room, {i: rho / scale for i, rho in truth.items()}, {6: LAMP * light})
    reflecting = disk.room.atlas.object_id < 6
    plain = radiosity(disk.room, {i: rho / scale for i, rho in truth.items()}, {6: LAMP * scale})
    before = disk.light[reflecting].mean(0)
    off, worse = again[reflecting].mean(0) / before, plain[reflecting].mean(0) / before
    assert np.abs(off - 1).max() < 0.04 < np.abs(worse - 1).max()


def test_a_doubtful_white_is_warned_of(recovered):
    found = recovered({"white": {"object": 4, "albedo": 0.25}})
    assert any("white" in one.lower() for one in found.report["warnings"])
    lamp = recovered({"white": {"object": 6, "albedo": 0.8}})
    assert any("No albedo" in one for one in lamp.report["warnings"])
    assert np.allclose(lamp.report["figures"]["white_scale"], 1)


@pytest.mark.slow
def test_keys_stay_where_nothing_is_given(recovered, folder):
    recovered()
    first = json.loads((folder / "materials.json").read_text())["run"]
    recovered({"objects": {"2": {"base_color": [0.3, 0.5, 0.1]}}})
    other = json.loads((folder / "materials.json").read_text())["run"]
    again = recovered({"objects": {"3": {}}})
    assert json.loads((folder / "materials.json").read_text())["run"] == first != other
    assert all(again.stored.values())
