"""What the artist gives instead of what the frames tell: model, roughness, F0, colour of objects, and a known white.

As JSON, with every key optional; what is not given is fitted under what is given:

    {"objects": {"12": {"model": "metal", "roughness": 0.3}, "13": {"same_as": 12}},
     "white": {"object": 26, "albedo": 0.8}}

The white may be a spot of the object: "at", its place in metres.

`null` takes back what was given before. The result folder keeps all of it in `OVERRIDES`, and later runs heed it.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field, fields, replace
from functools import partial
from pathlib import Path
from typing import Any

from ..brdf.model import Brdf
from ..brdf.registry import find, models
from ..errors import BadInputError
from ..io.files import readable
from ..json_values import is_number, key, plain

OVERRIDES = "overrides.json"
LOBE = ("model", "roughness", "f0")
"""What describes a highlight, and `same_as` takes from another object."""
VALUES = ("roughness", "f0", "base_color")
"""What can be given of a model; not every one has all of them (`Brdf.parameters`)."""
Colour = tuple[float, float, float]


@dataclass(frozen=True)
class Given:
    """What is given of one object; None where it is to be found.

    Attributes
    ----------
    model : str or None
        Name of one that can be given.
    roughness : float or None
        Blender's, 0...1: the square root of phi.
    f0 : float or (3,) tuple of float or None
        Reflectance at normal incidence, linear Rec.709.
    base_color : (3,) tuple of float or None
        Linear Rec.709: mean albedo over what was measured; of a metal its F0.
    same_as : int or None
        Object whose model and highlight this one takes over.
    """

    model: str | None = None
    roughness: float | None = None
    f0: float | Colour | None = None
    base_color: Colour | None = None
    same_as: int | None = None

    @property
    def any(self) -> bool:
        """Whether anything is given."""
        return bool(self.as_dict())

    @property
    def brdf(self) -> Brdf | None:
        """The model itself."""
        return find(self.model)

    @property
    def lobe(self) -> Given:
        """What of it bears on the fit of the highlight; a metal's colour is its F0."""
        f0 = self.base_color if self.f0 is None and self.brdf is not None and self.brdf.lobe_alone else self.f0
        return replace(self, f0=f0, base_color=None)

    def as_dict(self) -> dict[str, Any]:
        """What is given, as the file has it."""
        return {name: value for name, value in plain(self).items() if value is not None}


@dataclass(frozen=True)
class White:
    """A known albedo.

    Attributes
    ----------
    albedo : (3,) tuple of float
        Linear Rec.709: the mean over what was measured of the object.
    at : (3,) tuple of float or None
        World, metres: the spot of the object that has this albedo in place of its mean.
    """

    object_id: int
    albedo: Colour
    at: Colour | None = None


@dataclass(frozen=True)
class Overrides:
    """All that is given of a room.

    Attributes
    ----------
    objects : dict of int to Given
        By object_id.
    back : frozenset of (int or str, str)
        What was null: (object_id, key), (object_id, '') for all of an object, ('white', '').
    """

    objects: Mapping[int, Given] = field(default_factory=dict)
    white: White | None = None
    back: frozenset[tuple[int | str, str]] = frozenset()

    @property
    def any(self) -> bool:
        """Whether anything is given."""
        return bool(self.objects) or self.white is not None

    def of(self, object_id: int) -> Given:
        """What is given of one object."""
        return self.objects.get(object_id, NOTHING)

    def lobes(self) -> dict[int, Given]:
        """What bears on the fit of highlights, of the objects that have any."""
        return {i: given.lobe for i, given in sorted(self.objects.items()) if given.lobe.any}

    def lobes_key(self) -> tuple[str, ...]:
        """A digest of that as a tuple of one; empty where nothing is given."""
        lobes = {str(i): given.as_dict() for i, given in self.lobes().items()}
        return (key("overrides", lobes),) if lobes else ()

    def chain(self, object_id: int) -> tuple[int, ...]:
        """The objects that this one is the same as, one after the other; the last is described by itself."""
        ids: list[int] = []
        target = self.of(object_id).same_as
        while target is not None:
            ids.append(target)
            target = self.of(target).same_as
        return tuple(ids)

    def as_dict(self) -> dict[str, Any]:
        """As the file has it."""
        objects = {str(i): given.as_dict() for i, given in sorted(self.objects.items())}
        entry: dict[str, Any] = {"objects": objects}
        if self.white is not None:
            entry["white"] = {"object": self.white.object_id, "albedo": list(self.white.albedo)}
            if self.white.at is not None:
                entry["white"]["at"] = list(self.white.at)
        return entry


