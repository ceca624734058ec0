"""A whole run over a small room on disk: right, stored, taken up again, and told what is wrong."""

from __future__ import annotations

import json
import re
import shutil
from dataclasses import replace
from functools import wraps
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from addon.core.brdf.dielectric import DIELECTRIC
from addon.core.brdf.emitter import EMITTER
from addon.core.brdf.lambertian import LAMBERTIAN
from addon.core.errors import BadInputError, InterruptedRun, StorageError
from addon.core.io.exr import read_exr, write_exr
from addon.core.io.read import read_capture
from addon.core.lit_diffuse.exact import Exact
from addon.core.paper.recover import recover
from addon.core.passes.albedo.albedo import MEASURED, NONE
from addon.core.pipeline import frames
from addon.core.progress import Progress
from addon.core.results.store import Store
from addon.core.settings import PAPER
from tests.core.on_disk import ALBEDO, CHEAP, LAMP, QUICK, Finished, OnDisk
from tests.core.rooms import lit_box, make_room, quad, radiosity

pytestmark = pytest.mark.usefixtures("few_samples")
STAGES = ("surface", "lit_diffuse", "shading", "specular")


def check(found: Finished, albedo=ALBEDO, within=0.04):
    for object_id, rho in albedo.items():
        assert np.abs(np.median(found.off(object_id, rho), 0)).max() < within, object_id


@pytest.fixture(scope="module")
def finished(disk, tmp_path_factory):
    """The result folder of a first run, and the run."""
    folder = tmp_path_factory.mktemp("result")
    return folder, disk.run(folder, QUICK)


@pytest.fixture(scope="module")
def cheap(disk, tmp_path_factory):
    folder = tmp_path_factory.mktemp("cheap")
    return folder, disk.run(folder)


def test_albedo_lamp_and_report(disk, finished):
    folder, run = finished
    check(run)
    by_id = {m.object_id: m for m in run.materials}
    assert sorted(by_id) == list(range(7)) and by_id[6].model == EMITTER
    assert np.allclose(by_id[6].emission, LAMP, rtol=0.02)
    assert {by_id[i].model for i in range(6)} == {LAMBERTIAN}
    assert (run.albedo.origin[run.atlas.object_id == 6] == NONE).all()
    assert run.stored == dict.fromkeys(STAGES, False)
    figures = run.report["figures"]
    assert figures["lamps"] == [6] and figures["frames"] == 24 and figures["elements"] == len(run.atlas)
    assert figures["models"] == {EMITTER.name: 1, LAMBERTIAN.name: 6}
    assert figures["unseen_share"] < 0.01 and figures["escaped_share"] == 0
    assert figures["albedo_above_one_share"] < 0.005  # the lamp's quotient does not count
    assert figures["outside"] and run.report["warnings"] == []
    for name in ("albedo", "base_color", "shading", "lit_diffuse", "coverage", "environment"):
        assert (folder / f"{name}.exr").stat().st_size > 1000 or name == "environment"
    told = json.loads((folder / "materials.json").read_text())
    objects = told["objects"]
    assert told["capture"] == disk.root.name and re.fullmatch("[0-9a-f]{16}", told["run"])
    assert {one["object_id"]: one["name"] for one in objects} == {i: f"thing {i} {i}" for i in range(7)}
    assert [o["model"] for o in objects] == [m.model.name for m in run.materials]


def test_a_report_of_what_is_done_asks_for_no_further_stage(disk, tmp_path):
    with Store(tmp_path / "result") as store:
        run = disk.recovery(store)
        run.shading()
        assert run.report()["figures"]["lamps"] == [6]
        assert "specular" not in run.done


def test_a_second_run_computes_nothing(disk, finished):
    folder, first = finished

    @wraps(disk.unwrap)  # by its name and place it is the same
    def no_unwrap(mesh, size):
        raise AssertionError("laid out again")

    disk_unwrap, disk.unwrap = disk.unwrap, no_unwrap
    try:
        again = disk.run(folder, QUICK)
    finally:
        disk.unwrap = disk_unwrap
    assert again.stored == dict.fromkeys(STAGES, True)
    assert same(first, again) and again.materials == first.materials
    for part in ("figures", "warnings", "settings", "capture"):
        assert again.report[part] == first.report[part]


