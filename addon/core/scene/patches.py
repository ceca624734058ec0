"""Triangles that were found to be objects of their own, though the capture has them as parts of others."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, fields, replace

import numpy as np

from .model import Capture, Instance, Mesh
from .surface import Surface

LAMP, MIRROR = "lamp", "mirror"
"""Classes of their instances."""


def _nothing() -> np.ndarray:
    return np.zeros(0, np.int32)


@dataclass(frozen=True)
class Patches:
    """Triangles that are set apart.

    Attributes
    ----------
    triangle : (p,) int32
    object_id : (p,) int32
        The object that each is of now.
    mirrors : (m,) int32
        Those of the new objects that may be mirrors; the others may be lamps.
    """

    triangle: np.ndarray
    object_id: np.ndarray
    mirrors: np.ndarray = field(default_factory=_nothing)

    def __len__(self) -> int:
        return len(self.triangle)

    @staticmethod
    def none() -> Patches:
        """Where nothing is."""
        return Patches(_nothing(), _nothing())

    @staticmethod
    def together(parts: Sequence[Patches]) -> Patches:
        """Several that share no triangle and no object."""
        return Patches(*(np.concatenate([getattr(part, field.name) for part in parts]) for field in fields(Patches)))

    @property
    def objects(self) -> list[int]:
        """The new objects."""
        return [int(i) for i in np.unique(self.object_id)]

    @property
    def lamps(self) -> list[int]:
        """Those of them that may be lamps."""
        return [i for i in self.objects if i not in self.mirrors]

    def subset(self, objects: Iterable[int]) -> tuple[Patches, dict[int, int]]:
        """Those of some objects alone, numbered without gaps; and the new number of each."""
        numbers = dict(zip(sorted(objects), self.objects, strict=False))
        chosen = np.isin(self.object_id, list(numbers))
        new = np.array([numbers[int(i)] for i in self.object_id[chosen]], np.int32)
        mirrors = np.array([numbers[int(i)] for i in self.mirrors if i in numbers], np.int32)
        return Patches(self.triangle[chosen], new, mirrors), numbers

    def mesh(self, mesh: Mesh) -> Mesh:
        """A mesh with them set apart; it may lack the second sides (`Mesh.backs`)."""
        if not len(self):
            return mesh
        object_id, present = mesh.object_id.copy(), self.triangle < len(mesh.object_id)
        object_id[self.triangle[present]] = self.object_id[present]
        return replace(mesh, object_id=object_id)

    def surface(self, surface: Surface) -> Surface:
        """A surface with them set apart."""
        if not len(self):
            return surface
        mesh = self.mesh(surface.mesh)
        return replace(
            surface, mesh=mesh, atlas=replace(surface.atlas, object_id=mesh.object_id[surface.atlas.triangle])
        )

    def capture(self, capture: Capture) -> Capture:
        """A capture with them set apart; as it is where they are already."""
        known_ids = {instance.object_id for instance in capture.instances}
        classes = dict.fromkeys(self.objects, LAMP) | dict.fromkeys(self.mirrors.tolist(), MIRROR)
        new = tuple(Instance(i, name, guess=True) for i, name in classes.items() if i not in known_ids)
        if not new:
            return capture
        mesh = self.mesh(capture.mesh)
        remaining = set(np.unique(mesh.object_id).tolist())
        instances = (*(instance for instance in capture.instances if instance.object_id in remaining), *new)
        return replace(capture, mesh=mesh, instances=instances)
