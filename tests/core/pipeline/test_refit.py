"""A few objects fitted again in a finished result: what a whole run gives for them, and nothing else changed."""

from __future__ import annotations

import json
import shutil
from dataclasses import replace

import numpy as np
import pytest

from addon.core.brdf.dielectric import DIELECTRIC
from addon.core.brdf.metal import METAL
from addon.core.errors import BadInputError, MissingStageError
from addon.core.io.exr import read_exr
from addon.core.io.read import read_capture
from addon.core.passes.albedo.albedo import FILLED, TEXTURED
from addon.core.pipeline.recover import Recovery
from addon.core.pipeline.refit import Refit, open_result
from addon.core.progress import Progress
from addon.core.results.overrides import parse
from addon.core.results.room_file import write_room
from addon.core.results.store import Store
from addon.core.scene.params import FRAME_CHOICE
from tests.core.on_disk import ALBEDO, LAMP, QUICK, OnDisk
from tests.core.rooms import radiosity

pytestmark = pytest.mark.usefixtures("few_samples")
IMAGES = ("albedo", "base_color", "albedo_error", "coverage", "shading", "lit_diffuse", "evidence", "environment")


def recover(disk, folder, told=None, settings=QUICK, times=1):
    """A whole run with all that the bridge writes, but the scene; each frame comes so many times."""
    with Store(folder) as store:
        capture = read_capture(disk.root)
        capture = replace(capture, frames=capture.frames * times)
        run = Recovery(capture, store, settings, Progress(), disk.unwrap, parse(told or {}, "given", range(7)))
        run.write_images()
        write_room(folder, run.capture, run.surface().first_uv)
        store.write_json("report.json", run.report())
    return run


@pytest.fixture(scope="module")
def finished(disk, tmp_path_factory):
    folder = tmp_path_factory.mktemp("finished") / "result"
    recover(disk, folder)
    return folder


@pytest.fixture
def result(finished, tmp_path):
    return shutil.copytree(finished, tmp_path / "result")


def refit(folder, objects=(), told=None):
    override = None
    if told is not None:
        override = folder / "given.json"
        override.write_text(json.dumps(told))
    with Store(folder) as store:
        run = Refit(open_result(folder, objects, override), store, Progress())
        run.refit()
        store.write_json("overrides.json", run.overrides.as_dict())
        run.write_images()
        store.write_json("report.json", run.report())
    return run


def materials(folder):
    return {one["object_id"]: one for one in json.loads((folder / "materials.json").read_text())["objects"]}


def pictures(folder):
    return {name: read_exr(folder / f"{name}.exr").rgb for name in IMAGES}


GIVEN = {"objects": {"3": {"model": "specular", "roughness": 0.4}, "5": {"base_color": [0.2, 0.4, 0.1]}}}


@pytest.mark.slow
def test_as_a_whole_run_with_the_same_corrections(disk, finished, result, tmp_path):
    run = refit(result, told=GIVEN)
    assert run.touched == {3, 5} and run.fitted_again == {3}
    whole = recover(disk, tmp_path / "whole", GIVEN)
    assert not whole.log["specular"]["stored"]
    ours, theirs, before = materials(result), materials(tmp_path / "whole"), materials(finished)
    assert ours[3]["model"] == DIELECTRIC.name and ours[3]["given"] == GIVEN["objects"]["3"]
    for i in (3, 5):
        for name in (
            "model",
            "alpha",
            "roughness_low",
            "roughness_high",
            "f0_low",
            "f0_high",
            "given",
            "note",
            "observations",
        ):
            assert ours[i][name] == theirs[i][name], name
        for name in ("albedo", "albedo_low", "albedo_high"):
            assert np.allclose(ours[i]["evidence"][name], theirs[i]["evidence"][name], atol=0.02), (i, name)
    assert ours[5]["evidence"]["albedo"] == ours[5]["evidence"]["albedo_low"] == [0.2, 0.4, 0.1]
    assert {i: one for i, one in ours.items() if i not in (3, 5)} == {
        i: one for i, one in before.items() if i not in (3, 5)
    }
    images, wholes = pictures(result), pictures(tmp_path / "whole")
    atlas = run.surface().atlas
    for i in (3, 5):
        own = np.zeros(len(atlas), bool)
        own[(atlas.object_id == i) & run.lit_diffuse().seen] = True
        mine = atlas.image(own)[::-1] > 0
        for name in ("albedo", "base_color"):
            assert np.abs(images[name][mine] - wholes[name][mine]).mean() < 0.01, (name, i)
        assert np.median(np.abs(images["albedo_error"][mine] - wholes["albedo_error"][mine])) < 0.01


