"""Frames worth looking at, and what the recovery predicts for them, pixel by pixel."""

from dataclasses import dataclass

import numpy as np
from scipy import ndimage

from ..io.pixels import read_pixels
from ..kinds import Shown
from ..light.emitters import bright_triangles
from ..light.lobes import highlight
from ..significance import LEVELS
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
        seen, predicted = self.radiance.mean(2), self.predicted.mean(2)
        level = (seen + predicted) / 2 + LEVELS.dark * float(np.median(seen))
        return np.where(inner, np.abs(predicted - seen) / np.maximum(level, 1e-30), 0)


def choose_frames(findings: Findings, count: int) -> list[int]:
    """Frames that together show the most surface, the one that shows most first."""
    samples, atlas = findings.samples, findings.surface.atlas
    area = atlas.area[samples.element].astype(np.float64)
    chosen: list[int] = []
    unseen = np.ones(len(atlas), bool)
    while len(chosen) < min(count, len(findings.frames)):
        gain = np.bincount(samples.frame, area * unseen[samples.element], len(findings.frames))
        gain[chosen] = -1
        best = int(np.argmax(gain))
        if gain[best] <= 0:
            break
        chosen.append(best)
        unseen[samples.element[samples.frame == best]] = False
    return chosen


def view(findings: Findings, index: int) -> View:
    """Frame `index` made small, and predicted."""
    frame = findings.frames[index]
    step = -(-frame.camera.width // WIDTH)
    pixels, camera = read_pixels(frame).coarser(step), frame.camera.coarser(step)
    directions, defined = camera.rays(camera.pixel_centres())
    origins = np.broadcast_to(camera.centre.astype(np.float32), directions.shape)
    field, surface = findings.field, findings.surface
    hits = surface.scene.intersect(np.ascontiguousarray(origins), directions)
    element = np.where(defined, field.elements(hits), -1)
    predicted = field.arriving(hits, element, directions)
    predicted[~defined] = 0
    hit_pixels = np.flatnonzero(element >= 0)
    predicted[hit_pixels] -= findings.specular[element[hit_pixels]]
    _add_lobes(findings, predicted, element, directions)
    shape = (camera.height, camera.width)
    ids = np.where(element >= 0, surface.atlas.object_id[element], -1)
    valid, predicted = pixels.valid & ~pixels.saturated, predicted.reshape(*shape, 3)
    return View(pixels.radiance, valid, element.reshape(shape), ids.reshape(shape), predicted)


def _add_lobes(findings: Findings, predicted: np.ndarray, element: np.ndarray, directions: np.ndarray) -> None:
    """Highlights of what has one; a metal has nothing else, and a flat mirror was followed already."""
    field = findings.field
    bright = bright_triangles(field)
    mirrors = {mirror.object_id for mirror in field.mirrors}
    owner = np.where(element >= 0, field.atlas.object_id[element], -1)
    for m in findings.materials:
        pixels = np.flatnonzero(owner == m.object_id)
        if m.model.microfacets is None or m.alpha is None or m.f0 is None or m.object_id in mirrors or not len(pixels):
            continue
        if not m.model.has_diffuse:
            predicted[pixels] = 0
        predicted[pixels] += highlight(
            field, bright, element[pixels], -directions[pixels], m.alpha, m.f0, m.model.microfacets,
            rays=CALIBRATION.lobe_rays, threads=findings.threads, seed=findings.seed,
        )  # fmt: skip