def same(one: Finished, other: Finished) -> bool:
    pairs = zip(one.arrays(), other.arrays(), strict=True)
    return all(np.array_equal(a, b, equal_nan=a.dtype.kind == "f") for a, b in pairs)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("change", "kept"),
    [
        ({"specular_rays": 17}, STAGES[:3]),
        ({"refine": 1}, STAGES[:3]),
        ({"shading_rays": 65}, STAGES[:2]),
        ({"median": "mean"}, STAGES[:1]),
        ({"texel_size": 0.12}, ()),
        ({"threads": 1}, STAGES),
    ],
)
def test_only_later_stages_are_done_again(disk, cheap, tmp_path, change, kept):
    folder, _ = cheap
    copy = tmp_path / "copy"
    (copy / "stages").mkdir(parents=True)
    for path in (folder / "stages").glob("*.npz"):
        (copy / "stages" / path.name).write_bytes(path.read_bytes())
    again = disk.run(copy, replace(CHEAP, **change))
    assert again.stored == {name: name in kept for name in STAGES}
    mine, theirs = (json.loads((one / "materials.json").read_text())["run"] for one in (folder, copy))
    assert (mine == theirs) == (kept == STAGES)


@pytest.mark.slow
@pytest.mark.parametrize("after", [1, 2, 3])
def test_a_stopped_run_goes_on_from_there(disk, cheap, tmp_path, after):
    """The stop is asked for while the next stage runs."""
    begun: list[str] = []

    def listen(event):
        if event.stage and event.stage not in begun:
            begun.append(event.stage)

    progress = Progress(listen, lambda: len(begun) > after)
    with pytest.raises(InterruptedRun):
        disk.run(tmp_path / "result", progress=progress)
    left = [p.name for p in (tmp_path / "result").rglob("*") if p.is_file()]
    assert not [name for name in left if name.startswith(".partial")]
    again = disk.run(tmp_path / "result")
    assert again.stored == {name: name in STAGES[:after] for name in STAGES}
    assert same(again, cheap[1])  # and in another folder the same comes out


def spoilt(disk: OnDisk, tmp_path: Path) -> OnDisk:
    """A copy of the capture, to be damaged."""
    root = tmp_path / "spoilt"
    shutil.copytree(disk.root, root)
    copy = object.__new__(OnDisk)
    copy.__dict__.update(disk.__dict__, root=root)
    return copy


