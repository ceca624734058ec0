"""The preview's light: EEVEE beside Cycles, which needs a window's graphics, before and after baking."""

from __future__ import annotations

import math
import shutil

import pytest

MEDIANS = """
pictures, cameras = module("addon.bridge.relight.pictures"), module("addon.bridge.data.cameras")
scene = bpy.context.scene
found, answer = cameras.frame_cameras(scene), []
before = scene.camera
for one in (before, *found[1::3])[:{views}]:  # the fit looks through the first, the last and two between
    scene.camera = one
    answer.append(pictures.small_median(scene, {engine!r}, {samples}))
scene.camera = before
"""


@pytest.fixture(scope="module")
def window(open_window, recovered, tmp_path_factory):
    folder = shutil.copytree(recovered, tmp_path_factory.mktemp("preview") / "result")
    found = open_window(folder / "scene.blend")
    found.ask("setattr(place()['area'].spaces.active.shading, 'type', 'SOLID')")
    yield found
    found.close()


def test_eevee_is_within_a_stop_of_cycles(window, figures):
    def medians(engine, samples, views=4):
        return window.ask(MEDIANS.format(engine=engine, samples=samples, views=views), patience=600)

    traced, [before] = medians("CYCLES", 64), medians("EEVEE", 4, 1)
    window.ask(
        """
with bpy.context.temp_override(**place()):
    answer = list(bpy.ops.scan_relight.bake_preview())
""",
        patience=600,
    )
    after = medians("EEVEE", 4)
    intensity = window.ask("module('addon.bridge.relight.probe').probes(bpy.context.scene)[0].data.intensity")
    stops = [math.log2(max(got, 1e-6) / wanted) for got, wanted in zip(after, traced, strict=True)]
    figures["preview"] = {
        "cycles": traced,
        "eevee before": before,
        "eevee after": after,
        "stops": stops,
        "intensity": intensity,
    }
    print(figures["preview"])
    assert max(map(abs, stops)) < 1 and after[0] > 1.5 * before, stops
