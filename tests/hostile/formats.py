"""Spoils a file by one who knows its format: lengths, checksums and signatures fit, and what they guard does not."""

from __future__ import annotations

import io
import json
import re
import struct
import zipfile
import zlib
from collections.abc import Callable

import numpy as np

from tests.core.io.hostile.spoiling import places as places_of

INTS = (0, 1, 2, 3, 7, 255, 256, 65535, 1 << 20, (1 << 31) - 1, 1 << 31, (1 << 32) - 1)
REALS = (0.0, -0.0, 1e-320, 1e-30, 1e30, 1e154, 1e300, 1.7e308, -1e308, np.nan, np.inf, -np.inf, 1e6, -1.0, 0.5)
NAMES = (
    "a\nb",
    "a\0b", "\u202etxt.exe", "e\u0301", "\xe9", "a" * 255, "\u00e4" * 255, "CON", "a/../../b", "/dev/zero", " ", ".",
    "..", "a\tb\x1b[31m", "<script>alert(1)</script>", "${jndi:x}", "%s%n", "\udc80", "\U0001f600" * 60, "file:///etc/passwd",
    "//x/y", "a\\b", "-rf", "images", "images/000.exr",
)  # fmt: skip
RAW = ('"a":1,"a":2,', "[" * 100_000, '{"a":' * 20_000, "1" * 5_000, "1e400", "-", '"\\ud800"', "/*", "NaN", "\ufeff")
Rng = np.random.Generator


def spoiled(content: bytes, seed: int) -> bytes:
    """One of the ways that the file's format has; by its bytes alone, as `spoiling.py` does, none."""
    rng = np.random.default_rng([seed, 1])
    for begins, spoil in KINDS.items():
        if re.match(begins, content, re.DOTALL):
            for _ in range(rng.integers(1, 3)):
                content = spoil(content, rng)
            return content
    return _table(content, rng)


def _one(rng: Rng, values):
    return values[int(rng.integers(len(values)))]


def _word(rng: Rng, size: int, order: str) -> bytes:
    return struct.pack(f"{order}Q", _one(rng, INTS))[slice(-size, None) if order == ">" else slice(size)]


def _list_blow(parts: list, rng: Rng) -> None:
    """One part gone, doubled many times, or exchanged with another."""
    i, j = rng.integers(len(parts), size=2)
    what = rng.integers(3)
    if what == 0:
        del parts[i]
    elif what == 1:
        parts[i:i] = [parts[j]] * int(_one(rng, (1, 2, 300)))
    else:
        parts[i], parts[j] = parts[j], parts[i]