@pytest.mark.slow
@pytest.mark.parametrize("count", [2, 6])
def test_frames_that_turn_out_damaged(disk, tmp_path, count):
    """Whole when the run begins, cut off when they are read: few are left out, many are too many."""
    copy = spoilt(disk, tmp_path)
    capture = read_capture(copy.root)
    for i in range(count):
        content = copy.path(i).read_bytes()
        copy.path(i).write_bytes(content[: len(content) // 2])
    if count == 6:
        with pytest.raises(BadInputError, match="of 24 frames can't be read"):
            copy.run(tmp_path / "result", capture=capture)
        return
    run = copy.run(tmp_path / "result", capture=capture)
    check(run)
    told = [w for w in run.report["warnings"] if "left out" in w]
    assert len(told) == 2 and "000.exr" in " ".join(told) and "001.exr" in " ".join(told)
    again = copy.run(tmp_path / "result", capture=capture)
    assert again.report["warnings"] == run.report["warnings"]  # told as well when nothing is read


@pytest.mark.slow
def test_pixels_that_are_no_numbers(disk, tmp_path):
    copy = spoilt(disk, tmp_path)
    rng = np.random.default_rng(0)
    for i in range(copy.count):
        array = np.array(read_exr(copy.path(i)).rgb)
        for value in (np.nan, np.inf, -np.inf, -5.0):
            array[rng.random(array.shape[:2]) < 0.03] = value
        write_exr(copy.path(i), array)
    run = copy.run(tmp_path / "result")
    check(run, within=0.06)
    assert np.isfinite(run.albedo.rho).all() and np.isfinite(run.shading.irradiance).all()


@pytest.mark.slow
def test_an_object_that_nobody_sees(tmp_path):
    """A cupboard's inside: a small box far outside the room, its inner sides out of every frame's sight."""
    hidden = [quad((9, 9, 0), (1, 0, 0), (0, 1, 0), 7), quad((9, 9, 0.5), (0, 1, 0), (1, 0, 0), 7)]
    quads = [*lit_box(lamps=(((0.3, 0.7), (0.3, 0.7)),)), *hidden]

    def light(room):
        inner = make_room(quads[: -len(hidden)], 0.1)
        lit = np.zeros((len(room.atlas), 3), np.float32)
        lit[room.atlas.object_id != 7] = radiosity(inner, ALBEDO, {6: LAMP})
        return lit

    disk = OnDisk(tmp_path / "capture", quads, light=light)
    run = disk.run(tmp_path / "result")
    check(run)
    assert any("No frame sees thing 7 7" in warning for warning in run.report["warnings"])
    unseen = {m.object_id: m for m in run.materials}[7]
    assert unseen.model == LAMBERTIAN and unseen.observations == 0 and unseen.note
    own = run.atlas.object_id == 7
    assert (run.albedo.origin[own] == NONE).all() and (run.albedo.rho[own] > 0).all()
    assert run.report["figures"]["unseen_share"] > 0


@pytest.mark.slow
def test_a_room_lit_through_its_roof(tmp_path):
    """No ceiling, a sky of radiance 2 that the frames see: albedo of what it lights."""
    quads = [q for q in lit_box() if q.object_id not in (1, 6)]
    albedo = {i: ALBEDO[i] for i in (0, 2, 3, 4, 5)}

    def light(room):
        closed = make_room([*quads, quad((0, 0, 2.5), (0, 3, 0), (4, 0, 0), 6)], 0.1)
        whole = radiosity(closed, albedo, {6: (2, 2, 2)})
        return np.ascontiguousarray(whole[closed.atlas.object_id != 6], np.float32)

    disk = OnDisk(tmp_path / "capture", quads, light=light, outside=2.0)
    run = disk.run(tmp_path / "result")
    check(run, albedo, within=0.06)
    assert run.report["figures"]["lamps"] == [] and run.report["figures"]["escaped_share"] > 0.1
    assert "outside" not in run.report["figures"]
    assert all("sky that no frame sees was solved" in warning for warning in run.report["warnings"])


def test_a_capture_that_sees_nothing(disk, tmp_path):
    copy = spoilt(disk, tmp_path)
    for i in range(copy.count):
        write_exr(copy.path(i), np.full((40, 40, 3), np.nan, np.float32))
    with pytest.raises(BadInputError, match="No frame shows any of the mesh"):
        copy.run(tmp_path / "result")


def test_the_papers_preset_is_the_paper_alone(disk, tmp_path):
    """The stages, stored one by one, give what `paper.recover` gives in one go."""
    settings = replace(PAPER, shading_rays=64, specular_rays=64, texel_size=0.2, threads=2)
    run = disk.run(tmp_path / "result", settings)
    with Store(tmp_path / "other") as store:
        other = disk.recovery(store, settings)
        alone = recover(other.surface(), other.frames, other.read, 64, threads=2)
    assert np.array_equal(run.lit.radiance, alone.lit_diffuse, equal_nan=True)
    assert np.array_equal(run.shading.irradiance, alone.irradiance)
    measured = run.albedo.origin == MEASURED
    assert measured.any() and np.allclose(run.albedo.rho[measured], np.clip(alone.albedo[measured], 0, 1), atol=1e-5)
    lobes = {m.object_id: m for m in run.materials if m.model == DIELECTRIC}
    assert lobes.keys() | {6} == alone.fits.keys()
    for i, one in lobes.items():
        assert (one.alpha, one.f0) == pytest.approx((alone.fits[i].lobe.phi, alone.fits[i].lobe.psi), rel=1e-6)


@pytest.mark.slow
def test_the_papers_way(disk, tmp_path):
    run = disk.run(tmp_path / "result", replace(PAPER, shading_rays=512, specular_rays=16, texel_size=0.1, threads=2))
    # 512 rays instead of 10 000 give 10 % noise; the median over an object has less.
    check(run, within=0.1)
    assert run.report["figures"]["shading_points"] == len(run.atlas)
    assert {m.object_id: m.model for m in run.materials}[6] == EMITTER


@pytest.mark.slow
@pytest.mark.parametrize("distance", [1e3, 1e4])
def test_far_from_the_origin(tmp_path, distance):
    """In a national grid's coordinates the room lies kilometres away, where float32 is coarser than a ray's offset."""
    disk = OnDisk(tmp_path / "capture", shift=(distance, -distance, 0))
    run = disk.run(tmp_path / "result")
    check(run)


def test_disk_for_observations_is_asked_for_before_frames_are_read(disk, tmp_path, monkeypatch):
    kept, add = [], Exact.add

    def count(self, element, values):
        kept.append(values.nbytes + element.nbytes)
        add(self, element, values)

    def with_free(size, folder):
        monkeypatch.setattr(frames, "shutil", SimpleNamespace(disk_usage=lambda at: SimpleNamespace(free=size)))
        settings = replace(CHEAP, sharpen=False, refine_poses=False)
        with Store(tmp_path / folder) as store:
            disk.recovery(store, settings).observed()

    monkeypatch.setattr(Exact, "HELD", 0)
    monkeypatch.setattr(Exact, "add", count)
    with_free(1 << 60, "plenty")
    need = sum(kept)
    kept.clear()
    with pytest.raises(StorageError, match="GB are free"):
        with_free(0.7 * need, "short")
    assert not kept
    with_free(1.4 * need, "enough")
