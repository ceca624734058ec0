"""The operators, registered from the checkout as the package that Blender would install."""

from __future__ import annotations

import importlib.util
import os
import sys
import tempfile

import pytest

os.environ.setdefault("BLENDER_USER_EXTENSIONS", tempfile.mkdtemp())


@pytest.fixture(scope="module")
def package(root):
    """The checkout as the registered package `scan_relight`."""
    pytest.importorskip("bpy")
    spec = importlib.util.spec_from_file_location("scan_relight", root / "__init__.py",
                                                  submodule_search_locations=[str(root)])
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
