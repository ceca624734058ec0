"""What some of a frame's pixels meet: enough to know which surface the frames look at, and how closely."""

import numpy as np

from .model import Camera
from .params import SIDES
from .rays import Hits, RayScene


def sparse_hits(scene: RayScene, camera: Camera, step: int = SIDES.pixel_step) -> tuple[np.ndarray, np.ndarray, Hits]:
    """What every `step`-th pixel in x and y of a camera meets.

    Returns
    -------
    pixels : (n, 2) float64
        Those whose rays meet the mesh.
    directions : (n, 3) float32
    hits : Hits
    """
    pixels = camera.pixel_centres(step)
    directions, has_ray = camera.rays(pixels)
    if not has_ray.all():
        pixels, directions = pixels[has_ray], directions[has_ray]
    hits = scene.intersect(camera.centre, directions)
    met = np.flatnonzero(hits.triangle >= 0)
    return pixels[met], directions[met], hits.part(met)


def step_for(camera: Camera, rays: int) -> int:
    """The step of `sparse_hits` by which about so many rays go into a camera's frame."""
    return max(1, round(np.sqrt(camera.width * camera.height / rays)))


def pixel_edges(camera: Camera, pixels: np.ndarray, hits: Hits) -> np.ndarray:
    """Edge in metres of what each pixel ((n, 2) float), with the hit of its ray, covers where it is met head-on.

    (n,) float32; NaN: unknown.
    """
    if camera.lens is None:
        return hits.distance / np.float32(np.sqrt(camera.fx * camera.fy))
    return hits.distance * camera.pixel_angles(pixels)
