"""Glass and what is cut out by a mask: objects whose frames show what lies behind them.

Along a view ray, something transparent shows its own light and a share tau of what is behind; through holes that the
mesh does not have, a frame sees what is behind and nothing else. Either way, what an element shows changes from view to
view as its background does:

    I(x, wo) = D + tau b(x, wo)        b: the light field behind the object, along the ray

with one tau for the object (glass), or 0 or 1 for each element (cut out). D is free for each element, so a background
of the object's own colour decides nothing. One half of each element's views fits, the other half tests.
"""

from dataclasses import dataclass

import numpy as np

from ...fit.lobe_fit import LobeFit, huber
from ...fit.params import LOBE_FIT
from ...fit.problem import DenseProblem, Problem
from ...fit.transmission import SeeThrough
from ...light.field import LightField
from ...significance import LEVELS


@dataclass(frozen=True)
class SeeThroughParams:
    """Of `see_through` (`see-through` in the ablation).

    Rays count that lie `LEVELS.sigmas` of the mesh's noise within an object's outline: a bottle cap of 4 cm, inflated
    by a scan's error, passed for glass, as its outermost centimetre truly showed the room behind. The held-out cost
    must fall by `LEVELS.gain` against the best opaque model; opaque objects in five rooms gained up to 0.08.

    Attributes
    ----------
    surfaces : int
        Of one object, crossed by a ray, at most.
    least_told : float
        At least `LEVELS.few` elements, and this share of those that were looked at, must have a background that frames
        know. A brass pole three pixels wide passed for glass by 6 % of its elements, whose pixels truly mixed it with
        the wall behind; glass and foliage had 78 to 91 %. So much must also pass: opaque objects in those rooms passed
        up to 0.02.
    """

    surfaces: int = 8
    least_told: float = 0.1


SEE_THROUGH = SeeThroughParams()


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
    active = np.arange(len(element))
    for _ in range(SEE_THROUGH.surfaces):
        hits = scene.intersect(origin[active], onward[active])
        hit_element = field.elements(hits)
        same_object = (hit_element >= 0) & (field.mesh.object_id[hits.triangle] == object_id)
        exited = np.flatnonzero(~same_object)
        at = active[exited]
        radiance[at] = field.arriving(hits.part(exited), hit_element[exited], onward[at])
        known[at] = np.where(hit_element[exited] >= 0, seen[hit_element[exited]], field.environment.seen)
        step = hits.distance[same_object] + 4 * scene.offset
        active = active[same_object]
        if not len(active):
            break
        origin[active] += step[:, None] * onward[active]
        surfaces[active] += 1
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
        active = np.flatnonzero(inside)
        origin = field.atlas.position[element[active]] + margin * (side[active] + direction[active])
        hits = field.scene.intersect(origin.astype(np.float32), np.ascontiguousarray(-direction[active], np.float32))
        inside[active] = (hits.triangle >= 0) & (field.mesh.object_id[hits.triangle] == object_id)
    return inside


def judge(problem: Problem, behind: Behind, lobe: LobeFit | None, scale: float) -> SeeThrough | None:
    """Whether what is behind explains an object's frames better than its own light; None if known for too few elements.

    Parameters
    ----------
    lobe : LobeFit or None
        Of the opaque model that was chosen for it, if it has one.
    scale : float
        Standard deviation of the relative residual.
    """
    dense = DenseProblem(problem)
    valid = dense.laid(behind.known)
    usable = valid.sum(0) >= LEVELS.views
    if usable.sum() < max(LEVELS.few, SEE_THROUGH.least_told * len(usable)):
        return None
    b = dense.relative(behind.radiance)[..., usable]
    dense, valid = dense.part(usable), valid[:, usable]
    rank = np.cumsum(valid, 0)
    first_half = valid * (rank <= valid.sum(0) / 2)
    radiance = dense.I[:, 0]
    opaque = [radiance]
    if lobe is not None:
        lobe_light = dense.lobe(dense.at(lobe.phi))
        opaque.append(radiance - lobe.psi.astype(np.float32)[:, None, None] * lobe_light.A[:, 0] - lobe_light.B[:, 0])
    costs = {name: np.zeros(int(usable.sum())) for name in ("plain", "lobe", "glass", "holes")}
    transmissions, holes = [], []
    for train in (first_half, valid - first_half):
        test = valid - train
        plain, background = _centred(radiance, train), _centred(b, train)
        costs["plain"] += _cost(plain, test, scale)
        costs["lobe"] += _cost(_centred(opaque[-1], train), test, scale)
        tau = _transmission(plain, background, train, scale)
        costs["glass"] += _cost(plain - tau * background, test, scale)
        # A hole shows the background's changes in full; each element's first half of views decides whether it is one.
        hole = _cost(plain - background, train, scale) < _cost(plain, train, scale)
        costs["holes"] += _cost(plain - hole * background, test, scale)
        transmissions.append(tau)
        holes.append(float(hole.mean()))
    best = costs["plain"] if costs["plain"].sum() <= costs["lobe"].sum() else costs["lobe"]
    cut_out = bool(costs["holes"].sum() < costs["glass"].sum())
    cost = costs["holes"] if cut_out else costs["glass"]
    saved = best - cost
    return SeeThrough(
        transmission=float(np.mean(holes if cut_out else transmissions)),
        surfaces=float(behind.surfaces[behind.known].mean()),
        cut_out=cut_out,
        score=float(cost.sum() / max(costs["plain"].sum(), 1e-30)),
        gain=float(saved.sum() / max(best.sum(), 1e-30)),
        sigmas=float(saved.mean() / max(saved.std() / np.sqrt(len(saved)), 1e-30)),
    )


def is_sure(see_through: SeeThrough) -> bool:
    """Whether the object is to be taken for transparent or cut out."""
    return (
        see_through.transmission >= SEE_THROUGH.least_told
        and see_through.gain > LEVELS.gain
        and see_through.sigmas > LEVELS.sigmas
    )


def _centred(values: np.ndarray, train: np.ndarray) -> np.ndarray:
    """Values ((3, v, g)) less each element's mean over the views `train` ((v, g))."""
    return values - ((values * train).sum(1) / np.maximum(train.sum(0), 1e-9))[:, None]


def _cost(residual: np.ndarray, views: np.ndarray, scale: float) -> np.ndarray:
    """Robust cost of each element over some views, (g,)."""
    return (huber(np.sqrt(np.square(residual).mean(0)), scale) * views).sum(0, dtype=np.float64)


def _transmission(values: np.ndarray, behind: np.ndarray, train: np.ndarray, scale: float) -> float:
    """Share of the background in the values, by iteratively reweighted least squares."""
    tau, weight = 0.0, train
    for _ in range(LOBE_FIT.rounds):
        tau = float(np.clip((weight * values * behind).sum() / max((weight * behind**2).sum(), 1e-20), 0, 1))
        size = np.sqrt(np.square(values - tau * behind).mean(0))
        weight = train * np.minimum(1, LEVELS.outlier * scale / np.maximum(size, 1e-12))
    return tau
