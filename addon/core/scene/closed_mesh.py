"""A mesh whose holes were closed (`closing`): the scan alone, and the scan without noise with the faces beside it."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from scipy.spatial import cKDTree

from ..significance import LEVELS, SIGMA_OF_MAD
from .closing import plane_axes
from .model import Capture, Mesh
from .params import CLOSING, PARTS
from .rays import RayScene
from .shape_parts import plane_gap
from .uv_islands import connected


def as_scanned(mesh: Mesh) -> Mesh:
    """A mesh without the faces that close its holes."""
    if mesh.closed is None or not len(mesh.closed):
        return mesh
    scanned = np.ones(len(mesh.triangles), bool)
    scanned[mesh.closed] = False
    uv = None if mesh.uv is None else mesh.uv[scanned]
    count = int(mesh.triangles[mesh.closed].min())  # their vertices come last
    return replace(
        mesh, vertices=mesh.vertices[:count], triangles=mesh.triangles[scanned], object_id=mesh.object_id[scanned],
        uv=uv, closed=None, far=None if mesh.far is None else mesh.far[scanned],
    )  # fmt: skip


def without_closing(capture: Capture) -> Capture:
    """A capture whose mesh is `as_scanned`."""
    mesh = as_scanned(capture.mesh)
    remaining = set(np.unique(mesh.object_id).tolist())
    return replace(
        capture,
        mesh=mesh,
        instances=tuple(instance for instance in capture.instances if instance.object_id in remaining),
    )


def is_outward(scene: RayScene, points: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """Which of n places on faces that close a mesh ((n, 3) float32 each) have no mesh behind them, (n,) bool.

    Light may come in there from outside. The other faces close furniture.
    """
    return scene.intersect(scene.off_surface(points, -normals), -normals).triangle < 0


def with_aligned_closing(mesh: Mesh) -> Mesh:
    """A mesh whose noise was taken out, with the faces that close it drawn up to the scan beside them.

    They were laid out behind all of its noise. A step of a centimetre in a floor throws a shadow of several where light
    comes in low. Faces that are connected move as one plane, so that none of their edges parts. Crumbs of the scan over
    the midst of them, as where it ends far from all cameras, are laid flat onto that plane.
    """
    if mesh.closed is None or not len(mesh.closed):
        return mesh
    scan = as_scanned(mesh)
    gap = plane_gap(scan.vertices)
    centre, facing = scan.vertices[scan.triangles].mean(1).astype(np.float64), scan.geometry[0]
    tree, vertices = cKDTree(centre), mesh.vertices.copy()
    closing, normals = mesh.triangles[mesh.closed], mesh.geometry[0][mesh.closed]
    label = connected(closing)
    for piece in range(int(label.max()) + 1):
        faces = label == piece
        used, normal = np.unique(closing[faces]), normals[faces].mean(0)
        normal = normal / max(float(np.linalg.norm(normal)), 1e-12)
        positions = mesh.vertices[used].astype(np.float64)
        middle = positions.mean(0)
        neighbours = _near(tree, positions, 2 * gap)
        neighbours = neighbours[facing[neighbours] @ normal > np.cos(PARTS.tilt)]
        height = (centre[neighbours] - middle) @ normal
        neighbours = neighbours[np.abs(height) < gap]
        if len(neighbours) < LEVELS.few:
            continue
        height_at = _plane_through(centre[neighbours] - middle, normal, positions - middle)
        deviation = (centre[neighbours] - middle) @ normal - height_at(centre[neighbours] - middle)
        spread = SIGMA_OF_MAD * float(np.median(np.abs(deviation)))
        depth = max(spread, CLOSING.under * gap)
        rise = height_at(positions - middle) - depth - (positions - middle) @ normal
        vertices[used] = positions + np.clip(rise, -gap, gap)[:, None] * normal
        corner = np.searchsorted(used, closing[faces])
        corners = vertices[used][corner].astype(np.float64)
        # What frames saw is closed in single cells. Where they saw none, a curtain may hang before a wall.
        single = np.linalg.norm(corners - np.roll(corners, 1, 1), axis=2).min(1) < LEVELS.likely * gap
        near = _near(tree, corners[single].mean(1), 3 * gap)
        deviation = np.abs((centre[near] - middle) @ normal - height_at(centre[near] - middle))
        near = near[(deviation > LEVELS.likely * depth) | (facing[near] @ normal < np.cos(PARTS.tilt))]
        covering = _over_midst(RayScene(vertices[used], corner[single]), centre[near], normal, gap)
        crumb_vertices = np.unique(scan.triangles[near[covering]])
        offset = mesh.vertices[crumb_vertices].astype(np.float64) - middle
        height = height_at(offset) - offset @ normal
        close = np.abs(height) < gap
        vertices[crumb_vertices[close]] += (height[close, None] * normal).astype(vertices.dtype)
    return replace(mesh, vertices=vertices)


def _near(tree: cKDTree, points: np.ndarray, radius: float) -> np.ndarray:
    """Indices of what lies within a radius of any of the points ((n, 3)), (k,) int."""
    return np.unique(np.concatenate([np.zeros(0), *tree.query_ball_point(points, radius)])).astype(int)


def _over_midst(cover: RayScene, points: np.ndarray, normal: np.ndarray, gap: float) -> np.ndarray:
    """Points ((n, 3)) that lie over closing faces, as what is `gap` metres around them in the plane does, (n,) bool."""
    right, up = plane_axes(normal, [])
    over = np.ones(len(points), bool)
    for across in (-gap, 0, gap):
        for along in (-gap, 0, gap):
            start = (points + across * right + along * up + gap * normal).astype(np.float32)
            down = np.broadcast_to(-normal.astype(np.float32), start.shape)
            over &= ~(cover.intersect(start, down).distance > 2 * gap)
    return over


def _plane_through(points: np.ndarray, normal: np.ndarray, targets: np.ndarray) -> Callable[[np.ndarray], np.ndarray]:
    """Height along a normal, of a plane fitted robustly to points ((n, 3)), as a function of places ((k, 3)).

    It is tilted only along what the points reach over half of the `targets` places ((m, 3)): else it would be a guess.
    """
    right, up = plane_axes(normal, [])
    across = np.stack([points @ right, points @ up], 1)
    reach = np.ptp(across, axis=0)
    reach = np.where(2 * reach > np.ptp(np.stack([targets @ right, targets @ up], 1), axis=0), reach, np.inf)
    design = np.concatenate([np.ones((len(points), 1)), (across - across.mean(0)) / reach], 1)
    height, weight = points @ normal, np.ones(len(points))
    for _ in range(PARTS.fits):
        slope = np.linalg.lstsq(design * weight[:, None], height * weight, rcond=None)[0]
        residual = np.abs(height - design @ slope)
        weight = 1 / np.sqrt(1 + (residual / max(SIGMA_OF_MAD * float(np.median(residual)), 1e-9)) ** 2)
    middle = across.mean(0)

    def height_at(places: np.ndarray) -> np.ndarray:
        coordinates = np.stack([places @ right, places @ up], 1)
        return np.asarray(slope[0] + ((coordinates - middle) / reach) @ slope[1:])

    return height_at
