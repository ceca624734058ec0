"""Triangles that were found to be objects or materials of their own, though the capture has them as parts of others."""

from __future__ import annotations

from collections import Counter
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
    """Triangles that are set apart; none, unless given.

    Attributes
    ----------
    triangle : (p,) int32
    object_id : (p,) int32
        The object that each is of now.
    mirrors : (m,) int32
        Those of the new objects that may be mirrors; the others may be lamps.
    parts : (k,) int32
        Those that are the same thing as before, of another material (`Instance.part_of`).
    """

    triangle: np.ndarray = field(default_factory=_nothing)
    object_id: np.ndarray = field(default_factory=_nothing)
    mirrors: np.ndarray = field(default_factory=_nothing)
    parts: np.ndarray = field(default_factory=_nothing)

    def __len__(self) -> int:
        return len(self.triangle)

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
        return [i for i in self.objects if i not in self.mirrors and i not in self.parts]

    def grouped(self, groups: Iterable[Sequence[int]]) -> tuple[Patches, dict[int, int]]:
        """Some of the objects alone, each group as one, numbered without gaps; and the new number of each."""
        first = min(self.objects, default=0)
        numbers = {old: first + group for group, members in enumerate(groups) for old in members}
        old = np.array(sorted(numbers), np.int32)
        new = np.array([numbers[int(i)] for i in old], np.int32)

        def renumbered(ids: np.ndarray) -> np.ndarray:
            return new[np.searchsorted(old, ids[np.isin(ids, old)])]

        mirrors, parts = (np.unique(renumbered(ids)) for ids in (self.mirrors, self.parts))
        triangle = self.triangle[np.isin(self.object_id, old)]
        return Patches(triangle, renumbered(self.object_id), mirrors, parts), numbers

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
        known = {instance.object_id: instance for instance in capture.instances}
        classes = dict.fromkeys(self.objects, LAMP) | dict.fromkeys(self.mirrors.tolist(), MIRROR)
        parts = self._parts(capture.mesh, known)
        new = tuple(parts.get(i, Instance(i, name, guess=True)) for i, name in classes.items() if i not in known)
        if not new:
            return capture
        mesh = self.mesh(capture.mesh)
        remaining = set(np.unique(mesh.object_id).tolist())
        instances = (*(instance for instance in capture.instances if instance.object_id in remaining), *new)
        return replace(capture, mesh=mesh, instances=instances)

    def _parts(self, mesh: Mesh, known: dict[int, Instance]) -> dict[int, Instance]:
        """Instances of the parts. The second parts of all chairs are a class, as what those are made of says nothing of
        the first."""
        new, first = np.unique(self.object_id, return_index=True)
        instances: dict[int, Instance] = {}
        of_whole: Counter[int] = Counter()
        for i, triangle in zip(new.tolist(), self.triangle[first], strict=True):
            if i in self.parts and i not in known:
                whole = known[int(mesh.object_id[triangle])]
                of_whole[whole.object_id] += 1
                name = f"{whole.class_name} part {1 + of_whole[whole.object_id]}"
                instances[i] = Instance(
                    i, name, whole.guess, whole.object_id if whole.part_of is None else whole.part_of
                )
        return instances
