"""Frames worth looking at, and what the recovery predicts for them, pixel by pixel."""

from dataclasses import dataclass

import numpy as np
from scipy import ndimage

from ..io.pixels import read_pixels
from ..kinds import Shown
from ..light.emitters import bright_triangles
from ..light.lobes import highlight
from .findings import Findings
from .params import CALIBRATION

WIDTH: Shown[int] = 240
"""Pictures are this wide at most."""


@dataclass(frozen=True)
class View:
    """A frame, made small, and what lies behind its pixels.

    Attributes
    ----------
    radiance : (h, w, 3) float32
        Seen.
    valid : (h, w) bool
        Not masked, not clipped.
    element : (h, w) int32
        Behind each pixel's centre; -1 where it sees past the mesh, or no ray leads to it.
    object_id : (h, w) int32
    predicted : (h, w, 3) float32
        Diffuse light and highlight, as recovered.
    """

    radiance: np.ndarray
    valid: np.ndarray
    element: np.ndarray
    object_id: np.ndarray
    predicted: np.ndarray

    @property
    def residual(self) -> np.ndarray:
        """|predicted - seen| over their mean, (h, w) float32, 0...2.

        0 where nothing can be said: past the mesh, masked, clipped, and at the objects' edges, where pixels mix.
        """
        cross = ndimage.generate_binary_structure(2, 1)
        low = ndimage.minimum_filter(self.object_id, footprint=cross, mode="nearest")
        high = ndimage.maximum_filter(self.object_id, footprint=cross, mode="nearest")
        inner = self.valid & (self.element >= 0) & (low == high)
        seen, told = self.radiance.mean(2), self.predicted.mean(2)
        level = (seen + told) / 2 + 0.02 * float(np.median(seen))
        return np.where(inner, np.abs(told - seen) / np.maximum(level, 1e-30), 0)


def choose_frames(found: Findings, count: int) -> list[int]:
    """Frames that together show the most surface, the one that shows most first."""
    samples, atlas = found.samples, found.surface.atlas
    area = atlas.area[samples.element].astype(np.float64)
    chosen: list[int] = []
    left = np.ones(len(atlas), bool)
    while len(chosen) < min(count, len(found.frames)):
        gain = np.bincount(samples.frame, area * left[samples.element], len(found.frames))
        gain[chosen] = -1
        best = int(np.argmax(gain))
        if gain[best] <= 0:
            break
        chosen.append(best)
        left[samples.element[samples.frame == best]] = False
    return chosen


def view(found: Findings, index: int) -> View:
    """Frame `index` made small, and predicted."""
    frame = found.frames[index]
    step = -(-frame.camera.width // WIDTH)
    pixels, camera = read_pixels(frame).coarser(step), frame.camera.coarser(step)
    directions, seen = camera.rays(camera.pixel_centres())
    origins = np.broadcast_to(camera.centre.astype(np.float32), directions.shape)
    room, surface = found.field, found.surface
    hits = surface.scene.intersect(np.ascontiguousarray(origins), directions)
    element = np.where(seen, room.elements(hits), -1)
    predicted = room.arriving(hits, element, directions)
    predicted[~seen] = 0
    hit = np.flatnonzero(element >= 0)
    predicted[hit] -= found.specular[element[hit]]
    _add_lobes(found, predicted, element, directions)
    shape = (camera.height, camera.width)
    ids = np.where(element >= 0, surface.atlas.object_id[element], -1)
    valid, predicted = pixels.valid & ~pixels.saturated, predicted.reshape(*shape, 3)
    return View(pixels.radiance, valid, element.reshape(shape), ids.reshape(shape), predicted)


def _add_lobes(found: Findings, predicted: np.ndarray, element: np.ndarray, directions: np.ndarray) -> None:
    """Highlights of what has one; a metal has nothing else, and a flat mirror was followed already."""
    room = found.field
    bright = bright_triangles(room)
    mirrors = {mirror.object_id for mirror in room.mirrors}
    owner = np.where(element >= 0, room.atlas.object_id[element], -1)
    for m in found.materials:
        at = np.flatnonzero(owner == m.object_id)
        if m.model.microfacets is None or m.alpha is None or m.f0 is None or m.object_id in mirrors or not len(at):
            continue
        if not m.model.has_diffuse:
            predicted[at] = 0
        predicted[at] += highlight(
            room, bright, element[at], -directions[at], m.alpha, m.f0, m.model.microfacets,
            rays=CALIBRATION.lobe_rays, threads=found.threads, seed=found.seed,
        )  # fmt: skip
