"""Specular removal: a fitted lobe's radiance is subtracted from each frame, and the median is of the remainder.

Once lobes are known the model I = I_d + I_nd gives every observation its diffuse part. The median of those is L_d where
most views hold a highlight, too: a floor that mirrors a window from wherever one stands. Differences of medians, spread
between samples, left such windows white there, and what lies beside them burnt.

I_nd is predicted over whole pictures, by few rays in each pixel; pixels nearby on the same object share theirs. Of a
large picture one pixel in each cell is traced: no lobe has finer detail for being seen by more pixels. Where I_nd is
more than the remainder, the pixel is taken for a bound, as a clipped one is: it counts where there is no other, and
what rests on such pixels alone is not measured.
"""

import zlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.ndimage import gaussian_filter, map_coordinates

from ...brdf.material import ObjectMaterial
from ...brdf.model import Microfacets
from ...kinds import Code
from ...light.emitters import bright_triangles
from ...light.field import LightField
from ...light.lobes import highlight
from ...lit_diffuse.accumulate import accumulate
from ...scene.lit_diffuse import LitDiffuse
from ...scene.model import Frame, Pixels
from ...scene.rays import Hits
from ...scene.visibility import SATURATED, FrameView


@dataclass(frozen=True)
class RemovalParams:
    """How the specular part is predicted, and when it is accepted.

    Attributes
    ----------
    rays : int
        Of a pixel: a sixteenth of what an observation has in the fit, as neighbours share theirs.
    pixels : int
        Of a frame that are traced, about; of a larger one, one in each square cell.
    reach : int
        Pixels, or cells, whose rays are shared: two standard deviations of their weights.
    most : float
        Times the remainder that the specular part may be.
    """

    rays: int = 8
    pixels: int = 1 << 17
    reach: int = 2
    most: float = 3.0


REMOVAL = RemovalParams()

NO_OBJECT: Code[int] = -1


@dataclass(frozen=True)
class Removed:
    """What the frames show of L_d without its specular part.

    Attributes
    ----------
    specular : (n, 3) float32
        Part of L_d that is not diffuse; 0 for elements that were not requested.
    rest : LitDiffuse
        L_d without it, and what that rests on: the remainders' spread, not the highlights'. Clipped where in every view
        the specular part is far more than the remainder, and not on most of the object: that is dark.
    """

    specular: np.ndarray
    rest: LitDiffuse


class SpecularPart:
    """The specular part of whole pictures.

    Parameters
    ----------
    materials : sequence of ObjectMaterial
        Those whose lobes are predicted.
    rays : int
        Of a pixel.
    """

    def __init__(self, field: LightField, materials: Sequence[ObjectMaterial], seed: int = 0, rays: int = REMOVAL.rays):
        self._field, self._bright, self._seed, self._rays = field, bright_triangles(field), seed, rays
        self._lobes: dict[int, tuple[float, float, Microfacets]] = {}
        for m in materials:
            assert m.alpha is not None and m.f0 is not None and m.model.microfacets is not None
            self._lobes[m.object_id] = float(m.alpha), float(np.mean(m.f0)), m.model.microfacets

    def __call__(self, view: FrameView, seed: int) -> np.ndarray:
        """I_nd as a frame sees it, (height, width, 3) float32; 0 where there is no lobe."""
        field = self._field
        element = field.elements(Hits(*(x.ravel() for x in (view.triangle, view.u, view.v, view.distance))))
        owner = np.where(element >= 0, field.atlas.object_id[element], NO_OBJECT)
        rays, result = view.rays.reshape(3, -1), np.zeros((len(element), 3), np.float32)
        step = int(np.ceil(np.sqrt(len(element) / REMOVAL.pixels)))
        for object_id in self._lobes.keys() & set(np.unique(owner).tolist()):
            # Each object has rays of its own, so that its part is the same whichever others are requested.
            pixels = np.flatnonzero(owner == object_id)
            place = np.stack(np.divmod(pixels, view.triangle.shape[1]))
            traced, cell = one_of_each_cell(place, step) if step > 1 else (slice(None), place)
            part = highlight(
                field, self._bright, element[pixels[traced]], -rays[:, pixels[traced]].T, *self._lobes[object_id],
                rays=self._rays, seed=self._seed + seed + object_id,
            )  # fmt: skip
            result[pixels] = self._smoothed(part, cell, None if step == 1 else (place + 0.5) / step - 0.5)
        return result.reshape(*view.triangle.shape, 3)

    def _smoothed(self, part: np.ndarray, cell: np.ndarray, place: np.ndarray | None) -> np.ndarray:
        """The mean of an object's cells nearby, of one ray's place each, at places ((2, k), in cells): (k, 3) float32.

        `part` ((m, 3)) is of each `cell` ((2, m) int: row and column); without `place` at the cells themselves.
        """
        low = cell.min(1)
        planes = np.zeros((4, *(cell.max(1) + 1 - low)), np.float32)
        row, column = cell - low[:, None]
        planes[:3, row, column], planes[3, row, column] = part.T, 1
        reach = REMOVAL.reach
        total = gaussian_filter(planes, reach / 2, axes=(1, 2), mode="constant", radius=reach)
        if place is None:
            sums = total[:, row, column]
        else:
            at = place - low[:, None]
            sums = np.stack([map_coordinates(plane, at, np.float32, order=1, mode="nearest") for plane in total])
        return (sums[:3] / sums[3]).T


