"""How much longer, wider or more sensitive one frame was taken than another.

A camera's settings give the relative exposure H = t S / N^2 (exposure time in seconds, ISO, f-number; ISO 2720). Only
ratios are known, so that of the capture's median frame becomes 1.
"""

import csv
import math
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path, PurePosixPath
from typing import Any, NamedTuple

import numpy as np

from ..errors import BadInputError
from ..kinds import Limit
from ..scene.model import Frame
from . import exif
from .heif import HEIC
from .oiio import JPEG, TIFF
from .pictures import picture_kind
from .raw import DNG

EXPOSURE, NAME = "exposure", ("name", "file", "filepath", "filename", "frame", "image")
TIME = ("exposuretime", "shutter", "shutterspeed", "shuttertime", "exposureduration")
F_NUMBER, ISO = ("fnumber", "aperture", "fstop"), ("iso", "isospeed", "isospeedratings", "photographicsensitivity")
"""Keys and columns, in small letters and without underscores."""
WIDEST: Limit[float] = 1e9
"""Ratio of two exposures that no camera has."""


class Settings(NamedTuple):
    """What a camera was set to; None where it is not told."""

    time: float | None
    f_number: float | None
    iso: float | None


def settings_of(entry: dict[str, Any], name: str) -> Settings | None:
    """The camera's settings among the keys of a frame's JSON object or of a line of a CSV; None where it has none.

    Raises `BadInputError` where one of them is no number above 0.
    """
    key_of = {_plain(key): key for key, value in entry.items() if isinstance(key, str) and value not in (None, "")}
    values = []
    for keys in (TIME, F_NUMBER, ISO):
        key = next((key_of[key] for key in keys if key in key_of), None)
        values.append(None if key is None else parse_number(entry[key], key, name))
    return Settings(*values) if any(value is not None for value in values) else None


def _plain(key: str) -> str:
    return key.strip().lower().replace("_", "")


def parse_number(value: Any, key: str, name: str) -> float:
    """A number above 0 from `value`: itself, '1/60', 'f/2.8', '1/60 s' or [1, 60]; else raises `BadInputError`."""
    number = math.nan
    try:
        if isinstance(value, str):
            text = value.strip().lower().removesuffix("s").removeprefix("f/").removeprefix("iso").strip()
            above, slash, below = text.partition("/")
            number = float(above) / (float(below) if slash else 1.0)
        elif isinstance(value, (list, tuple)) and len(value) == 2:
            number = float(value[0]) / float(value[1])
        elif not isinstance(value, bool):
            number = float(value)
    except (TypeError, ValueError, ArithmeticError):
        pass
    if not 0 < number < math.inf:
        excerpt = repr(value) if len(repr(value)) < 40 else repr(value)[:40] + "..."
        raise BadInputError(f"Frame '{name}' has {key} = {excerpt}; give a number above 0.")
    return number


def relative(settings: Sequence[Settings | None]) -> list[float | None]:
    """Exposure of each frame over the median frame's; None where a setting is missing that others have.

    A setting that no frame tells is the same for all.
    """
    known = [entry for entry in settings if entry is not None]
    stated = [any(entry[i] is not None for entry in known) for i in range(3)]
    values: list[float | None] = []
    for entry in settings:
        if entry is None or any(wanted and value is None for wanted, value in zip(stated, entry)):
            values.append(None)
            continue
        time, f_number, iso = (1.0 if value is None else value for value in entry)
        value = time * iso / f_number / f_number  # not its square, which may be 0
        values.append(value if 0 < value < math.inf else None)
    median = float(np.median([value for value in values if value is not None] or [1.0]))
    return [None if value is None else value / median for value in values]


def from_settings(
    frames: Sequence[Frame], settings: Sequence[Settings | None], source: str
) -> tuple[list[Frame], list[str]]:
    """Give the frames the exposure of their settings (None: the frame keeps its own).

    Returns
    -------
    frames : list of Frame
    notes : list of str
        One sentence where any was used; one where some are not told.
    """
    values = relative(settings)
    known = [value for value in values if value is not None]
    if not known:
        return list(frames), []
    notes = [
        f"Exposures come from {source} (time x ISO / f-number squared, the median frame's as 1), from "
        f"{min(known):.3g} to {max(known):.3g}; give each frame's `exposure` if this is wrong."
    ]
    lacking = [frame.name for frame, value in zip(frames, values) if value is None and frame.exposure == 1]
    if lacking:
        notes.append(
            f"{len(lacking)} of {len(frames)} frames state no exposure (the first: '{lacking[0]}'); it was "
            "taken as 1; give each frame its own."
        )
    return [frame if value is None else replace(frame, exposure=value) for frame, value in zip(frames, values)], notes


