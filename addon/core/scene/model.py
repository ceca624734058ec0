"""The capture as plain values. Readers make these; every later stage takes them.

Conventions: metres, +Z up, right-handed. A camera looks along its -Z with +Y up (OpenGL, Blender). Pixel (0, 0)'s
centre lies at (0.5, 0.5); x runs right, y runs down. Radiance is linear Rec.709.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

import numpy as np

from ..kinds import Block
from ..naming import object_name
from ..parallel import blocks
from .lens import Lens
from .radiometry import Radiometry
from .stored_light import LitTexture, LitTiles

AUTO = "auto"
"""The unknown curve of codes: calibrated from what frames show together, sRGB's until then."""
TRIANGLES_AT_ONCE: Block[int] = 1 << 16


@dataclass(frozen=True)
class Camera:
    """A camera: a pinhole, or one with a lens.

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
            Distance along the optical axis in metres, negative behind the camera. With a lens: distance from the
            centre, negative where no ray from the point reaches the image plane.
        """
        if self.lens is not None:
            local = (points - self.centre) @ self.camera_to_world[:3, :3]
            image, valid = self.lens.project(local * (1, -1, -1))
            distance = np.linalg.norm(local, axis=1)
            return image * (self.fx, self.fy) + (self.cx, self.cy), np.where(valid, distance, -distance)
        rotation = self.camera_to_world[:3, :3]
        local = (points - self.centre.astype(points.dtype)) @ rotation.astype(points.dtype)
        depth = -local[:, 2]
        safe = np.where(depth > 0, depth, 1)
        pixels = np.stack([self.fx * local[:, 0] / safe + self.cx, self.cy - self.fy * local[:, 1] / safe], -1)
        return pixels, depth

    def directions(self, pixels: np.ndarray) -> np.ndarray:
        """World directions of unit length through `pixels` ((n, 2) float, x and y), as (n, 3) float32.

        Along the optical axis for pixels that no ray leads to; `rays` says which those are.
        """
        if self.lens is not None:
            return self.rays(pixels)[0]
        x = (pixels[:, 0] - self.cx) / self.fx
        y = (self.cy - pixels[:, 1]) / self.fy
        local = np.stack([x, y, -np.ones_like(x)], -1)
        world = local @ self.camera_to_world[:3, :3].T
        return (world / np.linalg.norm(world, axis=1, keepdims=True)).astype(np.float32)

    def rays(self, pixels: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """`directions` of `pixels` ((n, 2) float), and whether a ray leads there: (n, 3) float32, (n,) bool."""
        if self.lens is None:
            return self.directions(pixels), np.ones(len(pixels), bool)
        local, valid = self.lens.unproject((pixels - (self.cx, self.cy)) / (self.fx, self.fy))
        return ((local * (1, -1, -1)) @ self.camera_to_world[:3, :3].T).astype(np.float32), valid

    def pixel_angles(self, pixels: np.ndarray) -> np.ndarray:
        """Edge in radians of a square as large as what each of `pixels` ((n, 2) float) covers, (n,) float32.

        As at the principal point for a pinhole; NaN where no ray leads to all of the pixel.
        """
        if self.lens is None:
            return np.full(len(pixels), 1 / np.sqrt(self.fx * self.fy), np.float32)
        ends, valid = zip(*(self.lens.unproject((pixels + shift - (self.cx, self.cy)) / (self.fx, self.fy))
                           for shift in ((-0.5, 0), (0.5, 0), (0, -0.5), (0, 0.5))))  # fmt: skip
        area = np.linalg.norm(np.cross(ends[1] - ends[0], ends[3] - ends[2]), axis=1)
        return np.where(np.all(valid, 0), np.sqrt(area), np.nan).astype(np.float32)

    @property
    def pixel_angle(self) -> float:
        """Radians that a pixel covers: at the principal point of a pinhole, else the median over the frame."""
        if self.lens is None:
            return 1 / self.fx
        y, x = np.mgrid[0.5 : self.height : max(self.height / 16, 1), 0.5 : self.width : max(self.width / 16, 1)]
        angles = self.pixel_angles(np.stack([x.ravel(), y.ravel()], -1))
        known = angles[angles > 0]
        return float(np.median(known)) if len(known) else 1 / self.fx

    def coarser(self, step: int) -> Camera:
        """The camera of a picture whose pixels are `step` * `step` of this one's."""
        return replace(self, width=self.width // step, height=self.height // step, fx=self.fx / step,
                       fy=self.fy / step, cx=self.cx / step, cy=self.cy / step)  # fmt: skip

    def pixel_centres(self, step: int = 1) -> np.ndarray:
        """Centres of every `step`-th pixel in x and y, row by row, of all (height * width, 2) float64."""
        y, x = np.mgrid[step // 2 : self.height : step, step // 2 : self.width : step]
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
    mask_path : Path or None
        Picture whose black pixels are to be ignored.
    exposure : float
        pixel = radiance * exposure.
    saturation : float
        Pixel value (before division by `exposure`) from which on the sensor clips; inf where unknown.
    transfer : str
        Curve of the stored numbers, as `pictures.read_picture` takes it; '' for linear floats; `AUTO` for codes whose
        curve nobody told: `saturation` is one of a code then, in 0...1.
    brackets : tuple of Shot
        Further exposures of the same pose, to be merged with the first.
    id_path : Path or None
        Picture that holds each pixel's object.
    radiometry : Radiometry or None
        What calibration found of codes with the curve `AUTO`, in place of `exposure`.
    margin : int
        Pixels at each edge that say nothing, whatever the mask says.
    turned : bool
        Whether the camera is that of the pictures turned as their EXIF says, not of what is stored.
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
    radiometry: Radiometry | None = None
    margin: int = 0
    turned: bool = False

    @property
    def uncalibrated(self) -> bool:
        """Whether its codes are still to be calibrated; brackets, whose exposures are known, have sRGB's curve."""
        return self.transfer == AUTO and self.radiometry is None and not self.brackets

    @property
    def shots(self) -> tuple[Shot, ...]:
        """All exposures, its own first."""
        return Shot(self.path, self.exposure, self.saturation), *self.brackets

    @property
    def files(self) -> tuple[Path, ...]:
        """All pictures that belong to it: exposures, mask, ids."""
        more = (self.mask_path, self.id_path)
        return *(shot.path for shot in self.shots), *(path for path in more if path is not None)


@dataclass(frozen=True)
class Pixels:
    """A frame's content.

    Attributes
    ----------
    radiance : (height, width, 3) float32
        Linear Rec.709; 0 where not `valid`.
    valid : (height, width) bool
        False: masked out, NaN, inf, negative, or no ray leads there. Such a pixel says nothing.
    saturated : (height, width) bool
        True: the sensor clipped; `radiance` is a lower bound.
    """

    radiance: np.ndarray
    valid: np.ndarray
    saturated: np.ndarray

    def coarser(self, step: int) -> Pixels:
        """Means over `step` * `step` pixels, as `Camera.coarser` has them: valid where all are, clipped where any."""
        if step == 1:
            return self
        height, width = (n // step * step for n in self.valid.shape)

        def blocks(values: np.ndarray) -> np.ndarray:
            return values[:height, :width].reshape(height // step, step, width // step, step, *values.shape[2:])

        return Pixels(blocks(self.radiance).mean((1, 3)), blocks(self.valid).all((1, 3)),
                      blocks(self.saturated).any((1, 3)))  # fmt: skip


@dataclass(frozen=True)
class Instance:
    """One object of the room; `object_id` is what the mesh's faces carry.

    It is a `guess` where the mesh's shape alone gives it: it may hold things of several materials. Where it is
    `part_of` another one, it is the same thing to the artist, with a material of its own: a slot of that object.
    """

    object_id: int
    class_name: str
    guess: bool = False
    part_of: int | None = None

    @property
    def name(self) -> str:
        """What the object is called everywhere."""
        return object_name(self.class_name, self.object_id)


def class_names(instances: Iterable[Instance]) -> dict[int, str]:
    """Classes of objects, by their number."""
    return {instance.object_id: instance.class_name for instance in instances}


@dataclass(frozen=True)
class KnownMirror:
    """A flat mirror that the capture itself names.

    Attributes
    ----------
    point, normal : (3,) float64
        Its plane.
    reflectivity : float
        Share of the radiance that it reflects.
    """

    object_id: int
    point: np.ndarray
    normal: np.ndarray
    reflectivity: float


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
    lit : LitTiles or LitTexture or None
        Its light, where the capture stores it on the mesh; used where there are no frames.
    backs : (s,) int32 or None
        None in captures. The last s triangles are the second sides of these, in the same place with the other winding:
        sheets that frames see from both sides (`surface.two_sides`).
    closed : (c,) int32 or None
        Triangles that the capture lacks, by which its holes were closed (`closing`).
    whole : bool
        Its objects are unknown: they are parts by shape alone, and where two of them border one surface may continue.
    far : (t,) bool or None
        Triangles of other parts of a building (`division`): whole objects, there for the light that they send.
    """

    vertices: np.ndarray
    triangles: np.ndarray
    object_id: np.ndarray
    uv: np.ndarray | None = None
    lit: LitTiles | LitTexture | None = None
    backs: np.ndarray | None = None
    closed: np.ndarray | None = None
    whole: bool = False
    far: np.ndarray | None = None

    @cached_property
    def geometry(self) -> tuple[np.ndarray, np.ndarray]:
        """Unit normals ((t, 3) float32, by the winding) and areas ((t,) float64, square metres); not to be changed."""
        normal, area = np.empty((len(self.triangles), 3), np.float32), np.empty(len(self.triangles))
        for part in blocks(len(area), TRIANGLES_AT_ONCE):
            a, b, c = (self.vertices.take(corner, 0).T.astype(np.float64) for corner in self.triangles[part].T)
            (x, y, z), (p, q, r) = b - a, c - a
            cross = np.stack([y * r - z * q, z * p - x * r, x * q - y * p])
            length = np.sqrt(cross[0] * cross[0] + cross[1] * cross[1] + cross[2] * cross[2])
            normal[part] = (cross / np.maximum(length, 1e-300)).T
            area[part] = length / 2
        normal.flags.writeable = area.flags.writeable = False
        return normal, area


@dataclass(frozen=True)
class Capture:
    """A whole capture, checked: what a run takes in.

    Attributes
    ----------
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
    mirrors: tuple[KnownMirror, ...] = ()
