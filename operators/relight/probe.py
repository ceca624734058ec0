"""`bpy.ops.scan_relight.bake_preview`: the room's indirect light for EEVEE."""

from __future__ import annotations

from contextlib import suppress
from functools import partial

import bpy

from ...addon.bridge.relight import probe
from ...addon.core.errors import ScanRelightError
from ..base import poll
from .base import RelightOperator


class SCAN_RELIGHT_OT_bake_preview(RelightOperator, bpy.types.Operator):
    """Bake how light bounces through the room for EEVEE, and make its preview about as bright as the picture by Cycles
    through several of the cameras. Bake again after the light has changed. The status bar shows how far it is, ESC
    ends it"""

    bl_idname = "scan_relight.bake_preview"
    bl_label = "Bake Preview Light"

    _wait = True

    def invoke(self, context, event):
        """From a button: the window stays alive meanwhile."""
        self._wait = False
        return self.execute(context)

    def work(self, context):
        probe.bake(context.scene, self._wait)
        if self._wait:
            probe.fit(context.scene)
        else:
            bpy.app.timers.register(partial(_fit_when_baked, context.scene.name), first_interval=0.5)


def _fit_when_baked(name: str) -> float | None:
    """A timer: once Blender's own bake has ended, bring it to Cycles' brightness."""
    baking = {one.bl_idname for window in bpy.context.window_manager.windows for one in window.modal_operators}
    if "OBJECT_OT_lightprobe_cache_bake" in baking:
        return 0.5
    scene = bpy.data.scenes.get(name)
    if scene is not None:
        with suppress(ScanRelightError):  # then the light stays as it was baked
            probe.fit(scene)
    return None


@poll.needs(lambda context: probe.probes(context.scene), "No preview light was baked here.")
class SCAN_RELIGHT_OT_remove_preview(RelightOperator, bpy.types.Operator):
    """Remove the light that was baked for EEVEE"""

    bl_idname = "scan_relight.remove_preview"
    bl_label = "Remove Preview Light"

    def work(self, context):
        probe.remove(context.scene)
