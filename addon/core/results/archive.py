"""Arrays and their metadata in one file, as NumPy reads it; that it was changed, or is cut off, is found out.

A .npz whose last entry holds the metadata, as JSON, and the checksum (CRC-32) of every array, in their order: the one
that the zip format has anyway, so that it costs nothing. It detects accidents, and changes by programs that don't know
of it; it is no signature.
"""

import json
import math
import os
import zipfile
import zlib
from collections.abc import Container, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ..atomic import replacing
from ..json_values import plain

META = "__meta__"


class Damaged(Exception):
    """A file is no archive as it was written: cut off, changed, or of something else."""


def write_archive(path: Path, arrays: Mapping[str, np.ndarray], metadata: Mapping[str, Any]) -> None:
    """Write `arrays` and their `metadata`, whole or not at all; the same content makes the same file.

    Uncompressed: compressing costs more time than it saves, as these are mostly noise in their low bits.

    Raises
    ------
    StorageError
        The disk is full or can't be written; what was there before is still there.
    ValueError
        An array holds Python objects.
    """
    if any(np.asarray(array).dtype.hasobject for array in arrays.values()):
        raise ValueError(f"'{path.stem}' holds an array of objects")
    # Not np.savez: it takes the array names as keywords, so 'file' could not be one, stamps the time of day, and where
    # the disk is full leaves an archive open that fails once more when it is forgotten.
    with replacing(path) as temporary, open(temporary, "wb") as file:
        with zipfile.ZipFile(file, "w", zipfile.ZIP_STORED) as archive:
            for name, array in arrays.items():
                _write(archive, name, np.asarray(array))
            sums = [[_name(entry), entry.CRC] for entry in archive.infolist()]
            content = json.dumps({"told": plain(metadata), "sums": sums})
            checked = json.dumps([content, zlib.crc32(content.encode())]).encode()
            _write(archive, META, np.frombuffer(checked, np.uint8))
        file.flush()
        os.fsync(file.fileno())


def read_archive(path: Path, wanted: Container[str] | None = None) -> tuple[dict[str, Any], dict[str, np.ndarray]]:
    """The metadata of an archive, and its arrays, all or the `wanted` ones; no other is read.

    Raises
    ------
    FileNotFoundError
    Damaged
    """
    try:
        # Opened here: given a path, zipfile leaves a damaged file open.
        with open(path, "rb") as file, zipfile.ZipFile(file) as archive:
            *entries, last = archive.infolist()
            size = os.fstat(file.fileno()).st_size
            if _name(last) != META:
                raise Damaged("what is told of the arrays is missing")
            text, checked = json.loads(_read(archive, last, size).tobytes())
            if zlib.crc32(text.encode()) != checked:
                raise Damaged("what is told of the arrays was changed")
            content = json.loads(text)
            if content["sums"] != [[_name(entry), entry.CRC] for entry in entries]:
                raise Damaged("an array was changed")
            names = {_name(entry): entry for entry in entries if wanted is None or _name(entry) in wanted}
            return content["told"], {name: _read(archive, entry, size) for name, entry in names.items()}
    except (FileNotFoundError, MemoryError, Damaged):
        raise
    except Exception as error:  # all that zipfile, NumPy and json raise at what they can't read
        raise Damaged(f"{type(error).__name__}: {error}") from error


def _name(entry: zipfile.ZipInfo) -> str:
    return entry.filename.removesuffix(".npy")


def _write(archive: zipfile.ZipFile, name: str, array: np.ndarray) -> None:
    with archive.open(zipfile.ZipInfo(f"{name}.npy"), "w", force_zip64=True) as entry:
        np.lib.format.write_array(entry, array, allow_pickle=False)


def _read(archive: zipfile.ZipFile, entry: zipfile.ZipInfo, size: int) -> np.ndarray:
    """An array, read to its end, where its checksum is looked at; no more memory than the file has bytes."""
    if entry.compress_type != zipfile.ZIP_STORED or entry.file_size > size:
        raise Damaged("an array was changed")
    with archive.open(entry) as file:
        read_header = {(1, 0): np.lib.format.read_array_header_1_0, (2, 0): np.lib.format.read_array_header_2_0}[
            np.lib.format.read_magic(file)
        ]
        shape, _, dtype = read_header(file)
        if math.prod(shape) * dtype.itemsize != entry.file_size - file.tell():
            raise Damaged("an array's length was changed")
    with archive.open(entry) as file:
        return np.lib.format.read_array(file, allow_pickle=False)
