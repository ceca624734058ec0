"""A hash that changes with a capture, by which stored stages are known again."""

import dataclasses
import hashlib
import os

import numpy as np

from ..errors import BadInputError
from ..scene.model import Capture


def fingerprint(capture: Capture) -> str:
    """A hash of the mesh, the objects and the frames as they were read; name, size and time of each picture.

    Pictures are not read through: they are most of a capture, and one that was replaced has another time.

    Raises
    ------
    BadInputError
        A picture was taken away since the capture was read.
    """
    digest = hashlib.sha256()

    def add(value: object) -> None:
        if isinstance(value, np.ndarray):
            digest.update(f"{value.dtype.str}{value.shape}".encode())
            digest.update(np.ascontiguousarray(value).data)
        elif isinstance(value, os.PathLike):
            stat = os.stat(value)
            name = os.path.relpath(value, capture.root)
            digest.update(f"{name} {stat.st_size} {stat.st_mtime_ns}\n".encode("utf-8", "surrogatepass"))
        elif dataclasses.is_dataclass(value):
            digest.update(type(value).__name__.encode())
            for field in dataclasses.fields(value):
                add(getattr(value, field.name))
        elif isinstance(value, (tuple, list)):
            digest.update(f"({len(value)}".encode())
            for item in value:
                add(item)
        else:
            digest.update(f"{value!r};".encode("utf-8", "surrogatepass"))

    try:
        add([capture.mesh, capture.instances, capture.frames, capture.mirrors])
    except OSError as error:
        raise BadInputError(f"'{error.filename}' was taken away during the run; put it back and start anew.") from error
    return digest.hexdigest()