@pytest.mark.slow
def test_all_else_is_held(finished, result):
    run = refit(result, told=GIVEN)
    atlas, before, after = run.surface().atlas, pictures(finished), pictures(result)
    other = atlas.image(~np.isin(atlas.object_id, (3, 5)))[::-1]
    assert np.array_equal(before.pop("environment"), after.pop("environment"))
    # Contrast is taken about the mean of all albedo, and so may be rounded otherwise.
    np.testing.assert_allclose(after.pop("albedo_error")[other], before.pop("albedo_error")[other], atol=1e-5)
    for name in before:
        assert np.array_equal(before[name][other], after[name][other]), name
    assert (before["albedo"][~other] != after["albedo"][~other]).any()
    assert (
        json.loads((result / "materials.json").read_text())["run"]
        != (json.loads((finished / "materials.json").read_text())["run"])
    )


def test_a_later_run_keeps_it(disk, result):
    refit(result, told={"objects": {"4": {"model": "metal", "roughness": 0.2, "f0": [0.9, 0.6, 0.3]}}})
    kept = json.loads((result / "overrides.json").read_text())
    again = recover(disk, result, kept)
    assert all(one["stored"] for one in again.log.values())
    found = materials(result)[4]
    assert found["model"] == METAL.name and found["f0"] == [0.9, 0.6, 0.3] and found["alpha"] == pytest.approx(0.04)
    color = again.base_color()[again.surface().atlas.object_id == 4]
    assert np.allclose(color, (0.9, 0.6, 0.3))


def test_taken_back_it_is_as_before(finished, result):
    refit(result, told={"objects": {"3": {"model": "specular", "roughness": 0.4}}})
    run = refit(result, told={"objects": {"3": None}})
    assert run.touched == {3} and run.overrides.as_dict() == {"objects": {}}
    before, after = materials(finished)[3], materials(result)[3]
    for name in ("evidence",):
        assert np.allclose(before[name]["albedo"], after[name]["albedo"], atol=1e-3)
        before.pop(name), after.pop(name)
    assert before == after
    assert np.abs(pictures(finished)["albedo"] - pictures(result)["albedo"]).max() < 0.01


def test_what_is_the_same_follows(result):
    told = {"objects": {"2": {"same_as": 3}, "3": {"model": "metal", "roughness": 0.5}}}
    refit(result, told=told)
    run = refit(result, told={"objects": {"3": {"roughness": 0.1}}})
    assert run.touched == {2, 3}
    found = materials(result)
    assert found[2]["alpha"] == found[3]["alpha"] == pytest.approx(0.01) and found[2]["model"] == METAL.name


def test_a_lamp_given_and_taken_back(finished, result):
    refit(result, told={"objects": {"2": {"model": "emitter"}}})
    assert materials(result)[2]["emission"] and not materials(result)[2]["model"] == materials(finished)[2]["model"]
    refit(result, told={"objects": {"2": None}})
    assert np.abs(pictures(finished)["albedo"] - pictures(result)["albedo"]).max() < 0.01


@pytest.mark.slow
def test_a_white_makes_all_of_it_anew(finished, result):
    mean = materials(finished)[4]["evidence"]["albedo"]
    refit(result, told={"white": {"object": 4, "albedo": [x / 1.2 for x in mean]}})
    report = json.loads((result / "report.json").read_text())
    assert np.allclose(report["figures"]["white_scale"], 1.2, rtol=0.01)
    before, after = materials(finished), materials(result)
    for i in (0, 1, 3):
        assert np.allclose(np.array(before[i]["evidence"]["albedo"]) / after[i]["evidence"]["albedo"], 1.2, rtol=0.02)
    refit(result, told={"white": None})
    assert "white_scale" not in json.loads((result / "report.json").read_text())["figures"]
    assert np.allclose(pictures(finished)["albedo"], pictures(result)["albedo"], atol=1e-5)


