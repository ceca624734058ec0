"""Light that a scan without objects lacks: patches that the sensor clipped, and what comes in by the mesh's holes.

Most of a room's light may come from there. In a living room as a phone gives it, one ceiling lamp is clipped in every
frame, the other hangs in a part of the ceiling that no frame saw: the light that was measured is a third of all.
"""

from dataclasses import dataclass

import numpy as np

from ...light.contributions import contributions
from ...light.directions import cosine_patterns, turned
from ...light.environment import Environment
from ...light.few_elements import by_sun, filled_radiance, irradiance_at, mostly_lit, spread_over
from ...light.field import LightField
from ...light.joint_fit import Unknown, in_one_plane, solve_for_some
from ...light.lamps import Lamp, find_seen
from ...light.openings import CELLS, Openings, exits
from ...light.params import GATHER
from ...luminance import LUMINANCE
from ...parallel import for_blocks
from ...scene.atlas import Atlas
from ...scene.closed_mesh import is_outward
from ...scene.params import COPLANAR
from ...significance import LEVELS


@dataclass(frozen=True)
class MissingLightParams:
    """Of `missing_light`.

    Attributes
    ----------
    gain : float
        Share by which it must lower the spread of log albedo within planes to be believed in. In seven rooms with HDR
        frames and fused meshes it does so by .35, .18 and .11 where the albedo gains or stays, by .04 or less in the
        four where it loses; in nine phone-made ones by .20 to .59. Albedos above 1 in 5 % of the elements, the
        criterion before, told of a loss of 6 dB and not of a gain of 10.
    rays : int
        Of each of them into its hemisphere, to find through which cells it sees out.
    merged : int
        Cells along either axis that are one unknown.
    sky : float
        Radians either way of the parts in which clipped sky is solved for.
    least_seen : float
        Mean irradiance that an unknown of radiance 1 gives, below which it is left at the room's own radiance.
    alike : float
        Times the area of another patch in its plane up to which one is the same lamp (`same_lamps`). A lamp's edge is
        off by an element or a triangle of the scan: spots of .0062 and .0092 square metres came out at .006 to .021.
    lamp : float
        Times its clipped value, in each channel, that the room's light must ask for of a patch that is called a lamp.
    """

    gain: float = 0.07
    rays: int = 2048
    merged: int = 2
    sky: float = float(np.radians(30))
    least_seen: float = 2e-4
    alike: float = 3.0
    lamp: float = 2.0


