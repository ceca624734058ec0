"""The surface stage: surface elements over the mesh, whose noise is taken out first."""

import sys
from dataclasses import replace
from functools import partial
from importlib.metadata import version
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np

from ..kinds import Unit
from ..lit_diffuse.from_picture import texel_edge
from ..lit_diffuse.from_texture import face_edge
from ..origin import OWN, package_of
from ..passes.mesh_denoising.denoise import without_noise
from ..scene.closed_mesh import as_scanned, with_aligned_closing
from ..scene.elements import Elements
from ..scene.model import Capture, Mesh
from ..scene.stored_light import LitTexture
from ..scene.surface import Surface, build_surface, from_uv
from ..scene.two_sides import with_backs
from ..scene.unwrap import Unwrap, by_xatlas
from ..settings import Settings
from .source import CORE, digest
from .stage import Stage

STAGE = Stage("surface", Path(__file__), (), ("texel_size", "detail", "atlas_size", "denoise_mesh"))
COARSE: Unit[float] = 1e-6
"""Step of float32, as a share of the room's diagonal, from which on the room is moved."""


def centred(capture: Capture) -> Capture:
    """A capture as the stages take it: around the origin, if float32 is coarse where it lies; else as it is.

    In a national grid's coordinates a room lies thousands of kilometres off, where float32 can't distinguish two of its
    walls. Poses and vertices are double as they are read, so nothing is lost where they are moved before rays, elements
    and trees round them.
    """
    used = capture.mesh.vertices[capture.mesh.triangles.ravel()]
    low, high = used.min(0), used.max(0)
    step = float(np.spacing(np.float32(np.abs([low, high]).max())))
    if step <= COARSE * float(np.linalg.norm(high - low)):
        return capture
    centre = (low + high) / 2
    frames = []
    for frame in capture.frames:
        pose = frame.camera.camera_to_world.copy()
        pose[:3, 3] -= centre
        frames.append(replace(frame, camera=replace(frame.camera, camera_to_world=pose)))
    mesh = replace(capture.mesh, vertices=capture.mesh.vertices - centre)
    mirrors = tuple(replace(mirror, point=mirror.point - centre) for mirror in capture.mirrors)
    return replace(capture, mesh=mesh, frames=tuple(frames), mirrors=mirrors)


def laid_out_by(unwrap: Unwrap) -> str:
    """What lays the atlas out, in which version: its name, its source if it is the program's own, else its package."""
    while isinstance(unwrap, partial):
        unwrap = unwrap.func
    module = sys.modules[unwrap.__module__]
    name = f"{module.__name__.removeprefix(OWN)}.{getattr(unwrap, '__qualname__', type(unwrap).__qualname__)}"
    origin = package_of(unwrap)
    if not origin and module.__file__ is not None:
        origin = digest(Path(module.__file__), CORE.parent)[:16]
    library = version("xatlas") if unwrap is by_xatlas and find_spec("xatlas") else ""
    return " ".join(filter(None, (name, origin, library)))


def denoised(mesh: Mesh, settings: Settings) -> tuple[Mesh, float]:
    """A mesh `without_noise`; what closes its holes has none."""
    if mesh.closed is None:
        return without_noise(mesh, settings.without)
    scanned, noise = without_noise(as_scanned(mesh), settings.without)
    vertices = np.concatenate([scanned.vertices, mesh.vertices[len(scanned.vertices) :]])
    return with_aligned_closing(replace(mesh, vertices=vertices)), noise


def make_surface(capture: Capture, unwrap: Unwrap, settings: Settings) -> Surface:
    """Lay surface elements out over the mesh of a capture `centred`. Raises `BadInputError`: no camera looks at it."""
    noisy = settings.denoise_mesh and "mesh-denoising" not in settings.without
    mesh, noise = denoised(capture.mesh, settings) if noisy else (capture.mesh, 0.0)
    texel = settings.texel_size
    if mesh.lit is not None:
        edge = texel_edge(mesh, mesh.lit) if isinstance(mesh.lit, LitTexture) else face_edge(mesh)
        texel = texel or edge / settings.detail
    cameras, two_sides = [frame.camera for frame in capture.frames], "two-sides" not in settings.without
    surface = build_surface(
        mesh, cameras, unwrap, texel, settings.detail, settings.atlas_size, two_sides,
        "coarse-unseen" not in settings.without, settings.threads,
    )  # fmt: skip
    return replace(surface, noise=noise)


def to_store(surface: Surface, captured: Mesh, laid_out: str = "") -> tuple[dict[str, np.ndarray], dict[str, Any]]:
    """What is stored of a surface: arrays, and what JSON holds. Of the captured mesh it holds what is different."""
    arrays = {"uv": surface.uv, "sign": surface.sign, "backs": surface.backs}
    if surface.noise:
        arrays["vertices"] = surface.mesh.vertices[: len(captured.vertices)]
    arrays |= {name: getattr(surface.atlas, name) for name in Elements._fields}
    meta = {"size": surface.atlas.size, "noise": surface.noise, "texel_size": surface.texel_size, "unwrap": laid_out}
    return arrays, meta


def from_store(arrays: dict[str, np.ndarray], meta: dict[str, Any], captured: Mesh) -> Surface:
    """The inverse of `to_store`."""
    mesh = replace(captured, vertices=arrays.get("vertices", captured.vertices), uv=None)
    mesh = with_backs(mesh, arrays["backs"])
    elements = Elements(**{name: arrays[name] for name in Elements._fields})
    size, texel, noise = int(meta["size"]), float(meta["texel_size"]), float(meta["noise"])
    return from_uv(mesh, arrays["sign"], arrays["uv"], size, texel, elements, noise)
