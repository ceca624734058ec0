"""What a lens does between a ray and the image plane: the interface of all camera models."""

from typing import Any, ClassVar, Protocol

import numpy as np


class Lens(Protocol):
    """A camera model without its focal lengths and principal point.

    Axes are COLMAP's and OpenCV's: x right, y down, z forward. Image points (u, v) are such that
    pixel = (fx u + cx, fy v + cy). Instances are frozen dataclasses, and hold nothing but numbers, strings, tuples of
    them and lenses.

    Attributes
    ----------
    name : str
        The model, as COLMAP or nerfstudio calls it.
    widest : float
        No ray further than this angle (radians) from z is seen.
    """

    __dataclass_fields__: ClassVar[dict[str, Any]]

    def __hash__(self) -> int: ...

    @property
    def name(self) -> str: ...

    @property
    def widest(self) -> float: ...

    def project(self, rays: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Image points of rays.

        Parameters
        ----------
        rays : (n, 3) float
            Any length but 0.

        Returns
        -------
        points : (n, 2) float64
            Finite; nonsense where not `valid`.
        valid : (n,) bool
            False: outside of what the model can map one to one (behind the camera, beyond the fold).
        """
        ...

    def unproject(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Unit rays through image points: the inverse of `project`.

        Parameters
        ----------
        points : (n, 2) float

        Returns
        -------
        rays : (n, 3) float64
            z where not `valid`.
        valid : (n,) bool
            False: no ray leads there.
        """
        ...


def ahead(rays: np.ndarray, valid: np.ndarray) -> np.ndarray:
    """The same rays, those not `valid` replaced by z: what is computed with them stays finite."""
    rays[~valid] = 0, 0, 1
    return rays
