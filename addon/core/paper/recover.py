"""The published method from end to end (Haefner et al. 2021): L_d, S, albedo, and each object's phi and psi.

The five steps one after the other; the pipeline calls the same functions one by one and keeps what each gives.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from ..scene.model import Frame, Pixels
from ..scene.samples import SampleCollector, Samples
from ..scene.surface import Surface
from .albedo import albedo
from .captured_light import CapturedLight, Light
from .fit import PHI, Lobe, fit_lobe
from .irradiance import irradiance
from .lit_diffuse import lit_diffuse
from .reflection import reflected_parts
from .target_frame import frame_scores, target_frame


@dataclass(frozen=True)
class TargetFit:
    """What is found of one object.

    Attributes
    ----------
    frame : int
        The target frame's index.
    index : (m,) int
        Its observations, into the samples.
    """

    frame: int
    index: np.ndarray
    lobe: Lobe


@dataclass(frozen=True)
class Published:
    """What the method gives, for n elements.

    Attributes
    ----------
    lit_diffuse : (n, 3) float32
        L_d; NaN where no frame saw the element.
    irradiance : (n, 3) float32
        S.
    albedo : (n, 3) float32
        NaN where it is not known.
    fits : dict of int to TargetFit
        By object_id; without objects that no frame shows.
    """

    lit_diffuse: np.ndarray
    irradiance: np.ndarray
    albedo: np.ndarray
    fits: dict[int, TargetFit]


def recover(
    surface: Surface,
    frames: Sequence[Frame],
    read: Callable[[Frame], Pixels],
    rays: int = 10_000,
    *,
    outside: Callable[[np.ndarray], np.ndarray] | None = None,
    threads: int = 0,
    seed: int = 0,
) -> Published:
    """Run the method over a capture's frames, in video order.

    Parameters
    ----------
    read : callable
        Gives a frame's pixels.
    rays : int
        N of every integral.
    outside : callable, optional
        Radiance from directions ((k, 3) float32) in which rays leave the mesh.
    """
    atlas = surface.atlas
    collector = SampleCollector(atlas, len(frames), seed)
    L_d = lit_diffuse(
        surface.mesh, atlas, surface.scene, frames, read, threads=threads,
        also=lambda index, view, pixels, observations: collector.add(index, observations),
    ).median  # fmt: skip
    light = CapturedLight(surface.mesh, atlas, surface.scene, L_d, outside)
    S, _ = irradiance(light, atlas.position, atlas.normal, rays, threads=threads, seed=seed)
    samples, fits = collector.result(), {}
    for object_id in np.unique(atlas.object_id):
        index = usable(samples, atlas.object_id, object_id)
        target_fit = fit_object(light, atlas, L_d, samples, index, len(frames), rays, threads=threads, seed=seed)
        if target_fit is not None:
            fits[int(object_id)] = target_fit
    return Published(L_d, S, albedo(L_d, S), fits)


def usable(samples: Samples, owner: np.ndarray, object_id: int) -> np.ndarray:
    """Indices of an object's observations that are not saturated (A2); `owner`: (n,) int, each element's object."""
    return np.flatnonzero(~samples.saturated & (owner[samples.element] == object_id))


def fit_object(
    light: Light, atlas, L_d: np.ndarray, samples: Samples, index: np.ndarray, frames: int, rays: int,
    *, threads: int = 0, seed: int = 0,
) -> TargetFit | None:  # fmt: skip
    """phi and psi of one object from its target frame; None where no frame can be one.

    Parameters
    ----------
    L_d : (n, 3) float32
    index : (k,) int
        The object's `usable` observations.
    frames : int
        Number of frames.
    rays : int
        N of each observation.
    """
    element, direction = samples.element[index], samples.direction[index]
    position, normal = atlas.position[element], atlas.normal[element]
    target = target_frame(frame_scores(light, position, normal, direction, samples.frame[index], frames))
    if target < 0:
        return None
    in_target = samples.frame[index] == target
    geometry = position[in_target], normal[in_target], direction[in_target]
    A, B = reflected_parts(light, *geometry, PHI, rays, threads=threads, seed=seed)
    lobe = fit_lobe(A, B, samples.radiance[index[in_target]] - L_d[element[in_target]])
    return TargetFit(target, index[in_target], lobe)