def test_the_capture_may_be_gone(disk, result):
    hidden = disk.root.with_name("hidden")
    disk.root.rename(hidden)
    try:
        refit(result, [3])
    finally:
        hidden.rename(disk.root)
    assert (result / "report.html").is_file()


def test_what_can_not_be_done_is_one_sentence(disk, result, tmp_path):
    with pytest.raises(BadInputError, match="no object 99"):
        open_result(result, [99])
    with pytest.raises(BadInputError, match="Nothing is to be fitted"):
        open_result(result, [])
    with pytest.raises(MissingStageError, match="no finished result"):
        open_result(tmp_path, [1])
    shutil.rmtree(result / "stages")
    with Store(result) as store, pytest.raises(MissingStageError, match="run recover again"):
        Refit(open_result(result, [3]), store, Progress())
    (result / "report.json").unlink()
    with pytest.raises(MissingStageError, match="run recover again"):
        open_result(result, [3])


def test_stages_of_another_run_are_refused(disk, result):
    with Store(result) as store:  # the shading stage anew with other settings, and stopped there
        disk.recovery(store, replace(QUICK, shading_rays=32)).shading()
        with pytest.raises(MissingStageError, match="another run's"):
            Refit(open_result(result, [3]), store, Progress())


@pytest.mark.slow
def test_texture_of_what_is_not_touched_stays(tmp_path):
    """A tiled floor with a part that no frame shows: it is filled with tiles, and a wall's refit leaves them alone."""

    def light(room):
        L = radiosity(room, ALBEDO, {6: LAMP})
        place, floor = room.atlas.position, room.atlas.object_id == 0
        dark = floor & (np.floor(place[:, :2] / 0.4).astype(int).sum(1) % 2 > 0)
        L[dark] *= 0.2
        L[floor & (np.abs(place[:, :2] - (2.6, 1.4)) < (0.7, 0.6)).all(1)] = np.nan
        return L.astype(np.float32)

    disk, folder = OnDisk(tmp_path / "capture", light=light), tmp_path / "result"
    run = recover(disk, folder)
    before = {name: read_exr(folder / f"{name}.exr").rgb for name in IMAGES}
    tiled = before["coverage"][..., 2] == TEXTURED
    assert tiled.sum() > 100
    assert np.std(before["albedo"][tiled].mean(1)) > 0.5 * np.std(
        before["albedo"][before["albedo"][..., 0] > 0].mean(1)
    )
    refit(folder, told={"objects": {"4": {"model": "metal", "roughness": 0.2, "f0": [0.9, 0.6, 0.3]}}})
    after = {name: read_exr(folder / f"{name}.exr").rgb for name in ("albedo", "base_color", "coverage")}
    for name, image in after.items():
        assert np.array_equal(image[tiled], before[name][tiled]), name
    recover(disk, folder, settings=replace(QUICK, texture_fill=False))
    flat = read_exr(folder / "albedo.exr").rgb[tiled], read_exr(folder / "coverage.exr").rgb[tiled]
    assert np.std(flat[0].mean(1)) < 0.5 * np.std(before["albedo"][tiled].mean(1)) and (flat[1][:, 2] == FILLED).all()
    # Parts that were guessed by shape may hold several materials: none is carried over but along a floor.
    for name, textured in ("wall", False), ("floor", True):
        del run.texture
        guesses = tuple(replace(one, class_name=name, guess=True) for one in run.capture.instances)
        run.capture = replace(run.capture, instances=guesses)
        assert (len(run.texture.texel) > 100) == textured


@pytest.mark.slow
def test_a_video_is_fitted_again_with_the_frames_that_the_run_chose(disk, tmp_path):
    before = recover(disk, tmp_path / "result", times=2 * FRAME_CHOICE.enough)
    assert len(before.capture.frames) < 2 * FRAME_CHOICE.enough * disk.count
    again = refit(tmp_path / "result", [3])
    assert [frame.name for frame in again.capture.frames] == [frame.name for frame in before.capture.frames]
    assert len(again.room_poses().of(again.capture.frames)) == len(before.capture.frames)
