"""Which surface elements a frame sees, and how well: projection, occlusion, edges."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np

from ..kinds import Block, Code, Limit, Unit
from ..parallel import blocks
from .atlas import Atlas
from .model import Camera, Mesh, Pixels
from .params import VISIBILITY
from .pixel_rays import rays_of_rows
from .rays import RayScene
from .tangent_frame import dot

EDGE_MARGIN: Unit[float] = 0.5
"""Pixels around the frame's border that are not looked up: half of each lies beyond the outermost centres."""

CLEAN: Code[int] = 0
EDGE: Code[int] = 1
SATURATED: Code[int] = 2
"""Tiers of an observation. CLEAN: the pixel and its eight neighbours show one surface. EDGE: the pixel's centre shows
the element's object, but a neighbour shows something else, which a filter or a slightly wrong pose mixes in.
SATURATED: the sensor clipped; a lower bound."""
NOTHING: Code[int] = -2
"""No object's id, and not that of a ray that escapes."""
PIXELS_AT_ONCE: Block[int] = 1 << 18
"""Of a frame that is traced."""
PIXEL_BYTES: Block[int] = 100
"""Of a frame while it is looked at, for each pixel: what is read of it (14 and as much while it is decoded), what the
camera sees (33), its rays where they are kept (24)."""
FAR: Limit[float] = 1e9
"""Pixels; what a lens throws further out than this overflows nothing."""


@dataclass(frozen=True)
class FrameView:
    """What a camera sees of the mesh, pixel by pixel.

    Attributes
    ----------
    rays : (3, height, width) float32
        Unit directions through the pixels' centres, world; nonsense where no ray leads to the pixel.
    triangle : (height, width) int32
        First triangle along the pixel's ray; -1 where the ray leaves the mesh, or no ray leads to the pixel.
    u, v : (height, width) float32
        Where on it: barycentric coordinates of the second and third corner.
    distance : (height, width) float32
        Along the ray, metres.
    object_id : (height, width) int32
        -1 where `triangle` is.
    clean : (height, width) bool
        All nine pixels of the neighbourhood show one continuous surface (or all escape). No pixel is clean that has
        none of a lens's rays, or such a neighbour.
    whole : bool
        As the mesh's: its objects' borders are none of surfaces.
    """

    camera: Camera
    rays: np.ndarray
    triangle: np.ndarray
    u: np.ndarray
    v: np.ndarray
    distance: np.ndarray
    object_id: np.ndarray
    clean: np.ndarray
    whole: bool = False


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


def bytes_of_frame(cameras: Iterable[Camera]) -> int:
    """What the largest frame takes in memory while it is looked at."""
    return PIXEL_BYTES * max((camera.width * camera.height for camera in cameras), default=0)


def _shifts(height: int, width: int) -> Iterator[tuple[tuple[slice, slice], tuple[slice, slice]]]:
    """For each of the eight neighbours, the pixels that have one there, and where it lies."""
    for dy in (-1, 0, 1):
        for dx in (-1, 0, 1):
            if dy or dx:
                pixel, neighbour = zip(*((slice(max(-d, 0), n - max(d, 0)), slice(max(d, 0), n - max(-d, 0)))
                                   for d, n in ((dy, height), (dx, width))))  # fmt: skip
                yield pixel, neighbour


