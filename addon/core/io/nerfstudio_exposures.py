"""What `transforms.json` tells of exposures: our own keys, and those that cameras' settings go by."""

import math
from collections.abc import Sequence
from pathlib import Path

from ..errors import BadInputError
from ..scene.model import Frame, Shot
from .exposures import EXPOSURE, Settings, from_settings, settings_of
from .files import inside
from .nerfstudio_camera import Entry
from .pictures import ENDINGS


def ended(path: Path, name: str) -> Path:
    """`path`, or with the ending that it lacks, as in the NeRF-synthetic scenes.

    Raises
    ------
    BadInputError
        No file can be called so.
    """
    try:
        if path.is_file() or path.suffix.lower() in ENDINGS:
            return path
        found = [full for full in (path.with_name(path.name + ending) for ending in ENDINGS) if full.is_file()]
    except (OSError, ValueError) as error:  # a name that the system can't even ask for
        raise BadInputError(f"Frame '{name}' has a file_path that can't be a file; mend it.") from error
    if found:
        return found[0]
    return path if path.suffix else path.with_name(path.name + ENDINGS[0])


def read_brackets(root: Path, entry: Entry, outside: bool) -> tuple[Shot, ...]:
    """Further exposures of a frame: its `brackets`, a list of {file_path, exposure, saturation}.

    Raises
    ------
    BadInputError
        They are no such list, or lead out of the capture.
    """
    listed, name = entry.own.get("brackets"), entry.name
    if listed in (None, []):
        return ()
    if not isinstance(listed, list) or not all(isinstance(one, dict) for one in listed):
        raise BadInputError(
            f"Frame '{name}' has brackets that are no list of objects; give file_path and exposure of each."
        )
    if any(one.get(EXPOSURE) is None for one in listed):
        raise BadInputError(f"Frame '{name}' has brackets without an exposure; give each its own.")
    saturation = {"saturation": entry.get("saturation")}
    return tuple(
        Shot(
            ended(inside(root, one.own.get("file_path"), name, outside), name),
            one.positive(EXPOSURE, 1.0),
            one.positive("saturation", math.inf),
        )
        for one in (Entry(saturation, told, name) for told in listed)
    )


def with_settings(frames: Sequence[Frame], told: Sequence[Entry]) -> tuple[list[Frame], list[str]]:
    """Give the frames exposures by what the camera was set to, unless any of them states an exposure.

    Parameters
    ----------
    told : sequence of Entry
        For each frame.

    Returns
    -------
    As `exposures.from_settings`.
    """
    if any(keys.get(EXPOSURE) is not None for one in told for keys in (one.top, one.own)):
        return list(frames), []
    return from_settings(frames, [_settings(one) for one in told], "the camera's settings in the poses' file")


def _settings(entry: Entry) -> Settings | None:
    """What the camera was set to; None also where what is told is no number (`auto`)."""
    try:
        return settings_of(entry.own, entry.name)
    except BadInputError:
        return None