def from_exif(frames: Sequence[Frame]) -> tuple[list[Frame], list[str]]:
    """As `from_settings`, by the EXIF of JPEG, TIFF, DNG and HEIC, where no exposure is stated and all of them tell."""
    if any(frame.exposure != 1 or frame.brackets for frame in frames):
        return list(frames), []
    settings: list[Settings | None] = []
    for frame in frames:
        try:
            if picture_kind(frame.path) not in (JPEG, TIFF, DNG, HEIC):
                return list(frames), []
            tags = exif.exif_exposure(frame.path)
        except BadInputError:
            settings.append(None)  # told when its header is looked at
            continue
        if exif.EXPOSURE_TIME not in tags:
            return list(frames), []
        settings.append(Settings(*(tags.get(tag) for tag in (exif.EXPOSURE_TIME, exif.F_NUMBER, exif.ISO))))
    known = [value for value in relative(settings) if value is not None]
    if not known or max(known) == min(known):
        return list(frames), []
    return from_settings(frames, settings, "the pictures' EXIF")


def from_csv(frames: Sequence[Frame], path: Path) -> tuple[list[Frame], list[str], list[str]]:
    """Give the frames the exposures of the table `path`, and leave out those that it does not name.

    The first line names the columns: `name`, and `exposure` or some of `shutter`, `aperture`, `iso`. A name is the
    frame's, its picture's, or the end of its picture's path.

    Returns
    -------
    frames : list of Frame
    problems : list of str
        One for each frame that is left out.
    notes : list of str

    Raises
    ------
    BadInputError
        The table can't be read, names a frame twice, or holds what is no exposure.
    """
    table = _table(path)
    names = _index(frames)
    used: dict[int, dict[str, str]] = {}
    unknown = []
    for name, entry in table.items():
        hits = names.get(name.replace("\\", "/").removeprefix("./"), [])
        if len(hits) > 1:
            raise BadInputError(f"'{path}' has the name '{name}', which {len(hits)} frames have; give the folder, too.")
        if not hits:
            unknown.append(name)
        elif hits[0] in used:
            raise BadInputError(f"'{path}' names frame '{frames[hits[0]].name}' twice; keep one line.")
        else:
            used[hits[0]] = entry
    problems = [f"Frame '{frame.name}' has no line in '{path}'." for i, frame in enumerate(frames) if i not in used]
    notes = []
    if unknown:
        notes.append(
            f"'{path}' has {len(unknown)} lines for frames that the capture has not, such as '{unknown[0]}'; "
            "they are passed over."
        )
    used_frames = [frames[i] for i in sorted(used)]
    entries = [used[i] for i in sorted(used)]
    if entries and EXPOSURE in entries[0]:
        used_frames = [
            replace(frame, exposure=parse_number(entry[EXPOSURE], EXPOSURE, frame.name))
            for frame, entry in zip(used_frames, entries)
        ]
        values = [frame.exposure for frame in used_frames]
        if max(values) > WIDEST * min(values):
            raise BadInputError(f"'{path}' holds exposures from {min(values):g} to {max(values):g}; give factors.")
        return used_frames, problems, notes
    settings = [settings_of(entry, frame.name) for frame, entry in zip(used_frames, entries)]
    used_frames, more = from_settings(used_frames, settings, f"'{path.name}'")
    return used_frames, problems, notes + more


def _table(path: Path) -> dict[str, dict[str, str]]:
    """The lines of the CSV by name, columns as `TIME` has them."""
    if not path.is_file():
        raise BadInputError(f"Table of exposures '{path}' is not there or no file; check --exposures.")
    try:
        with open(path, encoding="utf-8-sig", newline="") as file:
            rows = [row for row in csv.reader(file) if any(cell.strip() for cell in row)]
    except (OSError, ValueError, csv.Error) as error:
        reason = getattr(error, "strerror", None) or error
        raise BadInputError(f"Table of exposures '{path}' can't be read ({reason}); save it as UTF-8 CSV.") from error
    columns = list(map(_plain, rows[0])) if rows else []
    key = next((name for name in NAME if name in columns), None)
    if key is None or not any(name in columns for name in (EXPOSURE, *TIME, *F_NUMBER, *ISO)):
        raise BadInputError(
            f"Table of exposures '{path}' needs a first line that names its columns: name, and "
            "exposure or some of shutter, aperture and iso."
        )
    table: dict[str, dict[str, str]] = {}
    for row in rows[1:]:
        if len(row) != len(columns):
            raise BadInputError(
                f"Table of exposures '{path}' has a line of {len(row)} instead of {len(columns)} cells "
                f"('{','.join(row)[:60]}'); mend it."
            )
        entry = {column: cell.strip() for column, cell in zip(columns, row)}
        if entry[key] in table:
            raise BadInputError(f"'{path}' names frame '{entry[key]}' twice; keep one line.")
        table[entry[key]] = entry
    return table


def _index(frames: Sequence[Frame]) -> dict[str, list[int]]:
    """The frames that each name, picture's name and end of a picture's path can mean; a frame's own name goes first."""
    index: dict[str, list[int]] = {}
    for i, frame in enumerate(frames):
        path = PurePosixPath(frame.path.as_posix())
        ends = {path.stem} | {"/".join(path.parts[k:]) for k in range(len(path.parts))}
        ends |= {str(PurePosixPath(end).with_suffix("")) for end in ends if end and end != "/"}
        for end in ends:
            index.setdefault(end, []).append(i)
    for i, frame in enumerate(frames):
        index[frame.name] = [i]
    return index
