"""Shapes beyond the demo's: tubes, turned pieces, cushions, curtains, walls with openings; and textures.

A shape is corners (q, 4, 3) and uv (q, 4, 2), as in `addon.bridge.demo.room`.
"""

import numpy as np

from addon.bridge.demo.room import ball, grid

Shape = tuple[np.ndarray, np.ndarray]


def _patch(points: np.ndarray) -> Shape:
    """Quads between the points (m, n, 3) of a bent sheet, with uv over the whole of it."""
    m, n = points.shape[:2]
    a, b = np.meshgrid(np.linspace(0, 1, m), np.linspace(0, 1, n), indexing="ij")
    uv = np.stack([a, b], -1)

    def quads(x):
        return np.stack([x[:-1, :-1], x[1:, :-1], x[1:, 1:], x[:-1, 1:]], 2).reshape(-1, 4, x.shape[-1])

    return quads(points), quads(uv)


def tube(path, radius: float, steps: int = 10) -> Shape:
    """A round tube along the corners `path` (m, 3)."""
    path = np.asarray(path, float)
    along = np.gradient(path, axis=0)
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    side = np.cross(along[0], (0.31, 0.9, 0.3))
    rings = []
    for point, ahead in zip(path, along):
        side = side - ahead * (side @ ahead)
        side = side / np.linalg.norm(side)
        turn = np.linspace(0, 2 * np.pi, steps + 1)[:, None]
        rings.append(point + radius * (np.cos(turn) * side + np.sin(turn) * np.cross(ahead, side)))
    return _patch(np.array(rings).transpose(1, 0, 2))


def arc(a, b, rise, count: int = 12) -> np.ndarray:
    """Points (count, 3) of a half ellipse from `a` to `b` that is `rise` ((3,)) away in its middle."""
    t = np.linspace(0, np.pi, count)[:, None]
    a, b = np.asarray(a, float), np.asarray(b, float)
    return (a + b) / 2 - np.cos(t) * (b - a) / 2 + np.sin(t) * np.asarray(rise, float)


def turned(centre, profile, steps: int = 28) -> Shape:
    """A piece from the lathe: `profile` (m, 2) is radius and height from the bottom up."""
    turn = np.linspace(0, 2 * np.pi, steps + 1)
    ring = np.stack([np.cos(turn), np.sin(turn)], -1)
    points = [np.concatenate([max(r, 0.002) * ring, np.full((steps + 1, 1), h)], 1) for r, h in profile]
    return _patch(np.asarray(centre) + np.array(points).transpose(1, 0, 2))


def cushion(centre, extent, steps: int = 8, round_off: float = 0.45) -> Shape:
    """A box of half edges `extent` with its edges rounded off."""
    quads, uv = ball((0, 0, 0), 1.0, steps)
    bulged = np.sign(quads) * np.abs(quads) ** round_off
    return np.asarray(centre) + bulged * np.asarray(extent), uv


def curtain(origin, across, height: float, depth, waves: int = 7, columns: int = 56, rows: int = 4) -> Shape:
    """Cloth that hangs in waves."""
    t, h = np.meshgrid(np.linspace(0, 1, columns + 1), np.linspace(0, 1, rows + 1), indexing="ij")
    wave = np.sin(2 * np.pi * waves * t) * (1 - 0.4 * h)
    return _patch(
        np.asarray(origin)
        + t[..., None] * np.asarray(across, float)
        + h[..., None] * (0, 0, height)
        + wave[..., None] * np.asarray(depth, float)
    )


def wall(origin, across, up, holes=(), cell: float = 0.3) -> Shape:
    """A wall with rectangular `holes` ((left, right, low, high) in metres); uv over the whole wall."""
    origin, across, up = (np.asarray(x, float) for x in (origin, across, up))
    width, height = np.linalg.norm(across), np.linalg.norm(up)
    xs = np.unique(np.round([0, width, *(h[0] for h in holes), *(h[1] for h in holes)], 6))
    zs = np.unique(np.round([0, height, *(h[2] for h in holes), *(h[3] for h in holes)], 6))
    quads = []
    for a, b in zip(xs[:-1], xs[1:]):
        for c, d in zip(zs[:-1], zs[1:]):
            x, z = (a + b) / 2, (c + d) / 2
            if any(h[0] < x < h[1] and h[2] < z < h[3] for h in holes):
                continue
            start = origin + across * (a / width) + up * (c / height)
            quads.append(
                grid(
                    start,
                    across * ((b - a) / width),
                    up * ((d - c) / height),
                    max(1, round((b - a) / cell)),
                    max(1, round((d - c) / cell)),
                )[0]
            )
    quads = np.concatenate(quads)
    uv = np.stack([(quads - origin) @ across / width**2, (quads - origin) @ up / height**2], -1)
    return quads, uv


def _xy(size: int):
    y, x = np.mgrid[:size, :size] / size
    return x, y


def tiles(colours, grout, columns: int, rows: int, seed: int, joint: float = 0.05, size: int = 384) -> np.ndarray:
    """Tiles of `colours` ((k, 3), by chance) with joints, (size, size, 3) float32."""
    rng = np.random.default_rng(seed)
    x, y = _xy(size)
    kind = rng.integers(0, len(colours), (rows, columns))
    tone = rng.uniform(0.93, 1.07, (rows, columns))
    i, j = (y * rows).astype(int), (x * columns).astype(int)
    picture = np.asarray(colours, float)[kind[i, j]] * tone[i, j][..., None]
    at_joint = ((x * columns) % 1 < joint) | ((y * rows) % 1 < joint * rows / columns)
    picture[at_joint] = grout
    return np.clip(picture, 0, 0.95).astype(np.float32)


def checker(first, second, count: int, size: int = 256) -> np.ndarray:
    """A chessboard."""
    x, y = _xy(size)
    odd = ((x * count).astype(int) + (y * count).astype(int)) % 2
    return np.where(odd[..., None], first, second).astype(np.float32)


def clouds(low, high, scale: float, seed: int, size: int = 256, sharp: float = 1.0) -> np.ndarray:
    """Marble or carpet: smooth noise of a few octaves between two colours."""
    rng = np.random.default_rng(seed)
    k = np.fft.fftfreq(size)[:, None] ** 2 + np.fft.fftfreq(size)[None] ** 2
    noise = np.fft.ifft2(np.fft.fft2(rng.normal(size=(size, size))) / (k + (scale / size) ** 2) ** 0.75).real
    level = 1 / (1 + np.exp(-sharp * 1.5 * noise / noise.std()))
    return (level[..., None] * np.subtract(high, low) + low).astype(np.float32)


def wood(colour, boards: int, seed: int, size: int = 256) -> np.ndarray:
    """Boards with grain."""
    rng = np.random.default_rng(seed)
    x, y = _xy(size)
    row = np.minimum((y * boards).astype(int), boards - 1)
    tone = rng.uniform(0.75, 1.2, boards)[row] * (1 + 0.15 * np.sin(60 * y * boards + 4 * np.sin(8 * x + 3 * row)))
    tone[(y * boards) % 1 < 0.04] *= 0.5
    return np.clip(tone[..., None] * np.asarray(colour), 0, 0.95).astype(np.float32)


def stripes(colours, count: int, size: int = 128) -> np.ndarray:
    """Stripes of `colours` ((k, 3)) in turn."""
    x, _ = _xy(size)
    return np.asarray(colours, np.float32)[(x * count).astype(int) % len(colours)]
