"""L_d from a scan's baked texture, where there are no frames: what an app blended of pictures that it had taken."""

from dataclasses import dataclass

import numpy as np

from ..errors import BadInputError
from ..io.base_colour import as_file
from ..io.oiio import CODED, Stored, read_coded
from ..io.pictures import picture_kind, picture_size, read_picture
from ..io.transfer import CLIP_SHARE, decode
from ..kinds import Block
from ..parallel import blocks
from ..progress import Progress
from ..scene.atlas import Atlas
from ..scene.lit_diffuse import LitDiffuse
from ..scene.model import Mesh
from ..scene.stored_light import LitTexture, StoredPicture
from ..weighted import weighted_median
from .from_texture import barycentric, interpolated, of_sums

AT_ONCE: Block[int] = 1 << 18


@dataclass(frozen=True)
class BakedParams:
    """How a baked texture is sampled.

    Attributes
    ----------
    points : int
        Along an element's edge, at which the texture is looked up; as many texels as an element usually covers, twice.
    texels : float
        Along an element's edge: an app's blending of pictures leaves no finer detail.
    elements : int
        At most, over the whole mesh: what a room has whose frames are seen at full detail.
    """

    points: int = 4
    texels: float = 2.0
    elements: int = 1 << 20


BAKED = BakedParams()


def texel_edge(mesh: Mesh, texture: LitTexture) -> float:
    """Edge in metres of an element for a baked texture: some texels of the usual triangle, by area."""
    with np.errstate(invalid="ignore"):
        _, area = mesh.geometry
    (ux, uy), (vx, vy) = (np.moveaxis(texture.uv[:, i] - texture.uv[:, 0], 1, 0).astype(np.float64) for i in (1, 2))
    texels = np.abs(ux * vy - uy * vx) / 2
    for i, picture in enumerate(texture.pictures):
        with as_file(picture) as file:
            width, height = picture_size(file)
        texels[texture.picture == i] *= width * height
    known = (texture.picture >= 0) & (texels > 0)
    if not known.any():
        raise BadInputError(
            f"The coordinates of texture {_named(texture)} span nothing; unwrap the mesh and bake it again."
        )
    typical = weighted_median(area[known] / texels[known], area[known])
    return float(max(BAKED.texels * np.sqrt(typical), np.sqrt(area.sum() / BAKED.elements)))


def lit_from_picture(mesh: Mesh, texture: LitTexture, atlas: Atlas, progress: Progress | None = None) -> LitDiffuse:
    """The mean of the texture over each element, in linear light; 1 at the greatest code.

    It is looked up within the element's triangle alone: what lies beside it on the picture may be any other place.
    Texels that are 0 in all channels, or transparent, were never seen. Elements most of whose texels are within two
    codes of the top are clipped. The interquartile range of what was blended is not known, and is 0.

    Raises
    ------
    BadInputError
        A picture was changed or taken away since it was read, or nothing is on it.
    """
    sums = np.zeros((len(atlas), 5))
    of_element = texture.picture[atlas.triangle]
    for i, picture in enumerate(texture.pictures):
        stored = _read(picture)
        elements = np.flatnonzero(of_element == i)
        for part in blocks(len(elements), AT_ONCE):
            sums[elements[part]] = _sums(mesh, texture, atlas, elements[part], stored)
        if progress is not None:
            progress.update(0.9 * (i + 1) / len(texture.pictures))
    if not sums[:, 3].any():
        raise BadInputError(f"Texture {_named(texture)} is black all over; bake or export it again.")
    return of_sums(sums)


def _named(texture: LitTexture) -> str:
    """The files that hold it, as a sentence gives them."""
    return ", ".join(f"'{path}'" for path in dict.fromkeys(picture.path for picture in texture.pictures))


def _read(picture: StoredPicture) -> Stored:
    """A texture's codes, or linear floats."""
    with as_file(picture) as file:
        return read_coded(file) if picture_kind(file) in CODED else Stored(read_picture(file).rgb, None)


def _sums(mesh: Mesh, texture: LitTexture, atlas: Atlas, element: np.ndarray, stored: Stored) -> np.ndarray:
    """Sums of R, G, B, number and number of clipped points over some elements, (n, 5)."""
    height, width = stored.colour.shape[:2]
    triangle, result = atlas.triangle[element], np.zeros((len(element), 5))
    a, b, c = (mesh.vertices[mesh.triangles[triangle, i]] for i in range(3))
    along = (b - a) / np.maximum(np.linalg.norm(b - a, axis=1), 1e-30)[:, None]
    across = np.cross(np.cross(b - a, c - a), along)
    across /= np.maximum(np.linalg.norm(across, axis=1), 1e-30)[:, None]
    edge = np.sqrt(atlas.area[element])[:, None]
    corner = texture.uv[triangle]
    steps = (np.arange(BAKED.points) + 0.5) / BAKED.points - 0.5
    for x, y in ((x, y) for x in steps for y in steps):
        u, v = np.maximum(barycentric(mesh, triangle, atlas.position[element] + edge * (x * along + y * across)), 0)
        u, v = (u, v) / np.maximum(u + v, 1)
        uv = interpolated(corner, u, v)
        column = np.minimum((uv[:, 0] % 1 * width).astype(int), width - 1)
        row = np.minimum(((1 - uv[:, 1]) % 1 * height).astype(int), height - 1)
        value = stored.colour[row, column]
        known = np.isfinite(value).all(-1) & (value > 0).any(-1)
        if stored.alpha is not None:
            known &= stored.alpha[row, column] > 0
        if value.dtype.kind == "f":
            linear, clipped = np.maximum(np.nan_to_num(value), 0), np.zeros(len(value), bool)
        else:
            linear, maximum = decode(value, texture.transfer), np.iinfo(value.dtype).max
            clipped = (value >= CLIP_SHARE[8 * value.dtype.itemsize] * maximum).any(-1)
        result[known, :3] += linear[known]
        result[:, 3] += known
        result[:, 4] += known & clipped
    return result
