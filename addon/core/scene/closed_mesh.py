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
        uv=uv, closed=None,
    )  # fmt: skip


def opened(capture: Capture) -> Capture:
    """A capture whose mesh is `as_scanned`."""
    mesh = as_scanned(capture.mesh)
    left = set(np.unique(mesh.object_id).tolist())
    return replace(capture, mesh=mesh, instances=tuple(one for one in capture.instances if one.object_id in left))


def settled(mesh: Mesh) -> Mesh:
    """A mesh whose noise was taken out, with the faces that close it drawn up to the scan beside them.

    They were laid out behind all of its noise. A step of a centimetre in a floor throws a shadow of several where light
    comes in low. Faces that hang together move as one plane, so that none of their edges parts. Crumbs of the scan over
    the midst of them, as where it ends far from all cameras, are laid flat onto that plane.
    """
    if mesh.closed is None or not len(mesh.closed):
        return mesh
    scan = as_scanned(mesh)
    gap = plane_gap(scan.vertices)
    centre, facing = scan.vertices[scan.triangles].mean(1).astype(np.float64), scan.geometry[0]
    tree, vertices = cKDTree(centre), mesh.vertices.copy()
    closing, turned = mesh.triangles[mesh.closed], mesh.geometry[0][mesh.closed]
    label = connected(closing)
    for piece in range(int(label.max()) + 1):
        faces = label == piece
        own, normal = np.unique(closing[faces]), turned[faces].mean(0)
        normal = normal / max(float(np.linalg.norm(normal)), 1e-12)
        at = mesh.vertices[own].astype(np.float64)
        middle = at.mean(0)
        beside = _near(tree, at, 2 * gap)
        beside = beside[facing[beside] @ normal > np.cos(PARTS.tilt)]
        height = (centre[beside] - middle) @ normal
        beside = beside[np.abs(height) < gap]
        if len(beside) < LEVELS.few:
            continue
        lies = _plane_through(centre[beside] - middle, normal, at - middle)
        off = (centre[beside] - middle) @ normal - lies(centre[beside] - middle)
        spread = SIGMA_OF_MAD * float(np.median(np.abs(off)))
        under = max(spread, CLOSING.under * gap)
        rise = lies(at - middle) - under - (at - middle) @ normal
        vertices[own] = at + np.clip(rise, -gap, gap)[:, None] * normal
        corner = np.searchsorted(own, closing[faces])
        corners = vertices[own][corner].astype(np.float64)
        # What frames saw is closed in single cells. Where they saw none, a curtain may hang before a wall.
        single = np.linalg.norm(corners - np.roll(corners, 1, 1), axis=2).min(1) < LEVELS.likely * gap
        near = _near(tree, corners[single].mean(1), 3 * gap)
        off = np.abs((centre[near] - middle) @ normal - lies(centre[near] - middle))
        near = near[(off > LEVELS.likely * under) | (facing[near] @ normal < np.cos(PARTS.tilt))]
        over = _over_midst(RayScene(vertices[own], corner[single]), centre[near], normal, gap)
        crumbs = np.unique(scan.triangles[near[over]])
        place = mesh.vertices[crumbs].astype(np.float64) - middle
        height = lies(place) - place @ normal
        flat = np.abs(height) < gap
        vertices[crumbs[flat]] += (height[flat, None] * normal).astype(vertices.dtype)
    return replace(mesh, vertices=vertices)


def _near(tree: cKDTree, points: np.ndarray, radius: float) -> np.ndarray:
    """What lies within a radius of any of n points ((n, 3)), (k,) int."""
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


def _plane_through(points: np.ndarray, normal: np.ndarray, wanted: np.ndarray) -> Callable[[np.ndarray], np.ndarray]:
    """Height along a normal, of a plane fitted robustly to points ((n, 3)), as a function of places ((k, 3)).

    It is tilted only along what the points reach over half of the `wanted` places ((m, 3)): else it would be a guess.
    """
    right, up = plane_axes(normal, [])
    across = np.stack([points @ right, points @ up], 1)
    reach = np.ptp(across, axis=0)
    reach = np.where(2 * reach > np.ptp(np.stack([wanted @ right, wanted @ up], 1), axis=0), reach, np.inf)
    base = np.concatenate([np.ones((len(points), 1)), (across - across.mean(0)) / reach], 1)
    height, weight = points @ normal, np.ones(len(points))
    for _ in range(PARTS.fits):
        slope = np.linalg.lstsq(base * weight[:, None], height * weight, rcond=None)[0]
        off = np.abs(height - base @ slope)
        weight = 1 / np.sqrt(1 + (off / max(SIGMA_OF_MAD * float(np.median(off)), 1e-9)) ** 2)
    middle = across.mean(0)

    def at(places: np.ndarray) -> np.ndarray:
        own = np.stack([places @ right, places @ up], 1)
        return np.asarray(slope[0] + ((own - middle) / reach) @ slope[1:])

    return at
