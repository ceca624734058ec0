"""`bpy.ops.scan_relight.expose`: the exposure that the present light asks for."""

from __future__ import annotations

import time

import bpy

from ...addon.bridge.relight import estimate, exposure
from ...addon.core.errors import ScanRelightError
from ...addon.core.kinds import Shown
from ..base.job_operator import areas
from .base import RelightOperator

_REST: Shown[float] = 0.2
_SLICE: Shown[float] = 0.02
"""Seconds that a slider stays still to count as let go; that looking takes of the window's time at once."""
_looked: dict = {"run": None}


class SCAN_RELIGHT_OT_expose(RelightOperator, bpy.types.Operator):
    """Measure the light in a small picture and set the exposure so that its median is middle grey; takes some
    seconds"""

    bl_idname = "scan_relight.expose"
    bl_label = "Expose for This Light"

    def work(self, context):
        exposure.expose(context.scene)


class SCAN_RELIGHT_OT_restore_exposure(RelightOperator, bpy.types.Operator):
    """Set the exposure back to what it was before it was measured"""

    bl_idname = "scan_relight.restore_exposure"
    bl_label = "Captured Exposure"

    def work(self, context):
        exposure.restore(context.scene)


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
        _looked["run"] = estimate.looking(scene)
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
