"""Shared by the operators for the light: when they can run, and what follows a change of the light."""

import time

import bpy

from ...addon.bridge.custom_properties import OBJECT_ID
from ...addon.bridge.relight import estimate, exposure
from ...addon.core.errors import ScanRelightError
from ...addon.core.kinds import Shown
from ..base.job_operator import areas
from ..base.operator import AtOnce, has_scene, needs, object_mode


@object_mode
@has_scene
class SceneOperator(AtOnce):
    """Works in the scene at once, in one undo step; `work` returns warnings."""


@needs(
    lambda context: has_room(context.scene),
    "The scene holds no scanned room yet; recover a capture or open a result's scene.blend.",
)
class RelightOperator(SceneOperator):
    """The same in a scanned room."""


def has_room(scene: bpy.types.Scene) -> bool:
    """Whether any object of a scene was scanned."""
    return any(OBJECT_ID in obj for obj in scene.objects)


_SLIDER_REST: Shown[float] = 0.2
_SLICE: Shown[float] = 0.02
"""Seconds without a change after which a slider counts as released; seconds of one slice of measuring."""
_measuring: dict = {"run": None}


def follow(scene: bpy.types.Scene) -> None:
    """After a change of the light: expose for it, by an estimate, if `follow` is on."""
    if scene.scan_relight_studio.follow and scene.camera is not None:
        exposure.follow(scene)


def follow_soon() -> None:
    """As `follow`, once the slider is released; at once without a window."""
    if bpy.app.background:
        follow(bpy.context.scene)
        return
    if bpy.app.timers.is_registered(_follow_current):
        bpy.app.timers.unregister(_follow_current)
    bpy.app.timers.register(_follow_current, first_interval=_SLIDER_REST)


def _follow_current() -> None:
    scene = bpy.context.scene
    if hasattr(scene, "scan_relight_studio"):  # else the add-on was disabled
        follow(scene)


def measure_soon(scene: bpy.types.Scene) -> None:
    """Start measuring how bright the light is, for a panel; can be called while drawing."""
    if _measuring["run"] is None and not bpy.app.background and not estimate.is_known(scene):
        _measuring["run"] = estimate.measure_in_steps(scene)
        bpy.app.timers.register(_measure_slice, first_interval=_SLICE)


def _measure_slice() -> float | None:
    """One slice of measuring; at the end the panels are redrawn."""
    deadline = time.perf_counter() + _SLICE
    try:
        for _ in _measuring["run"]:
            if time.perf_counter() > deadline:
                return _SLICE
    except (ReferenceError, KeyError, ScanRelightError):  # the room was removed meanwhile; the next redraw starts again
        pass
    _measuring["run"] = None
    for area in areas(bpy.context, "VIEW_3D"):
        area.tag_redraw()
    return None
