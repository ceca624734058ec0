"""Lamps that nobody saw shine, found one by one from what they throw, and the sky beside them."""

from collections.abc import Collection, Mapping
from dataclasses import replace

import numpy as np

from ...light.joint_fit import Unknown, in_one_plane, solve
from ...light.lamps import Lamp, LampKinds
from ...light.light_fit import Sample, log_of
from ...light.params import LIGHT_FIT, SKY
from ...luminance import LUMINANCE
from ...scene.atlas import Atlas
from .params import UNSEEN
from .sky import Sky, all_light


def solve_lamps(sample: Sample, contribution, floor, kinds: LampKinds, kin, seen, sky: Sky, base) -> list[Lamp]:
    """Unseen lamps, the one that explains most first; none once the gain falls below `lamp_gain`.

    A small lamp lights too little of a room to gain much. So of objects whose class shines (`kin`, with its luminance)
    any gain will do; but noise alone gains a little from a faint lamp, so it has to be within `reach` of its class.
    """
    sent = sample.radiance @ LUMINANCE
    gain = {i: 0.0 if i in kin else UNSEEN.lamp_gain for i in contribution}
    floor = {i: max(bound, kin.get(i, 0.0) / LIGHT_FIT.reach) for i, bound in floor.items()}
    lamps: list[Lamp] = []
    remaining = dict(contribution)
    while remaining:
        light = all_light(base, lamps, contribution, sky)
        received = light @ LUMINANCE
        best = {i: sample.best(sent, received, G) for i, G in remaining.items()}
        improving = {i: f for i, f in best.items() if f is not None and f[2] < (1 - gain[i]) * f[1] and f[0] > floor[i]}
        if not improving:
            break
        object_id = min(improving, key=lambda i: improving[i][2])
        by_channel = [sample.best(sample.radiance[:, c], light[:, c], remaining[object_id]) for c in range(3)]
        same = twin(object_id, improving[object_id][2], sample, sent, received, remaining[object_id], kinds.model, seen)
        lamps.append(
            _coloured(object_id, *improving[object_id], kinds.class_of, same, seen, sample.received, by_channel)
        )
        del remaining[object_id]
    return lamps


def needed(
    sample: Sample, lamps: list[Lamp], contribution, sky: Sky, base, shining: Collection[int]
) -> tuple[list[Lamp], Sky]:
    """The lamps and sky found; lamps that are not surely `shining` shine only where the sky alone explains less."""
    sure = [lamp for lamp in lamps if lamp.object_id in shining]
    if not sky.contribution or len(sure) == len(lamps):
        return lamps, sky
    alone = Sky(sky.contribution, sky.guess, sky.clipped, sky.measured)
    for _ in range(UNSEEN.sweeps):
        solve_sky(sample, sure, contribution, alone, base)
    sent = log_of(sample.radiance @ LUMINANCE)
    with_lamps, without = (
        sample.spread_under(sent, all_light(base, subset, contribution, subset_sky) @ LUMINANCE)
        for subset, subset_sky in ((lamps, sky), (sure, alone))
    )
    return (lamps, sky) if with_lamps < (1 - UNSEEN.lamp_gain) * without else (sure, alone)


def twin(object_id: int, min_spread: float, sample: Sample, sent, received, contribution, model, seen) -> Lamp | None:
    """The seen lamp of the object's model that explains best what is sent, if it does nearly as well as any radiance.

    Lamps of one model mostly shine alike; that one differs is believed as any lamp is, by `lamp_gain` of the least
    spread of log albedo.
    """
    alike = [lamp for lamp in seen if model.get(lamp.object_id) == model.get(object_id)]
    log_sent, luminance = log_of(sent), [float(lamp.radiance @ LUMINANCE) for lamp in alike]
    spread = [sample.spread_under(log_sent, received + s * contribution) for s in luminance]
    if not alike or min_spread < (1 - UNSEEN.lamp_gain) * min(spread):
        return None
    return alike[int(np.argmin(spread))]


def _coloured(object_id, s, before, after, class_of, same, seen, received, by_channel) -> Lamp:
    """Give a solved luminance its colour.

    That of a lamp that is the `same` as a seen one; else what each channel says by itself, if together they make that
    luminance; else that of the lamps, or of the light.
    """
    spread = float(before), float(after)
    if same is not None:
        return Lamp(int(object_id), same.radiance, False, spread=spread, twin=same.object_id, solved=float(s))
    alike = [lamp for lamp in seen if class_of.get(lamp.object_id) == class_of.get(object_id)]
    solved = [fit[0] for fit in by_channel if fit is not None]
    if not alike and len(solved) == 3:
        colour = np.array(solved, np.float32)
        if abs(float(colour @ LUMINANCE) / s - 1) < LIGHT_FIT.alike:
            return Lamp(int(object_id), colour, False, spread=spread)
    white = np.mean([lamp.radiance for lamp in alike or seen], 0) if seen else received.mean(0)
    return Lamp(int(object_id), _of_colour(s, white).astype(np.float32), False, spread=spread)


def _of_colour(luminance: float, colour: np.ndarray) -> np.ndarray:
    """The radiance of a luminance that has the colour of another radiance, (3,)."""
    return luminance * colour / max(float(colour @ LUMINANCE), 1e-12)


