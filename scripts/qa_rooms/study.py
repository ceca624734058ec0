"""Study: books, leather, a black piano, a patterned wallpaper; evening sky and warm lamps at once."""

import numpy as np

from addon.bridge.demo.room import ball, box, cone, grid, painting, planks

from .furnish import BRASS, COPPER, STEEL, Finish, FurnishedRoom, legs
from .shapes import checker, clouds, curtain, cushion, tube, turned, wood

SPINES = ((0.3, 0.03, 0.03), (0.03, 0.12, 0.06), (0.05, 0.07, 0.25), (0.5, 0.4, 0.2), (0.02, 0.02, 0.02))


def study(seed: int) -> FurnishedRoom:
    """Two windows under an evening sky, a floor lamp, a desk lamp and two bulbs that hang on cords."""
    r = FurnishedRoom(
        "study",
        seed,
        (5.0, 4.4, 2.8),
        (1.1, 1.2, 3.7, 2.9),
        pitch=(-42, 30),
        sky=(1.2, 1.5, 2.2),
        ground=(0.25, 0.25, 0.2),
    )
    x, y, z = r.size
    paper = r.matt_picture(clouds(r.tint((0.28, 0.36, 0.3)), r.tint((0.55, 0.56, 0.42)), 22, seed, sharp=2))
    plaster = r.diffuse(0.66, 0.62, 0.55)
    r.shell(
        r.gloss(0.25, np.float32(planks() * 0.8)),
        r.diffuse(0.8, 0.8, 0.78),
        [paper, plaster, paper, plaster],
        {0: [(0.8, 1.8, 0.9, 2.2), (2.8, 3.8, 0.9, 2.2)]},
    )
    r.window_frame(r.gloss(0.3, (0.8, 0.8, 0.78)))
    for left in (1.0, 2.05, 3.0, 4.05):
        drape = curtain((left - 0.15, 0.07, 0.1), (0.3, 0, 0), 2.3, (0, 0.03, 0), 3, 36)
        r.add("curtain", [drape], r.diffuse(0.12, 0.2, 0.35))
    _books(r, y)
    _piano(r, x)
    _desk(r, seed, y)
    _seats(r)
    _lamps(r, z)
    _small_things(r, x, y, seed)
    return r


def _books(r: FurnishedRoom, y: float) -> None:
    """A shelf along the far wall and books in it, each row one object of many colours."""
    case = [box((0.4 + a, y - 0.34, 0.02), (0.43 + a, y - 0.01, 2.2)) for a in (0, 1.0, 2.0)]
    case += [box((0.43, y - 0.34, h), (2.4, y - 0.01, h + 0.03)) for h in (0.1, 0.55, 0.95, 1.35, 1.75, 2.17)]
    r.add("shelf", [*case, box((0.43, y - 0.02, 0.1), (2.4, y - 0.005, 2.17))], r.gloss(0.35, (0.16, 0.08, 0.04)))
    for row, h in enumerate((0.13, 0.58, 0.98, 1.38, 1.78)):
        books, at = [], 0.45
        while at < 2.3:
            thick, high = r.rng.uniform(0.025, 0.06), r.rng.uniform(0.22, 0.33)
            if not 1.36 < at + thick < 1.46:
                books.append(box((at, y - 0.3, h + 0.001), (at + thick, y - 0.06, h + high)))
            at += thick + (0.002 if r.rng.uniform() < 0.9 else 0.12)
        spines = [Finish(np.float32(r.tint(c, 0.3)), 0.45, 0.04) for c in SPINES]
        slots = [int(k) for k in r.rng.integers(0, 5, len(books))]
        r.add("books", books, *(spines if row % 2 else [Finish(s.albedo) for s in spines]), slots=slots)


def _piano(r: FurnishedRoom, x: float) -> None:
    """An upright piano of black lacquer with white keys, brass pedals, a stool."""
    lacquer = r.gloss(0.1, (0.012, 0.011, 0.011), 0.1)
    body = [box((x - 0.35, 1.4, 0.05), (x - 0.02, 2.9, 1.25)), box((x - 0.62, 1.4, 0.62), (x - 0.35, 2.9, 0.7))]
    r.add("piano", [*body, *(box((x - 0.6, b, 0.002), (x - 0.54, b + 0.06, 0.62)) for b in (1.42, 2.8))], lacquer)
    r.add("keys", [box((x - 0.56, 1.5, 0.701), (x - 0.42, 2.8, 0.72))], r.gloss(0.2, (0.8, 0.78, 0.7)))
    pedals = [cushion((x - 0.4, 2.05 + 0.1 * k, 0.06), (0.06, 0.015, 0.008), 5, 0.5) for k in range(3)]
    r.add_round("pedals", pedals, r.metal(0.25, BRASS))
    r.add_round(
        "piano stool", [cushion((x - 1.0, 2.15, 0.5), (0.18, 0.28, 0.05), 8, 0.35)], r.gloss(0.45, (0.06, 0.02, 0.015))
    )
    r.add("stool legs", legs(x - 1.15, 1.9, x - 0.85, 2.4, 0.45, 0.04), lacquer)