MISSING = MissingLightParams()


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
    sun : (3,) float64
        Times the irradiance of the field's sun: the light that it throws asks for that.
    spread : (2,) tuple of float
        Mean deviation of log albedo within planes if openings are as bright as the room and patches as they were
        measured, and under this light.
    """

    lamps: tuple[Lamp, ...]
    radiance: dict[int, np.ndarray]
    brighter: frozenset[int]
    openings: Openings
    environment: Environment
    shut: np.ndarray
    sun: np.ndarray
    spread: tuple[float, float]
    notes: tuple[str, ...]

    @property
    def believed(self) -> bool:
        """Whether it tells clearly more of what the room reflects than that nothing is missing."""
        before, after = self.spread
        return after < (1 - MISSING.gain) * before


def find_missing_light(
    field: LightField,
    good: np.ndarray,
    patches: list[int],
    seed: int,
    windows: np.ndarray | None = None,
    sunlit: np.ndarray | None = None,
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
    sunlit : (n,) bool, optional
        Elements that send more than frames show, as the field's sun is on them. That is solved for with all the rest.
    """
    atlas, windows = field.atlas, np.zeros(CELLS, bool) if windows is None else windows
    radiance = filled_radiance(field)
    masks = [atlas.object_id == patch for patch in patches]
    bounds = np.reshape([np.median(radiance[mask], 0).astype(np.float64) for mask in masks], (-1, 3))
    shut = unseen_closing(field)
    sunlit = np.zeros(len(atlas), bool) if sunlit is None else sunlit
    hidden = np.isin(atlas.object_id, patches) | shut | sunlit
    element = spread_over(field, np.flatnonzero(good & ~hidden), LEVELS.sample, np.random.default_rng(seed))
    of_factor = by_sun(field, radiance, sunlit, element, seed)
    radiance[hidden] = 0
    lit_by_known = field.with_openings(None).with_light(radiance, Environment.dark())
    received = irradiance_at(lit_by_known.with_sun(None) if sunlit.any() else lit_by_known, element, seed)
    sky = field.environment
    part = sky.clipped_parts(MISSING.sky)
    cell, through, from_sky, by_part = _through_cells(field, part, shut, windows, element, seed)
    received = received + from_sky
    by_patch = contributions(field, element, [[patch] for patch in patches], seed)
    lamp_of = same_lamps(atlas, masks)
    daylight = _daylight(np.median(radiance[element], 0).astype(np.float64))
    # What hardly any element sees says nothing, and lights nothing.
    usable_cells, usable_parts = (contribution.mean(0) >= MISSING.least_seen for contribution in (through, by_part))
    level = sky.mean_of(part, len(usable_parts))
    received = (
        received
        + through[:, ~usable_cells].sum(1)[:, None] * daylight
        + by_part[:, ~usable_parts] @ level[~usable_parts]
    )
    patch_bounds = np.reshape([np.median(bounds[w > 0] / w[w > 0, None], 0) for w in lamp_of.T], (-1, 3))
    lower_bounds, cells = np.concatenate([patch_bounds, level[usable_parts]]), int(usable_cells.sum())
    by_white = np.concatenate([by_patch @ lamp_of, by_part[:, usable_parts], through[:, usable_cells]], 1)
    sources, of_sun = by_white.shape[1], np.ones((of_factor.shape[1], 3))
    unknown = Unknown(
        by_white,
        of_factor,
        np.concatenate([lower_bounds, np.full((cells, 3), 1e-6), 1e-6 * of_sun]),
        np.concatenate([patch_bounds, _daylight(level[usable_parts]), np.tile(daylight, (cells, 1)), of_sun]),
    )
    sent = field.radiance[element].astype(np.float64)
    pairs = in_one_plane(atlas.position[element], atlas.normal[element], seed)
    in_sun = np.array([mostly_lit(field, mask) for mask in masks], bool)

    def shines(of_lamp: np.ndarray) -> np.ndarray:
        """The patches that send clearly more than was measured, and not as the sun lights them, (p,) bool."""
        return (lamp_of @ of_lamp > MISSING.lamp * bounds).all(1) & ~in_sun

    def believed(radiances: np.ndarray) -> np.ndarray:
        """Not a highlight, or what lamps light: a patch that hardly lights the room would fit anything."""
        of_lamp = radiances[: len(patch_bounds)]
        E = received + unknown.irradiance(radiances)
        lamps = _prominent(by_white[:, : len(of_lamp)], of_lamp, E) & (lamp_of[shines(of_lamp)] > 0).any(0)
        return np.concatenate([lamps, np.ones(len(radiances) - len(lamps), bool)])

    radiances, spread = solve_for_some(sent, received, unknown, pairs, believed)
    patch_radiance = lamp_of @ radiances[: len(patch_bounds)]
    solved = dict(zip(patches, patch_radiance, strict=True))
    E = received + unknown.irradiance(radiances)
    lamp_patches = _prominent(by_patch, patch_radiance, E) & shines(radiances[: len(patch_bounds)])
    lamps = tuple(
        Lamp(patch, solved[patch].astype(np.float32), False, clipped=True, spread=spread)
        for patch, lamp in zip(patches, lamp_patches, strict=True)
        if lamp
    )
    opening_radiance = np.tile(daylight, (len(through.T), 1))
    opening_radiance[usable_cells] = radiances[len(lower_bounds) : sources]
    level[usable_parts] = radiances[len(patch_bounds) : len(lower_bounds)]
    low, size = field.outer_box
    outside = slice(len(patch_bounds), sources)
    share = float((by_white[:, outside] @ radiances[outside]).sum() / E.sum())
    openings = Openings(low, size, opening_radiance[cell].astype(np.float32), share, windows)
    note = (
        f"{share:.0%} of the light comes in by openings of the mesh, from where it was solved from what it throws: "
        "what no frame saw there may be a lamp."
    )
    brighter = frozenset(lamp.object_id for lamp in find_seen(atlas.object_id[element], sent, E))
    notes = (note,) if share >= LEVELS.gain else ()
    sun = radiances[-1] if sunlit.any() else np.ones(3)
    return MissingLight(lamps, solved, brighter, openings, sky.with_clipped(part, level), shut, sun, spread, notes)


def _prominent(contribution: np.ndarray, radiance: np.ndarray, irradiance: np.ndarray) -> np.ndarray:
    """Which of k sources ((m, k), (k, 3)) give a tenth of all E ((m, 3)) at many of the m elements, (k,) bool."""
    share = contribution * (radiance @ LUMINANCE) / (irradiance @ LUMINANCE)[:, None]
    return (share > LEVELS.gain).sum(0) >= LEVELS.many


def _daylight(radiance: np.ndarray) -> np.ndarray:
    """Of the luminance of some radiances ((..., 3)), white: nothing comes from outside that is as warm as a room."""
    return np.repeat((radiance @ LUMINANCE)[..., None], 3, -1)


