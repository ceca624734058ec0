"""Changes stored arrays as another program would: the file stays a sound archive, and says something else."""

from __future__ import annotations

import io
import zipfile
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np


def entries(path: Path) -> dict[str, bytes]:
    """The files in an archive, in their order."""
    with zipfile.ZipFile(path) as archive:
        return {one.filename: archive.read(one) for one in archive.infolist()}


def write(path: Path, content: dict[str, bytes], compression: int = zipfile.ZIP_STORED) -> None:
    with zipfile.ZipFile(path, "w", compression) as archive:
        for name, one in content.items():
            archive.writestr(zipfile.ZipInfo(name), one, compression)


def array(content: bytes) -> np.ndarray:
    return np.load(io.BytesIO(content))


def told(values: np.ndarray) -> bytes:
    file = io.BytesIO()
    np.save(file, values)
    return file.getvalue()


def another(values: np.ndarray) -> np.ndarray:
    """An array of the same shape and type that differs in one value; with one more where it has none."""
    if not values.size:
        return np.zeros((1, *values.shape[1:]), values.dtype)
    values = values.copy()
    first = values.reshape(-1)[:1].view(np.uint8)
    first[-1] ^= 1
    return values


def ways(path: Path) -> Iterator[tuple[str, Callable[[], None]]]:
    """Each way by its name, and what changes the file so: each array in one value and in its length, and the whole."""
    good = entries(path)
    for name in good:
        yield f"{name} changed", lambda name=name: write(path, good | {name: told(another(array(good[name])))})
        yield (
            f"{name} doubled",
            lambda name=name: write(path, good | {name: told(np.repeat(array(good[name])[None], 2, 0))}),
        )
        yield f"{name} gone", lambda name=name: write(path, {n: one for n, one in good.items() if n != name})
    first, *rest = good
    yield "one more", lambda: write(path, {"more.npy": good[first]} | good)
    yield "another order", lambda: write(path, {n: good[n] for n in (*rest[:-1], first, rest[-1]) if n in good})
    yield "compressed", lambda: write(path, good, zipfile.ZIP_DEFLATED)
    yield "other names", lambda: write(path, {"x" + n if n == first else n: one for n, one in good.items()})
