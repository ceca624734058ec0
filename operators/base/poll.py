"""What operators ask in `poll`: each check says in one sentence why not, as Blender's tooltips show it."""

from __future__ import annotations

from collections.abc import Callable

from .job_operator import active


def check(operator, fine: bool, otherwise: str) -> bool:
    """Whether `fine`; where not, the operator's tooltip says `otherwise`."""
    if not fine:
        operator.poll_message_set(otherwise)
    return fine


def needs(fine: Callable, otherwise: str | Callable[[], str]):
    """Class decorator: `poll` asks this of the context after all that it asks already.

    Parameters
    ----------
    fine : callable
        From the context to whether the operator can run.
    otherwise : str or callable
        What the tooltip says where it can't.
    """

    def asking(cls):
        before = getattr(cls, "poll", None)
        before = before.__func__ if before else lambda cls, context: True

        def poll(cls, context):
            return before(cls, context) and check(
                cls, bool(fine(context)), otherwise if isinstance(otherwise, str) else otherwise()
            )

        cls.poll = classmethod(poll)
        return cls

    return asking


has_scene = needs(lambda context: context.scene is not None, "There is no scene to work in.")
object_mode = needs(lambda context: context.mode == "OBJECT", "Leave the editing mode for object mode first.")
no_run = needs(lambda context: active() is None, "A run is going on; stop it first or wait for its end.")
has_capture = needs(lambda context: context.scene.scan_relight.capture_folder, "Choose the capture's folder first.")


def free_scene(cls):
    """Class decorator: for all that changes the scene, or starts what does."""
    return no_run(object_mode(has_scene(cls)))
