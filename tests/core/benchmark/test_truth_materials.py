"""Materials against a room's truth, with its objects and with parts that were found."""

import numpy as np
import pytest

from addon.benchmark.truth_materials import score_materials
from addon.benchmark.truth_views import pairs
from addon.core.brdf.dielectric import DIELECTRIC
from addon.core.brdf.lambertian import LAMBERTIAN
from addon.core.brdf.material import ObjectMaterial

TRUE = {"emission": None, "metallic": 0.0, "masked": False}
TRUTH = {
    0: TRUE | {"bsdf": "principled", "alpha": 0.09},
    1: TRUE | {"bsdf": "diffuse", "alpha": None},
    2: TRUE | {"bsdf": "diffuse", "alpha": None, "masked": True},
}


def test_an_object_has_the_model_that_most_of_its_pixels_show():
    parts = [ObjectMaterial(7, "table", DIELECTRIC, alpha=0.16, f0=0.04), ObjectMaterial(8, "wall", LAMBERTIAN)]
    scores = score_materials(
        parts, TRUTH, {(0, 7): 300, (0, 8): 100, (1, 7): 90, (1, 8): 110, (2, 7): 500, (5, 7): 500}
    )
    assert scores.models == {"specular as specular": 1, "lambertian as lambertian": 1}
    assert scores.right == scores.objects == 2
    # Where no lobe was found, Blender's default stands: .5.
    assert scores.roughness_by_pixel == pytest.approx((300 * 0.1 + 100 * 0.2) / 400)
    few = score_materials(parts, TRUTH, {(0, 7): 60, (0, 8): 30})
    assert few.objects == 0 and np.isnan(few.roughness_by_pixel)


def test_pairs_are_counted_where_a_pixel_shows_one_object():
    view = {
        "id": np.array([0, 0, 1, 1]),
        "found": np.array([7, 8, 8, 8]),
        "inside": np.array([True, True, True, False]),
    }
    assert pairs([view, view]) == {(0, 7): 2, (0, 8): 2, (1, 8): 2}
