"""Which surface elements a frame sees, and how well: projection, occlusion, edges."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..capture.model import Camera, Mesh, Pixels
from ..surface.atlas import Atlas
from ..surface.rays import RayScene

MIN_COSINE = 0.2
"""Views more grazing than this are dropped: their pixel covers too much surface."""
DEPTH_TOLERANCE = 0.02
"""A neighbouring pixel whose hit lies further than this share of the distance off the pixel's own plane lies beyond
a depth edge."""

CLEAN, EDGE, SATURATED = 0, 1, 2
"""Tiers of an observation. CLEAN: the pixel and its eight neighbours show one surface. EDGE: the pixel's centre shows
the element's object, but a neighbour shows something else, which a filter or a slightly wrong pose mixes in.
SATURATED: the sensor clipped; a lower bound."""


@dataclass(frozen=True)
class FrameView:
    """What a camera sees of the mesh, pixel by pixel.

    Attributes
    ----------
    camera : Camera
    triangle : (height, width) int32
        First triangle along the pixel's ray; -1 where the ray leaves the mesh.
    distance : (height, width) float32
        Along the ray, metres.
    object_id : (height, width) int32
        -1 where the ray leaves the mesh.
    clean : (height, width) bool
        All nine pixels of the neighbourhood show one continuous surface (or all escape).
    """

    camera: Camera
    triangle: np.ndarray
    distance: np.ndarray
    object_id: np.ndarray
    clean: np.ndarray


@dataclass(frozen=True)
class Observations:
    """Radiance that one frame saw of m elements.

    Attributes
    ----------
    element : (m,) int32
        Sorted.
    radiance : (m, 3) float32
        Linear Rec.709.
    tier : (m,) int8
        CLEAN, EDGE or SATURATED.
    direction : (m, 3) float32
        Unit, from the element to the camera.
    """

    element: np.ndarray
    radiance: np.ndarray
    tier: np.ndarray
    direction: np.ndarray


def _neighbours(image: np.ndarray):
    """The image's eight one-pixel shifts, borders repeated, with their offset (dy, dx)."""
    padded = np.pad(image, ((1, 1), (1, 1)) + ((0, 0),) * (image.ndim - 2), mode="edge")
    height, width = image.shape[:2]
    for dy in (-1, 0, 1):
        for dx in (-1, 0, 1):
            if dy or dx:
                yield padded[1 + dy : 1 + dy + height, 1 + dx : 1 + dx + width]


def view_frame(camera: Camera, mesh: Mesh, scene: RayScene, triangle_normal: np.ndarray) -> FrameView:
    """Trace the camera's pixels and find the depth edges.

    Parameters
    ----------
    triangle_normal : (t, 3) float32
    """
    height, width = camera.height, camera.width
    directions = camera.directions(camera.pixel_centres())
    origins = np.broadcast_to(camera.centre.astype(np.float32), directions.shape)
    hits = scene.intersect(origins, directions)
    hit = hits.triangle >= 0
    object_id = np.where(hit, mesh.object_id[hits.triangle], -1).reshape(height, width).astype(np.int32)
    # The plane through the hit, seen from the centre: distance along d is offset / (n.d).
    normal = np.where(hit[:, None], triangle_normal[hits.triangle], -directions)
    distance = np.where(hit, hits.distance, np.float32(0))
    offset = (distance * (normal * directions).sum(1)).reshape(height, width)
    distance, normal = distance.reshape(height, width), normal.reshape(height, width, 3)
    clean = np.ones((height, width), bool)
    rays = directions.reshape(height, width, 3)
    for other_id, other_distance, other_ray in zip(
        _neighbours(object_id), _neighbours(distance), _neighbours(rays), strict=True
    ):
        along = (normal * other_ray).sum(-1)
        # cross-multiplied, so that grazing planes divide by nothing
        off_plane = np.abs(other_distance * along - offset)
        clean &= (other_id == object_id) & (off_plane <= DEPTH_TOLERANCE * np.maximum(distance, 1e-6))
    return FrameView(camera, hits.triangle.reshape(height, width), distance, object_id, clean)


