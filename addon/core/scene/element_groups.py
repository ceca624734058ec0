"""Groups of neighbouring elements: which of them a frame can't see is found for the whole group at once."""

import zlib

import numpy as np

from ..groups import cell_of
from ..kinds import Block, Unit
from ..memory import BUDGET
from .atlas import Atlas
from .model import Camera
from .params import VISIBILITY
from .pixel_rays import widest_angle
from .visibility import FrameView

CELL: Block[int] = 16
"""Edge of a group in elements."""
SLACK: Unit[float] = 1e-4
"""What rounding may add to a sine or, as a share of the scene, to a length: a group that touches a limit stays in."""


class ElementGroups:
    """Elements of one object in one cell of space that face roughly one way: a ball, and a cone of normals.

    A group is left out only where no element of it could pass `visibility.observe`: nothing changes but the time.
    What a camera was found to see is kept, and need not be found again by the next pass over the frames.
    """

    def __init__(self, atlas: Atlas):
        spacing = CELL * atlas.texel_edge if len(atlas) else 1.0
        side = 2 * np.abs(atlas.normal).argmax(1)
        side += np.take_along_axis(atlas.normal, (side // 2)[:, None], 1)[:, 0] > 0
        key = cell_of(atlas.position, max(spacing, 1e-12)) * 6 + side
        order = np.lexsort((atlas.object_id, key))
        key, object_id = key[order], atlas.object_id[order]
        new = np.concatenate([[True], (np.diff(key) != 0) | (np.diff(object_id) != 0)])[: len(key)]
        start = np.flatnonzero(new)
        group = np.cumsum(new) - 1
        self._group = np.empty(len(key), np.int32)
        self._group[order] = group
        self._object_id = object_id[start]

        position, normal = atlas.position[order], atlas.normal[order]
        low, high = (f.reduceat(position, start) if len(key) else position for f in (np.minimum, np.maximum))
        self._centre = ((low + high) / 2).astype(np.float64)
        size = float(np.abs(position).max(initial=0))
        self._radius = np.linalg.norm(high - low, axis=1) / 2 + SLACK * (size + spacing)
        axis = np.add.reduceat(normal, start) if len(key) else normal
        self._axis = axis / np.maximum(np.linalg.norm(axis, axis=1, keepdims=True), 1e-12)
        cosine = np.einsum("ij,ij->i", normal, self._axis[group])
        widest = np.minimum.reduceat(cosine, start) if len(key) else cosine
        self._opening = np.arccos(np.clip(widest - SLACK, -1, 1))
        self._seen: dict[tuple, tuple[object, bytes, bytes]] = {}

    @staticmethod
    def _key(camera: Camera) -> tuple:
        size = camera.width, camera.height, camera.fx, camera.fy, camera.cx, camera.cy
        return *size, camera.camera_to_world.tobytes(), id(camera.lens)

    def remember(self, camera: Camera, valid: np.ndarray, element: np.ndarray) -> None:
        """Keep which elements ((k,) int32, sorted) a camera sees, of all, in the pixels that were valid.

        Where memory is short nothing is kept: it is found again.
        """
        if BUDGET.is_short():
            self._seen.clear()
            return
        seen = np.zeros(len(self._group), bool)
        seen[element] = True
        # The lens is held, so that its id is nobody else's.
        self._seen[self._key(camera)] = camera.lens, _packed(valid), _packed(seen)

    def seen(self, camera: Camera, valid: np.ndarray) -> np.ndarray | None:
        """What is remembered of a camera, (k,) int32; None where nothing is, or where other pixels are valid now."""
        remembered = self._seen.get(self._key(camera))
        if remembered is None or (valid.ravel() > _unpacked(remembered[1], valid.size)).any():
            return None
        return np.flatnonzero(_unpacked(remembered[2], len(self._group))).astype(np.int32)

    def candidates(self, view: FrameView) -> np.ndarray:
        """Elements that the frame may see, sorted: (k,) int32."""
        camera = view.camera
        visible_ids = np.zeros(max(self._object_id.max(initial=0), view.object_id.max()) + 2, bool)
        visible_ids[view.object_id.ravel()] = True  # -1 marks the last
        keep = visible_ids[self._object_id]
        keep &= self._in_frustum(camera) if camera.lens is None else self._in_cone(camera)
        to_camera = camera.centre - self._centre
        distance = np.maximum(np.linalg.norm(to_camera, axis=1), 1e-12)
        cosine = np.einsum("ij,ij->i", to_camera, self._axis) / distance
        # The smallest angle that any normal of the cone can make with the way from any point of the ball.
        smallest = np.arccos(np.clip(cosine, -1, 1)) - self._opening - np.arcsin(np.minimum(self._radius / distance, 1))
        keep &= (smallest < np.arccos(VISIBILITY.min_cosine) + SLACK) | (distance <= self._radius)
        return np.flatnonzero(keep[self._group]).astype(np.int32)

    def _in_frustum(self, camera: Camera) -> np.ndarray:
        """Groups that a pinhole's frustum may reach."""
        local = (self._centre - camera.centre) @ camera.camera_to_world[:3, :3]
        depth = -local[:, 2]
        keep = depth > -self._radius
        for offset, f, c, extent in (
            (local[:, 0], camera.fx, camera.cx, camera.width),
            (-local[:, 1], camera.fy, camera.cy, camera.height),
        ):
            # Signed distance to the frustum's two planes: f * along + c * depth is 0 at the frame's first column.
            keep &= f * offset + c * depth > -self._radius * np.hypot(f, c)
            keep &= f * offset + (c - extent) * depth < self._radius * np.hypot(f, c - extent)
        return keep

    def _in_cone(self, camera: Camera) -> np.ndarray:
        """Groups that the cone around a lens's widest ray may reach."""
        offset = self._centre - camera.centre
        distance = np.maximum(np.linalg.norm(offset, axis=1), 1e-12)
        angle = np.arccos(np.clip(-(offset @ camera.camera_to_world[:3, 2]) / distance, -1, 1))
        ball = np.arcsin(np.minimum(self._radius / distance, 1))
        return (angle - ball < widest_angle(camera) + SLACK) | (distance <= self._radius)


def _packed(mask: np.ndarray) -> bytes:
    """A mask (bool) in a few bytes: equal values lie in runs."""
    return zlib.compress(np.packbits(mask).tobytes(), 1)


def _unpacked(packed: bytes, count: int) -> np.ndarray:
    """The inverse of `_packed`, (count,) bool."""
    return np.unpackbits(np.frombuffer(zlib.decompress(packed), np.uint8), count=count).view(bool)
