"""Base colour in parts, for close work: an image for each object, or UDIM tiles, as fine as the frames resolve.

The recovery itself works on the room's atlas, whose texels are as large as the frames resolve the room on the whole.
An object that they resolve finer gets finer texels: the frames are looked at once more for what they show there, and
base colour is multiplied by what this differs from the room's own lit diffuse texture.
"""

import re
import sys
from collections.abc import Collection
from dataclasses import dataclass, replace

import numpy as np

from ..json_values import key
from ..kinds import Shown
from ..parallel import ordered_map
from ..passes.albedo.albedo import MEASURED
from ..passes.sharpening.sharpen import SHARPENING
from ..progress import Rounds
from ..scene.atlas import Atlas
from ..scene.elements import ElementLookup, make_atlas
from ..scene.lit_diffuse import LitDiffuse
from ..scene.model import Camera, Mesh
from ..scene.pages import OBJECT, Pages, lay_out
from ..scene.params import VISIBILITY
from ..scene.sparse_hits import pixel_edges, sparse_hits
from ..scene.surface import Surface
from ..scene.visibility import CLEAN
from ..significance import LEVELS
from .corrected import Corrected
from .frames import Passes
from .params import PARTS

LOOKED: Shown[float] = 0.3
"""Share of the writing, in terms of progress, that the look at the frames takes."""

STAGE = "detail"
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


@dataclass(frozen=True)
class Closer:
    """What the frames show of the objects whose texels are finer than the room's.

    Attributes
    ----------
    sheet : Pages
        Of these objects alone.
    atlas : Atlas
        Over that sheet.
    radiance : (n, 3) float32
        L_d of its elements; NaN where too few observations show it.
    """

    sheet: Pages
    atlas: Atlas
    radiance: np.ndarray


@dataclass(frozen=True)
class Parting:
    """How an atlas is parted, and a closer look at the objects whose texels are finer; None where no object is."""

    pages: Pages
    closer: Closer | None = None


def footprints(surface: Surface, cameras: list[Camera]) -> dict[int, float]:
    """Edge in metres of the surface that a pixel covers, by object: the lower quartile over all views of it."""
    edges: dict[int, list[np.ndarray]] = {}
    for camera in cameras:
        pixels, _, hits = sparse_hits(surface.scene, camera)
        edge, owner = pixel_edges(camera, pixels, hits), surface.mesh.object_id[hits.triangle]
        for number in np.unique(owner):
            edges.setdefault(int(number), []).append(edge[(owner == number) & (edge > 0)])
    return {
        number: float(np.percentile(np.concatenate(all_edges), 25))
        for number, all_edges in edges.items()
        if sum(map(len, all_edges))
    }


def scales(run: Corrected) -> dict[int, float]:
    """By object: how much finer than the room's its texels are to be; 1 where left out."""
    surface, s = run.surface(), run.settings
    wanted = {
        number: s.texel_size or edge / s.detail
        for number, edge in footprints(surface, [frame.camera for frame in run.frames]).items()
    }
    finer = {number: float(np.clip(surface.texel_size / texel, 1, PARTS.finest)) for number, texel in wanted.items()}
    finer = {number: scale for number, scale in finer.items() if scale > PARTS.worth}
    texels = np.bincount(surface.atlas.object_id) / max(len(surface.atlas), 1) * surface.atlas.size**2
    while finer and texels.sum() + sum((scale**2 - 1) * texels[i] for i, scale in finer.items()) > PARTS.most_texels:
        finer = {number: max(0.95 * scale, 1.0) for number, scale in finer.items()}
    return {number: scale for number, scale in finer.items() if scale > PARTS.worth}


def look_closer(run: Corrected) -> Parting:
    """Part a run's atlas and look at the frames once more for what they show of objects with finer texels.

    What it finds is stored, so that it is done once for a capture: a refit asks for no frame, tiles use what was found
    for objects. Nothing that was written is touched.

    Raises
    ------
    BadInputError
        Too many frames can't be read any more.
    InterruptedRun
        From the run's progress.
    """
    surface, detail_key = run.surface(), stored_key(run)
    stored, meta = run.store.load(STAGE, detail_key), run.store.load_meta(STAGE, detail_key) or {}
    wanted = scales(run) if stored is None else dict(meta["wanted"])
    mesh, uv, size = surface.mesh, surface.atlas.uv, surface.atlas.size
    pages = lay_out(run.settings.atlas, mesh.triangles, uv, mesh.object_id, size, wanted, run.settings.atlas_size)
    finer = {number: scale for number, scale in pages.scale.items() if scale > 1}
    if not finer:
        if stored is None:
            run.store.save(STAGE, detail_key, {}, {"wanted": [], "finer": []})
        return Parting(pages)
    # Their islands alone, on a sheet of their own: the time that this takes is theirs, not the room's.
    chosen = np.flatnonzero(np.isin(mesh.object_id, list(finer)))
    finer_mesh = Mesh(mesh.vertices, mesh.triangles[chosen], mesh.object_id[chosen])
    sheet = lay_out(OBJECT, finer_mesh.triangles, uv[chosen], finer_mesh.object_id, size, finer, sys.maxsize)
    atlas = make_atlas(finer_mesh, sheet.sheet_uv, sheet.size)
    if stored is None or dict(meta["finer"]) != finer:
        lit_diffuse = _finer_lit_diffuse(run, finer_mesh, atlas, chosen)
        measured = (lit_diffuse.tier == CLEAN) & (lit_diffuse.count >= VISIBILITY.enough)
        stored = {"radiance": np.where(measured[:, None], lit_diffuse.radiance, np.nan).astype(np.float32)}
        run.store.save(STAGE, detail_key, stored, {"wanted": [*wanted.items()], "finer": [*finer.items()]})
    return Parting(pages, Closer(sheet, atlas, stored["radiance"]))


