"""Glass and what is cut out by a mask: objects whose frames show what lies behind them.

Along a view ray, something transparent shows its own light and a share tau of what is behind; through holes that the
mesh does not have, a frame sees what is behind and nothing else. Either way, what an element shows changes from view to
view as its background does:

    I(x, wo) = D + tau b(x, wo)        b: the light field behind the object, along the ray

with one tau for the object (glass), or 0 or 1 for each element (cut out). D is free for each element, so a background
of the object's own colour decides nothing. Half of each element's views choose, the other half judge.
"""

from dataclasses import dataclass

import numpy as np

from ...fit.lobe_fit import LobeFit, huber
from ...fit.params import LOBE_FIT
from ...fit.problem import DenseProblem, Problem
from ...fit.transmission import SeeThrough
from ...light.field import LightField
from ...significance import LEVELS
from .params import SEE_THROUGH


@dataclass(frozen=True)
class Behind:
    """What lies behind the elements of m observations.

    Attributes
    ----------
    radiance : (m, 3) float32
    known : (m,) bool
        False where no frame ever saw it.
    surfaces : (m,) int
        Of the object's own, crossed on the way.
    """

    radiance: np.ndarray
    known: np.ndarray
    surfaces: np.ndarray


def look_behind(
    field: LightField, seen: np.ndarray, element: np.ndarray, direction: np.ndarray, object_id: int, noise: float = 0.0
) -> Behind:
    """Follow each view's ray through an object.

    Parameters
    ----------
    seen : (n,) bool
        Elements that any frame saw.
    element : (m,) int
    direction : (m, 3) float32
        Unit, towards the camera.
    noise : float
        Of the mesh, in metres: what is behind counts as unknown so near the object's outline that the ray may have
        passed it by.
    """
    scene, atlas = field.scene, field.atlas
    onward = np.ascontiguousarray(-direction, np.float32)
    origin = scene.off_surface(atlas.position[element], -atlas.normal[element])
    radiance, known = np.zeros((len(element), 3), np.float32), np.zeros(len(element), bool)
    surfaces = np.ones(len(element), int)
    left = np.arange(len(element))
    for _ in range(SEE_THROUGH.surfaces):
        hits = scene.intersect(origin[left], onward[left])
        met = field.elements(hits)
        own = (met >= 0) & (field.mesh.object_id[hits.triangle] == object_id)
        through = np.flatnonzero(~own)
        at = left[through]
        radiance[at] = field.arriving(hits.part(through), met[through], onward[at])
        known[at] = np.where(met[through] >= 0, seen[met[through]], field.environment.seen)
        step = hits.distance[own] + 4 * scene.offset
        left = left[own]
        if not len(left):
            break
        origin[left] += step[:, None] * onward[left]
        surfaces[left] += 1
    if noise > 0:
        known &= _well_inside(field, element, direction, object_id, LEVELS.sigmas * noise)
    return Behind(radiance, known, surfaces)


def _well_inside(
    field: LightField, element: np.ndarray, direction: np.ndarray, object_id: int, margin: float
) -> np.ndarray:
    """Whether rays on four sides, `margin` metres from each view's, meet the object too, (m,) bool."""
    across = np.cross(direction, np.eye(3, dtype=np.float32)[np.argmin(np.abs(direction), 1)])
    across /= np.linalg.norm(across, axis=1, keepdims=True)
    up = np.cross(direction, across)
    inside = np.ones(len(element), bool)
    for side in (across, -across, up, -up):
        left = np.flatnonzero(inside)
        origin = field.atlas.position[element[left]] + margin * (side[left] + direction[left])
        hits = field.scene.intersect(origin.astype(np.float32), np.ascontiguousarray(-direction[left], np.float32))
        inside[left] = (hits.triangle >= 0) & (field.mesh.object_id[hits.triangle] == object_id)
    return inside


