"""The one name that an object of the room has everywhere: Blender, lists, warnings, the report, exports."""

from .errors import one_line
from .kinds import Code

MAX_LENGTH: Code[int] = 48
"""Bytes of a name in UTF-8. Blender 4.5 cuts names at 63: this leaves room for ' base color' and its own '.001'."""


def writable(name: str) -> str:
    """What a capture calls something, as one line that can be shown and written."""
    return one_line(" ".join(name.split()))


def object_name(class_name: str, object_id: int) -> str:
    """'<class> <number>', as 'sofa 12'; a long class is cut, the number never, as it alone tells objects apart."""
    number = f" {object_id}"
    return cut(writable(class_name) or "Object", MAX_LENGTH - len(number)) + number


def cut(text: str, longest: int) -> str:
    """The first characters of `text` that take no more than `longest` bytes of UTF-8."""
    return text.encode()[:longest].decode(errors="ignore").rstrip()


def numbered(name: str) -> tuple[str, str]:
    """A name as class and number, the number '' where there is none: ('sofa', '12')."""
    kind, _, number = name.rpartition(" ")
    return (kind, number) if kind and number[:1].isdigit() else (name, "")


def in_order(name: str) -> tuple:
    """What names are sorted by: 'lamp 2' comes before 'lamp 10', whatever the case."""
    kind, number = numbered(name)
    digits = number.split(".")[0]
    return kind.casefold(), int(digits) if digits.isdecimal() else 0, name
