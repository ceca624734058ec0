"""Intervals are as wide as estimates differ."""

import numpy as np
import pytest

from addon.core.brdf.dielectric import DIELECTRIC
from addon.core.fit.lobe_fit import fit_lobe
from addon.core.passes.specular.intervals import jackknife
from tests.core.glossy_box import Box


@pytest.mark.slow
@pytest.mark.parametrize("noise", [0.02, 0.08])
def test_the_jackknife_tells_how_far_fits_to_other_elements_lie(noise):
    box = Box()
    estimates, errors = [], []
    for seed in range(8):
        element, direction, _ = box.views(60, 10, seed)
        tone = np.exp(np.random.default_rng(100 + seed).normal(np.log(0.3), 0.3, (element.max() + 1, 3)))
        problem = box.problem(element, direction, 0.11, 0.1, tone[element], noise=noise, seed=seed)
        fit = fit_lobe(problem, DIELECTRIC.constraints)
        estimates.append((np.sqrt(fit.phi), fit.psi.mean()))
        errors.append(jackknife(problem, fit, DIELECTRIC.constraints))
    ratio = np.median(errors, 0) / np.std(estimates, 0, ddof=1)
    assert ((0.5 < ratio) & (ratio < 3)).all(), ratio