def judge(problem: Problem, behind: Behind, lobe: LobeFit | None, scale: float) -> SeeThrough | None:
    """Whether what is behind explains an object's frames better than anything of its own; None if nothing tells.

    Parameters
    ----------
    lobe : LobeFit or None
        Of the opaque model that was chosen for it, if it has one.
    scale : float
        Standard deviation of the relative residual.
    """
    dense = DenseProblem(problem)
    there = dense.there * dense.each(behind.known[:, None].astype(np.float32))[0]
    told = there.sum(0) >= LEVELS.views
    if told.sum() < max(LEVELS.few, SEE_THROUGH.least_told * len(told)):
        return None
    b = dense.relative(behind.radiance)[..., told]
    dense, there = dense.part(told), there[:, told]
    rank = np.cumsum(there, 0)
    first = there * (rank <= there.sum(0) / 2)
    radiance = dense.I[:, 0]
    opaque = [radiance]
    if lobe is not None:
        one = dense.lobe(dense.at(lobe.phi))
        opaque.append(radiance - lobe.psi.astype(np.float32)[:, None, None] * one.A[:, 0] - one.B[:, 0])
    costs = {name: np.zeros(int(told.sum())) for name in ("plain", "lobe", "glass", "holes")}
    passed, holes = [], []
    for train in (first, there - first):
        test = there - train
        plain, clear = _less_own(radiance, train), _less_own(b, train)
        costs["plain"] += _cost(plain, test, scale)
        costs["lobe"] += _cost(_less_own(opaque[-1], train), test, scale)
        tau = _transmission(plain, clear, train, scale)
        costs["glass"] += _cost(plain - tau * clear, test, scale)
        # A hole shows the background's changes in full; each element's first half of views says whether it is one.
        hole = _cost(plain - clear, train, scale) < _cost(plain, train, scale)
        costs["holes"] += _cost(plain - hole * clear, test, scale)
        passed.append(tau)
        holes.append(float(hole.mean()))
    best = costs["plain"] if costs["plain"].sum() <= costs["lobe"].sum() else costs["lobe"]
    cut_out = bool(costs["holes"].sum() < costs["glass"].sum())
    found = costs["holes"] if cut_out else costs["glass"]
    saved = best - found
    return SeeThrough(
        transmission=float(np.mean(holes if cut_out else passed)),
        surfaces=float(behind.surfaces[behind.known].mean()),
        cut_out=cut_out,
        score=float(found.sum() / max(costs["plain"].sum(), 1e-30)),
        gain=float(saved.sum() / max(best.sum(), 1e-30)),
        sigmas=float(saved.mean() / max(saved.std() / np.sqrt(len(saved)), 1e-30)),
    )


def is_sure(found: SeeThrough) -> bool:
    """Whether the object is to be set apart."""
    return found.transmission >= SEE_THROUGH.least_told and found.gain > LEVELS.gain and found.sigmas > LEVELS.sigmas


def _less_own(values: np.ndarray, train: np.ndarray) -> np.ndarray:
    """Values ((3, v, g)) less each element's mean over the views `train` ((v, g))."""
    return values - ((values * train).sum(1) / np.maximum(train.sum(0), 1e-9))[:, None]


def _cost(rest: np.ndarray, views: np.ndarray, scale: float) -> np.ndarray:
    """Robust cost of each element over some views, (g,)."""
    return (huber(np.sqrt(np.square(rest).mean(0)), scale) * views).sum(0, dtype=np.float64)


def _transmission(values: np.ndarray, behind: np.ndarray, train: np.ndarray, scale: float) -> float:
    """Share of the background in the values, by iteratively reweighted least squares."""
    tau, weight = 0.0, train
    for _ in range(LOBE_FIT.rounds):
        tau = float(np.clip((weight * values * behind).sum() / max((weight * behind**2).sum(), 1e-20), 0, 1))
        size = np.sqrt(np.square(values - tau * behind).mean(0))
        weight = train * np.minimum(1, LEVELS.outlier * scale / np.maximum(size, 1e-12))
    return tau