def solve_sky(sample: Sample, lamps, contribution, sky: Sky, base) -> None:
    """Radiance of the sky's unknown parts, channel by channel, one after another.

    What explains no better than the guess stays that: a part that lights little of the room tells nothing of itself.
    """
    for i, G in enumerate(sky.contribution):
        others = all_light(base, lamps, contribution, sky, without=i)
        if not _tells(sky, i, others):
            continue
        bounds = np.transpose(sky.bounds(i))
        solutions = [
            _best_radiance(sample, sample.radiance[:, c], others[:, c], G, sky.guess[i][c], bounds[c]) for c in range(3)
        ]
        radiance = [s for s in solutions if s is not None]
        if len(radiance) < 3:
            continue
        sky.radiance[i] = np.array(radiance)
        if np.array_equal(radiance, sky.guess[i]):
            sky.solved.discard(i)
        else:
            sky.solved.add(i)


def _tells(sky: Sky, i: int, others: np.ndarray) -> bool:
    """Whether a part of the sky may light enough of the room, beside what others give ((m, 3)), to be solved for."""
    likely = sky.bounds(i)[1] if sky.clipped[i] else sky.guess[i]
    return bool((sky.contribution[i][:, None] * likely).mean() >= SKY.least_share * others.mean())


def solve_together(
    sample: Sample,
    atlas: Atlas,
    lamps: list[Lamp],
    contribution,
    sky: Sky,
    base: np.ndarray,
    bounds: Mapping[int, np.ndarray],
    by_sun: np.ndarray,
    measured: np.ndarray,
    seed: int,
) -> tuple[list[Lamp], np.ndarray]:
    """Lamps, and in place the sky, solved for once more by what albedo is plausible (`joint_fit`).

    By the spread within objects alone they come out too dark where most of the light is unknown. A lamp that shines as
    a seen one does keeps its radiance. One that the sensor clipped is no darker than that (`bounds`, (3,) each), and
    likely of that colour, which is about the white that a camera balances for.

    Parameters
    ----------
    base : (m, 3) float64
        E from what is known, and from the sun.
    by_sun : (m, 1, 3) float64, or (m, 0, 3)
        Of it, that from a sun which is at least as strong, and which is solved for as well.
    measured : (3,) bool
        Channels in which it is as strong as that.

    Returns
    -------
    lamps : list of Lamp
    factor : (3,) float64
        Of the sun.
    """
    free = [lamp for lamp in lamps if lamp.twin is None]
    kept = [lamp for lamp in lamps if lamp.twin is not None]
    light = all_light(base, lamps, contribution, sky)
    parts = [i for i in range(len(sky.contribution)) if _tells(sky, i, light)]
    suns = by_sun.shape[1]
    if not free and not parts and not suns:
        return lamps, np.ones(3)
    # Beside a sun the sky's level rests on too little to be a prior, as a lamp's does.
    of_sky = [sky.bounds(i) for i in parts]
    by_white = np.reshape(
        [*(contribution[lamp.object_id] for lamp in free), *(sky.contribution[i] for i in parts)], (-1, len(base))
    ).T
    of_sun = np.ones((suns, 3))
    unknown = Unknown(
        by_white,
        by_sun,
        np.stack([*(bounds.get(lamp.object_id, np.zeros(3)) for lamp in free), *(low for low, _ in of_sky), *of_sun]),
        np.stack([*(_like_its_bound(lamp, bounds) for lamp in free), *(sky.radiance[i] for i in parts), *of_sun]),
        np.array([True] * len(free) + [bool(suns)] * len(parts) + [True] * suns),
        np.concatenate([np.zeros((len(free) + len(parts), 3), bool), np.tile(measured, (suns, 1))]),
    )
    known = all_light(base, kept, contribution, sky.without(parts)) - by_sun.sum(1)
    position, normal = atlas.position[sample.element], atlas.normal[sample.element]
    area = sample.area(atlas) if bounds or suns else None
    radiance, _ = solve(sample.radiance, known, unknown, in_one_plane(position, normal, seed), area)
    solved = [replace(lamp, radiance=s.astype(np.float32)) for lamp, s in zip(free, radiance[: len(free)], strict=True)]
    for i, (low, high), s in zip(parts, of_sky, radiance[len(free) : len(free) + len(parts)], strict=True):
        sky.radiance[i] = np.clip(s, low, high)
        sky.solved.add(i)
    return solved + kept, radiance[-1] if suns else np.ones(3)


def _like_its_bound(lamp: Lamp, bounds: Mapping[int, np.ndarray]) -> np.ndarray:
    """A lamp's luminance, in the colour of its lower bound where it has one, (3,)."""
    if (bound := bounds.get(lamp.object_id)) is None:
        return lamp.radiance
    return _of_colour(max(float(lamp.radiance @ LUMINANCE), float(bound @ LUMINANCE)), bound)


def _best_radiance(sample: Sample, sent, others, contribution, guess: float, bounds) -> float | None:
    """A channel of a part of the sky: what explains best what is `sent`, or the guess; None if unbounded.

    `best` alone does not do: the least radiance that it tries may be far more than there is.
    """
    fit = sample.best(sent, others, contribution)
    if fit is None:
        return None
    log_sent = log_of(sent)
    return min(
        (guess, np.clip(fit[0], *bounds)), key=lambda s: sample.spread_under(log_sent, others + s * contribution)
    )
