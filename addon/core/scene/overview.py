"""A camera that shows the room, where the capture has none."""

import numpy as np

from ..kinds import Shown
from .model import Camera, Mesh
from .rays import RayScene

SIZE: Shown[tuple[int, int]] = (960, 640)
WIDE = np.radians(75)
"""Horizontal angle of view."""
EYES: Shown[float] = 1.5
"""Metres above the floor, or the middle of what is lower."""
INWARD: Shown[tuple[float, float, float]] = (0.25, 0.5, 0.75)
"""Where eyes are tried, as shares of the room's extent along x and y."""
TRIED: Shown[int] = 16
SEEN: Shown[int] = 24
"""Directions that are tried from each, and rays along a picture's edge that judge the view."""


def overview(mesh: Mesh) -> Camera:
    """The level view from within the mesh, of some tried ones, that shows most of its front sides, far and near alike.

    A view is judged by the mean distance that it sees, short of a room's length; backs and what lies outside count
    nothing.
    """
    used = mesh.vertices[mesh.triangles.ravel()]
    low, high = used.min(0), used.max(0)
    scene = RayScene(mesh.vertices, mesh.triangles)
    a, b, c = (mesh.vertices[mesh.triangles[:, i]] for i in range(3))
    normal = np.cross(b - a, c - a)
    height = low[2] + min(EYES, 0.6 * (high[2] - low[2]))
    views = [
        _view(low[:2] + (high - low)[:2] * (x, y), height, turn)
        for x in INWARD
        for y in INWARD
        for turn in 2 * np.pi * np.arange(TRIED) / TRIED
    ]
    return max(views, key=lambda camera: _mean_distance(camera, scene, normal))


def _view(place: np.ndarray, height: float, turn: float) -> Camera:
    """A level camera, looking down a little."""
    ahead = np.array([np.cos(turn), np.sin(turn), -0.1])
    back = -ahead / np.linalg.norm(ahead)
    right = np.cross([0, 0, 1], back)
    right /= np.linalg.norm(right)
    pose = np.eye(4)
    pose[:3] = np.stack([right, np.cross(back, right), back, [*place, height]], 1)
    focal = SIZE[0] / 2 / np.tan(WIDE / 2)
    return Camera(*SIZE, focal, focal, SIZE[0] / 2, SIZE[1] / 2, pose)


def _mean_distance(camera: Camera, scene: RayScene, normal: np.ndarray) -> float:
    fraction = (np.arange(SEEN) + 0.5) / SEEN
    pixels = np.stack(np.meshgrid(fraction * camera.width, fraction * camera.height), -1).reshape(-1, 2)
    directions = camera.directions(pixels)
    hits = scene.intersect(camera.centre, directions)
    front = (hits.triangle >= 0) & (np.einsum("ij,ij->i", normal[hits.triangle], directions) < 0)
    return float(np.where(front, np.minimum(hits.distance, scene.diagonal), 0).mean())
