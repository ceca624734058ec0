"""What goes wrong with files, and what someone could make go wrong with them, as Hypothesis strategies."""

from __future__ import annotations

import json
import re
import struct

from hypothesis import strategies as st

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


@st.composite
def bytes_spoiled(draw, content: bytes) -> bytes:
    """One to three blows, none of which knows the format."""
    for _ in range(draw(st.integers(1, 3))):
        content = draw(st.sampled_from(BLOWS))(draw, content)
    return content


def _place(draw, content: bytes) -> int:
    return draw(st.integers(0, max(len(content) - 1, 0)))


def cut(draw, content):
    return content[: _place(draw, content)]


def flip(draw, content):
    at = _place(draw, content)
    return content[:at] + bytes(draw(st.integers(0, 255)) for _ in content[at : at + 1]) + content[at + 1 :]


def overwrite(draw, content):
    at, word = _place(draw, content), draw(st.sampled_from(WORDS))
    return content[:at] + word + content[at + len(word) :]


def insert(draw, content):
    at = _place(draw, content)
    return content[:at] + draw(st.sampled_from((*WORDS, b"A" * 70_000, b"[" * 5_000, b"\n" * 1000))) + content[at:]


def repeat(draw, content):
    start, end = sorted((_place(draw, content), _place(draw, content)))
    return content[:end] + content[start:end] * draw(st.integers(1, 3)) + content[end:]


def remove(draw, content):
    start, end = sorted((_place(draw, content), _place(draw, content)))
    return content[:start] + content[end:]


def swap_lines(draw, content):
    lines = content.split(b"\n")
    i, j = (draw(st.integers(0, len(lines) - 1)) for _ in range(2))
    lines[i], lines[j] = lines[j], lines[i]
    return b"\n".join(lines)


def number(draw, content):
    found = list(NUMBER.finditer(content))
    if not found:
        return content
    match = draw(st.sampled_from(found))
    return content[: match.start()] + draw(st.sampled_from(NUMBERS)).encode() + content[match.end() :]


def other_endian(draw, content):
    at = _place(draw, content)
    return content[:at] + content[at : at + 4][::-1] + content[at + 4 :]


def emptied(draw, content):
    return b""


BLOWS = (
    cut,
    flip,
    flip,
    overwrite,
    overwrite,
    insert,
    repeat,
    remove,
    swap_lines,
    number,
    number,
    number,
    other_endian,
    emptied,
)


@st.composite
def json_spoiled(draw, content: bytes) -> bytes:
    """The file's object with one to three of its values replaced, removed, doubled or nested."""
    value = json.loads(content)
    for _ in range(draw(st.integers(1, 3))):
        places = list(_places(value))
        if not places:
            break
        holder, key = draw(st.sampled_from(places))
        what = draw(st.integers(0, 4))
        if what <= 1:
            holder[key] = draw(st.sampled_from(VALUES))
        elif what == 2:
            del holder[key]
        elif what == 3 and isinstance(holder, list):
            holder.insert(key, holder[key])
        else:
            nested = holder[key]
            for _ in range(draw(st.sampled_from((1, 50, 400)))):
                nested = [nested]
            holder[key] = nested
    return json.dumps(value).encode()


def _places(value):
    """Each (container, key) of a JSON value, the containers first met."""
    items = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    for key, inner in list(items):
        yield value, key
        yield from _places(inner)
