"""The capture as plain values. Readers make these; every later stage takes them.

Conventions: metres, +Z up, right-handed. A camera looks along its -Z with +Y up (OpenGL, Blender). Pixel (0, 0)'s
centre lies at (0.5, 0.5); x runs right, y runs down. Radiance is linear Rec.709.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from .lens import Lens


@dataclass(frozen=True)
class Camera:
    """A pinhole camera.

    Attributes
    ----------
    width, height : int
        Size of the frame in pixels.
    fx, fy, cx, cy : float
        Focal lengths and principal point in pixels.
    camera_to_world : (4, 4) float64
        Rigid pose, OpenGL axes.
    lens : Lens or None
        How rays become image points before focal lengths and principal point; None: perspective without distortion.
    """

    width: int
    height: int
    fx: float
    fy: float
    cx: float
    cy: float
    camera_to_world: np.ndarray
    lens: Lens | None = None

    @property
    def centre(self) -> np.ndarray:
        """Centre of projection in the world, (3,) float64."""
        return self.camera_to_world[:3, 3]

    def project(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Project world points.

        Parameters
        ----------
        points : (n, 3) float

        Returns
        -------
        pixels : (n, 2) float
            x and y in pixels; nonsense where `depth` <= 0.
        depth : (n,) float
            Distance along the optical axis in metres, negative behind the camera.
        """
        rotation = self.camera_to_world[:3, :3]
        local = (points - self.centre.astype(points.dtype)) @ rotation.astype(points.dtype)
        depth = -local[:, 2]
        safe = np.where(depth > 0, depth, 1)
        pixels = np.stack([self.fx * local[:, 0] / safe + self.cx, self.cy - self.fy * local[:, 1] / safe], -1)
        return pixels, depth

    def directions(self, pixels: np.ndarray) -> np.ndarray:
        """World directions of unit length through `pixels` ((n, 2) float, x and y), as (n, 3) float32."""
        x = (pixels[:, 0] - self.cx) / self.fx
        y = (self.cy - pixels[:, 1]) / self.fy
        local = np.stack([x, y, -np.ones_like(x)], -1)
        world = local @ self.camera_to_world[:3, :3].T
        return (world / np.linalg.norm(world, axis=1, keepdims=True)).astype(np.float32)

    def pixel_centres(self) -> np.ndarray:
        """Centres of all pixels row by row, (height * width, 2) float64."""
        y, x = np.mgrid[: self.height, : self.width]
        return np.stack([x.ravel() + 0.5, y.ravel() + 0.5], -1)


@dataclass(frozen=True)
class Shot:
    """One of several exposures of a frame; `path`, `exposure` and `saturation` as in `Frame`."""

    path: Path
    exposure: float
    saturation: float = float("inf")


@dataclass(frozen=True)
class Frame:
    """One posed HDR picture, still on disk.

    Attributes
    ----------
    name : str
        How the capture calls it; used in messages and as the camera's name.
    path : Path
        The picture.
    camera : Camera
    mask_path : Path or None
        Picture whose black pixels are to be ignored.
    exposure : float
        pixel = radiance * exposure.
    saturation : float
        Pixel value (before division by `exposure`) from which on the sensor clips; inf where unknown.
    transfer : str
        Curve of the stored numbers, as `pictures.read_picture` takes it; '' for linear floats.
    brackets : tuple of Shot
        Further exposures of the same pose, to be merged with the first.
    id_path : Path or None
        Picture that holds each pixel's object.
    """

    name: str
    path: Path
    camera: Camera
    mask_path: Path | None = None
    exposure: float = 1.0
    saturation: float = float("inf")
    transfer: str = ""
    brackets: tuple[Shot, ...] = ()
    id_path: Path | None = None


@dataclass(frozen=True)
class Pixels:
    """A frame's content.

    Attributes
    ----------
    radiance : (height, width, 3) float32
        Linear Rec.709; 0 where not `valid`.
    valid : (height, width) bool
        False: masked out, NaN, inf, negative. Such a pixel says nothing.
    saturated : (height, width) bool
        True: the sensor clipped; `radiance` is a lower bound.
    """

    radiance: np.ndarray
    valid: np.ndarray
    saturated: np.ndarray


@dataclass(frozen=True)
class Instance:
    """One object of the room; `object_id` is what the mesh's faces carry."""

    object_id: int
    class_name: str


@dataclass(frozen=True)
class Mesh:
    """The room's triangles.

    Attributes
    ----------
    vertices : (v, 3) float64
        World positions in metres.
    triangles : (t, 3) int32
    object_id : (t,) int32
        The instance that each triangle belongs to. Every value has an `Instance`.
    uv : (t, 3, 2) float32 or None
        The capture's own texture coordinates for each corner; may overlap and repeat.
    """

    vertices: np.ndarray
    triangles: np.ndarray
    object_id: np.ndarray
    uv: np.ndarray | None = None


@dataclass(frozen=True)
class Capture:
    """A whole capture, checked: what a run takes in.

    Attributes
    ----------
    root : Path
    mesh : Mesh
    instances : tuple of Instance
        Sorted by `object_id`; each has at least one triangle.
    frames : tuple of Frame
        In capture (video) order.
    warnings : tuple of str
        One sentence each, for the report.
    format : str
        What it was read as.
    """

    root: Path
    mesh: Mesh
    instances: tuple[Instance, ...]
    frames: tuple[Frame, ...]
    warnings: tuple[str, ...] = ()
    format: str = ""
