"""Bedroom, office and hall: sun through a window, fluorescent panels, a window alone."""

import numpy as np

from addon.bridge.demo.room import ball, box, cone, grid, painting, planks

from .furnish import BRASS, CHROME, GOLD, STEEL, Finish, FurnishedRoom, legs
from .shapes import arc, clouds, curtain, cushion, stripes, tiles, tube, turned, wood


def bedroom(seed: int) -> FurnishedRoom:
    """Cloth and dark wood, brass lamps with opaque shades, sun and sky through a window."""
    r = FurnishedRoom(
        "bedroom",
        seed,
        (4.4, 4.0, 2.6),
        (1.2, 0.7, 3.4, 1.6),
        sky=(2.6, 3.4, 4.6),
        ground=(0.7, 0.65, 0.5),
        sun=((-0.75, 0.35, -0.55), (1.0, 0.86, 0.66), 28.0),
    )
    x, y, z = r.size
    papered = r.matt_picture(stripes([r.tint((0.5, 0.42, 0.28)), r.tint((0.3, 0.36, 0.3))], 36))
    plain = r.diffuse(0.55, 0.56, 0.5)
    r.shell(
        r.gloss(0.4, (planks() * 0.5).astype(np.float32)),
        r.diffuse(0.8, 0.79, 0.76),
        [plain, plain, papered, plain],
        {1: [(1.4, 2.9, 0.8, 2.1)]},
    )
    r.window_frame(r.gloss(0.45, (0.7, 0.7, 0.68)))
    cloth = r.diffuse(0.35, 0.05, 0.1)
    r.add("curtain", [curtain((x - 0.07, 0.85, 0.05), (0, 0.4, 0), 2.3, (0.035, 0, 0), 4, 40)], cloth)
    r.add("curtain", [curtain((x - 0.07, 2.45, 0.05), (0, 0.4, 0), 2.3, (0.035, 0, 0), 4, 40)], cloth)
    r.add_round("rod", [tube([(x - 0.07, 0.6, 2.37), (x - 0.07, 3.1, 2.37)], 0.015)], r.metal(0.25, BRASS))
    dark = r.gloss(0.35, wood((0.1, 0.05, 0.025), 4, seed))
    bed_frame = [box((1.2, 1.85, 0.08), (2.95, y - 0.08, 0.3)), box((1.15, y - 0.08, 0.05), (3.0, y - 0.02, 1.15))]
    r.add("bed frame", bed_frame, dark)
    r.add_round("mattress", [cushion((2.075, 2.9, 0.4), (0.85, 1.0, 0.13), 10, 0.3)], r.diffuse(0.8, 0.79, 0.77))
    blanket = stripes([(0.05, 0.12, 0.3), (0.55, 0.5, 0.4), (0.08, 0.2, 0.35)], 12)
    r.add_round("blanket", [cushion((2.075, 2.55, 0.44), (0.89, 0.68, 0.13), 10, 0.25)], r.matt_picture(blanket))
    for k in range(2):
        r.add_round(
            "pillow", [cushion((1.65 + 0.85 * k, 3.55, 0.6), (0.33, 0.2, 0.1), 10, 0.6)], r.diffuse(0.75, 0.7, 0.55)
        )
        left = 0.55 + 2.6 * k
        table = [
            box((left, 3.5, 0.42), (left + 0.5, y - 0.02, 0.47)),
            box((left + 0.03, 3.53, 0.2), (left + 0.47, y - 0.04, 0.42)),
            *legs(left, 3.5, left + 0.5, y - 0.03, 0.42, 0.035),
        ]
        r.add("bedside table", table, dark)
        at = (left + 0.25, 3.75)
        stand = [(0.08, 0), (0.07, 0.02), (0.015, 0.04), (0.03, 0.14), (0.012, 0.2), (0.01, 0.3), (0.002, 0.3)]
        r.add_round("lamp stand", [turned((*at, 0.472), stand, 24)], r.metal(0.25, BRASS))
        r.add("lamp shade", [cone((*at, 0.72), 0.17, 0.1, 0.24, 32)], r.diffuse(0.72, 0.62, 0.42))
        r.add("bulb", [ball((*at, 0.82), 0.04, 5)], r.lamp(120, 84, 48))
    r.add("wardrobe", [box((0.01, 0.5, 0.06), (0.6, 2.4, 2.2))], r.gloss(0.3, wood((0.16, 0.075, 0.035), 3, seed + 1)))
    r.add_round("knob", [ball((0.63, a, 1.1), 0.02, 5) for a in (1.4, 1.5)], r.metal(0.2, BRASS))
    rug = [box((1.0, 0.6, 0.001), (3.2, 1.75, 0.014))]
    r.add("rug", rug, r.matt_picture(clouds((0.35, 0.04, 0.03), (0.5, 0.3, 0.1), 26, seed, sharp=3)))
    armchair = [
        cushion((3.75, 0.55, 0.28), (0.36, 0.34, 0.14), 8, 0.4),
        cushion((3.8, 0.22, 0.65), (0.36, 0.1, 0.3), 8, 0.4),
        cushion((3.42, 0.55, 0.45), (0.08, 0.34, 0.12), 8, 0.4),
        cushion((4.12, 0.55, 0.45), (0.08, 0.34, 0.12), 8, 0.4),
    ]
    r.add_round("armchair", armchair, r.gloss(0.5, (0.09, 0.04, 0.02)))
    for k in range(2):
        frame = r.gloss(0.25, (0.02, 0.02, 0.02))
        left = 1.4 + 0.9 * k
        r.add(
            "picture",
            [box((left, y - 0.03, 1.5), (left + 0.6, y - 0.002, 2.0))],
            Finish(frame.albedo),
            Finish(painting()),
        )
        r.objects[-1].slot[1] = 1
        bars = [box((left - 0.03, y - 0.045, h), (left + 0.63, y - 0.002, h + 0.03)) for h in (1.47, 2.0)]
        bars += [box((a, y - 0.045, 1.5), (a + 0.03, y - 0.002, 2.0)) for a in (left - 0.03, left + 0.6)]
        r.add("picture frame", bars, frame)
    r.add("dresser", [box((1.5, 0.01, 0.08), (2.7, 0.45, 0.8))], r.gloss(0.3, (0.6, 0.6, 0.56)))
    vase = [(0.05, 0), (0.1, 0.12), (0.05, 0.26), (0.06, 0.3), (0.002, 0.28)]
    r.add_round("vase", [turned((1.8, 0.22, 0.802), vase, 28)], r.gloss(0.12, (0.03, 0.1, 0.35)))
    r.add_round("globe", [ball((2.4, 0.23, 0.95), 0.14, 12)], r.gloss(0.3, (0.1, 0.28, 0.12)))
    return r


