"""The operators, registered from the checkout as the package that Blender would install."""

from __future__ import annotations

import importlib.util
import sys

import pytest


def honest(scene):
    """Cycles without anything that trades truth for calm pictures."""
    cycles = scene.cycles
    cycles.device, cycles.seed, cycles.pixel_filter_type = "CPU", 0, "BOX"
    cycles.use_adaptive_sampling, cycles.use_denoising = False, False
    cycles.sample_clamp_indirect, cycles.blur_glossy = 0, 0


def set_world(scene, path, strength=1.0):
    """Light a scene by an environment image, as a result's is; black without one."""
    from addon.bridge.data.images import load_image
    from addon.bridge.data.nodes import make_world

    scene.world = make_world(
        "Scan Relight", path and load_image(path, "Scan Relight environment", keep=False), strength
    )
    return scene.world


@pytest.fixture
def scene():
    """An empty factory scene, black world, rendered by an honest Cycles."""
    bpy = pytest.importorskip("bpy")
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    scene.render.use_compositing = scene.render.use_sequencer = False
    honest(scene)
    return scene


@pytest.fixture(scope="module")
def package(root):
    """The checkout as the registered package `scan_relight`."""
    pytest.importorskip("bpy")
    spec = importlib.util.spec_from_file_location(
        "scan_relight", root / "__init__.py", submodule_search_locations=[str(root)]
    )
    package = importlib.util.module_from_spec(spec)
    sys.modules["scan_relight"] = package
    spec.loader.exec_module(package)
    package.register()
    yield package
    package.unregister()
    for name in [name for name in sys.modules if name.split(".")[0] == "scan_relight"]:
        del sys.modules[name]


@pytest.fixture
def ops(package):
    """`bpy.ops.scan_relight` over an empty scene."""
    import bpy

    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    return bpy.ops.scan_relight
