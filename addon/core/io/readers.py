"""The formats that are known, the more telling before the more general; which of them a folder has."""

from __future__ import annotations

from pathlib import Path

from ..errors import BadInputError
from . import colmap, fipt, nerfstudio, replica, scannetpp, traj
from .layout import Reader

READERS: tuple[Reader, ...] = (
    replica.READER,
    fipt.SYNTHETIC,
    fipt.REAL,
    scannetpp.READER,
    traj.READER,
    nerfstudio.READER,
    colmap.READER,
)


def reader_for(root: Path, name: str = "") -> Reader:
    """The reader of the capture `root`: the one called `name`, or the first that finds its files.

    Raises
    ------
    BadInputError
        No format is called so, or none fits.
    """
    if name:
        for reader in READERS:
            if reader.name == name:
                return reader
        raise BadInputError(f"There is no format '{name}'; choose one of {', '.join(r.name for r in READERS)}.")
    for reader in READERS:
        if reader.find(root):
            return reader
    wanted = "; ".join(f"{reader.wants} ({reader.name})" for reader in READERS)
    raise BadInputError(f"Folder '{root}' holds no capture that is known; it needs one of: {wanted}.")
