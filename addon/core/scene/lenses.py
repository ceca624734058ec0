"""Lenses whose inverse has a closed form. Polynomial ones are in `lenses_polynomial.py`."""

import math
from dataclasses import dataclass

import numpy as np

from ..kinds import Unit
from .lens import Lens, ahead

TINY: Unit[float] = 1e-12


def _radius(points: np.ndarray) -> np.ndarray:
    return np.hypot(points[:, 0], points[:, 1])


@dataclass(frozen=True)
class FieldOfView:
    """r_d = atan(2 r tan(omega / 2)) / omega, r = tan(theta).

    Devernay and Faugeras, "Straight lines have to be straight" (2001); COLMAP's FOV.

    Attributes
    ----------
    omega : float
        Radians, above 0 and below pi.
    """

    omega: float
    name: str = "FOV"

    @property
    def widest(self) -> float:
        return math.pi / 2

    def project(self, rays: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        rays = np.asarray(rays, np.float64)
        radius, z = _radius(rays), rays[:, 2]
        # The angle of a ray that is bent by the factor, so that no tangent is taken of 90 degrees.
        bent = np.arctan2(2 * math.tan(self.omega / 2) * radius, np.maximum(z, 0)) / self.omega
        centre = 2 * math.tan(self.omega / 2) / self.omega  # limit of bent / tan(theta) on the axis
        near = radius < 1e-9 * np.abs(z)
        scale = np.where(near, centre / np.where(z == 0, 1, np.abs(z)), bent / np.maximum(radius, TINY))
        return rays[:, :2] * scale[:, None], z > 0

    def unproject(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        points = np.asarray(points, np.float64)
        radius = _radius(points)
        angle = radius * self.omega
        valid = angle < math.pi / 2
        theta = np.arctan(np.tan(np.where(valid, angle, 0)) / (2 * math.tan(self.omega / 2)))
        scale = np.sin(theta) / np.maximum(radius, TINY)
        return ahead(np.stack([points[:, 0] * scale, points[:, 1] * scale, np.cos(theta)], -1), valid), valid


@dataclass(frozen=True)
class Division:
    """tan(theta) = r_d / (1 + k r_d^2); for k < 0 it continues behind the camera.

    Fitzgibbon, "Simultaneous linear estimation of multiple view geometry and lens distortion" (CVPR 2001); COLMAP's
    DIVISION and SIMPLE_DIVISION.
    """

    k: float
    name: str = "DIVISION"

    @property
    def widest(self) -> float:
        # For k > 0 the angle is greatest at r_d = 1 / sqrt(k), and falls from there on.
        return math.atan(0.5 / math.sqrt(self.k)) if self.k > 0 else math.pi if self.k < 0 else math.pi / 2

    def project(self, rays: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        rays = np.asarray(rays, np.float64)
        square, z = rays[:, 0] ** 2 + rays[:, 1] ** 2, rays[:, 2]
        # The smaller root of k rho r^2 - z r + rho = 0, as r / rho.
        discriminant = z**2 - 4 * self.k * square
        root = np.sqrt(np.maximum(discriminant, 0))
        # For z < 0 the sum loses its digits; its product with the difference is -4 k rho^2.
        denominator = np.where(z < 0, -4 * self.k * square / np.maximum(root - z, 1e-300), z + root)
        valid = (discriminant >= 0) & (denominator > 1e-14 * np.maximum(root, np.abs(z)))
        if self.k >= 0:
            valid &= z > 0
        return rays[:, :2] * (2 / np.where(valid, denominator, 1))[:, None], valid

    def unproject(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        points = np.asarray(points, np.float64)
        square = (points**2).sum(1)
        rays = np.stack([points[:, 0], points[:, 1], 1 + self.k * square], -1)
        valid = self.k * square <= 1  # beyond 1 / sqrt(k) the radius folds back; never for k < 0
        return ahead(rays / np.linalg.norm(rays, axis=1, keepdims=True), valid), valid


@dataclass(frozen=True)
class EnhancedUnified:
    """(x, y) / (alpha d + (1 - alpha) z) with d^2 = beta (x^2 + y^2) + z^2; past 90 degrees for alpha > 0.

    Khomutenko, Garcia and Martinet, "An enhanced unified camera model" (2016), eq. 7 and 15; COLMAP's EUCM.

    Attributes
    ----------
    alpha, beta : float
        0 <= alpha <= 1, beta > 0.
    """

    alpha: float
    beta: float
    name: str = "EUCM"

    @property
    def _behind(self) -> float:
        """Seen is what has z > -this times d."""
        return (1 - self.alpha if self.alpha > 0.5 else self.alpha) / max(self.alpha, 1 - self.alpha)

    @property
    def widest(self) -> float:
        # z = -c d and d^2 = beta rho^2 + z^2: tan = rho / z = sqrt(1 - c^2) / (c sqrt(beta)) behind.
        c = min(self._behind, 1.0)
        return math.atan2(math.sqrt((1 - c * c) / self.beta), -c)

    def project(self, rays: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        rays = np.asarray(rays, np.float64)
        z = rays[:, 2]
        d = np.sqrt(self.beta * (rays[:, 0] ** 2 + rays[:, 1] ** 2) + z**2)
        valid = z > -self._behind * d
        denominator = self.alpha * d + (1 - self.alpha) * z
        valid &= denominator > 1e-14 * d
        return rays[:, :2] / np.where(valid, denominator, 1)[:, None], valid

    def unproject(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        points = np.asarray(points, np.float64)
        square = self.beta * (points**2).sum(1)
        radicand = 1 - (2 * self.alpha - 1) * square
        valid = radicand >= 0
        z = (1 - self.alpha**2 * square) / (self.alpha * np.sqrt(np.where(valid, radicand, 1)) + 1 - self.alpha)
        rays = np.stack([points[:, 0], points[:, 1], z], -1)
        return ahead(rays / np.linalg.norm(rays, axis=1, keepdims=True), valid), valid


@dataclass(frozen=True)
class Equirectangular:
    """u is the longitude and v the latitude, downwards, in radians; the picture's middle looks along z.

    COLMAP's EQUIRECTANGULAR (fx = w / 2 pi, fy = h / pi); nerfstudio's has its focal lengths pi times as long.
    """

    name: str = "EQUIRECTANGULAR"

    @property
    def widest(self) -> float:
        return math.pi

    def project(self, rays: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        rays = np.asarray(rays, np.float64)
        horizontal = np.hypot(rays[:, 0], rays[:, 2])
        points = np.stack([np.arctan2(rays[:, 0], rays[:, 2]), np.arctan2(rays[:, 1], horizontal)], -1)
        return points, np.ones(len(rays), bool)

    def unproject(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        points = np.asarray(points, np.float64)
        valid = (np.abs(points[:, 0]) <= math.pi + 1e-9) & (np.abs(points[:, 1]) <= math.pi / 2 + 1e-9)
        cosine = np.cos(points[:, 1])
        rays = np.stack([np.sin(points[:, 0]) * cosine, np.sin(points[:, 1]), np.cos(points[:, 0]) * cosine], -1)
        return ahead(rays, valid), valid


@dataclass(frozen=True)
class Cropped:
    """A lens whose picture ends at a circle around the principal point (nerfstudio's `fisheye_crop_radius`).

    Attributes
    ----------
    across, down : float
        Half axes in image points: the radius in pixels over fx and fy.
    """

    lens: Lens
    across: float
    down: float

    @property
    def name(self) -> str:
        return self.lens.name

    @property
    def widest(self) -> float:
        return self.lens.widest

    def _inside(self, points: np.ndarray) -> np.ndarray:
        return (points[:, 0] / self.across) ** 2 + (points[:, 1] / self.down) ** 2 <= 1

    def project(self, rays: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        points, valid = self.lens.project(rays)
        return points, valid & self._inside(points)

    def unproject(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        rays, valid = self.lens.unproject(points)
        valid = valid & self._inside(np.asarray(points))
        return ahead(rays, valid), valid
