"""Spoils a file's content, the same for the same seed: blows that know no format, some that know numbers or JSON."""

from __future__ import annotations

import contextlib
import json
import re
import struct

import numpy as np

from tests.core.io.hostile.blows import spoiled as bytes_spoiled

NUMBERS = (
    "nan",
    "inf",
    "-inf",
    "NaN",
    "Infinity",
    "1e308",
    "-1e308",
    "1e999",
    "-1",
    "0",
    "-0.0",
    "1e-320",
    str(2**31),
    str(2**63),
    str(2**64),
    "9" * 400,
    "0x10",
    "1/0",
    "abc",
    "",
    "\u0663",
    "1_0",
)
WORDS = (
    b"\xff" * 4,
    b"\xff" * 8,
    b"\x7f\xff\xff\xff",
    b"\xff\xff\xff\x7f",
    struct.pack("<Q", 1 << 63),
    struct.pack("<Q", 1 << 32),
    struct.pack("<d", float("nan")),
    struct.pack("<d", 1e308),
    struct.pack("<f", 1e38),
    b"\0" * 8,
    b"\0\0\0\x80",
    b"\x80\0\0\0",
    b"\n",
    b"\0",
    b"\xc3\x28",
    b"\xed\xa0\x80",
    b"\xff\xfe",
)
VALUES = (
    None,
    True,
    -1,
    0,
    2**63,
    1e308,
    float("nan"),
    float("inf"),
    "",
    "a",
    "x" * 100_000,
    [],
    {},
    [[]],
    [None],
    {"a": {}},
    "../../etc/passwd",
    "\0",
    "\ud800",
    [1e308] * 4,
    "C:\\a.exr",
    "//host/share/a.exr",
)
NUMBER = re.compile(rb"[-+]?\d+(?:\.\d*)?(?:[eE][-+]?\d+)?")

LONG = (b"A" * 70_000, b"[" * 5_000, b"\n" * 1000, b"9" * 400, b"\xef\xbb\xbf", b"\0" * 64)


def spoiled(content: bytes, seed: int) -> bytes:
    """One of the ways to spoil `content`."""
    rng = np.random.default_rng(seed)
    way = rng.integers(0, 10)
    if way < 3:
        with contextlib.suppress(ValueError, RecursionError):
            return _json(json.loads(content), rng)
    if way < 6 and b"\0" not in content[:200]:
        return _numbers(content, rng)
    if way == 6:
        return _lines(content, rng)
    return bytes_spoiled(content, min(len(content), 800), rng)


def words_spoiled(content: bytes, seed: int) -> bytes:
    """One to three blows with words that are a number's end, no text, or of the other byte order."""
    rng = np.random.default_rng([seed, 2])
    for _ in range(rng.integers(1, 4)):
        start, end = sorted(rng.integers(0, max(len(content), 1), 2).tolist())
        word = WORDS[rng.integers(len(WORDS))]
        content = (
            content[:start] + word + content[start + len(word) :],
            content[:start] + word + content[start:],
            content[:start] + content[start : start + 4][::-1] + content[start + 4 :],
            content[:end] + content[start:end] * int(rng.integers(1, 4)) + content[end:],
            content[:start],
        )[rng.integers(5)]
    return content


def _numbers(content: bytes, rng: np.random.Generator) -> bytes:
    for _ in range(rng.integers(1, 4)):
        found = list(NUMBER.finditer(content))
        if found:
            one = found[rng.integers(len(found))]
            content = content[: one.start()] + NUMBERS[rng.integers(len(NUMBERS))].encode() + content[one.end() :]
    return content


def _lines(content: bytes, rng: np.random.Generator) -> bytes:
    lines = content.split(b"\n")
    i, j = rng.integers(0, len(lines), 2)
    what = rng.integers(0, 4)
    if what == 0:
        lines[i], lines[j] = lines[j], lines[i]
    elif what == 1:
        lines[i:i] = [lines[j]] * int(rng.integers(1, 2000))
    elif what == 2:
        lines[i] = LONG[rng.integers(len(LONG))] + lines[i]
    else:
        del lines[min(i, j) : max(i, j)]
    return b"\n".join(lines)


def _json(value: object, rng: np.random.Generator) -> bytes:
    for _ in range(rng.integers(1, 4)):
        held = list(places(value))
        if not held:
            break
        holder, key = held[rng.integers(len(held))]
        what = rng.integers(0, 5)
        if what <= 1:
            holder[key] = VALUES[rng.integers(len(VALUES))]
        elif what == 2:
            del holder[key]
        elif what == 3 and isinstance(holder, list):
            holder[key:key] = [holder[key]] * int(rng.integers(1, 100))
        else:
            nested = holder[key]
            for _ in range(rng.choice((1, 50, 400))):
                nested = [nested]
            holder[key] = nested
    return json.dumps(value).encode()


def places(value):
    """Each (container, key) of a JSON value, the containers first met."""
    items = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    for key, inner in list(items):
        yield value, key
        yield from places(inner)
