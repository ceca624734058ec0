"""The shading stage as arrays and what JSON holds, and back."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

import numpy as np

from ..light.environment import Environment
from ..light.lamps import Lamp
from ..light.mirrors import Mirror
from ..light.shading import Shading
from ..light.sun import Sun


def to_store(found: Shading) -> tuple[dict[str, np.ndarray], dict[str, Any]]:
    """What is stored of a `Shading`: arrays, and what JSON holds."""
    arrays = {name: getattr(found, name) for name in ("irradiance", "escaped", "doubt", "radiance")}
    arrays |= {"sky": found.environment.radiance, "sky_seen": found.environment.observations}
    meta = {
        "sun": found.sun and {k: np.asarray(v).tolist() for k, v in asdict(found.sun).items()},
        "points": found.points,
        "mirrors": [mirror.as_lists() for mirror in found.mirrors],
        "notes": list(found.notes),
        "lamps": [asdict(lamp) | {"radiance": lamp.radiance.tolist()} for lamp in found.lamps],
    }
    return arrays, meta


def from_store(a: dict[str, np.ndarray], meta: dict[str, Any]) -> Shading:
    """The inverse of `to_store`."""
    lamps = tuple(Lamp(**(d | {"radiance": np.float32(d["radiance"])})) for d in meta["lamps"])
    mirrors = tuple(Mirror.from_lists(d) for d in meta["mirrors"])
    return Shading(
        a["irradiance"], a["escaped"], a["doubt"], a["radiance"], lamps,
        Environment(a["sky"], a["sky_seen"]), tuple(meta["notes"]), mirrors, meta["points"],
        meta["sun"] and Sun(**{k: np.float32(v) if isinstance(v, list) else v for k, v in meta["sun"].items()}),
    )  # fmt: skip
