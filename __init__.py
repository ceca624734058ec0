"""Scan Relight: from a posed HDR capture of a room to a Blender scene that can be relit.

As a library: `import scan_relight; scan_relight.recover(...)`. Blender starts with this module, so that what it gives
is loaded when it is first asked for.
"""

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from .addon.api import *  # noqa: F403  (its `__all__` is the same)

__all__ = [  # noqa: F405
    "PRESETS",
    "BadInputError",
    "Camera",
    "Capture",
    "Frame",
    "InterruptedRun",
    "Layout",
    "Mesh",
    "ObjectMaterial",
    "ProgressEvent",
    "RawMesh",
    "Reader",
    "Reading",
    "Recovered",
    "ScanRelightError",
    "Settings",
    "read_capture",
    "recover",
    "register_reader",
    "unwrapper",
]


def __getattr__(name: str) -> Any:
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from .addon import api

    return getattr(api, name)


def register():
    """Register the operators and the command line; called by Blender."""
    from . import operators
    from .addon import cli

    operators.register()
    cli.register()


def unregister():
    """Take back everything that `register` did."""
    from . import operators
    from .addon import cli

    cli.unregister()
    operators.unregister()
