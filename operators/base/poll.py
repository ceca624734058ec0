"""What operators ask in `poll`: each check says in one sentence why not, as Blender's tooltips show it."""

from __future__ import annotations

from .job_operator import active


def check(operator, fine: bool, otherwise: str) -> bool:
    """Whether `fine`; where not, the operator's tooltip says `otherwise`."""
    if not fine:
        operator.poll_message_set(otherwise)
    return fine


def has_scene(operator, context) -> bool:
    """There is a scene."""
    return check(operator, context.scene is not None, "There is no scene to work in.")


def object_mode(operator, context) -> bool:
    """Nothing is being edited."""
    return check(operator, context.mode == "OBJECT", "Leave the editing mode for object mode first.")


def no_run(operator) -> bool:
    """No job is at work."""
    return check(operator, active() is None, "A run is going on; stop it first or wait for its end.")


def has_capture(operator, context) -> bool:
    """The scene's panel has a capture's folder."""
    return check(
        operator,
        context.scene is not None and bool(context.scene.scan_relight.capture_folder),
        "Choose the capture's folder first.",
    )
