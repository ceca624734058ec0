"""Base colour in parts, for close work: an image for each object, or UDIM tiles, as fine as the frames resolve.

The recovery itself goes on in the room's atlas, whose texels are as large as the frames resolve the room on the whole.
An object that they resolve finer gets finer texels: the frames are looked at once more for what they show there, and
base colour is multiplied by what this differs from the room's own lit diffuse texture.
"""

from __future__ import annotations

import re
import zlib
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from .capture.model import Camera
from .lit_diffuse.accumulate import ENOUGH, LitDiffuse, accumulate
from .lit_diffuse.sharpen import FLOOR, MOST, sharpened
from .lit_diffuse.visibility import CLEAN
from .material import EMITTER, METAL
from .shading.albedo import MEASURED
from .store import key
from .surface.build import Surface
from .surface.elements import make_atlas
from .surface.pages import OBJECT, Pages, lay_out

if TYPE_CHECKING:
    from .recover import Recovery

FINEST = 4.0
"""Times that an object's texels may be finer than the room's."""
WORTH = 1.2
"""Finer by less than this is not worth another look at the frames."""
MOST_TEXELS = 25_000_000
"""Of all parts together: one and a half times an atlas of 4096. Memory, a few gigabytes for this, ends there."""
PIXEL_STEP = 8
HALF = 0.5
"""Of what lies around a spot on the room's atlas, this share has to be measured for detail to be told there."""
FOLDER = "objects"
TILE = "base_color.<UDIM>.exr"


@dataclass(frozen=True)
class Parts:
    """What the scene shows instead of the one image.

    Attributes
    ----------
    uv : (t, 3, 2) float32
        Texture coordinates for the images, as `Atlas.uv` is for the room's.
    images : dict of int to str
        By object: the file in the result folder; ``<UDIM>`` stands for the tiles' numbers.
    tiles : tuple of int
        Those numbers; () where each object has an image of its own.
    """

    uv: np.ndarray
    images: dict[int, str]
    tiles: tuple[int, ...] = ()


