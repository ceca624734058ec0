"""The specular stage: target frames, phi and psi of each object, and what of its median was no diffuse light."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..capture.model import Instance, Mesh
from ..lit_diffuse.accumulate import LitDiffuse
from ..material import EMITTER, LAMBERTIAN, METAL, SPECULAR, ObjectMaterial
from ..progress import Progress
from ..shading.emitters import bright_triangles
from ..shading.field import LightField
from ..shading.lamps import Lamp
from ..surface.elements import triangle_geometry
from .fit import Problem, fit_lobe
from .lobes import GRID, LobeLight, reflected_light
from .models import Choice, adopt_from_class, choose_model, metal_f0
from .samples import Samples
from .separate import specular_in_median, spread_over_object
from .targets import score_frames, target_frame

FIT_ELEMENTS = 300
FIT_VIEWS = 14
"""Elements of an object that the fit looks at, and views of each."""
LEAST_VIEWS = 4
SEPARATE_ELEMENTS = 2500
SEPARATE_VIEWS = 9
TARGET_PHI = 7
"""Index into the grid of the middle width with which highlights are foreseen (A1)."""


@dataclass(frozen=True)
class Specular:
    """What the specular stage finds.

    Attributes
    ----------
    materials : tuple of ObjectMaterial
        One for each instance, by object_id.
    specular : (n, 3) float32
        Part of each element's L_d that is specular.
    """

    materials: tuple[ObjectMaterial, ...]
    specular: np.ndarray


def pick(samples: Samples, of_object: np.ndarray, elements: int, views: int, least: int, seed: int) -> np.ndarray:
    """Indices into `samples` of up to `views` views of up to `elements` elements, sorted by element.

    Parameters
    ----------
    of_object : (k,) int
        Indices of the object's observations.
    least : int
        Elements with fewer views are left out.
    """
    rng = np.random.default_rng(seed)
    names, group, count = np.unique(samples.element[of_object], return_inverse=True, return_counts=True)
    enough = np.flatnonzero(count >= least)
    if len(enough) > elements:
        enough = rng.choice(enough, elements, replace=False)
    wanted = np.zeros(len(names), bool)
    wanted[enough] = True
    index, group = of_object[wanted[group]], group[wanted[group]]
    if not len(index):
        return index
    order = np.lexsort((rng.random(len(index)), group))
    index, group = index[order], group[order]
    start = np.concatenate([[0], np.flatnonzero(np.diff(group)) + 1])
    rank = np.arange(len(index)) - np.repeat(start, np.diff(np.concatenate([start, [len(index)]])))
    return np.sort(index[rank < views])


def _slice(light: LobeLight, part: slice) -> LobeLight:
    return LobeLight(light.A[part], light.B[part], light.mirror[part])


def _target_choice(problem: Problem, in_target: np.ndarray) -> Choice:
    """The paper's fit: one frame, one lobe; no choice of model."""
    if in_target.sum() < 3:
        return Choice(LAMBERTIAN, None, note="No frame shows enough of it.")
    return Choice(SPECULAR, fit_lobe(problem.part(in_target), "target"))


