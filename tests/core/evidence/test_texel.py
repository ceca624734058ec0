"""Errors of texels and objects in boxes whose light is known."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from addon.core.brdf.emitter import EMITTER
from addon.core.brdf.lambertian import LAMBERTIAN
from addon.core.brdf.material import Z90, ObjectMaterial
from addon.core.evidence.light import LightEvidence, light_evidence, spots
from addon.core.evidence.objects import object_evidence
from addon.core.evidence.params import CALIBRATION
from addon.core.evidence.texel import contrast, texel_evidence, without_light
from addon.core.light.lamps import Lamp
from addon.core.passes.albedo.albedo import FILLED, MEASURED, Albedo
from addon.core.scene.lit_diffuse import LitDiffuse
from addon.core.scene.visibility import CLEAN, EDGE
from tests.core.rooms import DARK, box_sides, lit_box, make_room, radiosity

ALBEDO = {i: (0.5, 0.4, 0.3) for i in range(6)}


@pytest.fixture(scope="module")
def box():
    return make_room(box_sides(), 0.1)


def known(room, seen=None, tier=CLEAN) -> LitDiffuse:
    n = len(room.atlas)
    seen = np.ones(n, bool) if seen is None else seen
    L = np.ones((n, 3), np.float32)
    tier = np.where(seen, tier, -1).astype(np.int8)
    return LitDiffuse(L, np.zeros_like(L), np.where(seen, 9, 0).astype(np.int32), tier, np.zeros(n, np.float32))


def grey(room, rho=0.5, error=0.05, filled=None) -> Albedo:
    n = len(room.atlas)
    origin = np.where(np.zeros(n, bool) if filled is None else filled, FILLED, MEASURED).astype(np.int8)
    return Albedo(np.full((n, 3), rho, np.float32), origin, np.full(n, error, np.float32))


def sure_light(room, noise=0.0, unsure=0.0) -> LightEvidence:
    n = len(room.atlas)
    return LightEvidence(*(np.full(n, x, np.float32) for x in (noise, 0.0, unsure)), n)


def evidence(room, lit, albedo, light, models=None):
    models = models or {}
    n = len(room.atlas)
    materials = [ObjectMaterial(i, "thing", models.get(i, LAMBERTIAN)) for i in range(7)]
    nothing = np.zeros((n, 3), np.float32)
    findings = SimpleNamespace(
        surface=room, lit_diffuse=lit, albedo=albedo, materials=materials, specular=nothing, irradiance=nothing + 1,
        emitters={m.object_id for m in materials if m.model.gives_light},
    )  # fmt: skip
    return texel_evidence(findings, without_light(findings), light)


def test_errors_add_up(box):
    found = evidence(box, known(box), grey(box, error=0.1), sure_light(box, 0.04, 0.03))
    assert np.allclose(found.shading, np.sqrt(0.04**2 + 0.03**2 + CALIBRATION.light_floor**2), rtol=1e-4)
    shrunk = (CALIBRATION.noise_left * 0.04) ** 2 + 0.03**2 + CALIBRATION.light_floor**2
    expected = np.sqrt(0.25 * ((CALIBRATION.own * 0.1) ** 2 + shrunk) + CALIBRATION.left**2)
    assert np.median(found.albedo) == pytest.approx(expected, rel=1e-3)


def test_what_was_filled_in_is_less_certain_the_less_of_its_object_was_seen(box):
    floor = box.atlas.object_id == 0
    half, most = floor & (box.atlas.position[:, 0] > 2), floor & (box.atlas.position[:, 0] > 0.3)
    errors = []
    for hidden in (half, most):
        found = evidence(box, known(box, ~hidden), grey(box, filled=hidden), sure_light(box))
        errors.append(np.median(found.albedo[hidden]))
        assert errors[-1] > np.median(found.albedo[~hidden])
    assert errors[1] > 1.5 * errors[0]


def test_edges_and_texture_are_less_certain(box):
    plain = evidence(box, known(box), grey(box), sure_light(box)).albedo
    edges = evidence(box, known(box, tier=EDGE), grey(box), sure_light(box)).albedo
    assert (edges > 2 * plain).all()
    rho = np.where((box.atlas.position[:, :1] * 5).astype(int) % 2, 0.7, 0.2).astype(np.float32).repeat(3, 1)
    striped = Albedo(rho, grey(box).origin, grey(box).error)
    assert np.median(contrast(box.atlas, rho.mean(1))) > 0.3
    found = evidence(box, known(box), striped, sure_light(box)).albedo
    assert np.median(found / rho) > 2 * np.median(plain / 0.5)


def test_a_lamp_has_no_albedo_and_no_error(box):
    found = evidence(box, known(box), grey(box), sure_light(box), {3: EMITTER})
    assert not found.albedo[box.atlas.object_id == 3].any()
    assert found.albedo[box.atlas.object_id != 3].all()


def test_an_object_is_surer_than_its_texels_and_says_what_was_seen(box):
    hidden = (box.atlas.object_id == 0) & (box.atlas.position[:, 0] > 1)
    lit, albedo = known(box, ~hidden), grey(box, filled=hidden)
    texels = evidence(box, lit, albedo, sure_light(box, 0.1))
    findings = SimpleNamespace(surface=box, lit_diffuse=lit, albedo=albedo)
    floor, ceiling = object_evidence(findings, texels)[:2]
    assert floor.seen_share == pytest.approx(0.25, abs=0.01) and ceiling.seen_share == 1
    assert ceiling.albedo == pytest.approx((0.5, 0.5, 0.5))
    half = Z90 * CALIBRATION.of_object * float(texels.albedo[box.atlas.object_id == 1].mean())
    assert ceiling.albedo_high[0] - 0.5 == pytest.approx(half, rel=0.05)
    assert ceiling.albedo_low[0] == pytest.approx(1 - ceiling.albedo_high[0], abs=1e-4)


def test_spots_stand_for_their_own_object_and_side(box):
    seen = box.atlas.position[:, 0] > 1
    chosen, nearest = spots(box.atlas, seen, 300)
    stands = chosen[nearest]
    assert 200 < len(chosen) < 1000
    assert (box.atlas.object_id[stands] == box.atlas.object_id).all() and (seen[stands] == seen).all()
    assert np.linalg.norm(box.atlas.position[stands] - box.atlas.position, axis=1).max() < 1.5


def light_of(room, off: float, seen_lamp: bool):
    """Evidence of E that is right but for `off` (a relative error of random sign), the lamp seen or solved for."""
    radiance = radiosity(room, ALBEDO, {6: (20, 20, 20)}).astype(np.float32)
    field = room.field(radiance).with_light(radiance, lamps=[6])
    n = len(room.atlas)
    shading = SimpleNamespace(
        irradiance=np.zeros((n, 3), np.float32), environment=DARK, sun=None,
        lamps=(Lamp(6, np.full(3, 20.0), seen_lamp),),
    )  # fmt: skip
    lamp = room.atlas.object_id == 6
    sign = np.random.default_rng(0).choice([-1, 1], n)[:, None]
    shading.irradiance[:] = np.pi * radiance / room.by_object(ALBEDO, 1.0) * np.exp(off * sign)
    lit = known(room, seen_lamp | ~lamp)
    findings = SimpleNamespace(field=field, shading=shading, lit_diffuse=lit, threads=0, seed=0)
    return light_evidence(findings, np.full(n, 0.2, np.float32)), lamp


@pytest.fixture(scope="module")
def lit_room():
    return make_room(lit_box(), 0.2)


@pytest.mark.parametrize("off", [0.0, 0.1, 0.3])
def test_the_error_of_the_light_is_found(lit_room, off):
    found, lamp = light_of(lit_room, off, True)
    assert np.median(found.noise[~lamp]) == pytest.approx(off, abs=0.035)
    assert not found.unseen.any() and not found.unsure.any()


def test_light_of_a_lamp_that_nobody_saw_is_unsure(lit_room):
    found, lamp = light_of(lit_room, 0.0, False)
    floor = lit_room.atlas.object_id == 0
    share = np.median(found.unseen[floor])
    assert 0.3 < share < 0.8
    assert np.median(found.unsure[floor]) == pytest.approx(share * CALIBRATION.solved, rel=0.05)
