"""Irradiance and albedo, and which objects are lamps."""

from dataclasses import replace

import numpy as np

from ...light.environment import Environment
from ...light.lamps import find_seen
from ...light.shading import Shading
from ...paper.albedo import albedo as quotient
from ...paper.captured_light import CapturedLight
from ...paper.irradiance import irradiance
from ...passes.albedo.albedo import MEASURED, Albedo, fill
from ...passes.albedo.neighbourhood import relative_error
from ...progress import Progress
from ...scene.atlas import Atlas
from ...scene.lit_diffuse import LitDiffuse
from ...scene.model import Instance, Mesh, class_names
from ...scene.rays import RayScene
from ...scene.visibility import SATURATED


def shade(
    mesh: Mesh,
    atlas: Atlas,
    scene: RayScene,
    lit_diffuse: LitDiffuse,
    environment: Environment,
    *,
    rays: int,
    threads: int,
    seed: int,
    progress: Progress | None = None,
) -> Shading:
    """S of every element by uniform rays, and the objects that must be lamps under it."""
    light = CapturedLight(mesh, atlas, scene, lit_diffuse.radiance, environment)
    E, escaped = irradiance(light, atlas.position, atlas.normal, rays, threads=threads, seed=seed, progress=progress)
    lamps = find_seen(atlas.object_id[lit_diffuse.seen], lit_diffuse.radiance[lit_diffuse.seen], E[lit_diffuse.seen])
    unknown = np.zeros(len(atlas), np.float32)
    return Shading(E, escaped, unknown, light.radiance, tuple(lamps), environment, (), (), len(atlas))


def albedo_of(
    atlas: Atlas, lit_diffuse: LitDiffuse, irradiance: np.ndarray, instances: tuple[Instance, ...], emitters: set[int]
) -> Albedo:
    """The quotient as it is, clamped at 1; elements without one take their object's albedo.

    Parameters as of `albedo.albedo_of`. The error is that of the median.
    """
    rho = quotient(np.maximum(lit_diffuse.radiance, 0), irradiance)
    valid = np.isfinite(rho).all(1) & (lit_diffuse.tier != SATURATED)
    albedo = fill(atlas, rho, valid, class_names(instances), emitters)
    return replace(
        albedo, error=np.where(albedo.origin == MEASURED, relative_error(lit_diffuse, atlas.object_id), albedo.error)
    )