def footprints(surface: Surface, cameras: list[Camera]) -> dict[int, float]:
    """Edge in metres of the surface that a pixel covers, by object: the lower quartile over all views of it."""
    found: dict[int, list[np.ndarray]] = {}
    for camera in cameras:
        y, x = np.mgrid[PIXEL_STEP // 2 : camera.height : PIXEL_STEP, PIXEL_STEP // 2 : camera.width : PIXEL_STEP]
        pixels = np.stack([x.ravel() + 0.5, y.ravel() + 0.5], -1)
        directions, led = camera.rays(pixels)
        pixels, directions = pixels[led], directions[led]
        hits = surface.scene.intersect(np.broadcast_to(camera.centre.astype(np.float32), directions.shape), directions)
        met = np.flatnonzero(hits.triangle >= 0)
        edge = hits.distance[met] * (
            camera.pixel_angles(pixels[met]) if camera.lens is not None else 1 / np.sqrt(camera.fx * camera.fy))
        owner = surface.mesh.object_id[hits.triangle[met]]
        for number in np.unique(owner):
            found.setdefault(int(number), []).append(edge[(owner == number) & (edge > 0)])
    return {number: float(np.percentile(np.concatenate(all_edges), 25)) for number, all_edges in found.items()
            if sum(map(len, all_edges))}


def scales(run: Recovery) -> dict[int, float]:
    """By object: how much finer than the room's its texels are to be; 1 where left out."""
    surface, s = run.surface(), run.settings
    wanted = {number: s.texel_size or edge / s.detail
              for number, edge in footprints(surface, [frame.camera for frame in run.frames]).items()}
    finer = {number: float(np.clip(surface.texel_size / texel, 1, FINEST)) for number, texel in wanted.items()}
    finer = {number: scale for number, scale in finer.items() if scale > WORTH}
    taken = np.bincount(surface.atlas.object_id) / max(len(surface.atlas), 1) * surface.atlas.size**2
    while finer and taken.sum() + sum((scale**2 - 1) * taken[i] for i, scale in finer.items()) > MOST_TEXELS:
        finer = {number: max(0.95 * scale, 1.0) for number, scale in finer.items()}
    return {number: scale for number, scale in finer.items() if scale > WORTH}


def pages_of(run: Recovery) -> Pages:
    """How the run's atlas is parted."""
    surface = run.surface()
    return lay_out(run.settings.atlas, surface.mesh.triangles, surface.atlas.uv, surface.mesh.object_id,
                   surface.atlas.size, scales(run), run.settings.atlas_size)


def write_parts(run: Recovery, base_color: np.ndarray) -> Parts:
    """Write the images into the result folder; those of an earlier run that are not written again are removed.

    Parameters
    ----------
    base_color : (s, s, 3) float32
        Over the room's atlas, row 0 at the bottom.
    """
    pages = pages_of(run)
    sheet = pages.image(base_color)
    finer = finer_detail(run, pages)
    if finer is not None:
        sheet *= finer
    materials = {m.object_id: m for m in run.materials()}
    shown = {number: m for number, m in materials.items() if m.model not in (EMITTER, METAL)}
    if run.settings.atlas == OBJECT:
        images = {page.number: f"{FOLDER}/{file_name(shown[page.number].name)} base_color.exr"
                  for page in pages.pages if page.number in shown}
        files = {images[page.number]: page for page in pages.pages if page.number in images}
        tiles = ()
    else:
        images = dict.fromkeys(shown, TILE)
        files = {TILE.replace("<UDIM>", str(page.number)): page for page in pages.pages}
        tiles = tuple(page.number for page in pages.pages)
    remove_parts(run, set(files))
    for done, (name, page) in enumerate(files.items()):
        run.store.write_exr(name, pages.of(sheet, page)[::-1], half=True)
        run.progress.update(0.55 + 0.05 * done / len(files))
    return Parts(pages.uv, images, tiles)


def remove_parts(run: Recovery, kept: set[str] = frozenset()) -> None:
    """Take away the parts that an earlier run left, but for the files `kept`."""
    folder = run.store.folder
    for path in [*folder.glob(f"{FOLDER}/* base_color.exr"), *folder.glob(TILE.replace("<UDIM>", "[0-9]" * 4))]:
        if path.relative_to(folder).as_posix() not in kept:
            path.unlink()


def file_name(name: str) -> str:
    """An object's name as a file may have it anywhere."""
    return re.sub(r"[^\w\- ]", "_", name)


def finer_detail(run: Recovery, pages: Pages) -> np.ndarray | None:
    """What base colour is multiplied by on the sheet, (size, size, 3) float32; None where nothing is finer.

    Raises
    ------
    BadInputError
        Too many frames can't be read any more.
    InterruptedRun
        From the run's progress.
    """
    finer = [number for number, scale in pages.scale.items() if scale > 1]
    if not finer or not run.frames:
        return None
    surface, lit = run.surface(), run.lit_diffuse()
    atlas = make_atlas(surface.mesh, pages.sheet_uv, pages.size)
    only = np.isin(atlas.object_id, finer)
    # By what it was made of: a refit knows the capture no more.
    known = (zlib.crc32(np.ascontiguousarray(part).tobytes()) for part in (lit.radiance, lit.count, surface.atlas.uv))
    own = key("detail", *known, run.settings.atlas, run.settings.sharpen, sorted(pages.scale.items()), pages.size)
    stored = run.store.load("detail", own)
    if stored is None:
        found = _looked(run, Surface(surface.mesh, atlas, surface.scene, pages.sheet_uv, surface.texel_size), only)
        told = (found.tier == CLEAN) & (found.count >= ENOUGH)
        stored = {"radiance": np.where(told[:, None], found.radiance, np.nan)[only].astype(np.float32)}
        run.store.save("detail", own, stored)
    good = (lit.tier == CLEAN) & (lit.count >= ENOUGH) & (run.albedo.origin == MEASURED)
    known = np.concatenate([np.where(good[:, None], lit.radiance, 0), good[:, None]], 1).astype(np.float32)
    room = pages.image(surface.atlas.image(known)).reshape(-1, 4)[atlas.texel[only]]
    floor = np.float32(max(FLOOR * run.median_radiance(), 1e-30))
    level = room[:, :3] / np.maximum(room[:, 3:], 1e-6)
    ratio = np.clip((stored["radiance"] + floor) / (level + floor), 1 / MOST, MOST)
    ratio[(room[:, 3] < HALF) | ~np.isfinite(ratio).all(1)] = 1
    every = np.ones((len(atlas), 3), np.float32)
    every[only] = ratio
    return atlas.image(every, 1.0)


def _looked(run: Recovery, surface: Surface, only: np.ndarray) -> LitDiffuse:
    """L_d of some elements of a finer surface."""
    s = run.settings
    how = {"median": s.median, "order": s.frame_order, "seed": s.seed, "threads": s.threads, "folder": run.store.folder}
    found = accumulate(surface.mesh, surface.atlas, surface.scene, run.frames, run.read, only=only, **how)
    return sharpened(found, surface, run.frames, run.read, **how) if s.sharpen and found.seen.any() else found
