"""Lenses as JSON holds them: the class's name and the values of its fields."""

import dataclasses
from collections.abc import Callable
from typing import Any

from .lens import Lens
from .lenses import Cropped, Division, EnhancedUnified, Equirectangular, FieldOfView
from .lenses_polynomial import Polynomial

_CLASSES: tuple[type[Lens], ...] = (Cropped, Division, EnhancedUnified, Equirectangular, FieldOfView, Polynomial)
KINDS: dict[str, Callable[..., Lens]] = {kind.__name__: kind for kind in _CLASSES}


def lens_to_json(lens: Lens | None) -> list[Any] | None:
    """A lens as lists, numbers and strings; None stays None."""
    if lens is None:
        return None
    values = [getattr(lens, field.name) for field in dataclasses.fields(lens)]
    return [type(lens).__name__, [lens_to_json(v) if type(v).__name__ in KINDS else v for v in values]]


def lens_from_json(stored: list[Any] | None) -> Lens | None:
    """The lens that `lens_to_json` stored. Raises KeyError, TypeError or ValueError for anything else."""
    if stored is None:
        return None
    kind, values = stored
    if kind == Cropped.__name__:
        inner = lens_from_json(values[0])
        if inner is None:
            raise TypeError("a crop of no lens")
        return Cropped(inner, *values[1:])
    return KINDS[kind](*(tuple(v) if isinstance(v, list) else v for v in values))
