"""Archives of arrays: whole, and as they were written, or told to be damaged."""

from __future__ import annotations

import errno
import gc
import io
import json
import os
import sys
import tracemalloc
import zipfile
import zlib

import numpy as np
import pytest

from addon.core.errors import StorageError
from addon.core.results.archive import META, Damaged, read_archive, write_archive
from tests.core.results.tampering import entries, told, ways, write

ARRAYS = {
    "values": np.random.default_rng(0).random((50, 3), np.float32),
    "none": np.zeros((0, 3)),
    "flag": np.array(True),
    "names": np.array(["a", "bc"]),
}


@pytest.fixture
def path(tmp_path):
    write_archive(tmp_path / "a.npz", ARRAYS, {"key": "k"})
    return tmp_path / "a.npz"


def test_what_is_written_is_read(path):
    tells, arrays = read_archive(path)
    assert tells == {"key": "k"} and arrays.keys() == ARRAYS.keys()
    for name, values in ARRAYS.items():
        np.testing.assert_array_equal(arrays[name], values)
        assert arrays[name].dtype == values.dtype and arrays[name].flags.writeable
    assert read_archive(path, {"flag"}) == ({"key": "k"}, {"flag": True})
    with np.load(path, allow_pickle=False) as archive:  # others can read it
        np.testing.assert_array_equal(archive["values"], ARRAYS["values"])


def test_every_change_is_found(path):
    good = path.read_bytes()
    for name, change in ways(path):
        change()
        with pytest.raises(Damaged):
            read_archive(path)
            pytest.fail(name)
        path.write_bytes(good)
    read_archive(path)


def test_every_byte_counts(path):
    """A byte that is turned over is found, or is none of the content's (dates and rights in the zip's directory)."""
    good, missed = path.read_bytes(), 0
    for at in range(0, len(good), 7):
        path.write_bytes(good[:at] + bytes([good[at] ^ 0xFF]) + good[at + 1 :])
        try:
            tells, arrays = read_archive(path)
        except Damaged:
            continue
        missed += 1
        assert tells == {"key": "k"} and arrays.keys() == ARRAYS.keys()
        assert all(np.array_equal(arrays[name], values) for name, values in ARRAYS.items())
    assert missed < len(good) / 35


def test_what_claims_more_than_the_file_holds_takes_no_memory(path):
    header = io.BytesIO()
    np.lib.format.write_array_header_1_0(header, {"descr": "<f8", "fortran_order": False, "shape": (1 << 30,)})
    content = entries(path)
    huge = content | {"values.npy": header.getvalue()}
    write(path, huge)
    with zipfile.ZipFile(path) as archive:
        sums = [[one.filename[:-4], one.CRC] for one in archive.infolist()[:-1]]
    tells = json.dumps({"told": {}, "sums": sums})
    checked = json.dumps([tells, zlib.crc32(tells.encode())]).encode()
    write(path, huge | {f"{META}.npy": told(np.frombuffer(checked, np.uint8))})  # who did it knew of the sums
    tracemalloc.start()
    with pytest.raises(Damaged, match="length"):
        read_archive(path)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 1 << 22


class Filling(io.FileIO):
    """A file on a disk that has room for `left` bytes."""

    left = 0

    def write(self, data):
        data = bytes(data)[: Filling.left]
        if not data:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        Filling.left -= len(data)
        return super().write(data)


def test_a_disk_that_fills_at_any_byte_is_told_once(path, monkeypatch):
    whole, more = path.read_bytes(), []
    big = {"values": np.zeros((5000, 3), np.float32), **ARRAYS}
    write_archive(path, big, {})
    size = path.stat().st_size
    path.write_bytes(whole)
    monkeypatch.setattr(sys, "unraisablehook", more.append)
    monkeypatch.setattr("builtins.open", lambda name, mode="r", *_: io.BufferedWriter(Filling(name, mode)))
    for room in (*range(0, size - 1, 4999), *range(size - 900, size, 61)):
        Filling.left = room
        with pytest.raises(StorageError, match="No space left"):
            write_archive(path, big, {})
        gc.collect()
    monkeypatch.undo()
    assert not more and path.read_bytes() == whole
    assert [one.name for one in path.parent.iterdir()] == [path.name]