def _desk(r: FurnishedRoom, seed: int, y: float) -> None:
    """A desk with a leather pad, a steel lamp, a cup, papers; before it a chair."""
    top = r.gloss(0.3, wood((0.3, 0.13, 0.06), 3, seed))
    desk = [box((3.0, y - 0.9, 0.72), (4.6, y - 0.15, 0.76)), *legs(3.02, y - 0.88, 4.58, y - 0.17, 0.72, 0.06)]
    r.add("desk", desk, top)
    r.add("desk pad", [box((3.5, y - 0.85, 0.7605), (4.1, y - 0.45, 0.765))], r.gloss(0.5, (0.03, 0.09, 0.05)))
    r.add("paper", [box((3.65, y - 0.75, 0.7655), (3.86, y - 0.5, 0.768))], r.diffuse(0.82, 0.82, 0.8))
    arm = [(4.35, y - 0.3, 0.775), (4.35, y - 0.3, 1.1), (4.2, y - 0.45, 1.2)]
    foot = turned((4.35, y - 0.3, 0.7605), [(0.1, 0), (0.1, 0.012), (0.002, 0.015)], 24)
    r.add_round("desk lamp", [tube(arm, 0.012, 10), foot], r.metal(0.35, STEEL))
    r.add("lamp shade", [cone((4.18, y - 0.47, 1.1), 0.11, 0.04, 0.13, 28)], r.gloss(0.3, (0.02, 0.14, 0.06)))
    r.add("bulb", [ball((4.18, y - 0.47, 1.14), 0.03, 5)], r.lamp(110, 80, 50))
    cup = [(0.035, 0), (0.04, 0.09), (0.037, 0.09), (0.033, 0.01), (0.002, 0.01)]
    r.add_round("cup", [turned((3.3, y - 0.6, 0.761), cup, 24)], r.gloss(0.12, (0.75, 0.3, 0.05)))
    chair = [
        cushion((3.8, y - 1.25, 0.46), (0.23, 0.22, 0.035), 8, 0.4),
        cushion((3.8, y - 1.47, 0.8), (0.22, 0.03, 0.24), 8, 0.4),
    ]
    r.add_round("chair", chair, r.diffuse(0.4, 0.12, 0.05))
    r.add("chair legs", legs(3.58, y - 1.46, 4.02, y - 1.04, 0.43, 0.035), r.gloss(0.35, (0.12, 0.06, 0.03)))


def _seats(r: FurnishedRoom) -> None:
    """A leather sofa by the left wall, cushions on it, a low table of steel and dark marble on a rug."""
    leather = r.gloss(0.4, (0.2, 0.08, 0.035))
    parts = [
        cushion((0.5, 1.9, 0.28), (0.4, 0.85, 0.16), 10, 0.3),
        cushion((0.16, 1.9, 0.6), (0.13, 0.85, 0.26), 10, 0.3),
    ]
    parts += [cushion((0.5, 1.9 + 0.88 * side, 0.4), (0.4, 0.1, 0.22), 8, 0.35) for side in (-1, 1)]
    r.add_round("sofa", parts, leather)
    for k, colour in enumerate(((0.6, 0.45, 0.08), (0.65, 0.63, 0.58))):
        pad = cushion((0.4, 1.45 + 0.85 * k, 0.56), (0.1, 0.2, 0.18), 8, 0.6)
        r.add_round("cushion", [pad], r.diffuse(*colour))
    rug = checker(r.tint((0.3, 0.06, 0.05)), r.tint((0.45, 0.36, 0.24)), 14)
    r.add("rug", [box((0.95, 1.0, 0.001), (2.6, 2.9, 0.012))], r.matt_picture(rug))
    stone = r.gloss(0.15, clouds((0.03, 0.03, 0.035), (0.22, 0.2, 0.18), 8, 3, sharp=2))
    r.add("table", [box((1.35, 1.5, 0.38), (1.95, 2.4, 0.41))], stone)
    r.add("table legs", legs(1.38, 1.53, 1.92, 2.37, 0.38, 0.03), r.metal(0.3, STEEL))
    bowl = [(0.06, 0), (0.14, 0.06), (0.15, 0.09), (0.14, 0.09), (0.002, 0.02)]
    r.add_round("bowl", [turned((1.65, 2.05, 0.411), bowl, 28)], r.metal(0.2, COPPER))
    r.add("magazine", [box((1.45, 1.6, 0.4105), (1.66, 1.88, 0.418))], r.gloss(0.2, painting()))


