"""Lamps that the frames see: objects that give more light than they could reflect."""

from collections.abc import Collection, Mapping
from dataclasses import dataclass

import numpy as np

from ..groups import by_number
from ..luminance import LUMINANCE
from ..scene.elements import triangle_geometry
from ..scene.model import Instance, Mesh
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
        told = "Clipped in every frame" if self.clipped else unseen
        told += "; solved from the light it throws"
        if self.spread is not None:
            before, after = self.spread
            told += f" (spread of log albedo {before:.3f} to {after:.3f})"
        if self.twin is not None:
            told += (
                f": {self.solved:.3g}; that of the seen '{names[self.twin]}' explains it nearly as well, and is taken"
            )
        return f"{told}."


def find_seen(object_id: np.ndarray, radiance: np.ndarray, irradiance: np.ndarray) -> list[Lamp]:
    """Objects whose albedo pi L_d / E would have to be above `emitter_albedo`.

    Parameters
    ----------
    object_id : (m,) int
        Of a sample of elements.
    radiance, irradiance : (m, 3) float32
        L_d and E there.
    """
    luminance, received = radiance @ LUMINANCE, irradiance @ LUMINANCE
    lamps = []
    for one, own in by_number(object_id).items():
        if np.median(np.pi * luminance[own] / np.maximum(received[own], 1e-12)) > LIGHT_FIT.emitter_albedo:
            lamps.append(Lamp(one, np.median(radiance[own], 0), True))
    return lamps


def of_shining_class(lamps: Collection[Lamp], clean: np.ndarray, instances: tuple[Instance, ...]) -> dict[int, float]:
    """Objects of a class of which most that frames show unmixed are lamps, with the median luminance of those.

    The capture has to tell classes.

    Parameters
    ----------
    lamps : collection of Lamp
        Those seen.
    clean : (m,) int
        Objects that have an element whose L_d rests on clean observations, each at least once.
    """
    luminance = {lamp.object_id: float(lamp.radiance @ LUMINANCE) for lamp in lamps}
    members: dict[str, list[int]] = {}
    for one in instances:
        members.setdefault(one.class_name, []).append(one.object_id)
    shown = set(np.unique(clean).tolist())
    found: dict[int, float] = {}
    for name, own in members.items():
        seen = shown & set(own)
        shining = [luminance[i] for i in seen if i in luminance]
        if name and len(shining) * 2 > len(seen):
            found |= dict.fromkeys(own, float(np.median(shining)))
    return found


def mixed_lamps(lamps: Collection[Lamp], clean: np.ndarray) -> list[int]:
    """Seen lamps whose radiance no pixel shows unmixed.

    Their pixels hold what is beside them as well. So a lamp's radiance is to be solved for, too, and what only stands
    beside one is none.

    Parameters
    ----------
    clean : (m,) int
        As in `of_shining_class`.
    """
    shown = set(np.unique(clean).tolist())
    return [lamp.object_id for lamp in lamps if lamp.seen and lamp.object_id not in shown]


def lamp_models(mesh: Mesh, instances: tuple[Instance, ...]) -> dict[int, int]:
    """Which objects would be the same lamp hung several times: of one class that was told, and of about the same area.

    That of their triangles: the elements of a bulb are too few to measure it by.

    Returns
    -------
    dict of int
        Of each object the first that is like it, or its own number.
    """
    area = np.bincount(mesh.object_id, triangle_geometry(mesh)[1])
    model: dict[int, int] = {}
    firsts: dict[str, list[int]] = {}
    for one in instances:
        told = one.class_name and one.object_id < len(area)
        own = area[one.object_id] if told else 0.0
        known = firsts.setdefault(one.class_name, [])
        like = [i for i in known if abs(own - area[i]) <= LIGHT_FIT.same * area[i]] if own else []
        model[one.object_id] = like[0] if like else one.object_id
        if own and not like:
            known.append(one.object_id)
    return model
