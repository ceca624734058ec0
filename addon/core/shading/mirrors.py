"""Flat mirrors: light that reaches a surface over one.

A mirror shows every point of the room something else; its L_d, one value an element, says nothing of what it throws on
its surroundings. Rays that meet one go on in the mirrored direction (`field`), and bright triangles are aimed at
through it (`over_mirrors`). On the living room that took the albedo from 28.0 to 30.2 dB.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ..capture.model import KnownMirror

if TYPE_CHECKING:
    from .field import LightField


@dataclass(frozen=True)
class Mirror:
    """One flat mirror.

    Attributes
    ----------
    object_id : int
    point, normal : (3,) float32
        Its plane; the normal on the side that the frames see.
    f0 : (3,) float32
        Share of the radiance that it reflects, linear Rec.709.
    """

    object_id: int
    point: np.ndarray
    normal: np.ndarray
    f0: np.ndarray


def known_mirror(known: KnownMirror, field: LightField) -> Mirror:
    """The mirror that a capture tells of, its normal turned to its object's front."""
    own = field.mesh.object_id == known.object_id
    turn = -1.0 if (field.normal[own] @ known.normal).sum() < 0 else 1.0
    return Mirror(known.object_id, np.float32(known.point), np.float32(turn * known.normal),
                  np.full(3, known.reflectivity, np.float32))


def reflect(vectors: np.ndarray, normal: np.ndarray) -> np.ndarray:
    """Directions ((n, 3)) mirrored at a plane with the given unit normal ((3,))."""
    return vectors - 2 * (vectors @ normal)[:, None] * normal