def _lamps(r: FurnishedRoom, z: float) -> None:
    """A floor lamp with a cloth shade, and two bulbs on cords."""
    pole = [(0.14, 0), (0.13, 0.02), (0.012, 0.03), (0.012, 1.42), (0.002, 1.42)]
    r.add_round("lamp stand", [turned((0.45, 3.35, 0.002), pole, 24)], r.metal(0.25, BRASS))
    r.add("lamp shade", [cone((0.45, 3.35, 1.4), 0.2, 0.13, 0.26, 32)], r.diffuse(0.75, 0.66, 0.48))
    r.add("bulb", [ball((0.45, 3.35, 1.53), 0.045, 5)], r.lamp(100, 72, 44))
    for a, b in ((1.6, 2.2), (3.4, 2.2)):
        r.add("bulb", [ball((a, b, 2.25), 0.055, 6)], r.lamp(70, 52, 34))
        r.add_round(
            "socket", [turned((a, b, 2.295), [(0.03, 0), (0.03, 0.07), (0.002, 0.08)], 20)], r.metal(0.3, BRASS)
        )
        r.add("cord", [tube([(a, b, 2.37), (a, b, z)], 0.006, 6)], r.diffuse(0.03, 0.03, 0.03))


def _small_things(r: FurnishedRoom, x: float, y: float, seed: int) -> None:
    """A mirror, pictures, a pot with a plant, a globe, a door, a skirting, a radiator under a window."""
    r.add("mirror", [grid((0.012, 1.45, 1.2), (0, 0.9, 0), (0, 0, 0.75), 4, 4)], r.metal(0.0, (0.9, 0.9, 0.9)))
    rim = [box((0.001, 1.4, h), (0.03, 2.4, h + 0.05)) for h in (1.15, 1.95)]
    rim += [box((0.001, b, 1.2), (0.03, b + 0.05, 1.95)) for b in (1.4, 2.35)]
    r.add("mirror frame", rim, r.metal(0.4, (0.85, 0.65, 0.3)))
    r.add("picture", [box((x - 0.03, 1.7, 1.5), (x - 0.002, 2.6, 2.1))], r.matt_picture(painting()))
    pot = [(0.14, 0), (0.19, 0.35), (0.17, 0.35), (0.002, 0.3)]
    r.add_round("plant pot", [turned((4.6, 0.5, 0.002), pot, 28)], r.gloss(0.2, (0.1, 0.25, 0.4)))
    leaves = [
        cushion((4.6 + 0.2 * np.cos(2 * k), 0.5 + 0.18 * np.sin(2 * k), 0.5 + 0.1 * k), (0.17, 0.1, 0.012), 4, 0.8)
        for k in range(8)
    ]
    r.add_round(
        "plant", [tube([(4.6, 0.5, 0.3), (4.6, 0.5, 1.25)], 0.014, 8), *leaves], r.gloss(0.45, (0.08, 0.2, 0.05))
    )
    r.add_round("globe", [ball((2.75, y - 0.35, 1.0), 0.16, 12)], r.gloss(0.25, (0.1, 0.22, 0.4)))
    stand = [turned((2.75, y - 0.35, 0.002), [(0.16, 0), (0.03, 0.05), (0.025, 0.82), (0.06, 0.845)], 24)]
    r.add_round("globe stand", stand, r.gloss(0.3, wood((0.25, 0.12, 0.05), 1, seed)))
    r.add("door", [box((x - 0.04, 3.2, 0.0), (x - 0.002, 4.1, 2.1))], r.gloss(0.35, (0.7, 0.68, 0.6)))
    r.add_round("door handle", [tube([(x - 0.09, 3.28, 1.02), (x - 0.09, 3.41, 1.02)], 0.012, 8)], r.metal(0.25, BRASS))
    fins = [box((0.85 + 0.06 * k, 0.03, 0.15), (0.89 + 0.06 * k, 0.13, 0.75)) for k in range(15)]
    r.add("radiator", fins, r.gloss(0.3, (0.78, 0.78, 0.75)))
    sides = [
        box((0.001, 0.0, 0.0), (0.018, y, 0.1)),
        box((x - 0.018, 0.0, 0.0), (x - 0.001, 1.38, 0.1)),
        box((0.0, 0.001, 0.0), (x, 0.018, 0.1)),
    ]
    r.add("skirting", sides, r.gloss(0.35, (0.2, 0.1, 0.05)))
