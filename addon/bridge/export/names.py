"""Names in exported files: those of the objects, although what is exported are copies of them.

Names are unique in Blender, so while a copy bears an object's name that object, and whoever else has it, gives it away
for the moment.
"""

from __future__ import annotations

import re
from collections.abc import Iterable

import bpy

from ..data.materials import MODEL
from ..marks import OBJECT_ID

_ASIDE = "Scan Relight keeps "
_SUFFIX = re.compile(r"\.\d{3,}$")


def identifier(name: str) -> str:
    """A name as USD writes it: letters, digits and underscores, no digit first."""
    legal = re.sub(r"\W", "_", name)
    return f"_{legal}" if legal[:1].isdigit() else legal


def own_name(thing: bpy.types.ID) -> str:
    """An object's or material's name; of a recovered one without the '.001' that Blender adds to the second room's."""
    return _SUFFIX.sub("", thing.name) if OBJECT_ID in thing or MODEL in thing else thing.name


def unique(names: Iterable[str]) -> list[str]:
    """The names, those after the first of their kind with a number: no two are one in USD, nor on any file system."""
    taken, result = set(), []
    for name in names:
        found, number = name, 1
        while identifier(found).casefold() in taken:
            number += 1
            found = f"{name} ({number})"
        taken.add(identifier(found).casefold())
        result.append(found)
    return result


class Names:
    """Who bears which name for the moment, and the way back."""

    def __init__(self) -> None:
        self._before: list[tuple[bpy.types.ID, str]] = []

    def give(self, kind: str, item: bpy.types.ID, name: str) -> None:
        """Let `item` of ``bpy.data``'s collection `kind` be called `name`; nothing happens to linked data."""
        if item.library or item.name == name:
            return
        known = getattr(bpy.data, kind)
        bearer = known.get((name, None))
        if bearer is not None:
            self._rename(bearer, f"{_ASIDE}{len(self._before)}")
        self._rename(item, name)

    def _rename(self, item: bpy.types.ID, name: str) -> None:
        self._before.append((item, item.name))
        item.name = name

    def put_back(self) -> None:
        """Everything is called what it was; copies have to be gone."""
        for item, name in reversed(self._before):
            try:
                item.name = name
            except ReferenceError:  # a copy, gone by now
                continue
        self._before.clear()
