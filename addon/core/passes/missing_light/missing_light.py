"""Light that a scan without objects lacks: patches that the sensor clipped, and what comes in by the mesh's holes.

Most of a room's light may come from there. In a living room as a phone gives it, one ceiling lamp is clipped in every
frame, the other hangs in a part of the ceiling that no frame saw: the light that was measured is a third of all.
Nothing is done unless albedos above 1 tell that light is missing.
"""

from dataclasses import dataclass

import numpy as np

from ...light.contributions import contributions
from ...light.directions import cosine_patterns, turned
from ...light.environment import Environment
from ...light.few_elements import evened, from_sun, irradiance_at, spread_over
from ...light.field import LightField
from ...light.lamps import Lamp, find_seen
from ...light.openings import CELLS, Openings, exits
from ...light.params import GATHER
from ...luminance import LUMINANCE
from ...parallel import for_blocks
from ...scene.atlas import Atlas
from ...scene.params import COPLANAR
from ...significance import LEVELS
from .params import MISSING
from .solve import Unknown, in_one_plane, solve


@dataclass(frozen=True)
class MissingLight:
    """What was solved for.

    Attributes
    ----------
    lamps : tuple of Lamp
        Patches of which the room's light asks for clearly more than was measured.
    radiance : dict of (3,) float
        Of every patch, by object.
    brighter : frozenset of int
        Other objects that give more than they could reflect of all this light.
    environment : Environment
        With what was solved for where it is clipped.
    shut : (n,) bool
        Elements of faces that close the mesh and that no frame saw: what they send was solved for like openings.
    """

    lamps: tuple[Lamp, ...]
    radiance: dict[int, np.ndarray]
    brighter: frozenset[int]
    openings: Openings
    environment: Environment
    shut: np.ndarray
    notes: tuple[str, ...]


def is_missing(field: LightField, good: np.ndarray, seed: int) -> bool:
    """Whether the light of a room, as it was found, is too little for what it reflects."""
    element = _sample(field, good, seed)
    if len(element) < LEVELS.many:
        return False
    rho = np.pi * field.radiance[element] / np.maximum(irradiance_at(field, element, seed), 1e-12)
    return float((rho.max(1) > 1).mean()) > MISSING.alarm


