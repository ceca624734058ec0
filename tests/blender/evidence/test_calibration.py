"""Stated 90 % intervals hold the truth about 90 % of the time, over rooms of known truth that Cycles rendered."""

from __future__ import annotations

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from addon.bridge.data.unwrap import unwrap  # noqa: E402
from addon.core.brdf.material import Z90  # noqa: E402
from addon.core.brdf.metal import METAL  # noqa: E402
from addon.core.io.read import read_capture  # noqa: E402
from addon.core.passes.albedo.albedo import MEASURED  # noqa: E402
from addon.core.pipeline.recover import Recovery  # noqa: E402
from addon.core.progress import Progress  # noqa: E402
from addon.core.results.store import Store  # noqa: E402
from addon.core.settings import Settings  # noqa: E402
from tests.blender.evidence.known_rooms import known_rooms  # noqa: E402

pytestmark = [pytest.mark.slow, pytest.mark.arithmetic]

FRAMES, SIZE, SAMPLES = 16, (72, 54), 32
"""So small that a lamp which is solved for comes out 8 % too bright: the intervals must know."""
SETTINGS = Settings(specular_rays=128, texel_size=0.05)
ROOMS = ("demo", "light, window", "lamp unseen")


def held(run: Recovery, truth: np.ndarray) -> dict[str, float]:
    """Shares of the truth ((n, 3), NaN on lamps) within the intervals: by area, and objects' means."""
    atlas, albedo, evidence = run.surface().atlas, run.albedo, run.evidence
    known = np.isfinite(truth).all(1)
    within = (np.abs(albedo.rho - truth) <= Z90 * evidence.texels.albedo + 1e-6).mean(1)

    def share(chosen: np.ndarray) -> float:
        return float((within[chosen] * atlas.area[chosen]).sum() / atlas.area[chosen].sum())

    measured = albedo.origin == MEASURED
    means = []
    for one in evidence.objects:
        own = known & measured & (atlas.object_id == one.object_id)
        if own.sum() >= 20:
            mean = np.average(truth[own], 0, atlas.area[own])
            means.append(((np.array(one.albedo_low) <= mean) & (mean <= one.albedo_high)).mean())
    return {"measured": share(known & measured), "filled": share(known & ~measured), "objects": float(np.mean(means))}


def gloss_held(run: Recovery, gloss: dict[int, tuple[float, float]]) -> list[bool]:
    """Whether roughness and F0 lie within the intervals of each object that has them."""
    found = []
    for m in run.materials():
        if m.object_id in gloss:
            roughness, f0 = gloss[m.object_id]
            found += [m.roughness_low <= roughness <= m.roughness_high, m.f0_low <= f0 <= m.f0_high]
    return found


@pytest.fixture(scope="module")
def recovered(tmp_path_factory) -> dict[str, tuple[Recovery, np.ndarray, dict]]:
    """A finished recovery of each room, its true albedo, and its objects' true roughness and F0."""
    folder, result = tmp_path_factory.mktemp("rooms"), {}
    for k, name in enumerate(ROOMS):
        room = known_rooms(FRAMES)[name]
        capture = read_capture(room.render(folder / f"capture{k}", SIZE, SAMPLES))
        with Store(folder / f"result{k}") as store:
            run = Recovery(capture, store, SETTINGS, Progress(), unwrap)
            run.specular()
        paints = {thing.object_id: thing.paints[0] for thing in room.things}
        gloss = {i: (paint.roughness, paint.f0) for i, paint in paints.items() if paint.f0}
        result[name] = run, room.albedo(run.surface().atlas), gloss
    return result


@pytest.mark.slow
def test_intervals_of_albedo_hold_the_truth(recovered):
    by_room = {name: held(run, truth) for name, (run, truth, _) in recovered.items()}
    for kind in ("measured", "filled", "objects"):
        mean = np.mean([shares[kind] for shares in by_room.values()])
        assert 0.85 <= mean <= (0.95 if kind == "measured" else 0.99), (kind, by_room)
    assert all(shares["measured"] > 0.8 for shares in by_room.values()), by_room


def test_intervals_of_gloss_hold_the_truth(recovered):
    """Of 18 numbers that are held with a chance of 0.9 each, fewer than 14 are in 3 % of cases."""
    hits = [hit for run, _, gloss in recovered.values() for hit in gloss_held(run, gloss)]
    assert len(hits) >= 12 and np.mean(hits) > 0.7, hits


def test_no_dielectric_is_taken_for_a_metal(recovered):
    """With 5.2's noise two of the room with the window were, when a metal could have a diffuse part."""
    for name, (run, _, _) in recovered.items():
        assert not [m.class_name for m in run.materials() if m.model == METAL], name


def test_intervals_are_no_wider_than_they_need_be(recovered):
    """The stated error is within a factor of two or so of the error that there is.

    One room alone may be lucky, as that with the unseen lamp is on 5.2: right within 0.1 % where its lamp's 10 % are
    doubted.
    """
    ratios = {}
    for name, (run, truth, _) in recovered.items():
        told = np.isfinite(truth).all(1) & (run.albedo.origin == MEASURED)
        off = np.median(np.abs(run.albedo.rho[told] - truth[told]))
        ratios[name] = 0.6745 * np.median(run.evidence.texels.albedo[told]) / off
    assert 1 / 1.5 < np.exp(np.mean(np.log(list(ratios.values())))) < 2.25, ratios
    assert all(1 / 1.5 < ratio < 3 for ratio in ratios.values()), ratios