def view_frame(camera: Camera, mesh: Mesh, scene: RayScene) -> FrameView:
    """Trace the camera's pixels and find the depth edges."""
    height, width = camera.height, camera.width
    has_ray = np.ones((height, width), bool)  # pixels that a ray of the lens leads to
    rays = np.empty((3, height, width), np.float32)
    triangle, object_id = np.empty((height, width), np.int32), np.empty((height, width), np.int32)
    u, v, distance = np.empty((3, height, width), np.float32)
    # By rows: all that is needed for a moment would be three times what is kept of a large frame.
    step = max(PIXELS_AT_ONCE // width, 1)
    for rows in blocks(height, step):
        local, valid = rays_of_rows(camera, rows)
        world = np.stack([dot(local, row) for row in camera.camera_to_world[:3, :3].tolist()]).astype(np.float32)
        directions = np.ascontiguousarray(world.T)
        hits = scene.intersect(camera.centre, directions)
        rays[:, rows] = world.reshape(3, -1, width)
        hit_triangle = hits.triangle.reshape(-1, width)
        if valid is not None:
            has_ray[rows], hit_triangle = valid, np.where(valid, hit_triangle, -1)
        triangle[rows], object_id[rows] = hit_triangle, np.where(hit_triangle >= 0, mesh.object_id[hit_triangle], -1)
        u[rows], v[rows] = hits.u.reshape(-1, width), hits.v.reshape(-1, width)
        distance[rows] = np.where(hit_triangle >= 0, hits.distance.reshape(-1, width), np.float32(0))
    object_id[~has_ray] = NOTHING
    surface_id = np.minimum(object_id, 0) if mesh.whole else object_id
    clean = np.ones((height, width), bool)
    for rows in blocks(height, step):
        # With the rows beside them, whose pixels are neighbours.
        with_neighbours = slice(max(rows.start - 1, 0), min(rows.stop + 1, height))
        clean_rows = _clean(
            triangle[with_neighbours],
            surface_id[with_neighbours],
            distance[with_neighbours],
            rays[:, with_neighbours],
            mesh.geometry[0],
        )
        clean[rows] = clean_rows[rows.start - with_neighbours.start :][: rows.stop - rows.start]
    clean &= has_ray
    object_id[~has_ray] = -1
    return FrameView(camera, rays, triangle, u, v, distance, object_id, clean, mesh.whole)


def _clean(
    triangle: np.ndarray, object_id: np.ndarray, distance: np.ndarray, rays: np.ndarray, triangle_normal: np.ndarray
) -> np.ndarray:
    """Whether each pixel and the eight around it lie on one surface of one object, (h, w) bool."""
    height, width = triangle.shape
    # The plane through the hit, seen from the centre: distance along d is offset / (n.d).
    normal = triangle_normal.take(triangle.ravel(), 0).T.reshape(3, height, width)
    normal = np.where(triangle >= 0, normal, -rays)
    offset = distance * dot(normal, rays)
    tolerance = VISIBILITY.depth_tolerance * np.maximum(distance, 1e-6)
    clean = np.ones((height, width), bool)
    for pixel, neighbour in _shifts(height, width):
        along = dot(normal[:, pixel[0], pixel[1]], rays[:, neighbour[0], neighbour[1]])
        # cross-multiplied, so that grazing planes divide by nothing
        along *= distance[neighbour]
        along -= offset[pixel]
        clean[pixel] &= (np.abs(along, out=along) <= tolerance[pixel]) & (object_id[neighbour] == object_id[pixel])
    return clean


def _projected(camera: Camera, offset: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Pixel positions x, y ((n,) float32) of points `offset` ((3, n) float32) from the centre, and whether
    they are seen."""
    right, up, back = camera.camera_to_world[:3, :3].T.tolist()
    if camera.lens is not None:
        image, visible = camera.lens.project(np.stack([dot(offset, right), -dot(offset, up), -dot(offset, back)], -1))
        pixels = np.clip(image * (camera.fx, camera.fy) + (camera.cx, camera.cy), -FAR, FAR).astype(np.float32)
        return np.ascontiguousarray(pixels[:, 0]), np.ascontiguousarray(pixels[:, 1]), visible
    depth = -dot(offset, back)
    inverse = 1 / np.maximum(depth, np.float32(1e-12))
    x = float(camera.fx) * (dot(offset, right) * inverse) + float(camera.cx)
    y = float(camera.cy) - float(camera.fy) * (dot(offset, up) * inverse)
    return x, y, depth > 0


def _bilinear(image: np.ndarray, x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Sample (h, w, 3) at m pixel positions, (m,) each; at a pixel's centre that is the pixel alone: (m, 3) float32."""
    height, width = image.shape[:2]
    x, y = x - np.float32(0.5), y - np.float32(0.5)
    x0 = np.clip(x.astype(np.int32), 0, width - 2)  # towards zero: what lies outside is clipped all the same
    y0 = np.clip(y.astype(np.int32), 0, height - 2)
    a, b = np.clip(x - x0, 0, 1).astype(np.float32), np.clip(y - y0, 0, 1).astype(np.float32)
    index = y0 * width + x0
    right, below, diagonal = index + 1, index + width, index + (width + 1)
    not_a, not_b = 1 - a, 1 - b
    result = np.empty((len(x), 3), np.float32)
    for channel, plane in enumerate(np.ascontiguousarray(image.reshape(-1, 3).T)):
        top = plane.take(index) * not_a
        top += plane.take(right) * a
        bottom = plane.take(below) * not_a
        bottom += plane.take(diagonal) * a
        top *= not_b
        bottom *= b
        np.add(top, bottom, out=result[:, channel])
    return result


def _tiers(view: FrameView, pixels: Pixels) -> np.ndarray:
    """The tier of what each pixel shows, (height * width,) int8."""
    # A bilinear sample needs four good pixels, which only a clean neighbourhood grants; else the one pixel counts.
    usable = pixels.valid & ~pixels.saturated
    all_usable = usable.copy()
    for pixel, neighbour in _shifts(*usable.shape):
        all_usable[pixel] &= usable[neighbour]
    tier = np.where(view.clean & all_usable, CLEAN, np.where(pixels.saturated, SATURATED, EDGE))
    return tier.astype(np.int8).ravel()


def observe(
    view: FrameView,
    pixels: Pixels,
    atlas: Atlas,
    scene: RayScene,
    elements: np.ndarray | None = None,
    free: bool = False,
) -> Observations:
    """What a frame says of the surface elements.

    Rejected: out of the lens's reach, outside the frame, n.v < `min_cosine`, occluded (embree), pixel of another
    object, invalid pixels.

    Parameters
    ----------
    elements : (k,) int array, sorted, optional
        Ask only for these; all where not given.
    free : bool
        Nothing is known to hide them from the camera.
    """
    camera = view.camera
    centre = camera.centre.astype(np.float32)
    index = np.arange(len(atlas), dtype=np.int32) if elements is None else elements.astype(np.int32, copy=False)

    # Cheapest tests first: the frustum, then what the pixel shows, then the angle; rays last.
    offset = np.empty((3, len(index)), np.float32)
    np.subtract(atlas.position.take(index, 0).T, centre[:, None], out=offset)
    x, y, inside = _projected(camera, offset)
    for position, extent in ((x, camera.width), (y, camera.height)):
        inside &= (position >= EDGE_MARGIN) & (position < extent - EDGE_MARGIN)
    candidates = np.flatnonzero(inside)
    x, y = x.take(candidates), y.take(candidates)
    pixel = y.astype(np.int32) * camera.width + x.astype(np.int32)
    visible_id = np.where(pixels.valid, view.object_id, NOTHING).ravel()
    same_object = visible_id.take(pixel) == atlas.object_id.take(index.take(candidates))
    if view.whole:
        same_object |= view.clean.ravel().take(pixel) & (visible_id.take(pixel) >= 0)
    keep = np.flatnonzero(same_object)
    candidates = candidates.take(keep)
    offset = np.stack([plane.take(candidates) for plane in offset])
    distance = np.sqrt(dot(offset, offset))
    direction = offset / -np.maximum(distance, np.float32(1e-12))
    normal = atlas.normal.take(index.take(candidates), 0)
    angle = np.flatnonzero(dot(direction, normal.T) >= VISIBILITY.min_cosine)
    candidates, keep, normal = candidates.take(angle), keep.take(angle), normal.take(angle, 0)
    index = index.take(candidates)
    to_camera = np.empty((len(candidates), 3), np.float32)
    for i in range(3):
        to_camera[:, i] = direction[i].take(angle)
    if not free:
        origins = scene.off_surface(atlas.position.take(index, 0), normal)
        reach = distance.take(angle) - np.float32(2 * scene.offset)
        unoccluded = np.flatnonzero(~scene.occluded(origins, to_camera, reach))
        index, to_camera, keep = index.take(unoccluded), to_camera.take(unoccluded, 0), keep.take(unoccluded)

    x, y, pixel = x.take(keep), y.take(keep), pixel.take(keep)
    tier = _tiers(view, pixels).take(pixel)
    unclean = np.flatnonzero(tier != CLEAN)
    x[unclean], y[unclean] = np.floor(x[unclean]) + np.float32(0.5), np.floor(y[unclean]) + np.float32(0.5)
    return Observations(index, _bilinear(pixels.radiance, x, y), tier, to_camera)


def normal_variance(view: FrameView, atlas: Atlas, element: np.ndarray, triangle_normal: np.ndarray) -> np.ndarray:
    """Variance of the surface's normal within what a frame's pixels show of some elements.

    Over the four pixels around: at half a pixel's distance along either axis they have the second moments of a pixel
    that is looked up between its neighbours (1/12 of its own square, 1/6 of the interpolation).

    Parameters
    ----------
    element : (k,) int
    triangle_normal : (t, 3) float32

    Returns
    -------
    (k,) float32
        Summed over the axes, radians^2. Pixels of other objects don't count.
    """
    camera = view.camera
    x, y, _ = _projected(camera, (atlas.position[element] - camera.centre.astype(np.float32)).T)
    left = np.clip(np.rint(x).astype(np.int32) - 1, 0, camera.width - 2)
    top = np.clip(np.rint(y).astype(np.int32) - 1, 0, camera.height - 2)
    pixels = top * camera.width + left + np.array([[0], [1], [camera.width], [camera.width + 1]], np.int32)
    same_object = (view.object_id.ravel()[pixels] == atlas.object_id[element]).astype(np.float32)
    share = same_object / np.maximum(same_object.sum(0), 1)
    mean = np.einsum("jk,jki->ki", share, triangle_normal[view.triangle.ravel()[pixels]])
    # The mean of unit vectors falls short of length 1 by their variance.
    return np.where(same_object.any(0), np.maximum(1 - np.square(mean).sum(1), 0), 0).astype(np.float32)