NOTHING = Given()
NONE = Overrides()


def merge(older: Overrides, newer: Overrides) -> Overrides:
    """Both together: key by key what is newer wins, and what it took back is gone.

    A newly given `same_as` replaces an older description of the highlight, and the other way round; a diffuse surface
    or a lamp has no older roughness or F0. Raises `BadInputError` where objects come to be the same as each other in a
    circle.
    """
    objects = {i: given for i, given in older.objects.items() if (i, "") not in newer.back}
    for object_id, name in newer.back:
        if name and object_id in objects:
            objects[object_id] = replace(objects[object_id], **{name: None})
    for object_id, given in newer.objects.items():
        values = given.as_dict()
        outdated: tuple[str, ...] = LOBE if "same_as" in values else ("same_as",) if values.keys() & set(LOBE) else ()
        if "model" in values:
            outdated += _has_no(values["model"])
        elif values.keys() & set(_has_no(objects.get(object_id, NOTHING).model)):
            outdated += ("model",)  # a highlight is given now, so it is diffuse no longer
        older_given = replace(objects.get(object_id, NOTHING), **dict.fromkeys(outdated))
        objects[object_id] = replace(older_given, **{name: getattr(given, name) for name in values})
    white = newer.white or (None if ("white", "") in newer.back else older.white)
    merged = Overrides({i: given for i, given in sorted(objects.items()) if given.any}, white)
    if circle := _circle(merged):
        raise BadInputError(
            f"What is kept and what is given together make objects the same as each other in a circle "
            f"({circle}); give one of them values of its own."
        )
    return merged


def read_overrides(path: Path, known: Iterable[int]) -> Overrides:
    """The overrides in a file; `known` are the capture's objects.

    Raises `BadInputError`, one sentence that names file, object and key, and what is allowed.
    """
    path = Path(path)
    if not path.is_file():
        raise BadInputError(f"'{path}' is no file; give the JSON file with what is to be overridden.")
    try:
        with readable(f"'{path}'", "give one that can"):
            content = json.loads(path.read_text(encoding="utf-8-sig"))
    except (ValueError, RecursionError) as error:
        raise BadInputError(f"'{path}' is not valid JSON ({error}); mend it there.") from error
    return parse(content, f"'{path}'", known)


def kept_overrides(folder: Path, known: Iterable[int]) -> Overrides:
    """What a result folder keeps; nothing where it keeps none. Raises `BadInputError`."""
    path = Path(folder) / OVERRIDES
    return read_overrides(path, known) if path.is_file() else NONE


def heeded(folder: Path, known: Iterable[int], file: Path | None = None, keep: bool = True) -> Overrides:
    """What a run heeds: what its result folder keeps (unless `keep` is False), and over that what is in a `file`.

    `known` are the capture's objects. Raises as `read_overrides` and `merge`.
    """
    known = set(known)
    older = kept_overrides(folder, known) if keep else NONE
    return merge(older, read_overrides(file, known)) if file is not None else older


def parse(content: Any, name: str, known: Iterable[int]) -> Overrides:
    """Overrides from what JSON holds; `name` is what errors call it. Parameters and errors as of `read_overrides`."""
    known = set(known)
    _keys(content, ("objects", "white"), name)
    objects: dict[int, Given] = {}
    back: set[tuple[int | str, str]] = set()
    entries = content.get("objects") or {}
    if not isinstance(entries, dict):
        raise BadInputError(
            f'{name}: \'objects\' has to be an object of JSON by object_id, such as {{"12": {{"model": "metal"}}}}.'
        )
    for number, entry in entries.items():
        object_id = _object(number, known, name)
        if entry is None:
            back.add((object_id, ""))
            continue
        given, removed = _given(object_id, entry, known, name)
        back |= {(object_id, key) for key in removed}
        if given.any:
            objects[object_id] = given
    white = None
    if "white" in content:
        white = _white(content["white"], known, name)
        back |= {("white", "")} if white is None else set()
    overrides = Overrides(objects, white, frozenset(back))
    if circle := _circle(overrides):
        raise BadInputError(
            f"{name}: objects are the same as each other in a circle ({circle}); give one of them values of its own."
        )
    return overrides


def _has_no(model: str | None) -> tuple[str, ...]:
    """What a model does not have of what can be given."""
    brdf = find(model)
    return () if brdf is None else tuple(name for name in VALUES if name not in brdf.parameters)