def find_missing_light(
    field: LightField, good: np.ndarray, patches: list[int], seed: int, windows: np.ndarray | None = None
) -> MissingLight:
    """Solve for the light of clipped patches, and of all that is seen through the mesh's openings.

    Parameters
    ----------
    field : LightField
        With L_d, dark where no frame saw it, and no lamps. With its sun, if there is one.
    good : (n,) bool
        Elements whose L_d is to be believed.
    patches : list of int
        Objects that were set apart as the sensor clipped them.
    windows : (CELLS,) bool, optional
        `Openings.windows`.
    """
    atlas, windows = field.atlas, np.zeros(CELLS, bool) if windows is None else windows
    radiance = evened(field)
    own = {one: atlas.object_id == one for one in patches}
    bound = {one: np.median(radiance[which], 0).astype(np.float64) for one, which in own.items()}
    shut = unseen_closing(field)
    hidden = np.isin(atlas.object_id, patches) | shut
    element = _sample(field, good & ~hidden, seed)
    radiance[hidden] = 0
    received = irradiance_at(field.with_openings(None).with_light(radiance, Environment.dark()), element, seed)
    sky = field.environment
    part = sky.clipped_parts(MISSING.sky)
    cell, through, shown, by_part = _through_cells(field, part, shut, windows, element, seed)
    received = received + shown
    thrown = contributions(field, element, [[one] for one in patches], seed)
    same = same_lamps(atlas, list(own.values()))
    usual = _daylight(np.median(radiance[element], 0).astype(np.float64))
    # What hardly any element sees says nothing, and lights nothing.
    told, lit = (given.mean(0) >= MISSING.least_seen for given in (through, by_part))
    level = sky.mean_of(part, len(lit))
    received = received + through[:, ~told].sum(1)[:, None] * usual + by_part[:, ~lit] @ level[~lit]
    told_by = np.reshape(list(bound.values()), (-1, 3))
    least = np.reshape([np.median(told_by[w > 0] / w[w > 0, None], 0) for w in same.T], (-1, 3))
    clipped, cells = np.concatenate([least, level[lit]]), int(told.sum())
    unknown = Unknown(
        np.concatenate([thrown @ same, by_part[:, lit], through[:, told]], 1),
        np.concatenate([clipped, np.full((cells, 3), 1e-6)]),
        np.concatenate([least, _daylight(level[lit]), np.tile(usual, (cells, 1))]),
    )
    sent = field.radiance[element].astype(np.float64)
    pairs = in_one_plane(atlas.position[element], atlas.normal[element], seed)
    found, spread = solve(sent, received, unknown, pairs)

    of_patch = same @ found[: len(least)]
    solved = dict(zip(patches, of_patch, strict=True))
    E = received + unknown.contribution @ found
    of_all = thrown * (of_patch @ LUMINANCE) / (E @ LUMINANCE)[:, None]
    sunlit = {one for one, which in own.items() if _mostly_lit(field, which)}
    strong = (of_all > LEVELS.gain).sum(0) >= LEVELS.many
    lamps = tuple(
        Lamp(one, solved[one].astype(np.float32), False, clipped=True, spread=spread)
        for k, one in enumerate(patches)
        if strong[k] and (solved[one] > MISSING.lamp * bound[one]).all() and one not in sunlit
    )
    by_opening = np.tile(usual, (len(through.T), 1))
    by_opening[told] = found[len(clipped) :]
    level[lit] = found[len(least) : len(clipped)]
    low, size = field.outer_box
    share = float((unknown.contribution[:, len(least) :] @ found[len(least) :]).sum() / E.sum())
    openings = Openings(low, size, by_opening[cell].astype(np.float32), share, windows)
    note = (
        f"{share:.0%} of the light comes in by openings of the mesh, from where it was solved from what it throws: "
        "what no frame saw there may be a lamp."
    )
    brighter = frozenset(lamp.object_id for lamp in find_seen(atlas.object_id[element], sent, E))
    notes = (note,) if share >= LEVELS.gain else ()
    return MissingLight(lamps, solved, brighter, openings, sky.with_clipped(part, level), shut, notes)


def _daylight(radiance: np.ndarray) -> np.ndarray:
    """Of the luminance of some radiances ((..., 3)), white: nothing comes from outside that is as warm as a room."""
    return np.repeat((radiance @ LUMINANCE)[..., None], 3, -1)


def _mostly_lit(field: LightField, which: np.ndarray) -> bool:
    """Whether the sun lights most of some elements, (n,) bool."""
    return 2 * from_sun(field, np.flatnonzero(which)).any(1).sum() > which.sum()


def same_lamps(atlas: Atlas, patches: list[np.ndarray]) -> np.ndarray:
    """Which patches are the same lamp, hung several times in one plane, of about one area: it gives as much light each.

    Parameters
    ----------
    patches : list of (n,) bool
        Elements of each of p.

    Returns
    -------
    (p, l) float
        Radiance of each patch where each of l lamps is of the mean radiance 1; 0 for what is another.
    """
    area = np.maximum([atlas.area[own].sum() for own in patches], 1e-12)
    centre, normal = (
        np.reshape([atlas.area[own] @ of[own] for own in patches], (-1, 3)) for of in (atlas.position, atlas.normal)
    )
    centre = centre / area[:, None]
    normal = normal / np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-12)
    left, lamps = np.ones(len(patches), bool), []
    for one in np.argsort(-area, kind="stable"):
        if left[one]:
            # Normals of small patches are off by degrees, which is decimetres across a room: one of the two has to do.
            away = centre - centre[one]
            height = np.minimum(np.abs(away @ normal[one]), np.abs(np.einsum("ij,ij->i", away, normal)))
            flat = height < COPLANAR.off
            alike = left & flat & (normal @ normal[one] > np.cos(COPLANAR.turn)) & (MISSING.alike * area > area[one])
            alike[one] = True
            left[alike] = False
            lamps.append(np.where(alike, area[alike].mean() / area, 0))
    return np.reshape(lamps, (len(lamps), len(patches))).T


