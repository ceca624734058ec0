"""Frozen values as arrays and JSON, and back as they were: the same types, the same bits.

For what stages store, and what one worker hands to another. Nothing of it is code: only classes that the reader names
are made.
"""

from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from typing import Any

import numpy as np

from ..brdf.model import Brdf
from ..brdf.registry import find

Arrays = dict[str, np.ndarray]
Kinds = Mapping[str, type]
"""Frozen values by their names."""


def kinds_of(*classes: type) -> Kinds:
    """Classes by their names."""
    return {cls.__name__: cls for cls in classes}


def to_store(value: Any) -> tuple[Arrays, dict[str, Any]]:
    """What is stored of a value: arrays, and what JSON holds. Raises as `packed`."""
    arrays: Arrays = {}
    return arrays, {"value": packed(value, arrays)}


def from_store(arrays: Arrays, meta: dict[str, Any], kinds: Kinds) -> Any:
    """The inverse of `to_store`; parameters and errors as of `unpacked`."""
    return unpacked(meta["value"], arrays, kinds)


def packed(value: Any, arrays: Arrays) -> Any:
    """A value in what JSON knows; its arrays, and NumPy's own numbers, are put into `arrays`.

    Raises `TypeError` where there is something in it that is no value.
    """
    if value is None or isinstance(value, (bool, int, str)):
        return value
    if isinstance(value, np.ndarray | np.generic):
        name = str(len(arrays))
        arrays[name] = np.asarray(value)
        return {"scalar" if isinstance(value, np.generic) else "array": name}
    if isinstance(value, float):
        return {"float": value.hex()}
    if isinstance(value, Brdf):
        return {"brdf": value.name}
    if isinstance(value, dict):
        return {"dict": [[packed(item, arrays) for item in pair] for pair in value.items()]}
    for kind in (tuple, list, frozenset):
        if type(value) is kind:
            return {kind.__name__: [packed(item, arrays) for item in (sorted(value) if kind is frozenset else value)]}
    if is_dataclass(value) and not isinstance(value, type):
        content = {field.name: packed(getattr(value, field.name), arrays) for field in fields(value)}
        return {"value": type(value).__name__, "fields": content}
    raise TypeError(f"{type(value).__name__} is no value that can be stored")


def unpacked(stored: Any, arrays: Mapping[str, np.ndarray], kinds: Kinds) -> Any:
    """The inverse of `packed`; `kinds` are those that may be in it.

    Raises `LookupError` where something in it is none of these, or an array or a reflectance model is not there.
    """
    if not isinstance(stored, dict):
        return stored
    if "value" in stored:
        return kinds[stored["value"]](**{k: unpacked(item, arrays, kinds) for k, item in stored["fields"].items()})
    [(kind, content)] = stored.items()
    if kind == "array":
        return arrays[content]
    if kind == "scalar":
        return arrays[content][()]
    if kind == "float":
        return float.fromhex(content)
    if kind == "brdf":
        if (brdf := find(content)) is None:
            raise LookupError(f"there is no reflectance model '{content}'")
        return brdf
    if kind == "dict":
        return {unpacked(k, arrays, kinds): unpacked(item, arrays, kinds) for k, item in content}
    return {"tuple": tuple, "list": list, "frozenset": frozenset}[kind](
        unpacked(item, arrays, kinds) for item in content
    )