def _png(content: bytes, rng: Rng) -> bytes:
    chunks, at = [], 8
    while at + 12 <= len(content):
        size = int.from_bytes(content[at : at + 4], "big")
        chunks.append([content[at + 4 : at + 8], content[at + 8 : at + 8 + size]])
        at += 12 + size
    what, chunk = rng.integers(5), _one(rng, chunks)
    if what == 0 and chunks[0][0] == b"IHDR":
        head = bytearray(chunks[0][1])
        place = int(_one(rng, (0, 4, 8, 9, 10, 11, 12)))
        head[place : place + 4 if place < 8 else place + 1] = _word(rng, 4 if place < 8 else 1, ">")
        chunks[0][1] = bytes(head[:13])
    elif what == 1:
        _list_blow(chunks, rng)
    elif what == 2:
        kind = _one(
            rng,
            (
                b"iCCP",
                b"eXIf",
                b"gAMA",
                b"cHRM",
                b"sBIT",
                b"tRNS",
                b"PLTE",
                b"bKGD",
                b"zTXt",
                b"iTXt",
                b"sRGB",
                b"acTL",
            ),
        )
        packed = b"a\0\0" + zlib.compress(bytes(int(_one(rng, (0, 100, 50_000_000)))))
        data = _one(
            rng, (b"", packed, rng.bytes(12), bytes(4), b"\xff" * 800, b"II*\0\x08\0\0\0\x01\0" + rng.bytes(14))
        )
        chunks.insert(int(rng.integers(1, len(chunks) + 1)), [kind, data])
    elif what == 3:
        for one in chunks:
            if one[0] == b"IDAT":
                raw = _one(rng, (b"", bytes(10), b"\xff" * 100_000, bytes(60_000_000)))
                one[1] = _one(rng, (zlib.compress(raw), one[1][: len(one[1]) // 2], zlib.compress(raw)[:-4]))
    else:
        chunk[1] = bytes(_bytes_blow(chunk[1], rng))
    return content[:8] + b"".join(
        struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data)) for kind, data in chunks
    )


def _bytes_blow(content: bytes, rng: Rng, order: str = ">") -> bytes:
    size = int(_one(rng, (1, 2, 4, 8)))
    at = int(rng.integers(max(len(content) - size, 0) + 1))
    return content[:at] + _word(rng, size, order) + content[at + size :]


def _exr(content: bytes, rng: Rng) -> bytes:
    """An attribute of the header with other values, of the length that it tells, gone, or twice."""
    parts, at = [], 8
    while content[at : at + 1] not in (b"\0", b""):
        name, kind = content.index(b"\0", at), content.index(b"\0", content.index(b"\0", at) + 1)
        size = struct.unpack("<i", content[kind + 1 : kind + 5])[0]
        parts.append([content[at:name], content[name + 1 : kind], content[kind + 5 : kind + 5 + size]])
        at = kind + 5 + size
    rest, what, part = content[at:], rng.integers(5), _one(rng, parts)
    if what == 0:
        _list_blow(parts, rng)
    elif what == 1:
        part[int(rng.integers(2))] = _one(rng, NAMES).replace("\0", "").encode(errors="replace")
    elif what == 2:
        data = bytearray(part[2])
        for place in range(0, len(data) - 3, 4):
            if rng.random() < 0.5:
                data[place : place + 4] = _one(
                    rng, (_word(rng, 4, "<"), struct.pack("<f", np.float32(_one(rng, REALS[:5]))))
                )
        part[2] = bytes(data)
    elif what == 3:
        part[2] = part[2] * int(_one(rng, (0, 2, 1000))) if rng.random() < 0.5 else part[2][: int(rng.integers(9))]
    else:
        rest = _bytes_blow(rest[:400], rng, "<") + rest[400:]
    head = b"".join(name + b"\0" + kind + b"\0" + struct.pack("<i", len(data)) + data for name, kind, data in parts)
    return content[:8] + head + rest


def _tiff(content: bytes, rng: Rng) -> bytes:
    """A field of the first directory, or the place of a directory."""
    order = "<" if content[:2] == b"II" else ">"
    first = struct.unpack(f"{order}I", content[4:8])[0]
    data = bytearray(content)
    if first + 2 > len(data):
        return content
    count = struct.unpack(f"{order}H", data[first : first + 2])[0]
    entry = first + 2 + 12 * int(rng.integers(max(count, 1)))
    what = rng.integers(5)
    if what == 0:
        end = first + 2 + 12 * count
        data[end : end + 4] = struct.pack(
            f"{order}I", int(_one(rng, (8, first, first + 2, len(data) - 1, (1 << 32) - 1)))
        )
    elif what == 1:
        data[entry : entry + 2] = struct.pack(
            f"{order}H", int(_one(rng, (254, 266, 274, 284, 317, 322, 324, 330, 338, 339, 34665, 34675, 700)))
        )
    elif what == 2:
        data[entry + 2 : entry + 4] = struct.pack(f"{order}H", int(rng.integers(0, 20)))
    else:
        place = entry + (4 if what == 3 else 8)
        data[place : place + 4] = _word(rng, 4, order)
    return bytes(data)


def _jpeg(content: bytes, rng: Rng) -> bytes:
    parts, at = [], 2
    while at + 4 <= len(content) and content[at] == 0xFF and content[at + 1] != 0xDA:
        size = struct.unpack(">H", content[at + 2 : at + 4])[0]
        parts.append((content[at + 1], content[at + 4 : at + 2 + size]))
        at += 2 + size
    what = rng.integers(4)
    if parts and what == 0:
        _list_blow(parts, rng)
    elif parts and what == 1:
        i = int(rng.integers(len(parts)))
        parts[i] = (parts[i][0], _bytes_blow(parts[i][1], rng))
    elif what == 2:
        loop = b"Exif\0\0II*\0\x08\0\0\0\x01\0\x69\x87\x04\0\x01\0\0\0\x08\0\0\0\x08\0\0\0"
        icc = b"ICC_PROFILE\0" + bytes((int(rng.integers(4)), int(rng.integers(4)))) + rng.bytes(200)
        big = b"MPF\0" + b"\xff" * 60_000
        parts.insert(
            int(rng.integers(len(parts) + 1)),
            _one(rng, ((0xE1, loop), (0xE2, icc), (0xE2, big), (0xFE, b"x" * 65_000))),
        )
    else:
        return content[:at] + _bytes_blow(content[at:], rng)
    body = b"".join(bytes((0xFF, kind)) + struct.pack(">H", min(len(data) + 2, 65535)) + data for kind, data in parts)
    return content[:2] + body + content[at:]


def _json(content: bytes, rng: Rng) -> bytes:
    """Names that mislead, numbers at their type's end, matrices that are none, text that is no JSON any more."""
    try:
        value = json.loads(content)
    except (ValueError, RecursionError):
        return content
    places = list(places_of(value))
    if not places:
        return content
    what, (holder, key) = rng.integers(6), _one(rng, places)
    numbers = [p for p in places if type(p[0][p[1]]) in (int, float)]
    texts = [p for p in places if type(p[0][p[1]]) is str]
    if what == 0 and texts:
        holder, key = _one(rng, texts)
        holder[key] = _one(rng, NAMES)
    elif what == 1 and numbers:
        holder, key = _one(rng, numbers)
        holder[key] = _one(rng, (*REALS, *INTS, -1, 1 << 64, 10**400))
    elif what == 2 and isinstance(holder[key], dict):
        holder[key] = {_one(rng, NAMES): one for one in holder[key].values()} | holder[key]
    elif what == 2 and isinstance(holder[key], list):
        factor = _one(rng, (*REALS[:10], -1.0))
        holder[key] = json.loads(
            json.dumps(holder[key]),
            parse_float=lambda t: float(t) * factor,
            parse_int=lambda t: int(t) * 10 ** int(rng.integers(19)),
        )
    elif what == 3:
        text = json.dumps(value)
        marks = [m.start() for m in re.finditer(r"[{\[,:]", text)]
        at = int(_one(rng, marks)) + 1
        return (text[:at] + _one(rng, RAW) + text[at:]).encode(errors="surrogatepass")
    elif what == 4:
        other_holder, other_key = _one(rng, places)
        holder[key], inner = other_holder[other_key], holder[key]
        if rng.random() < 0.5 and not isinstance(inner, (dict, list)):
            other_holder[other_key] = inner
    elif isinstance(holder, list):
        holder[key:key] = [holder[key]] * int(_one(rng, (1, 5, 3000)))
    try:
        return json.dumps(value).encode()
    except (ValueError, RecursionError):  # it holds itself now
        return content


def _glb(content: bytes, rng: Rng) -> bytes:
    size = struct.unpack("<I", content[12:16])[0]
    text = _json(content[20 : 20 + size].rstrip(b" "), rng)
    text += b" " * (-len(text) % 4)
    data = content[20 + size :]
    if rng.random() < 0.2:
        data = _bytes_blow(data, rng, "<")
    return struct.pack("<4sIII4s", b"glTF", 2, 20 + len(text) + len(data), len(text), b"JSON") + text + data


def _zip(content: bytes, rng: Rng) -> bytes:
    """Arrays of other values, types and shapes, and what is told of them; a room's with checksums that fit."""
    with zipfile.ZipFile(io.BytesIO(content)) as archive:
        arrays = {one.filename: np.load(io.BytesIO(archive.read(one))) for one in archive.infolist()}
    known = json.loads(json.loads(arrays.pop("__meta__.npy").tobytes())[0])
    told = known["told"]
    what, name = rng.integers(4), _one(rng, list(arrays))
    if what == 0:
        told = json.loads(_again(_json(json.dumps(told).encode(), rng), told))
    elif what == 1 and arrays[name].dtype.kind in "fiu" and arrays[name].size:
        value = arrays[name].copy()
        with np.errstate(all="ignore"):
            place = rng.integers(value.size, size=int(_one(rng, (1, value.size))))
            value.reshape(-1)[place] = np.float64(_one(rng, (*REALS, *INTS, -1))).astype(value.dtype)
        arrays[name] = value
    elif what == 2:
        value = arrays[name]
        arrays[name] = _one(
            rng,
            (
                value[:0],
                value[None],
                value.ravel(),
                value[..., :-1] if value.ndim else value,
                np.repeat(value[None], 2, 0)[0].T,
                np.array(3),
                value.astype(str),
                value.astype("c16") if value.dtype.kind in "fiu" else value,
                np.zeros(len(value) if value.ndim else 1, [("a", "f4"), ("b", "S3")]),
            ),
        )
    else:
        del arrays[name]
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w") as archive:

        def add(name: str, array: np.ndarray) -> None:
            one = io.BytesIO()
            np.save(one, array, allow_pickle=False)
            archive.writestr(zipfile.ZipInfo(name), one.getvalue())

        for one, array in arrays.items():
            add(one, array)
        sums = [[one.filename.removesuffix(".npy"), one.CRC] for one in archive.infolist()]
        if "root" not in told:  # a stage: with a checksum of its own it says what it wants, see docs/security.md
            sums, told = known["sums"], known["told"]
        text = json.dumps({"told": told, "sums": sums})
        add("__meta__.npy", np.frombuffer(json.dumps([text, zlib.crc32(text.encode())]).encode(), np.uint8))
    return file.getvalue()


def _again(text: bytes, before: object) -> bytes:
    """`text` if it is JSON, else what was before."""
    try:
        json.loads(text)
    except (ValueError, RecursionError):
        return json.dumps(before).encode()
    return text


def _ply(content: bytes, rng: Rng) -> bytes:
    """Lines of the header, or words of the body."""
    head, mark, body = content.partition(b"end_header\n")
    lines = head.split(b"\n")
    what = rng.integers(5)
    if what == 0:
        _list_blow(lines, rng)
    elif what == 1:
        i = int(rng.integers(len(lines)))
        kinds = (
            b"char",
            b"uchar",
            b"short",
            b"ushort",
            b"int",
            b"uint",
            b"float",
            b"double",
            b"int8",
            b"list",
            b"list uchar int",
            b"half",
        )
        lines[i] = re.sub(rb"\b(float|double|int|uchar|uint)\b", lambda _: _one(rng, kinds), lines[i], count=1)
    elif what == 2:
        i = int(rng.integers(len(lines)))
        lines[i] = re.sub(rb"\d+", lambda _: str(int(_one(rng, (*INTS, 1 << 40, 1 << 63)))).encode(), lines[i], count=1)
    elif what == 3:
        i = int(rng.integers(len(lines)))
        lines.insert(
            i,
            _one(
                rng,
                (
                    b"element face 3",
                    b"element other 1000000000",
                    b"property list uint double x",
                    b"comment " + b"x" * 100_000,
                    b"obj_info \xff",
                    b"format ascii 1.0",
                    b"property float nan",
                ),
            ),
        )
    elif b"ascii" in head:
        return head + mark + _table(body, rng)
    else:
        return head + mark + _bytes_blow(body, rng, "<")
    return b"\n".join(lines) + mark + body


def _table(content: bytes, rng: Rng) -> bytes:
    """Words of a text exchanged for names that mislead or numbers at their end; of a binary file, its counts."""
    if b"\0" in content:
        return (
            _bytes_blow(content[:64], rng, "<") + content[64:] if rng.random() < 0.5 else _bytes_blow(content, rng, "<")
        )
    words = re.split(rb"(\s+|,)", content)
    for _ in range(int(_one(rng, (1, 1, 12)))):
        i = 2 * int(rng.integers((len(words) + 1) // 2))
        words[i] = _one(
            rng,
            (
                *(one.encode(errors="replace") for one in NAMES),
                *(repr(float(one)).encode() for one in REALS),
                *(str(one).encode() for one in INTS),
                b"",
                b"0.0",
            ),
        )
    return b"".join(words)


KINDS: dict[bytes, Callable[[bytes, Rng], bytes]] = {
    rb"\x89PNG": _png,
    rb"v/1\x01": _exr,
    rb"II\*\0|MM\0\*": _tiff,
    rb"\xff\xd8": _jpeg,
    rb"glTF": _glb,
    rb"PK\x03\x04": _zip,
    rb"ply\s": _ply,
    rb"\s*[{\[]": _json,
}
