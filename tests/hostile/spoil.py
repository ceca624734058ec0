"""Spoils a file's content, the same for the same seed: blows that know no format, some that know numbers or JSON."""

from __future__ import annotations

import contextlib
import json
import re

import numpy as np

from tests.core.io.hostile.blows import spoiled as bytes_spoiled
from tests.core.io.hostile.spoiling import NUMBERS, VALUES, _places

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
        places = list(_places(value))
        if not places:
            break
        holder, key = places[rng.integers(len(places))]
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
