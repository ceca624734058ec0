"""Observations kept one by one: for a spread-out choice of elements, what every frame saw of them.

The lit diffuse texture keeps order statistics only; the specular fit needs to know which view saw what.
"""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np

from ..significance import LEVELS
from .atlas import Atlas
from .params import SAMPLES
from .visibility import CLEAN, SATURATED, FrameView, Observations, normal_variance


@dataclass(frozen=True)
class Samples:
    """m observations of chosen elements.

    Attributes
    ----------
    element : (m,) int32
    frame : (m,) int32
        Index into the capture's frames.
    radiance : (m, 3) float32
    direction : (m, 3) float32
        Unit, from the element to the camera.
    saturated : (m,) bool
    normal_variance : (m,) float32
        Of the surface's normal within the pixel, summed over the axes, radians^2.
    """

    element: np.ndarray
    frame: np.ndarray
    radiance: np.ndarray
    direction: np.ndarray
    saturated: np.ndarray
    normal_variance: np.ndarray

    @staticmethod
    def none() -> Samples:
        """Where there are no frames."""
        integers, values = np.zeros(0, np.int32), np.zeros((0, 3), np.float32)
        return Samples(integers, integers, values, values, np.zeros(0, bool), np.zeros(0, np.float32))


def choose_elements(atlas: Atlas, seed: int) -> np.ndarray:
    """Elements to keep observations of: up to `LEVELS.sample` for each object, at random, sorted."""
    rng = np.random.default_rng(seed)
    key = rng.random(len(atlas))
    order = np.lexsort((key, atlas.object_id))
    _, start, count = np.unique(atlas.object_id[order], return_index=True, return_counts=True)
    rank = np.arange(len(order)) - np.repeat(start, count)
    limit = LEVELS.sample
    while limit > 16 and np.minimum(count, limit).sum() > SAMPLES.in_all:
        limit //= 2
    return np.sort(order[rank < limit])


class SampleCollector:
    """Takes a frame's observations, keeps those of the chosen elements.

    With `triangle_normal` ((t, 3) float32) and views it is kept how the surface turns within their pixels.
    """

    def __init__(self, atlas: Atlas, frames: int, seed: int, triangle_normal: np.ndarray | None = None):
        self._atlas, self._triangle_normal = atlas, triangle_normal
        self._chosen = np.zeros(len(atlas), bool)
        self._chosen[choose_elements(atlas, seed)] = True
        self._keep = min(1.0, SAMPLES.frames / max(frames, 1))
        self._seed = seed
        self._parts: list[Samples] = []

    def add(self, frame: int, observations: Observations, view: FrameView | None = None) -> None:
        """Take what `frame` saw; observations at depth edges show something else and are left out."""
        keep = self._chosen[observations.element] & ((observations.tier == CLEAN) | (observations.tier == SATURATED))
        if self._keep < 1:
            keep &= np.random.default_rng([self._seed, frame]).random(len(keep)) < self._keep
        element = observations.element[keep]
        variance = np.zeros(len(element), np.float32)
        if view is not None and self._triangle_normal is not None:
            variance = normal_variance(view, self._atlas, element, self._triangle_normal)
        self._parts.append(
            Samples(
                element,
                np.full(len(element), frame, np.int32),
                observations.radiance[keep],
                observations.direction[keep],
                observations.tier[keep] == SATURATED,
                variance,
            )
        )

    def result(self) -> Samples:
        """All of it, ordered by element, then frame."""
        names = [field.name for field in fields(Samples)]
        columns = {name: np.concatenate([getattr(part, name) for part in self._parts]) for name in names}
        order = np.lexsort((columns["frame"], columns["element"]))
        return Samples(**{name: values[order] for name, values in columns.items()})