def fit_specular(
    mesh: Mesh,
    instances: tuple[Instance, ...],
    field: LightField,
    lit_diffuse: LitDiffuse,
    lamps: tuple[Lamp, ...],
    samples: Samples,
    frame_names: list[str],
    *,
    way: str = "frames",
    rays: int = 64,
    refine: int = 1,
    threads: int = 0,
    seed: int = 0,
    progress: Progress | None = None,
) -> Specular:
    """Fit every object (Haefner et al. 2021, sec. 3.3 and 3.4) and find the specular part of L_d.

    Parameters
    ----------
    way : str
        'target': the paper's single target frame and always a lobe. 'frames': many views and a choice of model.
    refine : int
        0 leaves L_d as the median gave it.

    Raises
    ------
    InterruptedRun
        From `progress`.
    """
    normals, _ = triangle_geometry(mesh)
    atlas = field.atlas
    bright = bright_triangles(field)
    glowing = {lamp.object_id: lamp for lamp in lamps}
    usable = np.flatnonzero(~samples.saturated)
    owner = atlas.object_id[samples.element[usable]]
    order = np.argsort(owner, kind="stable")
    owner, usable = owner[order], usable[order]
    picked = {}
    for i in instances:
        first, last = np.searchsorted(owner, [i.object_id, i.object_id + 1])
        if i.object_id not in glowing:
            views = 10**6 if way == "target" else FIT_VIEWS
            picked[i.object_id] = pick(samples, usable[first:last], FIT_ELEMENTS, views, LEAST_VIEWS, seed)
    every = np.concatenate([*picked.values(), np.zeros(0, np.int64)]).astype(np.int64)
    light = reflected_light(
        field, bright, normals, samples.element[every], samples.direction[every],
        rays=rays, threads=threads, seed=seed,
    )  # fmt: skip

    problems, choices, targets, start = {}, {}, {}, 0
    for object_id, index in picked.items():
        part = slice(start, start + len(index))
        start += len(index)
        choices[object_id] = Choice(LAMBERTIAN, None, note="Seen too little to look for a highlight.")
        if not len(index):
            continue
        element = samples.element[index]
        cosine = np.einsum("ij,ij->i", atlas.normal[element], samples.direction[index])
        problem = Problem(
            element, samples.radiance[index], lit_diffuse.radiance[element], _slice(light, part), cosine
        )
        problems[object_id] = problem
        scores = score_frames(
            samples.frame[index], problem.light.A[:, TARGET_PHI], problem.lit_diffuse, np.ones(len(index), bool),
            len(frame_names),
        )  # fmt: skip
        target = targets[object_id] = target_frame(scores)
        choices[object_id] = (
            choose_model(problem) if way == "frames" else _target_choice(problem, samples.frame[index] == target)
        )
        if progress is not None:
            progress.update(0.4 + 0.4 * start / max(len(every), 1))
    if way == "frames":
        choices = adopt_from_class(choices, problems, {i.object_id: i.class_name for i in instances})

    materials = []
    for i in instances:
        if i.object_id in glowing:
            lamp = glowing[i.object_id]
            radiance = tuple(float(x) for x in lamp.radiance)
            materials.append(ObjectMaterial(i.object_id, i.class_name, EMITTER, emission=radiance, note=lamp.note))
            continue
        target = targets.get(i.object_id, -1)
        name = frame_names[target] if target >= 0 else None
        materials.append(_material(i, choices[i.object_id], problems.get(i.object_id), name))

    specular = np.zeros((len(atlas), 3), np.float32)
    if refine:
        glossy = [m for m in materials if m.model == SPECULAR]
        _separate(glossy, field, bright, normals, samples, owner, usable, specular, rays, threads, seed, progress)
    return Specular(tuple(materials), specular)


def _material(instance: Instance, choice: Choice, problem: Problem | None, target: str | None) -> ObjectMaterial:
    """The description of what was chosen."""
    fit = choice.fit
    common = {
        "object_id": instance.object_id,
        "class_name": instance.class_name,
        "model": choice.model,
        "target_frame": target,
        "observations": 0 if problem is None else len(problem.element),
        "residual": None if fit is None else fit.residual,
        "residual_lambertian": None if fit is None else fit.residual_lambertian,
        "note": choice.note,
    }
    if choice.model == LAMBERTIAN:
        return ObjectMaterial(**(common | {"residual": common["residual_lambertian"]}))
    if choice.model == METAL:
        at = int(np.argmin(np.abs(GRID - fit.phi)))
        f0 = fit.psi if problem is None else metal_f0(problem, at)
        return ObjectMaterial(**common, phi=fit.phi, f0=tuple(float(x) for x in f0))
    return ObjectMaterial(**common, phi=fit.phi, psi=float(fit.psi.mean()))


def _separate(glossy, field, bright, normals, samples, owner, usable, specular, rays, threads, seed, progress) -> None:
    """Write the specular part of L_d of the glossy objects into `specular`."""
    for done, material in enumerate(glossy):
        first, last = np.searchsorted(owner, [material.object_id, material.object_id + 1])
        index = pick(samples, usable[first:last], SEPARATE_ELEMENTS, SEPARATE_VIEWS, 1, seed + 1)
        light = reflected_light(
            field, bright, normals, samples.element[index], samples.direction[index],
            rays=rays, grid=np.float32([material.phi]), threads=threads, seed=seed + 1,
        )  # fmt: skip
        lobe = material.psi * light.A[:, 0] + light.B[:, 0]
        element, part = specular_in_median(samples, index, lobe)
        own = np.flatnonzero(field.atlas.object_id == material.object_id)
        specular[own] = spread_over_object(field.atlas, own, element, part)
        if progress is not None:
            progress.update(0.8 + 0.2 * (done + 1) / len(glossy))
