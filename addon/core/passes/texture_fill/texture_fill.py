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
from .synthesis import autocovariance, completed, scale_of, smooth_mean, typical_contrast


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
    level, textures = np.log(np.maximum(rho.mean(1), LEVELS.dark)), [NOTHING]
    objects = [
        elements
        for elements in by_label(atlas.object_id)
        if filled[elements].any() and _textured(level, error, elements[measured[elements]])
    ]
    wanted = np.zeros(len(atlas), bool)
    for elements in objects:
        wanted[elements] = filled[elements]
    if not objects:
        return NOTHING
    texels = texels_of(atlas, mesh, wanted)
    texels_of_object = by_number(atlas.object_id[texels.element])
    for elements in objects:
        object_texels = texels.part(texels_of_object.get(int(atlas.object_id[elements[0]]), np.zeros(0, np.int64)))
        for plane in planes_of(atlas, elements, filled):
            known = plane.members[measured[plane.members]]
            plane_texels = object_texels.part(
                plane.near(object_texels.position) & (np.isin(object_texels.element, plane.members))
            )
            if _textured(level, error, known) and len(plane_texels.texel) >= LEVELS.many:
                picture = Picture.of(atlas, mesh, known, plane_texels)
                textures.append(_filled(picture, rho[known], error[known]))
    return Texture(np.concatenate([t.texel for t in textures]), np.concatenate([t.rho for t in textures]))


def _foreign(log: np.ndarray, source: np.ndarray, known: np.ndarray, error: float) -> np.ndarray:
    """Cells that belong to something else in the plane, (h, w) bool: outliers side by side as far as the picture's rim.

    A hearth in a scan's floor, the feet of a table, the fringe of a sofa. An outlier that nothing unknown borders, a
    dark tile or a knot, is part of the texture.
    """
    deviation = np.abs(log - np.median(log[source], 0))
    spread = np.maximum(SIGMA_OF_MAD * np.median(deviation[source], 0), error)
    outlier = known & (deviation > LEVELS.sigmas * spread).any(2)
    wide = outlier & (ndimage.uniform_filter(outlier.astype(np.float32), TEXTURE.mostly, mode="constant") > 0.5)
    label, _ = ndimage.label(ndimage.binary_propagation(wide, mask=outlier))
    at_rim = np.setdiff1d(label[ndimage.binary_dilation(~known, border_value=1)], [0])
    return np.isin(label, at_rim)


def _textured(level: np.ndarray, error: np.ndarray, known: np.ndarray) -> bool:
    """Whether elements `known` ((m,) int) have more detail than their errors explain."""
    return len(known) >= LEVELS.many and _beyond(float(np.std(level[known])), error[known])


def _beyond(contrast: float, error: np.ndarray) -> bool:
    return contrast > float(np.median(error))


def _filled(picture: Picture, rho: np.ndarray, error: np.ndarray) -> Texture:
    """Texels of one plane and their albedo; none where there is too little to go by."""
    painted, known = picture.paint(rho)
    # As in the neighbourhood prior: what was measured well, the better half at least; and no clamped albedo.
    typical_error = float(np.median(error))
    sure = (error <= max(LEVELS.sure, typical_error)) & (rho.max(1) < 1)
    around = ndimage.uniform_filter(picture.paint(sure[:, None])[0][..., 0], TEXTURE.mostly, mode="constant")
    source = known & (around > 0.5)
    if source.sum() < LEVELS.many:
        return NOTHING
    log = np.log(np.maximum(painted, LEVELS.dark))
    same_surface = known & ~_foreign(log, source, known, typical_error)
    source &= same_surface
    detail = np.where(source[..., None], log - log[source].mean(0), 0).astype(np.float32)
    scale = scale_of(*autocovariance(detail, source))
    if source.sum() < TEXTURE.samples * scale**2:
        return NOTHING
    smooth = np.maximum(smooth_mean(painted, same_surface, TEXTURE.smooth * scale), LEVELS.dark)
    detail = np.where(known[..., None], log - np.log(smooth), 0).astype(np.float32)
    if not _beyond(typical_contrast(detail, source, TEXTURE.smooth * scale), error):
        return NOTHING
    copy, done = completed(detail, source, picture.hole & ~known, scale)
    filled = (done | known).ravel()[picture.wanted]
    value = (np.exp(copy) * smooth).reshape(-1, 3)[picture.wanted[filled]]
    return Texture(picture.texel[filled], np.clip(value, 0, 1).astype(np.float32))
