"""A textured room, its surface elements and a camera's way through it: a capture made without Blender."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from addon.core.scene.atlas import Atlas
from addon.core.scene.elements import make_atlas
from addon.core.scene.model import Camera, Frame, Mesh, Pixels
from addon.core.scene.rays import RayScene

ROOM = (6.0, 5.0, 2.8)
BOXES = 12
TILES = 16
"""Squares along a side's edge: the tree of triangles is then as deep as a scan's."""
NOISE = 0.03
GAP = 2
"""Texels between two islands."""


@dataclass(frozen=True)
class SyntheticCapture:
    """A room, a camera's way through it, and its pictures.

    Attributes
    ----------
    mesh : Mesh
    atlas : Atlas
    rays : RayScene
    frames : tuple of Frame
        Their names are their numbers; `make` makes their pixels.
    seed : int
    """

    mesh: Mesh
    atlas: Atlas
    rays: RayScene
    frames: tuple[Frame, ...]
    seed: int

    def make(self, frame: Frame) -> Pixels:
        """What the frame sees: a pattern on every surface, a highlight that moves with the camera, noise."""
        camera = frame.camera
        directions = camera.directions(camera.pixel_centres())
        centre = camera.centre.astype(np.float32)
        hits = self.rays.intersect(np.broadcast_to(centre, directions.shape), directions)
        where = (centre + np.where(hits.triangle < 0, 0, hits.distance)[:, None] * directions).T
        value = 0.4 + 0.25 * np.sin(9 * where[0]) * np.sin(9 * where[1]) * np.sin(9 * where[2])
        # Brightest where the ray goes down steeply: on each spot for a stretch of the way, as in a video.
        value += 3 * np.maximum(-directions[:, 2], 0) ** 8
        rng = np.random.default_rng([self.seed, int(frame.name)])
        image = value[:, None] * np.float32([1.0, 0.8, 0.6]) * np.exp(NOISE * rng.standard_normal(directions.shape))
        shape = camera.height, camera.width
        image = image.astype(np.float32).reshape(*shape, 3)
        return Pixels(image, np.ones(shape, bool), np.zeros(shape, bool))


def synthetic_capture(count: int, size: tuple[int, int], elements: int, seed: int) -> SyntheticCapture:
    """A room with boxes seen by `count` frames of `size` (width, height) pixels on a closed way.

    Parameters
    ----------
    elements : int
        About so many surface elements.
    """
    rng = np.random.default_rng(seed)
    quads, ids = [box(np.zeros(3), np.array(ROOM), inward=True)], [np.arange(6)]
    for number in range(BOXES):
        low = np.append(rng.uniform(0.05, 0.85, 2) * ROOM[:2], 0.0)
        quads.append(box(low, low + rng.uniform(0.2, 0.9, 3), inward=False))
        ids.append(np.full(6, 6 + number))
    mesh, atlas = tiled(np.concatenate(quads), np.concatenate(ids), elements)
    frames = tuple(Frame(str(i), Path(f"{i}.exr"), _camera(i / count, size)) for i in range(count))
    return SyntheticCapture(mesh, atlas, RayScene(mesh.vertices, mesh.triangles), frames, seed)


def box(low: np.ndarray, high: np.ndarray, inward: bool) -> np.ndarray:
    """A box's six sides: a corner and two edges, whose cross product is the normal; (6, 3, 3)."""
    result = []
    for axis in range(3):
        u, v = (axis + 1) % 3, (axis + 2) % 3
        edges = np.zeros((2, 3))
        edges[0, u], edges[1, v] = (high - low)[u], (high - low)[v]
        for side in (low, high):
            corner = low.copy()
            corner[axis] = side[axis]
            result.append(np.stack([corner, *(edges if (side is high) != inward else edges[::-1])]))
    return np.array(result)


def tiled(quads: np.ndarray, ids: np.ndarray, elements: int) -> tuple[Mesh, Atlas]:
    """Quads ((q, 3, 3): corner and edges) as TILES * TILES squares each, laid out row upon row in an atlas."""
    length = np.linalg.norm(quads[:, 1:], axis=2)
    texel = np.sqrt(length.prod(1).sum() / elements)
    extent = np.ceil(length / texel).astype(int)
    edge = int(np.sqrt(1.3 * (extent + GAP).prod(1).sum())) + int(extent.max()) + GAP
    place = np.zeros((len(quads), 2), int)
    left, bottom, tallest = 0, 0, 0
    for quad in np.argsort(-extent[:, 1], kind="stable"):
        if left + extent[quad, 0] + GAP > edge:
            left, bottom, tallest = 0, bottom + tallest, 0
        place[quad] = left, bottom
        left, tallest = left + extent[quad, 0] + GAP, max(tallest, extent[quad, 1] + GAP)
    size = max(edge, bottom + tallest)
    row, column = (i.ravel() for i in np.mgrid[:TILES, :TILES])
    square = np.stack([column, row], 1)[:, None] + np.array([(0, 0), (1, 0), (1, 1), (0, 0), (1, 1), (0, 1)])
    share = square.reshape(-1, 3, 2) / TILES  # the same triangles for every quad
    corners = quads[:, None, None, 0] + np.einsum("tks,qsj->qtkj", share, quads[:, 1:])
    uv = (place[:, None, None] + share * extent[:, None, None]) / size
    vertices = corners.reshape(-1, 3)
    triangles = np.arange(len(vertices), dtype=np.int32).reshape(-1, 3)
    mesh = Mesh(vertices, triangles, np.repeat(ids, len(share)).astype(np.int32))
    return mesh, make_atlas(mesh, uv.reshape(-1, 3, 2).astype(np.float32), size)


def _camera(share: float, size: tuple[int, int]) -> Camera:
    """The camera at a share of its way: an oval at eye height, looking ahead and across."""
    width, height = size
    angle = 2 * np.pi * share
    eye = np.array([ROOM[0] / 2 + 1.8 * np.cos(angle), ROOM[1] / 2 + 1.3 * np.sin(angle), 1.7])
    gaze = angle + 2.2 + 0.8 * np.sin(3 * angle)
    back = -np.array([np.cos(gaze), np.sin(gaze), 0.35 * np.sin(5 * angle) - 0.15])
    back /= np.linalg.norm(back)
    right = np.cross([0, 0, 1.0], back)
    right /= np.linalg.norm(right)
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = np.stack([right, np.cross(back, right), back], 1), eye
    f = 0.6 * width
    return Camera(width, height, f, f, width / 2, height / 2, pose)