def _bilinear(image: np.ndarray, pixels: np.ndarray) -> np.ndarray:
    """Sample (h, w, 3) at (m, 2) pixel positions whose four neighbours all lie inside."""
    x, y = pixels[:, 0] - 0.5, pixels[:, 1] - 0.5
    height, width = image.shape[:2]
    x0 = np.clip(np.floor(x).astype(np.int32), 0, width - 2)
    y0 = np.clip(np.floor(y).astype(np.int32), 0, height - 2)
    a = np.clip(x - x0, 0, 1)[:, None].astype(np.float32)
    b = np.clip(y - y0, 0, 1)[:, None].astype(np.float32)
    flat = image.reshape(-1, image.shape[2])
    at = y0 * width + x0
    top = flat.take(at, 0) * (1 - a) + flat.take(at + 1, 0) * a
    bottom = flat.take(at + width, 0) * (1 - a) + flat.take(at + width + 1, 0) * a
    return top * (1 - b) + bottom * b


def observe(
    view: FrameView, pixels: Pixels, atlas: Atlas, scene: RayScene, elements: np.ndarray | None = None
) -> Observations:
    """What a frame says of the surface elements.

    Rejected: behind the camera, outside the frame, n.v < `MIN_COSINE`, occluded (embree), pixel of another object,
    invalid pixels.

    Parameters
    ----------
    elements : (k,) int array, sorted, optional
        Ask only for these; all where not given.
    """
    camera = view.camera
    centre = camera.centre.astype(np.float32)
    index = np.arange(len(atlas), dtype=np.int32) if elements is None else elements.astype(np.int32)
    position = atlas.position if elements is None else atlas.position.take(index, 0)
    normal = atlas.normal if elements is None else atlas.normal.take(index, 0)

    # Cheapest tests first: the side that faces the camera, then the frustum, then what the pixel shows.
    at = np.flatnonzero(np.einsum("ij,ij->i", centre - position, normal) > 0)
    xy, depth = camera.project(position.take(at, 0))
    margin = 0.5
    inside = np.flatnonzero(
        (depth > 0)
        & (xy[:, 0] >= margin) & (xy[:, 0] < camera.width - margin)
        & (xy[:, 1] >= margin) & (xy[:, 1] < camera.height - margin)
    )  # fmt: skip
    at, xy = at[inside], xy.take(inside, 0)
    pixel = xy[:, 1].astype(np.int32) * camera.width + xy[:, 0].astype(np.int32)
    shows = (view.object_id.ravel()[pixel] == atlas.object_id[index[at]]) & pixels.valid.ravel()[pixel]
    keep = np.flatnonzero(shows)
    at, xy, pixel = at[keep], xy.take(keep, 0), pixel[keep]
    position, normal = position.take(at, 0), normal.take(at, 0)
    to_camera = centre - position
    distance = np.linalg.norm(to_camera, axis=1)
    direction = to_camera / np.maximum(distance, 1e-12)[:, None]
    keep = np.flatnonzero(np.einsum("ij,ij->i", direction, normal) >= MIN_COSINE)
    origins = scene.off_surface(position.take(keep, 0), normal.take(keep, 0))
    direction = direction.take(keep, 0)
    free = np.flatnonzero(~scene.occluded(origins, direction, distance[keep] - 2 * scene.offset))
    keep, direction = keep[free], direction.take(free, 0)
    index, xy, pixel = index[at[keep]], xy.take(keep, 0), pixel[keep]

    # A bilinear sample needs four good pixels, which only a clean neighbourhood grants; else the one pixel counts.
    usable = pixels.valid & ~pixels.saturated
    around = usable.copy()
    for other in _neighbours(usable):
        around &= other
    clean = (view.clean & around).ravel()[pixel]
    radiance = pixels.radiance.reshape(-1, 3).take(pixel, 0)
    smooth = np.flatnonzero(clean)
    radiance[smooth] = _bilinear(pixels.radiance, xy.take(smooth, 0))
    tier = np.where(clean, CLEAN, np.where(pixels.saturated.ravel()[pixel], SATURATED, EDGE)).astype(np.int8)
    return Observations(index, radiance, tier, direction)