def _given(object_id: int, entry: Any, known: set[int], name: str) -> tuple[Given, list[str]]:
    where = f"{name}, object {object_id}"
    _keys(entry, tuple(f.name for f in fields(Given)), where)
    removed = [key for key, value in entry.items() if value is None]
    values = {key: value for key, value in entry.items() if value is not None}
    parsed: dict[str, Any] = {}
    if (model := values.get("model")) is not None:
        allowed = [brdf.name for brdf in models() if brdf.can_be_given]
        if model not in allowed:
            raise BadInputError(f"{where}: 'model' is {model!r}; give one of {', '.join(allowed)}.")
        parsed["model"] = model
    parsers: tuple[Callable[..., Any], ...]
    parsers = _share, partial(_colour, keep_number=True), partial(_colour, number=False)
    parsed |= {
        name: parse(values[name], f"{where}: '{name}'") for name, parse in zip(VALUES, parsers) if name in values
    }
    if "same_as" in values:
        parsed["same_as"] = _object(values["same_as"], known, f"{where}, 'same_as'")
    also = [key for key in LOBE if key in values]
    if "same_as" in values and also:
        raise BadInputError(f"{where}: 'same_as' brings the other object's {also[0]}; leave one of the two out.")
    for parameter in _has_no(model):
        if parameter in values:
            raise BadInputError(f"{where}: model '{model}' has no '{parameter}'; leave one of the two out.")
    return Given(**parsed), removed


def _white(entry: Any, known: set[int], name: str) -> White | None:
    if entry is None:
        return None
    where = f"{name}, 'white'"
    _keys(entry, ("object", "albedo", "at"), where)
    for required in ("object", "albedo"):
        if entry.get(required) is None:
            raise BadInputError(f"{where}: '{required}' is missing; give " + '{"object": 26, "albedo": 0.8}.')
    albedo = _colour(entry["albedo"], f"{where}: 'albedo'")
    if min(albedo) <= 0:
        raise BadInputError(f"{where}: 'albedo' is {entry['albedo']}; a known white is more than 0 in every channel.")
    at = entry.get("at")
    if at is not None and not (isinstance(at, list) and len(at) == 3 and all(map(is_number, at))):
        raise BadInputError(f"{where}: 'at' is {at!r}; give a spot's three coordinates in metres.")
    return White(
        _object(entry["object"], known, where),
        albedo,
        None if at is None else (float(at[0]), float(at[1]), float(at[2])),
    )


def _keys(entry: Any, allowed: tuple[str, ...], where: str) -> None:
    if not isinstance(entry, dict):
        raise BadInputError(f"{where} has to be an object of JSON with the keys {', '.join(allowed)}.")
    for name in entry:
        if name not in allowed:
            raise BadInputError(f"{where}: there is no key '{name}'; choose from {', '.join(allowed)}.")


def _object(number: Any, known: set[int], where: str) -> int:
    """An object_id, which JSON may have as text."""
    text = str(number)
    if isinstance(number, (bool, float)) or not text.isascii() or not text.removeprefix("-").isdigit():
        raise BadInputError(f"{where}: {number!r} is no object_id; give a whole number.")
    if int(text) not in known:
        raise BadInputError(f"{where}: the capture has no object {text}; it has {_listed(known)}.")
    return int(text)


def _listed(known: set[int]) -> str:
    ids = sorted(known)
    if ids and ids == list(range(ids[0], ids[-1] + 1)):
        return f"{ids[0]} to {ids[-1]}"
    return ", ".join(map(str, ids[:20])) + (", ..." if len(ids) > 20 else "") if ids else "none"


def _share(value: Any, where: str) -> float:
    if not is_number(value) or not 0 <= value <= 1:
        raise BadInputError(f"{where} is {value!r}; give a number from 0 to 1.")
    return float(value)


def _colour(value: Any, where: str, number: bool = True, keep_number: bool = False) -> Any:
    """(3,) tuple of float, or where it may be the number that was given."""
    if number and not isinstance(value, (list, tuple)):
        share = _share(value, where)
        return share if keep_number else (share,) * 3
    if not isinstance(value, (list, tuple)) or len(value) != 3:
        raise BadInputError(
            f"{where} is {value!r}; give {'a number or ' if number else ''}three numbers from 0 to 1 "
            "(red, green, blue)."
        )
    return tuple(_share(channel, where) for channel in value)


def _circle(overrides: Overrides) -> str:
    """The first circle of `same_as`, as text; '' if there is none."""
    for start in overrides.objects:
        chain, current = [start], overrides.of(start).same_as
        while current is not None and current not in chain:
            chain.append(current)
            current = overrides.of(current).same_as
        if current is not None:
            return " -> ".join(map(str, (*chain[chain.index(current) :], current)))
    return ""
