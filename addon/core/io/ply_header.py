"""The header of a PLY file: which elements follow, how many, and what each record holds."""

from dataclasses import dataclass
from typing import NamedTuple

from ..kinds import Limit

MAX_HEADER: Limit[int] = 1 << 20
KINDS = {
    "char": "i1", "int8": "i1", "uchar": "u1", "uint8": "u1", "short": "i2", "int16": "i2", "ushort": "u2",
    "uint16": "u2", "int": "i4", "int32": "i4", "uint": "u4", "uint32": "u4", "float": "f4", "float32": "f4",
    "double": "f8", "float64": "f8",
}  # fmt: skip
FORMATS = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}


class Property(NamedTuple):
    """One property; `count_kind` is the type of a list's length, empty where it is no list."""

    name: str
    kind: str
    count_kind: str = ""


@dataclass(frozen=True)
class Element:
    """One element: `count` records, each with all `properties` in their order."""

    name: str
    count: int
    properties: tuple[Property, ...]


def parse_header(content: bytes) -> tuple[str, list[Element], int]:
    """Parse the head of `content`.

    Returns
    -------
    order : str
        '<', '>' or '' for text.
    elements : list of Element
    start : int
        Position of the first byte behind the header.

    Raises
    ------
    ValueError
        The text is the second half of a sentence that begins with the file's name.
    """
    if content[:3] != b"ply":
        raise ValueError("is empty" if not content else "is not a PLY file")
    end = content.find(b"end_header", 0, MAX_HEADER)
    start = content.find(b"\n", end) + 1
    if end < 0 or not start:
        raise ValueError("ends within its header, or has none")
    order = None
    elements: list[tuple[str, int, list[Property]]] = []
    for line in content[3:end].decode("latin-1").splitlines():
        words = line.split()
        if not words or words[0] in ("comment", "obj_info"):
            continue
        try:
            if words[0] == "format":
                order = FORMATS[words[1]]
            elif words[0] == "element":
                elements.append((words[1], int(words[2]), []))
                if elements[-1][1] < 0:
                    raise ValueError
            elif words[0] == "property" and words[1] == "list":
                if KINDS[words[2]][0] == "f":
                    raise ValueError
                elements[-1][2].append(Property(words[4], KINDS[words[3]], KINDS[words[2]]))
            elif words[0] == "property":
                elements[-1][2].append(Property(words[2], KINDS[words[1]]))
            else:
                raise ValueError
        except (IndexError, KeyError, ValueError):
            raise ValueError(f"has a header line that means nothing: '{line.strip()[:60]}'") from None
    if order is None:
        raise ValueError("does not say whether it is text or binary")
    return order, [Element(name, count, tuple(properties)) for name, count, properties in elements], start
