"""The table of what Principled's specular layer takes from its diffuse; test_light.py tries it in Cycles."""

import numpy as np
import pytest

from addon.core.brdf.compensation import base_color, layer_reflectance


def test_nothing_is_taken_without_a_lobe():
    assert layer_reflectance(0.0, np.array([0.0, 0.3, 1.0])).max() == 0


def test_it_rises_with_psi_and_falls_with_roughness():
    psi, phi = np.linspace(0, 0.9, 200), np.linspace(0, 1, 100)
    table = layer_reflectance(psi[:, None], phi)
    assert (np.diff(table, axis=0) > 0).all()
    assert (np.diff(table[psi < 0.38], axis=1) <= 1e-9).all()
    assert (table >= psi[:, None] - 1e-12).all() and table.max() <= 0.91


@pytest.mark.parametrize(
    ("psi", "phi", "measured"),
    [(0.03, 0.15, 0.0653), (0.2, 0.35, 0.2161), (0.1, 0.02, 0.1496), (0.001, 0.05, 0.0153), (0.04, 0.002, 0.0921)],
)
def test_measured_between_the_knots(psi, phi, measured):
    """Furnace values of scripts/measure_cycles_layering.py away from its grid."""
    assert layer_reflectance(psi, phi) == pytest.approx(measured, abs=0.0015)


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_base_color(dtype):
    albedo = np.full((2, 3), 0.5, dtype)
    got = base_color(albedo, np.array([0.0, 0.4]), 0.1)
    assert got.dtype == dtype and got.shape == (2, 3)
    np.testing.assert_allclose(got, [[0.5] * 3, [0.5 / (1 - float(layer_reflectance(0.4, 0.1)))] * 3], rtol=1e-6)
    assert np.isfinite(base_color(albedo, 5.0, -1.0)).all()