def _sample(field: LightField, good: np.ndarray, seed: int) -> np.ndarray:
    """Good elements, spread over the surface."""
    return spread_over(field, np.flatnonzero(good), LEVELS.sample, np.random.default_rng(seed))


def unseen_closing(field: LightField) -> np.ndarray:
    """Elements of faces that close the mesh, of which no frame saw what they send: it is dark, (n,) bool."""
    closing = np.zeros(len(field.mesh.triangles), bool)
    if field.mesh.closed is not None:
        closing[field.mesh.closed] = True
    return closing[field.atlas.triangle] & ~field.radiance.any(1)


def _through_cells(
    field: LightField, part: np.ndarray, shut: np.ndarray, windows: np.ndarray, element: np.ndarray, seed: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """What comes to m elements from outside: by `windows` from the sky, else by the other cells of the box.

    Elements that are `shut` ((n,) bool) let through what comes from there.

    Returns
    -------
    unknown : (CELLS,) int
        That each cell belongs to.
    through : (m, u) float64
        E from each of those at radiance 1.
    shown : (m, 3) float64
        E from where frames tell the sky.
    by_part : (m, p) float64
        E from each clipped `part` ((h, 2h) int) at radiance 1.
    """
    side, row, column = np.unravel_index(np.arange(CELLS), (6, GATHER.cells, GATHER.cells))
    edge = -(-GATHER.cells // MISSING.merged)
    unknown = (side * edge + row // MISSING.merged) * edge + column // MISSING.merged
    low, size = field.outer_box
    sky = field.environment
    unfamiliar = sky.unfamiliar if sky.seen else np.ones(sky.observations.shape, np.float32)
    patterns = cosine_patterns(MISSING.rays, seed)
    through = np.zeros((len(element), int(unknown.max()) + 1))
    shown, by_part = np.zeros((len(element), 3)), np.zeros((len(element), int(part.max()) + 1))

    def run(block: slice) -> None:
        normal = field.atlas.normal[element[block]]
        directions = turned(patterns, normal, np.random.default_rng([seed, block.start]))[0].reshape(-1, 3)
        origins = np.repeat(field.scene.off_surface(field.atlas.position[element[block]], normal), MISSING.rays, 0)
        hits, each = field.scene.intersect(origins, directions), np.full(len(origins), np.pi / MISSING.rays)
        met, closed = hits.triangle, shut[field.elements(hits)]
        if field.mirrors and len(seen := np.flatnonzero((met >= 0) & (field.mirror_of.take(met) >= 0))):
            origins[seen], directions[seen], f0 = field.onward(hits.part(seen), directions[seen])
            further = field.scene.intersect(origins[seen], directions[seen])
            met[seen], closed[seen] = further.triangle, shut[field.elements(further)]
            each[seen] *= f0.mean(1)
        closed &= met >= 0
        out = np.flatnonzero((met < 0) | closed)
        place, way, each = out // MISSING.rays, directions[out], each[out]
        by = exits(low, size, origins[out], way)[0]
        share = np.where(closed[out], 1, np.where(windows[by], 0, sky.at(unfamiliar, way))) * each
        np.add.at(through[block], (place, unknown[by]), share)
        rest, own = each - share, sky.at(part, way)
        clipped = own >= 0
        np.add.at(by_part[block], (place[clipped], own[clipped]), rest[clipped])
        np.add.at(shown[block], place[~clipped], rest[~clipped, None] * sky(way[~clipped]))

    for_blocks(run, len(element), 64, 0)
    return unknown, through, shown, by_part
