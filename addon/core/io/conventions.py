"""Other ways to read a pose: axes of the camera, axes of the world, scale, direction of the matrix.

A convention is written as parts joined by commas, each of which changes all poses alike:

world-to-camera      the matrices lead from the world to the camera
camera:+x-y-z        the camera's x, y and z axes in terms of those that the file's matrix has; here OpenCV's
world:+x-z+y         the world's x, y and z in terms of the file's: turns the poses towards the mesh
scale:0.001          the positions are in another unit than the mesh
up:+y                mesh and poses alike have that axis upwards: both are turned so that +Z is
"""

import itertools
import math
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..errors import BadInputError
from ..json_values import float_of
from ..kinds import Unit
from ..scene.model import Camera, Frame
from .layout import RawMesh

AS_READ = "as-read"
"""The poses as they are, whatever the pictures say."""
NAMED = {"opengl": "camera:+x+y+z", "opencv": "camera:+x-y-z", "fipt": "camera:-x+y-z"}
CAMERAS = ("+x+y+z", "+x-y-z", "-x+y-z", "-x-y+z")
"""Camera axes that formats use: OpenGL, OpenCV, FIPT's, and an upside-down one."""
SCALES: Unit[tuple[float, ...]] = (0.001, 0.01, 0.0254, 0.1, 0.3048, 10.0, 100.0, 1000.0)
"""Millimetres, centimetres, inches, decimetres, feet, and the mesh in those."""


@dataclass(frozen=True)
class Convention:
    """A correction of all poses; see the module.

    Attributes
    ----------
    camera, world : str
        Signed axes, as '+x-y-z'.
    """

    world_to_camera: bool = False
    camera: str = "+x+y+z"
    world: str = "+x+y+z"
    scale: float = 1.0
    up: str = "+z"

    def __str__(self) -> str:
        plain = "+x+y+z"
        parts = ["world-to-camera"] if self.world_to_camera else []
        parts += [f"{name}:{axes}" for name, axes in (("camera", self.camera), ("world", self.world)) if axes != plain]
        parts += [f"scale:{self.scale:g}"] if self.scale != 1 else []
        parts += [f"up:{self.up}"] if self.up != "+z" else []
        return ",".join(parts) or AS_READ

    @property
    def parts(self) -> int:
        """How many things it changes."""
        return self.world_to_camera + (self.camera != "+x+y+z") + (self.world != "+x+y+z") + (self.scale != 1)

    def pose(self, camera_to_world: np.ndarray) -> np.ndarray:
        """A (4, 4) pose as read, corrected."""
        pose = np.linalg.inv(camera_to_world) if self.world_to_camera else camera_to_world.copy()
        world = matrix(self.world)
        pose[:3, :3] = world @ pose[:3, :3] @ matrix(self.camera).T
        pose[:3, 3] = self.scale * world @ pose[:3, 3]
        pose[:3] = upright(self.up) @ pose[:3]
        return pose

    def mesh(self, mesh: RawMesh) -> RawMesh:
        """The mesh that goes with the corrected poses."""
        return mesh if self.up == "+z" else replace(mesh, vertices=mesh.vertices @ upright(self.up).T)

    def cameras(self, cameras: Sequence[Camera]) -> list[Camera]:
        """Cameras with corrected poses."""
        return [replace(camera, camera_to_world=self.pose(camera.camera_to_world)) for camera in cameras]

    def frames(self, frames: Sequence[Frame]) -> list[Frame]:
        """Frames with corrected poses."""
        return [replace(f, camera=c) for f, c in zip(frames, self.cameras([f.camera for f in frames]), strict=True)]


def matrix(axes: str) -> np.ndarray:
    """'+x-z+y' as the (3, 3) rotation whose rows pick those axes."""
    return np.array([[(s + "1") * (name == a) and float(s + "1") or 0.0 for name in "xyz"]
                     for s, a in zip(axes[::2], axes[1::2], strict=True)])  # fmt: skip


def upright(up: str) -> np.ndarray:
    """The (3, 3) rotation that turns the signed axis `up` to +Z."""
    return matrix({"+z": "+x+y+z", "-z": "+x-y-z", "+y": "+x-z+y", "-y": "+x+z-y", "+x": "-z+y+x", "-x": "+z+y-x"}[up])


def all_axes() -> list[str]:
    """The 24 rotations that map axes onto axes, as signed axes; the identity first."""
    every = ["".join(s + a for s, a in zip(signs, order, strict=True))
             for order in itertools.permutations("xyz") for signs in itertools.product("+-", repeat=3)]  # fmt: skip
    turns = [axes for axes in every if np.linalg.det(matrix(axes)) > 0]
    return sorted(turns, key=lambda axes: (np.abs(matrix(axes) - np.eye(3)).sum(), axes))


def parse(text: str) -> Convention:
    """The convention that `text` writes; raises `BadInputError` where it can't be read."""
    convention = Convention()
    for part in filter(None, (p.strip() for p in text.split(","))):
        part = NAMED.get(part, part)
        kind, _, value = part.partition(":")
        if part == AS_READ:
            continue
        if part == "world-to-camera":
            convention = replace(convention, world_to_camera=True)
        elif kind in ("camera", "world") and re.fullmatch(r"([+-][xyz]){3}", value) and value in all_axes():
            convention = replace(convention, camera=value) if kind == "camera" else replace(convention, world=value)
        elif kind == "up" and re.fullmatch(r"[+-][xyz]", value):
            convention = replace(convention, up=value)
        elif kind == "scale" and 0 < float_of(value) < math.inf:
            convention = replace(convention, scale=float(value))
        else:
            raise BadInputError(
                f"Convention '{text}' can't be read at '{part}'; join parts such as opencv, "
                "world-to-camera, camera:+x-y-z, world:+x-z+y, up:+y or scale:0.01 by commas "
                "(axes must make a rotation)."
            )
    return convention


def alternatives() -> Iterator[Convention]:
    """Every combination of direction, camera axes and world axes, without scale."""
    for inverse, camera, world in itertools.product((False, True), CAMERAS, all_axes()):
        yield Convention(inverse, camera, world)