def same_lamps(atlas: Atlas, patches: list[np.ndarray]) -> np.ndarray:
    """Which patches are the same lamp, hung several times in one plane with about one area: each has the same radiance.

    Parameters
    ----------
    patches : list of (n,) bool
        Elements of each of p.

    Returns
    -------
    (p, l) float
        Radiance of each patch where each of l lamps is of the mean radiance 1; 0 for what is another.
    """
    area = np.maximum([atlas.area[mask].sum() for mask in patches], 1e-12)
    centre, normal = (
        np.reshape([atlas.area[mask] @ values[mask] for mask in patches], (-1, 3))
        for values in (atlas.position, atlas.normal)
    )
    centre = centre / area[:, None]
    normal = normal / np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-12)
    free, lamps = np.ones(len(patches), bool), []
    for i in np.argsort(-area, kind="stable"):
        if free[i]:
            # Normals of small patches are off by degrees, which is decimetres across a room: one of the two has to do.
            offset = centre - centre[i]
            height = np.minimum(np.abs(offset @ normal[i]), np.abs(np.einsum("ij,ij->i", offset, normal)))
            flat = height < COPLANAR.off
            alike = free & flat & (normal @ normal[i] > np.cos(COPLANAR.turn)) & (MISSING.alike * area > area[i])
            alike[i] = True
            free[alike] = False
            lamps.append(np.where(alike, area[alike].mean() / area, 0))
    return np.reshape(lamps, (len(lamps), len(patches))).T


def unseen_closing(field: LightField) -> np.ndarray:
    """Elements of faces that close the mesh towards the outside, of which no frame saw what they send, (n,) bool.

    They are dark in the `field`.
    """
    closing = np.zeros(len(field.mesh.triangles), bool)
    if field.mesh.closed is not None:
        closing[field.mesh.closed] = True
    unseen = closing[field.atlas.triangle] & ~field.radiance.any(1)
    unseen[unseen] = is_outward(field.scene, field.atlas.position[unseen], field.atlas.normal[unseen])
    return unseen


def _through_cells(
    field: LightField, part: np.ndarray, shut: np.ndarray, windows: np.ndarray, element: np.ndarray, seed: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """What comes to m elements from outside: by `windows` from the sky, else by the other cells of the box.

    Elements that are `shut` ((n,) bool) let through what comes from there. Gives the unknown that each cell belongs to,
    (CELLS,) int; E from each of those at radiance 1, (m, u); E from the sky that frames tell, (m, 3); and E from each
    clipped `part` ((h, 2h) int) at radiance 1, (m, p), float64 all.
    """
    side, row, column = np.unravel_index(np.arange(CELLS), (6, GATHER.cells, GATHER.cells))
    edge = -(-GATHER.cells // MISSING.merged)
    unknown = (side * edge + row // MISSING.merged) * edge + column // MISSING.merged
    low, size = field.outer_box
    sky = field.environment
    unfamiliar = sky.unfamiliar if sky.seen else np.ones(sky.observations.shape, np.float32)
    patterns = cosine_patterns(MISSING.rays, seed)
    through = np.zeros((len(element), int(unknown.max()) + 1))
    from_sky, by_part = np.zeros((len(element), 3)), np.zeros((len(element), int(part.max()) + 1))

    def run(block: slice) -> None:
        normal = field.atlas.normal[element[block]]
        directions = turned(patterns, normal, np.random.default_rng([seed, block.start]))[0].reshape(-1, 3)
        origins = np.repeat(field.scene.off_surface(field.atlas.position[element[block]], normal), MISSING.rays, 0)
        hits, weight = field.scene.intersect(origins, directions), np.full(len(origins), np.pi / MISSING.rays)
        triangle, closed = hits.triangle, shut[field.elements(hits)]
        if field.mirrors and len(mirrored := np.flatnonzero((triangle >= 0) & (field.mirror_of.take(triangle) >= 0))):
            origins[mirrored], directions[mirrored], f0 = field.onward(hits.part(mirrored), directions[mirrored])
            further = field.scene.intersect(origins[mirrored], directions[mirrored])
            triangle[mirrored], closed[mirrored] = further.triangle, shut[field.elements(further)]
            weight[mirrored] *= f0.mean(1)
        closed &= triangle >= 0
        escaped = np.flatnonzero((triangle < 0) | closed)
        receiver, direction, weight = escaped // MISSING.rays, directions[escaped], weight[escaped]
        exit_cell = exits(low, size, origins[escaped], direction)[0]
        share = np.where(closed[escaped], 1, np.where(windows[exit_cell], 0, sky.at(unfamiliar, direction))) * weight
        np.add.at(through[block], (receiver, unknown[exit_cell]), share)
        sky_weight, sky_part = weight - share, sky.at(part, direction)
        clipped = sky_part >= 0
        np.add.at(by_part[block], (receiver[clipped], sky_part[clipped]), sky_weight[clipped])
        np.add.at(from_sky[block], receiver[~clipped], sky_weight[~clipped, None] * sky(direction[~clipped]))

    for_blocks(run, len(element), 64, 0)
    return unknown, through, from_sky, by_part
