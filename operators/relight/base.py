"""What the operators for the light share: when they can run, and what follows a change of it."""

import time

import bpy

from ...addon.bridge.marks import OBJECT_ID
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
    return any(OBJECT_ID in thing for thing in scene.objects)


_REST: Shown[float] = 0.2
_SLICE: Shown[float] = 0.02
"""Seconds that a slider stays still to count as let go; that looking takes of the window's time at once."""
_looked: dict = {"run": None}


def follow(scene: bpy.types.Scene) -> None:
    """After a change of the light: expose for it, by an estimate, where that was asked for."""
    if scene.scan_relight_studio.follow and scene.camera is not None:
        exposure.follow(scene)


def follow_soon() -> None:
    """As `follow`, once the slider that is dragged has rested; at once without a window."""
    if bpy.app.background:
        follow(bpy.context.scene)
        return
    if bpy.app.timers.is_registered(_rested):
        bpy.app.timers.unregister(_rested)
    bpy.app.timers.register(_rested, first_interval=_REST)


def _rested() -> None:
    scene = bpy.context.scene
    if hasattr(scene, "scan_relight_studio"):  # else the add-on is gone
        follow(scene)


def look_soon(scene: bpy.types.Scene) -> None:
    """Have a panel know before long how bright the light is; it can be asked for by what draws."""
    if _looked["run"] is None and not bpy.app.background and not estimate.is_known(scene):
        _looked["run"] = estimate.measure_in_steps(scene)
        bpy.app.timers.register(_look, first_interval=_SLICE)


def _look() -> float | None:
    """A slice of looking; at its end the panels are drawn anew."""
    until = time.perf_counter() + _SLICE
    try:
        for _ in _looked["run"]:
            if time.perf_counter() > until:
                return _SLICE
    except (ReferenceError, KeyError, ScanRelightError):  # the room went meanwhile; the next drawing asks anew
        pass
    _looked["run"] = None
    for area in areas(bpy.context, "VIEW_3D"):
        area.tag_redraw()
    return None
