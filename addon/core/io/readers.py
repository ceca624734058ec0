"""The formats that are known, the more telling before the more general; which of them a folder has."""

import functools
from importlib.metadata import EntryPoint, entry_points
from pathlib import Path

from ..errors import BadInputError
from ..origin import package_of, package_of_entry_point
from . import colmap, fipt, nerfstudio, polycam, record3d, replica, scannetpp, stray, textured, traj
from .layout import Layout, Reader, Reading

GROUP = "scan_relight.readers"
"""Entry points of other packages: the name of each is a format's, and it loads a `Reader`."""
READERS: tuple[Reader, ...] = (
    replica.READER,
    fipt.SYNTHETIC,
    fipt.REAL,
    scannetpp.READER,
    polycam.READER,
    record3d.READER,
    stray.READER,
    traj.READER,
    nerfstudio.READER,
    colmap.READER,
    textured.READER,
)
_registered: dict[str, Reader] = {}


def register_reader(reader: Reader) -> None:
    """Have captures of another format read; it is asked before those that Scan Relight brings.

    One of the same name that was registered before is replaced.

    Raises
    ------
    BadInputError
        Scan Relight brings a format of that name.
    """
    if reader.name in {known.name for known in READERS}:
        raise BadInputError(f"There is a format '{reader.name}' already; give the reader another name.")
    _registered[reader.name] = reader


def readers() -> tuple[Reader, ...]:
    """All that can be read: what was registered, what other packages bring as entry points, then our own."""
    taken = {*_registered, *(reader.name for reader in READERS)}
    return (*_registered.values(), *(reader for reader in _of_packages() if reader.name not in taken), *READERS)


@functools.cache
def _of_packages() -> tuple[Reader, ...]:
    return tuple(_loaded(point) for point in entry_points(group=GROUP))


def origin(name: str) -> str:
    """The package that the reader of a format comes from, and its version; "" for the program's own."""
    if name in _registered:
        return package_of(_registered[name].read)
    return next((package_of_entry_point(point) for point in entry_points(group=GROUP) if point.name == name), "")


def _loaded(point: EntryPoint) -> Reader:
    """The reader of an entry point; one that fits no folder, and says why when it is asked for, where it is broken."""
    package = point.dist.name if point.dist is not None else point.value
    try:
        name, wants, find, read = point.load()
        return Reader(point.name, wants, find, read)
    except Exception as error:  # whatever another package does wrong
        message = f"The format '{point.name}' can't be loaded from the Python package '{package}' ({error!r}); mend it."

    def refuse(root: Path, reading: Reading) -> Layout:
        raise BadInputError(message)

    return Reader(point.name, f"nothing, as its package '{package}' is broken", lambda root: False, refuse)


def reader_for(root: Path, name: str = "") -> Reader:
    """The reader of the capture `root`: the one called `name`, or the first that finds its files.

    Raises `BadInputError` where no format is called so, or none fits.
    """
    known = readers()
    found = next((reader for reader in known if (reader.name == name if name else reader.find(root))), None)
    if found is not None:
        return found
    if name:
        raise BadInputError(f"There is no format '{name}'; choose one of {', '.join(r.name for r in known)}.")
    wanted = "; ".join(f"{reader.wants} ({reader.name})" for reader in known)
    raise BadInputError(f"Folder '{root}' holds no capture that is known; it needs one of: {wanted}.")