def office(seed: int) -> FurnishedRoom:
    """Six fluorescent panels, black plastics, bent chrome chairs, four like desks, a glass partition."""
    r = FurnishedRoom("office", seed, (5.6, 4.2, 2.7), (0.9, 1.5, 4.6, 2.6), pitch=(-40, 20))
    x, y, z = r.size
    wall_paint, accent = r.diffuse(0.7, 0.71, 0.7), r.diffuse(0.04, 0.2, 0.45)
    r.shell(
        r.matt_picture(clouds((0.1, 0.11, 0.13), (0.2, 0.2, 0.22), 60, seed)),
        r.matt_picture(tiles([(0.76, 0.76, 0.75)], (0.5, 0.5, 0.5), 9, 7, seed, 0.03)),
        [wall_paint, wall_paint, wall_paint, accent],
    )
    for k in range(6):
        a, b = 1.0 + 1.8 * (k % 3), 0.9 + 1.9 * (k // 3)
        r.add("light panel", [box((a, b, z - 0.03), (a + 0.3, b + 1.0, z - 0.005))], r.lamp(9.5, 10.5, 11))
        if k == 4:
            panel = r.objects.pop()  # one tube is dead
            r.add("light panel", [(panel.quads, panel.uv)], r.diffuse(0.7, 0.7, 0.7))
    top = r.gloss(0.35, wood((0.55, 0.42, 0.27), 5, seed))
    black = r.gloss(0.3, (0.018, 0.018, 0.02))
    for k in range(4):
        a, b = 0.8 + 2.3 * (k % 2), 0.35 + 2.9 * (k // 2)
        r.add("desk", [box((a, b, 0.7), (a + 1.5, b + 0.7, 0.74))], top)
        r.add_round(
            "desk legs",
            [tube([(a + p, b + q, 0.002), (a + p, b + q, 0.7)], 0.022, 10) for p in (0.06, 1.44) for q in (0.06, 0.64)],
            r.metal(0.3, STEEL),
        )
        face = b + (0.1 if k < 2 else 0.55)
        monitor = [
            box((a + 0.45, face, 0.86), (a + 1.05, face + 0.03, 1.22)),
            box((a + 0.72, face, 0.745), (a + 0.78, face + 0.03, 0.9)),
            box((a + 0.62, face - 0.08, 0.742), (a + 0.88, face + 0.1, 0.752)),
        ]
        r.add("monitor", monitor, black)
        r.add(
            "keyboard", [box((a + 0.5, b + 0.3, 0.742), (a + 0.95, b + 0.43, 0.758))], r.gloss(0.5, (0.03, 0.03, 0.03))
        )
        cx, cy = a + 0.75, (b + 1.0 if k < 2 else b - 0.3)
        away = 1 if k < 2 else -1
        seat = r.gloss(0.45, [(0.55, 0.05, 0.03), (0.03, 0.03, 0.032), (0.05, 0.3, 0.1), (0.03, 0.03, 0.032)][k])
        chair = [
            cushion((cx, cy, 0.45), (0.22, 0.21, 0.03), 8, 0.4),
            cushion((cx, cy + 0.22 * away, 0.75), (0.21, 0.025, 0.17), 8, 0.4),
        ]
        r.add_round("chair", chair, seat)
        frame = []
        for side in (-0.2, 0.2):
            path = [
                (cx + side, cy + 0.22 * away, 0.9),
                (cx + side, cy + 0.21 * away, 0.45),
                (cx + side, cy - 0.15 * away, 0.43),
            ]
            bend = arc((cx + side, cy - 0.2 * away, 0.4), (cx + side, cy - 0.2 * away, 0.02), (0, -0.05 * away, 0))
            frame.append(tube([*path, *bend, (cx + side, cy + 0.22 * away, 0.015)], 0.012, 8))
        r.add_round("chair frame", frame, r.metal(0.12, CHROME))
    pane = [grid((4.5, 0.0, 0.0), (0, 1.3, 0), (0, 0, 2.2), 4, 6)]
    r.add("glass wall", pane, Finish(np.float32([1, 1, 1]), 0.0, 0.04, glass=True))
    glass_frame = [tube([(4.5, 1.3, 0), (4.5, 1.3, 2.2)], 0.025, 8), tube([(4.5, 0, 2.2), (4.5, 1.3, 2.2)], 0.025, 8)]
    r.add_round("glass frame", glass_frame, r.gloss(0.4, (0.02, 0.02, 0.02)))
    pot = [(0.15, 0), (0.2, 0.4), (0.18, 0.4), (0.002, 0.36)]
    r.add_round("plant pot", [turned((5.1, 0.6, 0.002), pot, 28)], r.gloss(0.25, (0.7, 0.68, 0.62)))
    leaves = [
        cushion((5.1 + 0.2 * np.cos(k), 0.6 + 0.2 * np.sin(k), 0.55 + 0.09 * k), (0.16, 0.12, 0.012), 4, 0.8)
        for k in range(9)
    ]
    r.add_round(
        "plant", [tube([(5.1, 0.6, 0.36), (5.1, 0.6, 1.3)], 0.015, 8), *leaves], r.gloss(0.5, (0.06, 0.22, 0.04))
    )
    r.add("white board", [box((0.9, y - 0.03, 1.0), (2.6, y - 0.005, 2.0))], r.gloss(0.16, (0.82, 0.83, 0.83)))
    r.add("door", [box((4.7, y - 0.04, 0.0), (5.5, y - 0.002, 2.05))], r.gloss(0.4, (0.45, 0.3, 0.15)))
    r.add_round("door handle", [tube([(4.8, y - 0.09, 1.02), (4.93, y - 0.09, 1.02)], 0.011, 8)], r.metal(0.25, STEEL))
    r.add("cupboard", [box((x - 0.5, 1.5, 0.02), (x - 0.01, 3.3, 1.3))], r.metal(0.55, (0.4, 0.41, 0.42)))
    folders = [
        box((x - 0.4, 1.6 + 0.085 * k, 1.302), (x - 0.1, 1.6 + 0.085 * k + 0.075, 1.302 + 0.32)) for k in range(14)
    ]
    colours = [r.gloss(0.4, c) for c in ((0.02, 0.02, 0.02), (0.5, 0.04, 0.03), (0.03, 0.1, 0.4), (0.6, 0.5, 0.1))]
    colours = [Finish(c.albedo, colours[0].roughness, 0.04) for c in colours]
    r.add("folders", folders, *colours, slots=[int(k) for k in r.rng.integers(0, 4, 14)])
    bucket = [(0.12, 0), (0.15, 0.35), (0.145, 0.35), (0.115, 0.01), (0.002, 0.01)]
    r.add_round("bin", [turned((0.5, 1.9, 0.002), bucket, 28)], r.metal(0.4, (0.35, 0.36, 0.38)))
    dial = [(0.16, 0), (0.16, 0.03), (0.15, 0.035), (0.002, 0.03)]
    r.add_round("clock", [turned((0, 0, 0), dial, 28)], r.gloss(0.2, (0.75, 0.75, 0.72)))
    clock = r.objects[-1]
    clock.quads[:] = clock.quads[..., [2, 0, 1]] + (0.002, 2.1, 2.2)
    return r


def hall(seed: int) -> FurnishedRoom:
    """A stair under saturated walls, lit by one big window alone; gold, marble, ceramics. Nobody looks up."""
    r = FurnishedRoom(
        "hall", seed, (4.4, 5.0, 3.6), (0.7, 0.8, 2.6, 4.0), pitch=(-35, 8), sky=(4.2, 5.2, 6.8), ground=(1.0, 1.0, 0.7)
    )
    x, y, z = r.size
    red, ochre = r.diffuse(0.62, 0.1, 0.06), r.diffuse(0.68, 0.45, 0.08)
    r.shell(
        r.gloss(0.2, clouds((0.04, 0.04, 0.05), (0.2, 0.19, 0.18), 10, seed, sharp=3)),
        r.diffuse(0.82, 0.8, 0.76),
        [red, ochre, red, ochre],
        {3: [(1.2, 3.8, 0.5, 2.9)]},
    )
    r.window_frame(r.gloss(0.35, (0.75, 0.74, 0.7)))
    step = r.gloss(0.3, wood((0.32, 0.17, 0.07), 2, seed))
    riser = r.gloss(0.45, (0.72, 0.7, 0.65))
    for k in range(12):
        a, h = 0.6 + 0.27 * k, 0.17 * (k + 1)
        r.add("stair tread", [box((x - 1.1, a, h - 0.04), (x - 0.01, a + 0.3, h))], step)
        r.add("stair riser", [box((x - 1.08, a + 0.02, h - 0.17), (x - 0.01, a + 0.035, h - 0.04))], riser)
    slope = [(x - 1.05, 0.7, 1.05), (x - 1.05, 3.7, 1.05 + 11 * 0.17)]
    r.add_round("hand rail", [tube([(x - 1.05, 0.68, 0.05), *slope], 0.025, 10)], r.gloss(0.25, (0.12, 0.06, 0.03)))
    bars = [
        tube([(x - 1.05, 0.75 + 0.27 * k, 0.17 * (k + 1)), (x - 1.05, 0.75 + 0.27 * k, 1.07 + 0.17 * k)], 0.009, 6)
        for k in range(12)
    ]
    r.add_round("railing", bars, r.metal(0.3, (0.3, 0.3, 0.31)))
    sculpture = [(0.22, 0), (0.2, 0.9), (0.002, 0.9)]
    r.add("sculpture", [turned((1.3, 4.45, 0.0), sculpture, 32)], r.gloss(0.5, (0.75, 0.75, 0.73)))
    r.add_round("gold ball", [ball((1.3, 4.45, 1.15), 0.25, 14)], r.metal(0.3, GOLD))
    vase = [(0.1, 0), (0.2, 0.25), (0.14, 0.5), (0.08, 0.62), (0.11, 0.7), (0.1, 0.7), (0.06, 0.6), (0.002, 0.5)]
    r.add_round("vase", [turned((0.35, 4.5, 0.002), vase, 32)], r.gloss(0.1, (0.02, 0.12, 0.3)))
    r.add_round("vase", [turned((0.4, 0.4, 0.002), vase, 32)], r.gloss(0.1, (0.7, 0.68, 0.6)))
    console = [box((1.2, 0.02, 0.8), (2.6, 0.4, 0.84)), *legs(1.2, 0.03, 2.6, 0.4, 0.8, 0.04)]
    r.add("console", console, r.gloss(0.15, (0.015, 0.014, 0.013)))
    for k, c in enumerate([(0.5, 0.05, 0.04), (0.05, 0.25, 0.06), (0.75, 0.72, 0.65)]):
        bowl = [(0.05, 0), (0.12, 0.05), (0.13, 0.1), (0.12, 0.1), (0.002, 0.03)]
        r.add_round("bowl", [turned((1.45 + 0.4 * k, 0.2, 0.842), bowl, 24)], r.gloss(0.2 + 0.15 * k, c))
    r.add("picture", [box((1.3, 0.002, 1.3), (2.5, 0.03, 2.2))], Finish(np.float32([0.03] * 3)), Finish(painting()))
    r.objects[-1].slot[3] = 1
    r.add_round("bench", [cushion((2.3, 4.6, 0.42), (0.6, 0.22, 0.06), 10, 0.3)], r.diffuse(0.06, 0.16, 0.12))
    arcs = [arc((a, 4.45, 0.004), (a, 4.75, 0.004), (0, 0, 0.36)) for a in (1.85, 1.85 + 0.9)]
    r.add_round("bench legs", [tube(path, 0.014, 8) for path in arcs], r.metal(0.2, BRASS))
    pattern = tiles([(0.08, 0.1, 0.25), (0.45, 0.35, 0.2), (0.3, 0.05, 0.05)], (0.5, 0.45, 0.35), 8, 12, seed, 0.1)
    r.add("rug", [box((0.9, 1.3, 0.001), (2.3, 3.6, 0.013))], r.matt_picture(pattern))
    sides = [
        box((0.001, 0.0, 0.0), (0.02, y, 0.12)),
        box((0.0, y - 0.02, 0.0), (x, y - 0.001, 0.12)),
        box((0.0, 0.001, 0.0), (x, 0.02, 0.12)),
    ]
    r.add("skirting", sides, r.gloss(0.4, (0.78, 0.77, 0.74)))
    r.add_round("globe lamp (off)", [ball((1.8, 2.5, 2.9), 0.2, 10)], r.gloss(0.1, (0.8, 0.8, 0.78)))
    r.add("cord", [tube([(1.8, 2.5, 3.1), (1.8, 2.5, z)], 0.006, 6)], r.diffuse(0.03, 0.03, 0.03))
    return r
