"""The exposure for a light: a small picture is rendered and its median brought to middle grey.

As `scene.py` does with the median of the frames, so that the captured light gives about the captured exposure.
"""

import math

import bpy

from ...core.errors import BadInputError
from ...core.kinds import Limit
from ...core.photo import MIDDLE_GREY
from ..scene.parts import EXPOSURE
from . import estimate
from .pictures import small_median

CAPTURED = "scan_relight_captured_exposure"
"""Custom property of a scene: its exposure before ours, in stops."""
_MAX_STOPS: Limit[float] = 32.0


def measure(scene: bpy.types.Scene) -> float:
    """The exposure in stops that shows the median of the current picture as middle grey."""
    if scene.camera is None:
        raise BadInputError("The scene has no camera to measure the light through; choose a frame first.")
    median = small_median(scene)
    if not median > 0:
        raise BadInputError("No light reaches what the camera looks at; switch a lamp on or add a light.")
    return min(max(math.log2(MIDDLE_GREY / median), -_MAX_STOPS), _MAX_STOPS)


def expose(scene: bpy.types.Scene) -> float:
    """Set the scene's exposure by `measure`; returns it in stops. Raises as `measure`."""
    stops = measure(scene)
    _set(scene, stops)
    return stops


def _set(scene: bpy.types.Scene, stops: float) -> None:
    """Set the exposure; the previous one is stored for `restore`."""
    if CAPTURED not in scene:
        scene[CAPTURED] = scene.view_settings.exposure
    scene.view_settings.exposure = min(max(stops, -_MAX_STOPS), _MAX_STOPS)


def restore(scene: bpy.types.Scene) -> None:
    """The exposure as it was before `expose`."""
    if CAPTURED in scene:
        scene.view_settings.exposure = scene.pop(CAPTURED)


def captured_exposure(scene: bpy.types.Scene) -> float:
    """The exposure in stops that shows the captured light: the room's own, else what it was before `expose`."""
    return float(scene.get(EXPOSURE, scene.get(CAPTURED, scene.view_settings.exposure)))


def follow(scene: bpy.types.Scene) -> None:
    """Set the exposure by `relight.estimate`, if that has a result; nothing is rendered."""
    stops = estimate.estimate(scene)
    if stops not in (None, estimate.NO_LIGHT):
        _set(scene, captured_exposure(scene) - stops)


def darkness(scene: bpy.types.Scene) -> str:
    """A sentence where the picture is estimated much darker or brighter than the captured one; '' otherwise."""
    stops = estimate.stops(scene)
    if stops is None:
        return ""
    if stops == estimate.NO_LIGHT:
        return "No light is on that reaches what the camera looks at."
    raised = scene.view_settings.exposure - captured_exposure(scene)
    if abs(stops + raised) < 0.5:
        return ""
    light_text = "about as captured"
    if abs(stops) >= 0.5:
        light_text = f"about {abs(stops):.1f} stops {'darker' if stops < 0 else 'brighter'} than captured"
    exposure_text = "as captured" if abs(raised) < 0.05 else f"{abs(raised):.1f} stops {'up' if raised > 0 else 'down'}"
    return f"The light is {light_text}; exposure is {exposure_text}."