def one_of_each_cell(place: np.ndarray, step: int) -> tuple[np.ndarray, np.ndarray]:
    """Of pixels ((2, k) int: row and column) the one nearest to the middle of each cell of `step` pixels' edge.

    Returns
    -------
    index : (m,) int
    cell : (2, m) int
        Row and column of each cell that holds any, row by row.
    """
    cell, within = np.divmod(place, step)
    squared_distance = np.square(np.indices((step, step)) - (step - 1) / 2).sum(0).ravel()
    rank = np.argsort(np.argsort(squared_distance, kind="stable"))
    number = cell[0] * (cell[1].max(initial=0) + 1) + cell[1]
    order = np.argsort(number * step**2 + rank[within[0] * step + within[1]], kind="stable")
    first = order[np.flatnonzero(np.diff(number[order], prepend=-1))]
    return first, cell[:, first]


def without_specular(
    part: SpecularPart,
    field: LightField,
    lit: LitDiffuse,
    glossy: np.ndarray,
    frames: Sequence[Frame],
    read: Callable[[Frame], Pixels],
    **options: Any,
) -> Removed:
    """Subtract the specular part from every frame, and take the median of the remainder.

    Parameters
    ----------
    lit : LitDiffuse
        With the specular part.
    glossy : (n,) bool
        Elements of glossy objects.
    frames : sequence of Frame
        In the poses that `lit` was accumulated with.
    read : callable
        Gives a frame's pixels.
    **options
        As `accumulate` takes it: median, seed, threads, folder, groups, progress.

    Raises
    ------
    BadInputError
        From `read`.
    InterruptedRun
        From a progress.
    """

    def diffuse_part(frame: Frame, view: FrameView, pixels: Pixels) -> Pixels:
        specular = part(view, zlib.crc32(frame.name.encode()) & 0xFFFFFF)
        remainder = pixels.radiance - specular
        hidden = specular.sum(-1) > REMOVAL.most * remainder.sum(-1)
        return replace(pixels, radiance=remainder, saturated=pixels.saturated | hidden)

    diffuse = accumulate(
        field.mesh, field.atlas, field.scene, frames, read, only=glossy, change=diffuse_part, **options
    )
    measured = glossy & lit.seen & diffuse.seen
    radiance = np.nan_to_num(lit.radiance)
    specular = np.where(measured[:, None], radiance - np.maximum(np.nan_to_num(diffuse.radiance), 0), 0).astype(
        np.float32
    )
    bounds, object_id = measured & (diffuse.tier == SATURATED), field.atlas.object_id
    objects = int(object_id.max()) + 1
    share = np.bincount(object_id, bounds, objects) / np.maximum(np.bincount(object_id, measured, objects), 1)
    # Of what is dark the highlights tell as much as they do elsewhere.
    known = measured & (~bounds | (share[object_id] <= 0.5))
    rest = replace(diffuse.where(known, lit), radiance=lit.radiance - specular, clipped=lit.clipped)
    return Removed(specular, rest)