def stored_key(run: Corrected) -> str:
    """The key of what `look_closer` stores, of a run whose passes over the frames are done."""
    return key(STAGE, run.store.stored_key("lit_diffuse"))


def _finer_lit_diffuse(run: Corrected, part: Mesh, atlas: Atlas, chosen: np.ndarray) -> LitDiffuse:
    """L_d of the elements of an atlas over a `part` of the room's mesh: its triangles `chosen`."""
    s, surface = run.settings, run.surface()
    local_index = np.full(len(surface.mesh.triangles), -1)
    local_index[chosen] = np.arange(len(chosen))
    find = ElementLookup(part, atlas)

    def lookup(triangle: np.ndarray, u: np.ndarray, v: np.ndarray) -> np.ndarray:
        local = local_index[triangle]
        element = np.full(len(local), -1, np.int32)
        present = local >= 0
        element[present] = find(local[present], u[present], v[present])
        return element

    rounds = Rounds(run.progress, 0, LOOKED)
    passes = Passes(replace(surface, atlas=atlas), run.read, s, run.store.folder)
    lit_diffuse = passes.lit_diffuse(run.frames, rounds)
    rounds.next()
    return (
        passes.sharpened(lit_diffuse, run.frames, rounds, lookup=lookup)
        if s.sharpen and lit_diffuse.seen.any()
        else lit_diffuse
    )


def write_parts(run: Corrected, parting: Parting, base_color: np.ndarray) -> Parts:
    """Write the images into the result folder; those of an earlier run that are not written again are removed.

    Parameters
    ----------
    parting : Parting
        What `look_closer` gave.
    base_color : (s, s, 3) float32
        Over the room's atlas, row 0 at the bottom.
    """
    pages = parting.pages
    sheet = pages.image(base_color, _owner(run))
    if parting.closer is not None:
        pages.multiply(sheet, parting.closer.sheet, finer_detail(run, parting.closer))
    materials = {m.object_id: m for m in run.materials()}
    diffuse = {number: m for number, m in materials.items() if m.model.has_diffuse}
    if run.settings.atlas == OBJECT:
        images = {
            page.number: f"{FOLDER}/{file_name(diffuse[page.number].name)} base_color.exr"
            for page in pages.pages
            if page.number in diffuse
        }
        files = {images[page.number]: page for page in pages.pages if page.number in images}
        tiles: tuple[int, ...] = ()
    else:
        images = dict.fromkeys(diffuse, TILE)
        files = {TILE.replace("<UDIM>", str(page.number)): page for page in pages.pages}
        tiles = tuple(page.number for page in pages.pages)
    remove_parts(run, set(files))

    def write(name: str) -> None:
        run.store.write_exr(name, pages.of(sheet, files[name])[::-1], half=True)

    for done, _ in enumerate(ordered_map(write, files, run.settings.threads)):
        run.progress.update(0.5 + 0.1 * (done + 1) / len(files))
    return Parts(pages.uv, images, tiles)


def finer_detail(run: Corrected, closer: Closer) -> np.ndarray:
    """What base colour is multiplied by on the finer objects' sheet, (size, size, 3) float32."""
    surface, lit_diffuse, atlas = run.surface(), run.lit_diffuse(), closer.atlas
    good = (lit_diffuse.tier == CLEAN) & (lit_diffuse.count >= VISIBILITY.enough) & (run.albedo.origin == MEASURED)
    radiance_and_weight = np.concatenate([np.where(good[:, None], lit_diffuse.radiance, 0), good[:, None]], 1).astype(
        np.float32
    )
    room = closer.sheet.image(surface.atlas.image(radiance_and_weight), _owner(run)).reshape(-1, 4)[atlas.texel]
    floor = np.float32(max(LEVELS.dark * run.median_radiance, 1e-30))
    level = room[:, :3] / np.maximum(room[:, 3:], 1e-6)
    ratio = np.clip((closer.radiance + floor) / (level + floor), 1 / SHARPENING.most, SHARPENING.most)
    # No detail where less than half of what lies around a spot on the room's atlas was measured.
    ratio[(room[:, 3] < 0.5) | ~np.isfinite(ratio).all(1)] = 1
    return atlas.image(ratio, 1.0)


def _owner(run: Corrected) -> np.ndarray:
    """The object that each texel of the room's images shows, (s, s) int32."""
    atlas = run.surface().atlas
    return atlas.image(atlas.object_id, -1)


def remove_parts(run: Corrected, keep: Collection[str] = ()) -> None:
    """Take away the parts that an earlier run left, but for the files `keep`."""
    folder = run.store.folder
    for path in [*folder.glob(f"{FOLDER}/* base_color.exr"), *folder.glob(TILE.replace("<UDIM>", "[0-9]" * 4))]:
        if path.relative_to(folder).as_posix() not in keep:
            path.unlink()


def file_name(name: str) -> str:
    """An object's name as a file may have it anywhere."""
    return re.sub(r"[^\w\- ]", "_", name)
