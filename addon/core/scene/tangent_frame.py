"""Frames about normals: local directions, in which the normal is +Z, and the world's."""

import numpy as np


def dot(a: np.ndarray | tuple, b: np.ndarray | tuple | list) -> np.ndarray:
    """Sum of products over the first axis, of three planes (or numbers) each.

    Plane by plane: NumPy's sums over an axis of three, and einsum along short rows, take many times as long.
    """
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def tangent_frame(normal: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Two unit vectors at right angles to each unit normal ((n, 3) float32), without branches.

    Duff et al., "Building an Orthonormal Basis, Revisited", JCGT 2017.
    """
    x, y, z = normal[:, 0], normal[:, 1], normal[:, 2]
    sign = np.copysign(np.float32(1), z)
    a = -1 / (sign + z)
    b = x * y * a
    tangent = np.stack([1 + sign * x * x * a, sign * b, -sign * x], -1)
    bitangent = np.stack([b, sign + y * y * a, -y], -1)
    return tangent.astype(np.float32), bitangent.astype(np.float32)


def to_world(local: np.ndarray, normal: np.ndarray) -> np.ndarray:
    """Turn local directions, (n, k, 3) or (1, k, 3), so that +Z becomes the normal, (n, 3): (n, k, 3) float32."""
    tangent, bitangent = tangent_frame(normal)
    return local[..., 0:1] * tangent[:, None] + local[..., 1:2] * bitangent[:, None] + local[..., 2:3] * normal[:, None]
