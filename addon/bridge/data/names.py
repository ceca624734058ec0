"""Blender's names: a number such as '.001' keeps equal names apart."""

import re

_NUMBERED = re.compile(r"(.*?)(?:\.(\d{3,}))?", re.DOTALL)


def split_number(name: str) -> tuple[str, int]:
    """A name without its number, and that number; 0 where it has none."""
    stem, number = _NUMBERED.fullmatch(name).groups()
    return stem, int(number or 0)
