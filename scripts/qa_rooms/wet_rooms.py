"""Kitchen and bathroom: gloss, steel, tiles, many small lamps."""

from addon.bridge.demo.room import ball, box, grid

from .furnish import BRASS, CHROME, COPPER, STEEL, FurnishedRoom, legs
from .shapes import arc, checker, clouds, curtain, cushion, tiles, tube, turned, wood


def kitchen(seed: int) -> FurnishedRoom:
    """Lacquered cabinets, steel, tiles; three pendant bulbs in copper shades, spots, a small window."""
    r = FurnishedRoom(
        "kitchen", seed, (4.2, 3.6, 2.5), (1.0, 0.9, 3.2, 2.1), sky=(2.2, 2.8, 3.6), ground=(0.5, 0.45, 0.4)
    )
    x, y, z = r.size
    plain = r.diffuse(0.72, 0.68, 0.58)
    r.shell(
        r.gloss(0.35, checker((0.62, 0.58, 0.52), (0.06, 0.06, 0.07), 10)),
        r.diffuse(0.82, 0.82, 0.8),
        [plain] * 4,
        {1: [(1.2, 2.3, 1.1, 2.0)]},
    )
    r.window_frame(r.gloss(0.4, (0.8, 0.8, 0.78)))
    splash = tiles([(0.75, 0.74, 0.7), (0.12, 0.3, 0.35), (0.7, 0.66, 0.5)], (0.4, 0.38, 0.36), 24, 4, seed)
    r.add("backsplash", [grid((0.0, y - 0.004, 0.9), (x, 0, 0), (0, 0, 0.55), 12, 3)], r.gloss(0.2, splash))
    front = r.gloss(0.2, (0.55, 0.09, 0.06))
    upper = r.gloss(0.3, (0.78, 0.77, 0.72))
    for k in range(5):
        r.add("base cabinet", [box((0.02 + 0.6 * k, y - 0.6, 0.1), (0.6 + 0.6 * k, y - 0.01, 0.86))], front)
        if k != 2:
            r.add("wall cabinet", [box((0.02 + 0.6 * k, y - 0.36, 1.45), (0.6 + 0.6 * k, y - 0.01, 2.15))], upper)
    worktop = [box((0, y - 0.63, 0.86), (3.02, y - 0.005, 0.9))]
    r.add("worktop", worktop, r.gloss(0.25, clouds((0.02, 0.02, 0.02), (0.16, 0.15, 0.14), 18, seed, sharp=1.5)))
    r.add("fridge", [box((3.2, y - 0.68, 0.03), (3.95, y - 0.02, 1.85))], r.metal(0.35, STEEL))
    r.add_round("fridge handle", [tube([(3.27, y - 0.73, 0.7), (3.27, y - 0.73, 1.6)], 0.015)], r.metal(0.15, CHROME))
    hood = [(0.3, 0), (0.28, 0.1), (0.12, 0.3), (0.12, 0.9)]
    r.add_round("hood", [turned((1.51, y - 0.32, 1.5), hood, 24)], r.metal(0.28, STEEL))
    r.add("oven", [box((1.24, y - 0.625, 0.2), (1.78, y - 0.605, 0.75))], r.gloss(0.12, (0.012, 0.012, 0.013)))
    path = [
        (2.3, y - 0.15, 0.9),
        *arc((2.3, y - 0.15, 1.15), (2.3, y - 0.37, 1.15), (0, 0, 0.12)),
        (2.3, y - 0.37, 1.08),
    ]
    r.add_round("tap", [tube(path, 0.017)], r.metal(0.1, CHROME))
    # An island with stools.
    top = r.gloss(0.4, wood((0.42, 0.25, 0.12), 6, seed))
    r.add("table", [box((1.3, 0.2, 0.84), (2.9, 0.8, 0.9)), *legs(1.35, 0.25, 2.85, 0.75, 0.84, 0.06)], top)
    for k in range(3):
        at = 1.55 + 0.5 * k
        stool = [(0.002, 0), (0.16, 0), (0.17, 0.02), (0.16, 0.04), (0.002, 0.045)]
        r.add_round("stool", [turned((at, 1.0, 0.6), stool, 24)], r.gloss(0.45, (0.08, 0.2, 0.32)))
        r.add_round(
            "stool legs",
            [
                tube([(at + 0.11 * a, 1 + 0.11 * b, 0.6), (at + 0.18 * a, 1 + 0.18 * b, 0.004)], 0.012, 8)
                for a in (-1, 1)
                for b in (-1, 1)
            ],
            r.metal(0.2, CHROME),
        )
        pendant = [(0.17, 0), (0.16, 0.06), (0.06, 0.16), (0.02, 0.2)]
        r.add_round("pendant", [turned((at, 0.5, 1.62), pendant, 24)], r.metal(0.3, COPPER))
        r.add("cord", [tube([(at, 0.5, 1.82), (at, 0.5, z)], 0.005, 6)], r.diffuse(0.03, 0.03, 0.03))
        r.add("bulb", [ball((at, 0.5, 1.68), 0.045, 5)], r.lamp(150, 120, 82))
    bowl = [(0.03, 0), (0.09, 0.02), (0.15, 0.08), (0.145, 0.08), (0.085, 0.03), (0.002, 0.015)]
    r.add_round("bowl", [turned((2.55, 0.5, 0.902), bowl, 24)], r.gloss(0.15, (0.75, 0.75, 0.76)))
    for k, c in enumerate([(0.75, 0.3, 0.02), (0.6, 0.04, 0.03), (0.35, 0.5, 0.05)]):
        r.add_round("fruit", [ball((2.51 + 0.05 * k, 0.47 + 0.05 * (k % 2), 0.965), 0.045, 6)], r.gloss(0.35, c))
    for k in range(4):
        at = (0.8 + 0.85 * k, 2.25, z - 0.012)
        r.add("spot", [turned(at, [(0.055, 0), (0.002, 0.0)], 16)], r.lamp(70, 62, 50))
        ring = [(0.055, 0.01), (0.056, -0.006), (0.075, -0.006), (0.076, 0.01)]
        r.add("spot ring", [turned(at, ring, 16)], r.metal(0.25, STEEL))
    kettle = [(0.09, 0), (0.1, 0.05), (0.07, 0.17), (0.03, 0.2), (0.002, 0.2)]
    r.add_round("kettle", [turned((0.5, y - 0.3, 0.902), kettle, 24)], r.gloss(0.18, (0.03, 0.25, 0.22)))
    r.add(
        "curtain", [curtain((x - 0.05, 0.75, 0.9), (0, 0.42, 0), 1.25, (0.03, 0, 0), 4, 32)], r.diffuse(0.6, 0.5, 0.12)
    )
    shelf = [box((0.005, 0.5, 1.4), (0.25, 1.8, 1.43)), box((0.005, 0.5, 1.8), (0.25, 1.8, 1.83))]
    r.add("shelf", shelf, r.gloss(0.5, wood((0.3, 0.17, 0.08), 2, seed + 1)))
    for k in range(6):
        h = r.rng.uniform(0.12, 0.26)
        at = (0.13, 0.65 + 0.2 * k, 1.432 + 0.4 * (k % 2))
        jar = [(0.05, 0), (0.055, h * 0.6), (0.03, h), (0.002, h)]
        r.add_round("jar", [turned(at, jar, 20)], r.gloss(r.rng.uniform(0.15, 0.5), r.rng.uniform(0.04, 0.75, 3)))
    pan = [(0.11, 0), (0.13, 0.07), (0.12, 0.07), (0.1, 0.006), (0.002, 0.006)]
    r.add_round("pan", [turned((0.95, y - 0.35, 0.903), pan, 24)], r.metal(0.3, COPPER))
    return r


