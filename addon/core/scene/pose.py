"""Whether a camera's pose is one: finite, rigid, not mirrored; rotations of quaternions."""

from typing import Any

import numpy as np

from ..errors import BadInputError
from ..kinds import Limit, Unit

TOLERANCE: Unit[float] = 1e-3
"""How far R^T R may be from the identity; less is rounding, and is taken out."""
MAX_DISTANCE: Limit[float] = 1e6
"""Metres from the origin from which on single precision can't hold a room."""


def rotation_of(quaternion: np.ndarray) -> np.ndarray:
    """The rotation of a quaternion w, x, y, z ((4,) float64, finite and not 0, of any length), (3, 3) float64."""
    quaternion = quaternion / np.abs(quaternion).max()  # first: squares of huge numbers are inf
    w, x, y, z = quaternion / np.linalg.norm(quaternion)
    return np.array([
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ])  # fmt: skip


def check_pose(matrix: Any, name: str) -> np.ndarray:
    """Check the camera-to-world matrix of frame `name` and take rounding out of its rotation.

    Parameters
    ----------
    matrix : nested lists, (4, 4) or (3, 4)
        OpenGL axes.

    Returns
    -------
    (4, 4) float64

    Raises
    ------
    BadInputError
        Not a matrix, not finite, not rigid, or mirrored.
    """
    try:
        pose = np.array(matrix, np.float64)
    except (TypeError, ValueError, OverflowError):
        pose = np.zeros(0)
    if pose.shape == (3, 4):
        pose = np.vstack([pose, [0, 0, 0, 1]])
    if pose.shape != (4, 4):
        raise BadInputError(f"Frame '{name}' has no 4 x 4 transform_matrix; export the poses again.")
    if not np.isfinite(pose).all():
        raise BadInputError(f"Frame '{name}' has a pose that is not finite; export the poses again.")
    if np.abs(pose[3] - [0, 0, 0, 1]).max() > TOLERANCE:
        raise BadInputError(f"Frame '{name}' has a pose whose last row is not 0 0 0 1; export the poses again.")
    if np.abs(pose[:3, 3]).max() > MAX_DISTANCE:
        raise BadInputError(f"Frame '{name}' lies over {MAX_DISTANCE:g} m from the origin; check the pose's units.")
    rotation = pose[:3, :3]
    # Bounded first: the square of a huge number is inf.
    if np.abs(rotation).max() > 1e3 or np.abs(rotation.T @ rotation - np.eye(3)).max() > TOLERANCE:
        raise BadInputError(
            f"Frame '{name}' has a pose that is not rigid (scaled or sheared); "
            "take the scale out of its transform_matrix."
        )
    if np.linalg.det(rotation) < 0:
        raise BadInputError(f"Frame '{name}' has a mirrored pose; flip one axis of its transform_matrix.")
    u, _, v = np.linalg.svd(rotation)
    pose = pose.copy()
    pose[:3, :3] = u @ v
    pose[3] = 0, 0, 0, 1
    return pose
