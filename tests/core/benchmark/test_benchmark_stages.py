"""The benchmark's stages `medians` and `accumulation`, at a size of seconds."""

from __future__ import annotations

import numpy as np
import pytest

from addon.benchmark import accumulation, medians
from addon.benchmark.run import Options
from addon.benchmark.sequences import SEQUENCES, video
from addon.benchmark.synthetic import synthetic_capture
from addon.core.io.pixels import read_pixels


@pytest.fixture
def few(monkeypatch):
    monkeypatch.setattr(medians, "COUNTS", (5, 40))
    monkeypatch.setattr(medians, "ELEMENTS", 30)
    some = {name: SEQUENCES[name] for name in ("video, 40 % highlights", "tied")}
    monkeypatch.setattr(medians, "SEQUENCES", some | {medians.TIMED: SEQUENCES[medians.TIMED]})
    monkeypatch.setattr(medians, "TIMED_COUNTS", (12,))
    monkeypatch.setattr(medians, "TIMED_ELEMENTS", 64)
    monkeypatch.setattr(accumulation, "FRAMES", (6,))
    monkeypatch.setattr(accumulation, "SIZE", (48, 32))
    monkeypatch.setattr(accumulation, "ELEMENTS", 3000)


@pytest.mark.slow
def test_medians(few):
    errors, costs = medians.run(Options(seed=1))
    records = {(r["sequence"], r["observations"], r["alternative"]): r for r in errors.records()}
    assert len(records) == 3 * 2 * len(medians.RIVALS)
    for (sequence, n, name), record in records.items():
        assert record["baseline"] == (name == medians.PAPERS)
        if name == "exact" or (n == 5 and name in (medians.DEFAULT, "summary, as filmed")):
            assert record["RMS log error"] < 1e-6, (sequence, n, name)
    shining = records["video, 40 % highlights", 40, medians.DEFAULT]
    assert shining["error against paper's"] < 0.1
    assert shining["bytes an element, memory"] == 244
    assert records["video, 40 % highlights", 40, medians.PAPERS]["bytes an element, memory"] == 124
    assert records["tied", 40, "exact"]["bytes an element, disk"] == 640
    assert {r["alternative"] for r in costs.records()} == set(medians.RIVALS)
    assert next(iter(medians.run(Options(seed=1)))).rows == errors.rows
    assert next(iter(medians.run(Options(seed=2)))).rows != errors.rows


def test_a_video_shines_for_one_stretch():
    x = video(50, 20, 0.4, np.random.default_rng(0))
    bright = x[..., 0] > 1.2
    assert (np.abs(np.diff(bright.astype(int), axis=0)).sum(0) <= 8).all()  # of the twenty a few hardly shine
    assert 10 < bright.sum(0).mean() <= 20
    assert np.allclose(np.median(x, 0), 1, atol=0.2)


@pytest.mark.slow
def test_accumulation(few, tmp_path):
    (table,) = accumulation.run(Options(out=tmp_path, threads=2))
    records = {r["alternative"]: r for r in table.records()}
    assert set(records) == {"reading", "rays", "least", *accumulation.ALTERNATIVES}
    assert records["least"]["against the least"] == 1 < records["default"]["against the least"]
    assert records["exact"]["RMS log error"] == 0 and records["default"]["RMS log error"] < 1e-6
    assert records["p2 (paper)"]["baseline"] and records["rays"]["rays"] > records["exact"]["observations"] > 1000
    assert list(tmp_path.iterdir()) == []


def test_the_synthetic_room(tmp_path):
    capture = synthetic_capture(4, (48, 32), 3000, 0, tmp_path)
    assert 2000 < len(capture.atlas) < 5000
    inward = np.array([3, 2.5, 1.4]) - capture.atlas.position
    walls = capture.atlas.object_id < 6
    assert ((inward * capture.atlas.normal).sum(1)[walls] > 0).all()
    for frame in capture.frames:
        made, read = capture.make(frame), read_pixels(frame)
        assert np.allclose(made.radiance, read.radiance, rtol=1e-3) and read.valid.all()
        assert np.array_equal(made.radiance, capture.make(frame).radiance)
