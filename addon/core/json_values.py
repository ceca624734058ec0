"""Values in what JSON knows, and a digest of them."""

import dataclasses
import hashlib
import json
import math
from collections.abc import Sequence
from pathlib import PurePath
from typing import Any, TypeGuard

import numpy as np


def key(*parts: Any) -> str:
    """A stage's key: a hash of the key of the stage before it and of the settings that it heeds.

    Parts may be anything that JSON holds, frozen values (dataclasses), paths, and small arrays.
    """
    return hashlib.sha256(json.dumps(plain(list(parts)), sort_keys=True).encode()).hexdigest()


def plain(value: Any) -> Any:
    """`value` in what JSON knows."""
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        value = {field.name: getattr(value, field.name) for field in dataclasses.fields(value)}
    if isinstance(value, (np.ndarray, np.generic)):
        value = value.tolist()
    if isinstance(value, dict):
        return {str(name): plain(item) for name, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [plain(item) for item in value]
    if isinstance(value, (set, frozenset)):
        return sorted(plain(item) for item in value)
    if isinstance(value, PurePath):
        return value.as_posix()
    if isinstance(value, float) and not math.isfinite(value):
        return None
    if value is None or isinstance(value, (bool, int, float, str)):
        return value
    raise TypeError(f"{type(value).__name__} is nothing that can be stored")


def is_number(value: Any) -> TypeGuard[float]:
    """Whether `value` is a finite number (true and false are none)."""
    return (
        isinstance(value, (int, float)) and not isinstance(value, bool) and abs(value) < 1e300 and math.isfinite(value)
    )


def float_of(text: str | bytes) -> float:
    """The number that a text is; NaN where it is none."""
    try:
        return float(text)
    except ValueError:
        return math.nan


def numbers(entry: Any, names: Sequence[str]) -> list[float] | None:
    """The finite numbers that a JSON object has under all of `names`; None where one is absent or something else."""
    values = [entry.get(name) for name in names] if isinstance(entry, dict) else [None]
    finite = [number for number in values if is_number(number)]
    return finite if len(finite) == len(values) else None
