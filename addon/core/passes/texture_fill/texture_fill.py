"""What no frame saw gets the texture of its plane's measured part; its colour, where texture is averaged out, is what
lies around it."""

from dataclasses import dataclass

import numpy as np
from scipy import ndimage

from ...groups import by_label, by_number
from ...scene.atlas import Atlas
from ...scene.model import Mesh
from ...significance import LEVELS, SIGMA_OF_MAD
from .params import TEXTURE
from .planes import Picture, planes_of, texels_of
from .synthesis import autocovariance, completed, scale_of, smooth_mean, usual_contrast


@dataclass(frozen=True)
class Texture:
    """Albedo of k texels of the atlas's images that differ from their element's.

    Attributes
    ----------
    texel : (k,) int64
        Flat index.
    rho : (k, 3) float32
    """

    texel: np.ndarray
    rho: np.ndarray


NOTHING = Texture(np.zeros(0, np.int64), np.zeros((0, 3), np.float32))


def texture_of(
    atlas: Atlas, mesh: Mesh, rho: np.ndarray, measured: np.ndarray, filled: np.ndarray, error: np.ndarray
) -> Texture:
    """Texture for the texels of the elements that are filled in.

    Parameters
    ----------
    rho : (n, 3) float32
        Albedo of the elements.
    measured, filled : (n,) bool
    error : (n,) float32
        Relative standard error of what was measured.

    Returns
    -------
    Texture
        Of planes whose measured part has detail beyond its error, and enough of it.
    """
    level, told = np.log(np.maximum(rho.mean(1), LEVELS.dark)), []
    objects = [
        own for own in by_label(atlas.object_id) if filled[own].any() and _textured(level, error, own[measured[own]])
    ]
    wanted = np.zeros(len(atlas), bool)
    for own in objects:
        wanted[own] = filled[own]
    if not objects:
        return NOTHING
    texels = texels_of(atlas, mesh, wanted)
    shown = by_number(atlas.object_id[texels.element])
    for own in objects:
        mine = texels.part(shown.get(int(atlas.object_id[own[0]]), np.zeros(0, np.int64)))
        for plane in planes_of(atlas, own, filled):
            known = plane.members[measured[plane.members]]
            there = mine.part(plane.near(mine.position) & (np.isin(mine.element, plane.members)))
            if _textured(level, error, known) and len(there.texel) >= LEVELS.many:
                picture = Picture.of(atlas, mesh, known, there)
                told.append(_filled(picture, rho[known], error[known]))
    if not told:
        return NOTHING
    texel, value = (np.concatenate(parts) for parts in zip(*told, strict=True))
    return Texture(texel, value)


def _of_others(log: np.ndarray, source: np.ndarray, known: np.ndarray, error: float) -> np.ndarray:
    """Cells that belong to something else in the plane, (h, w) bool: outliers side by side as far as the picture's rim.

    A hearth in a scan's floor, the feet of a table, the fringe of a sofa. An outlier that nothing unknown borders, a
    dark tile or a knot, is part of the texture.
    """
    off = np.abs(log - np.median(log[source], 0))
    spread = np.maximum(SIGMA_OF_MAD * np.median(off[source], 0), error)
    odd = known & (off > LEVELS.sigmas * spread).any(2)
    wide = odd & (ndimage.uniform_filter(odd.astype(np.float32), TEXTURE.mostly, mode="constant") > 0.5)
    label, _ = ndimage.label(ndimage.binary_propagation(wide, mask=odd))
    at_rim = np.setdiff1d(label[ndimage.binary_dilation(~known, border_value=1)], [0])
    return np.isin(label, at_rim)


def _textured(level: np.ndarray, error: np.ndarray, known: np.ndarray) -> bool:
    """Whether elements `known` ((m,) int) have more detail than their errors explain."""
    return len(known) >= LEVELS.many and _beyond(float(np.std(level[known])), error[known])


def _beyond(contrast: float, error: np.ndarray) -> bool:
    return contrast > float(np.median(error))


def _filled(picture: Picture, rho: np.ndarray, error: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Texels of one plane and their albedo; none where there is too little to go by."""
    shown, known = picture.paint(rho)
    # As where neighbourhoods are told: what was seen well, the better half at least; and no albedo that was cut off.
    usual = float(np.median(error))
    sure = (error <= max(LEVELS.sure, usual)) & (rho.max(1) < 1)
    around = ndimage.uniform_filter(picture.paint(sure[:, None])[0][..., 0], TEXTURE.mostly, mode="constant")
    source = known & (around > 0.5)
    if source.sum() < LEVELS.many:
        return NOTHING.texel, NOTHING.rho
    log = np.log(np.maximum(shown, LEVELS.dark))
    own = known & ~_of_others(log, source, known, usual)
    source &= own
    detail = np.where(source[..., None], log - log[source].mean(0), 0).astype(np.float32)
    scale = scale_of(*autocovariance(detail, source))
    if source.sum() < TEXTURE.samples * scale**2:
        return NOTHING.texel, NOTHING.rho
    smooth = np.maximum(smooth_mean(shown, own, TEXTURE.smooth * scale), LEVELS.dark)
    detail = np.where(known[..., None], log - np.log(smooth), 0).astype(np.float32)
    if not _beyond(usual_contrast(detail, source, TEXTURE.smooth * scale), error):
        return NOTHING.texel, NOTHING.rho
    copy, done = completed(detail, source, picture.hole & ~known, scale)
    got = (done | known).ravel()[picture.wanted]
    value = (np.exp(copy) * smooth).reshape(-1, 3)[picture.wanted[got]]
    return picture.texel[got], np.clip(value, 0, 1).astype(np.float32)
