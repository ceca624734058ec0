"""The benchmark's stage `specular`, at a size of seconds."""

from __future__ import annotations

import numpy as np
import pytest

from addon.benchmark import specular
from addon.benchmark.run import Options
from addon.core.light.lobes import reflected_light


@pytest.fixture
def few(monkeypatch):
    monkeypatch.setattr(specular, "ELEMENTS", 60)
    monkeypatch.setattr(specular, "VIEWS", 8)
    monkeypatch.setattr(specular, "TRUE_RAYS", 256)
    monkeypatch.setattr(specular, "PHIS", (0.1,))
    monkeypatch.setattr(specular, "F0S", (0.04, 0.9))
    for name in ("RIVALS", "CASES"):
        keep = (specular.PAPERS, specular.OURS, "3 % noise", "off by 1 cm")
        monkeypatch.setattr(specular, name, {k: v for k, v in getattr(specular, name).items() if k in keep})


@pytest.mark.slow
def test_errors_by_alternative(few):
    tables = list(specular.run(Options(seed=1)))
    assert [table.stage for table in tables] == ["specular", "specular-range"]
    whole, single = (table.records() for table in tables)
    assert len(whole) == 2 * 2 and len(single) == 2 * 2
    for record in whole:
        assert record["baseline"] == (record["alternative"] == specular.PAPERS)
        if record["alternative"] == specular.OURS:
            assert record["roughness error"] < 0.05 and record["relative F0 error"] < 0.3
    again = [table.records() for table in specular.run(Options(seed=1))]
    for old, new in zip((whole, single), again, strict=True):
        for one, other in zip(old, new, strict=True):
            assert {k: v for k, v in one.items() if "seconds" not in k} == {
                k: v for k, v in other.items() if "seconds" not in k
            }


def test_the_truth_is_that_of_our_rays(few):
    """Two samplers, one light: the normals' distribution, and uniform rays, against the lobes'."""
    scene = specular.Scene(Options(seed=0))
    phi = np.float32([0.4])
    A, B, _ = scene.true_light(0.4, 0.0)
    ours = reflected_light(scene.field, scene.bright, scene.element, scene.direction, rays=512, grid=phi)
    uniform = scene.light(specular.Rival(rays=512, sampler="uniform", grid=phi))
    assert ours.A.mean() == pytest.approx(A.mean(), rel=0.02)
    assert uniform.A.mean() == pytest.approx(A.mean(), rel=0.04)
    assert ours.B.mean() == pytest.approx(B.mean(), rel=0.05)