def bathroom(seed: int) -> FurnishedRoom:
    """White glossy tiles, a large mirror, chrome, a curved tub; six small ceiling spots, no window."""
    r = FurnishedRoom("bathroom", seed, (3.0, 2.6, 2.4), (0.95, 0.85, 2.1, 1.7))
    x, y, z = r.size
    white = r.gloss(0.18, tiles([(0.78, 0.79, 0.78)], (0.42, 0.42, 0.4), 12, 10, seed, 0.04))
    r.shell(
        r.gloss(0.4, tiles([(0.1, 0.1, 0.11), (0.13, 0.13, 0.14)], (0.3, 0.29, 0.28), 8, 7, seed, 0.03)),
        r.diffuse(0.84, 0.84, 0.83),
        [white] * 4,
    )
    border = tiles([(0.02, 0.16, 0.3), (0.05, 0.3, 0.4), (0.6, 0.6, 0.55)], (0.4, 0.4, 0.4), 40, 2, seed)
    r.add("border", [grid((0.004, y, 1.25), (0, -y, 0), (0, 0, 0.15), 8, 1)], r.gloss(0.18, border))
    r.add("mirror", [grid((0.6, y - 0.02, 1.0), (1.6, 0, 0), (0, 0, 1.0), 4, 3)], r.metal(0.0, (0.9, 0.91, 0.9)))
    r.add("vanity", [box((0.5, y - 0.5, 0.35), (2.3, y - 0.01, 0.8))], r.gloss(0.45, wood((0.3, 0.17, 0.08), 3, seed)))
    r.add("basin top", [box((0.45, y - 0.53, 0.8), (2.35, y - 0.005, 0.86))], r.gloss(0.15, (0.82, 0.82, 0.81)))
    for k in range(2):
        at = 0.95 + 0.9 * k
        basin = [(0.1, 0), (0.2, 0.05), (0.23, 0.13), (0.22, 0.13), (0.18, 0.05), (0.002, 0.03)]
        r.add_round("basin", [turned((at, y - 0.28, 0.862), basin, 30)], r.gloss(0.12, (0.84, 0.84, 0.84)))
        path = [(at, y - 0.08, 0.86), *arc((at, y - 0.08, 1.05), (at, y - 0.25, 1.05), (0, 0, 0.08))]
        r.add_round("tap", [tube(path, 0.015)], r.metal(0.08, CHROME))
        soap = [(0.03, 0), (0.035, 0.09), (0.012, 0.12), (0.002, 0.12)]
        r.add_round("soap", [turned((at + 0.33, y - 0.2, 0.862), soap, 20)], r.gloss(0.25, (0.5, 0.05, 0.2)))
    tub = [(0.3, 0.0), (0.38, 0.2), (0.42, 0.55), (0.39, 0.55), (0.34, 0.2), (0.002, 0.12)]
    quads, uv = turned((0, 0, 0), tub, 40)
    r.add_round("tub", [(quads * (1.0, 1.9, 1.0) + (2.5, 1.15, 0.002), uv)], r.gloss(0.12, (0.84, 0.84, 0.83)))
    tap = [tube([(2.93, 0.3, 0.002), *arc((2.93, 0.3, 0.8), (2.7, 0.45, 0.8), (0, 0, 0.1))], 0.02)]
    r.add_round("tub tap", tap, r.metal(0.15, BRASS))
    r.add_round("towel rail", [tube([(0.06, 0.5, 1.15), (0.06, 1.3, 1.15)], 0.012)], r.metal(0.12, CHROME))
    r.add("towel", [curtain((0.085, 0.58, 0.45), (0, 0.45, 0), 0.7, (0.012, 0, 0), 3, 24)], r.diffuse(0.62, 0.12, 0.04))
    r.add("towel", [curtain((0.085, 1.06, 0.6), (0, 0.2, 0), 0.55, (0.01, 0, 0), 2, 16)], r.diffuse(0.62, 0.12, 0.04))
    seat = [(0.12, 0), (0.1, 0.15), (0.18, 0.36), (0.2, 0.42), (0.002, 0.43)]
    toilet = [turned((0.55, 0.45, 0.002), seat, 30), cushion((0.55, 0.12, 0.62), (0.2, 0.09, 0.2))]
    r.add_round("toilet", toilet, r.gloss(0.14, (0.82, 0.82, 0.8)))
    r.add_round("mat", [cushion((1.5, 1.35, 0.015), (0.4, 0.3, 0.012))], r.diffuse(0.2, 0.35, 0.3))
    bin = [(0.12, 0), (0.13, 0.3), (0.12, 0.32), (0.002, 0.33)]
    r.add_round("bin", [turned((1.25, 0.25, 0.002), bin, 28)], r.metal(0.35, STEEL))
    stool = [box((1.75, 0.15, 0.4), (2.05, 0.45, 0.43)), *legs(1.77, 0.17, 2.03, 0.43, 0.4, 0.03)]
    r.add("stool", stool, r.gloss(0.4, (0.35, 0.22, 0.1)))
    r.add("door", [box((1.1, 0.001, 0.0), (1.9, 0.03, 2.0))], r.gloss(0.5, (0.13, 0.2, 0.18)))
    r.add_round("door handle", [tube([(1.8, 0.06, 1.0), (1.67, 0.06, 1.0)], 0.01)], r.metal(0.3, BRASS))
    head = [(0.1, 0), (0.1, 0.02), (0.02, 0.05), (0.015, 0.39)]
    r.add_round("shower head", [turned((2.5, 2.2, 2.0), head, 24)], r.metal(0.1, CHROME))
    for k in range(6):
        at = (0.6 + 0.9 * (k % 3), 0.75 + 1.1 * (k // 3), z - 0.012)
        r.add("spot", [turned(at, [(0.045, 0), (0.002, 0.0)], 16)], r.lamp(130, 122, 108))
        ring = [(0.045, 0.01), (0.046, -0.008), (0.07, -0.008), (0.071, 0.01)]
        r.add("spot ring", [turned(at, ring, 16)], r.metal(0.2, CHROME))
    return r
