"""Blender starts with the add-on enabled: that must cost next to nothing, and work before its packages are there."""

from __future__ import annotations

import subprocess
import sys

REGISTER = """
import importlib.util, os, sys
import bpy
known = set(sys.modules)
spec = importlib.util.spec_from_file_location("scan_relight", {root!r} + "/__init__.py",
                                              submodule_search_locations=[{root!r}])
sys.modules["scan_relight"] = package = importlib.util.module_from_spec(spec)
spec.loader.exec_module(package)
package.register()
print("LOADED", *sorted({{name.split(".")[0] for name in set(sys.modules) - known}}), flush=True)
os._exit(0)  # Blender 5.2 as a module may hang at its end
"""


def test_registering_loads_none_of_the_bundled_packages(root):
    told = subprocess.run([sys.executable, "-c", REGISTER.format(root=str(root))], capture_output=True, text=True)
    line = next((one for one in told.stdout.splitlines() if one.startswith("LOADED")), None)
    assert line is not None, told.stdout + told.stderr
    assert "scan_relight" in line.split()
    assert not {"OpenEXR", "scipy", "embreex", "OpenImageIO"} & set(line.split())
