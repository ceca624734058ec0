"""Objects that the sensor clipped in every view: what was measured of them is a lower bound, not a value.

A clipped lamp lights the room with more than its pixels show. So it is solved for from the light that it throws, as a
lamp that no frame looked at is (`unseen_light`); where that fails, the bound is used and said to be one.
"""

from collections.abc import Callable, Collection, Mapping
from dataclasses import replace

import numpy as np

from ...light.shading import Shading
from ...luminance import LUMINANCE
from ...scene.atlas import Atlas
from ...scene.lit_diffuse import LitDiffuse


def clipped_objects(lit: LitDiffuse, atlas: Atlas, but: Collection[int] = ()) -> dict[int, np.ndarray]:
    """Objects of which most frames show most clipped, with the radiance that they have at least, (3,); none of `but`.

    Not by the tier: where poses are off, a few pixels of an edge reach far into a lamp that all others show clipped.
    """
    bounds = {}
    mostly_clipped = lit.seen & (lit.clipped > 0.5)
    for object_id in np.setdiff1d(atlas.object_id[mostly_clipped], list(but)):
        elements = atlas.elements_of(int(object_id))
        elements = elements[lit.seen[elements]]
        clipped = elements[mostly_clipped[elements]]
        if 2 * atlas.area[clipped].sum() > atlas.area[elements].sum():
            bounds[int(object_id)] = np.median(lit.radiance[clipped], 0).astype(np.float64)
    return bounds


def unseen(lit: LitDiffuse, atlas: Atlas, objects: list[int]) -> LitDiffuse:
    """The same as if no frame had seen these objects."""
    hidden = np.isin(atlas.object_id, objects)
    radiance = np.where(hidden[:, None], np.float32(np.nan), lit.radiance)
    return replace(
        lit, radiance=radiance, count=np.where(hidden, 0, lit.count).astype(np.int32),
        tier=np.where(hidden, -1, lit.tier).astype(np.int8),
    )  # fmt: skip


def shade_clipped(
    shade: Callable[[LitDiffuse, Mapping[int, np.ndarray]], Shading],
    lit: LitDiffuse,
    atlas: Atlas,
    but: Collection[int] = (),
) -> Shading:
    """`shade(lit)`, with clipped lamps solved for.

    Parameters
    ----------
    shade : callable
        Gives a Shading for an L_d, and objects that count in it as unseen though they shine, with at least a radiance.
    but : collection of int
        Objects that are left to `shade`.

    Returns
    -------
    Shading
        Each lamp that was clipped says so.
    """
    bounds = clipped_objects(lit, atlas, but)
    if not bounds:
        return shade(lit, {})
    shading = shade(unseen(lit, atlas, list(bounds)), bounds)
    solved = {
        lamp.object_id for lamp in shading.lamps
        if lamp.object_id in bounds and float((lamp.radiance - bounds[lamp.object_id]) @ LUMINANCE) >= 0
    }  # fmt: skip
    if len(solved) < len(bounds):
        # Once more, as the first run had nothing where those that were not solved for are: their bound lights the
        # others, and has to be there when these are solved for. Where all were solved, the first run stands.
        shining = {object_id: bounds[object_id] for object_id in solved}
        shading = shade(unseen(lit, atlas, list(solved)) if solved else lit, shining)

    return replace(
        shading, lamps=tuple(replace(lamp, clipped=lamp.clipped or lamp.object_id in bounds) for lamp in shading.lamps)
    )
