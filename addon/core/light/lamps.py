"""Lamps that the frames see: objects that give more light than they could reflect."""

from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass

import numpy as np

from ..groups import by_number
from ..luminance import LUMINANCE
from ..scene.model import Instance, Mesh, class_names
from ..significance import LEVELS
from .params import LIGHT_FIT


@dataclass(frozen=True)
class Lamp:
    """One object that gives light.

    Attributes
    ----------
    radiance : (3,) float32
        Median over its elements, or solved for.
    seen : bool
        False: solved for from the light that it throws.
    clipped : bool
        The sensor clipped it in every frame. If it is `seen` all the same, `radiance` is a lower bound.
    spread : (2,) tuple of float or None
        Standard deviation of log albedo before and after the lamp was solved for.
    twin : int or None
        The seen lamp of its model whose radiance it takes, which explains nearly as well as `solved`, the luminance
        that was solved for.
    mixed : bool
        Frames show it, but no pixel without what is beside it.
    """

    object_id: int
    radiance: np.ndarray
    seen: bool
    clipped: bool = False
    spread: tuple[float, float] | None = None
    twin: int | None = None
    solved: float | None = None
    mixed: bool = False

    def note(self, names: Mapping[int, str]) -> str:
        """How the radiance was found, where that needs saying; `names` are those of all objects."""
        if self.seen:
            return "Clipped in every frame; its radiance is a lower bound." if self.clipped else ""
        unseen = "Frames show it only mixed with what is beside it" if self.mixed else "No frame sees it"
        note = "Clipped in every frame" if self.clipped else unseen
        note += "; solved from the light it throws"
        if self.spread is not None:
            before, after = self.spread
            note += f" (spread of log albedo {before:.3f} to {after:.3f})"
        if self.twin is not None:
            note += (
                f": {self.solved:.3g}; that of the seen '{names[self.twin]}' explains it nearly as well, and is taken"
            )
        return f"{note}."


def find_seen(object_id: np.ndarray, radiance: np.ndarray, irradiance: np.ndarray) -> list[Lamp]:
    """Objects whose albedo pi L_d / E would have to be above `emitter_albedo`.

    By a sample of elements: their objects ((m,) int), L_d and E there ((m, 3) float32 each).
    """
    luminance, received = radiance @ LUMINANCE, irradiance @ LUMINANCE
    lamps = []
    for number, members in by_number(object_id).items():
        if np.median(np.pi * luminance[members] / np.maximum(received[members], 1e-12)) > LIGHT_FIT.emitter_albedo:
            lamps.append(Lamp(number, np.median(radiance[members], 0), True))
    return lamps


@dataclass(frozen=True)
class LampKinds:
    """Which objects are of one kind.

    Attributes
    ----------
    class_of : dict of str
        The class of each object that the capture names; empty where it gives none.
    model : dict of int
        Of each object the first that would be the same lamp hung once more, or its own number.
    """

    class_of: dict[int, str]
    model: dict[int, int]

    def classes(self) -> dict[str, list[int]]:
        """The objects of each class that is known."""
        members: dict[str, list[int]] = {}
        for number, name in self.class_of.items():
            if name:
                members.setdefault(name, []).append(number)
        return members


def lamp_kinds(mesh: Mesh, instances: Iterable[Instance], noise: float = 0.0) -> LampKinds:
    """Classes as the capture gives them, and as models those of a class that are of about one size.

    A scan's `noise` along its normals (metres) is allowed for.
    """
    size, class_of = radius_of_gyration(mesh), class_names(instances)
    kinds = LampKinds(class_of, {number: number for number in class_of})
    for members in kinds.classes().values():
        firsts: list[int] = []
        for number in members:
            radius = size[number] if number < len(size) else 0.0
            tolerance = LIGHT_FIT.same * radius + LEVELS.likely * noise
            alike = [i for i in firsts if abs(radius - size[i]) <= tolerance] if radius else []
            if alike:
                kinds.model[number] = alike[0]
            elif radius:
                firsts.append(number)
    return kinds


def radius_of_gyration(mesh: Mesh) -> np.ndarray:
    """Root mean square distance of each object's surface from its centroid in metres, (objects,) float64.

    A scan's noise changes it less than an area, as that grows with every triangle that is tilted.
    """
    area, middle = mesh.geometry[1], mesh.vertices[mesh.triangles].mean(1, dtype=np.float64)
    total = np.maximum(np.bincount(mesh.object_id, area), 1e-30)
    centroid = np.stack([np.bincount(mesh.object_id, area * middle[:, k]) / total for k in range(3)], 1)
    square_distance = ((middle - centroid[mesh.object_id]) ** 2).sum(1)
    return np.sqrt(np.bincount(mesh.object_id, area * square_distance) / total)


def of_shining_class(lamps: Collection[Lamp], clean: np.ndarray, kinds: LampKinds) -> dict[int, float]:
    """Objects of a class of which most that frames show unmixed are lamps, with the median luminance of those.

    The capture has to give classes.

    Parameters
    ----------
    lamps : collection of Lamp
        Those seen.
    clean : (m,) int
        Objects that have an element whose L_d rests on clean observations, each at least once.
    """
    luminance = {lamp.object_id: float(lamp.radiance @ LUMINANCE) for lamp in lamps}
    shown_objects = set(np.unique(clean).tolist())
    luminance_of: dict[int, float] = {}
    for members in kinds.classes().values():
        seen = shown_objects & set(members)
        shining = [luminance[i] for i in seen if i in luminance]
        if len(shining) * 2 > len(seen):
            luminance_of |= dict.fromkeys(members, float(np.median(shining)))
    return luminance_of


def mixed_lamps(lamps: Collection[Lamp], clean: np.ndarray) -> list[int]:
    """Seen lamps whose radiance no pixel shows unmixed; `clean` as in `of_shining_class`.

    Their pixels hold what is beside them as well. So such a lamp's radiance is to be solved for, too, and what only
    stands beside one is none.
    """
    shown_objects = set(np.unique(clean).tolist())
    return [lamp.object_id for lamp in lamps if lamp.seen and lamp.object_id not in shown_objects]
