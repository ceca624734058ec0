"""The preview's light: EEVEE beside Cycles, which needs a window's graphics, before and after baking."""

from __future__ import annotations

import math
import shutil

import pytest

MEDIAN = """
import importlib
import numpy as np
scene = bpy.context.scene
pictures = module("addon.bridge.pictures")
exr = importlib.import_module(pictures.__name__.replace("bridge.pictures", "core.io.exr"))
with pictures.settings_kept(scene):
    pictures.prepare(scene, {engine!r}, {samples})
    scene.render.resolution_x, scene.render.resolution_y, scene.render.resolution_percentage = 64, 48, 100
    pictures.shoot(scene, Path({out!r}))
answer = float(np.median(exr.read_exr(Path({out!r})).rgb @ np.array((0.2126, 0.7152, 0.0722))))
"""


@pytest.fixture(scope="module")
def window(open_window, recovered, tmp_path_factory):
    folder = shutil.copytree(recovered, tmp_path_factory.mktemp("preview") / "result")
    found = open_window(folder / "scene.blend")
    found.ask("setattr(place()['area'].spaces.active.shading, 'type', 'SOLID')")
    yield found
    found.close()


@pytest.mark.xfail(strict=True, reason="measured 1.8 stops darker in this view; see docs/relighting.md")
def test_eevee_is_within_a_stop_of_cycles(window, tmp_path, figures):
    def median(engine, samples):
        out = str(tmp_path / f"{engine}.exr")
        return window.ask(MEDIAN.format(engine=engine, samples=samples, out=out), patience=300)

    traced, before = median("CYCLES", 64), median("EEVEE", 4)
    window.ask(
        """
with bpy.context.temp_override(**place()):
    answer = list(bpy.ops.scan_relight.bake_preview())
""",
        patience=300,
    )
    after = median("EEVEE", 4)
    figures["preview"] = {"cycles": traced, "eevee before": before, "eevee after": after}
    assert abs(math.log2(after / traced)) < 1 and after > 1.5 * before, figures["preview"]
