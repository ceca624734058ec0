"""Planar regions of a noisy mesh, found and made flat.

Dihedral angles alone (`denoise`) leave a crease of a degree across a mirror of two triangles, and where triangles are
as small as the noise they leave normals that wander. A plane through all the points of a flat part knows better.

Regions grow from triangle to triangle (region growing, Besl and Jain 1988): by the angle to the region's plane, and by
the points' distance against the prediction interval of the plane fitted so far. What grew is flat if the data say so:
its points tell well which way it faces, they lie about as far off as the noise takes them, and a bend (quadratic terms)
explains them no better than chance would. Spheres, cushions and cylinders fail the last and stay as they are.
"""

from dataclasses import dataclass

import numpy as np
from scipy import sparse

from ...significance import LEVELS, SIGMA_OF_MAD
from .params import DENOISE


@dataclass(frozen=True)
class Sheet:
    """A flat region.

    Attributes
    ----------
    mean, normal : (3,) float
        Of its plane.
    faces : (f,) int
        Its triangles.
    """

    mean: np.ndarray
    normal: np.ndarray
    faces: np.ndarray


class Moments:
    """Count, sum and scatter of points that come bit by bit, and the plane through them."""

    def __init__(self, origin: np.ndarray):
        self.origin, self.count, self.sum, self.outer = origin, 0, np.zeros(3), np.zeros((3, 3))

    def add(self, points: np.ndarray) -> None:
        arm = points - self.origin
        self.count += len(arm)
        self.sum += arm.sum(0)
        self.outer += arm.T @ arm

    def plane(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Mean (3,), axes (3, 3) in rows, the normal first, and the scatter along each (3,)."""
        mean = self.sum / self.count
        scatter, axes = np.linalg.eigh(self.outer - self.count * np.outer(mean, mean))
        return self.origin + mean, axes.T, np.maximum(scatter, 1e-18)


def paired(edges: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The first and the second of edges ((m, 2) int) that are listed just twice, whichever way round, (k,) int each."""
    low, high = edges.min(1), edges.max(1)
    key = low.astype(np.int64) * (int(edges.max()) + 1) + high
    order = np.argsort(key, kind="stable")
    start = np.flatnonzero(np.r_[True, key[order][1:] != key[order][:-1]])
    start = start[np.diff(np.r_[start, len(order)]) == 2]
    return order[start], order[start + 1]


def neighbours_of(faces: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The triangle across each edge, (t, 3), -1 where there is not just one; and 1 or -1: wound alike or not."""
    count = len(faces)
    edges = np.stack([faces, faces[:, [1, 2, 0]]], 2).reshape(-1, 2)
    first, second = paired(edges)
    across, winding = np.full(3 * count, -1), np.ones(3 * count, np.int8)
    across[first], across[second] = second // 3, first // 3
    winding[first] = winding[second] = np.where(edges[first, 0] == edges[second, 0], -1, 1)
    return across.reshape(-1, 3), winding.reshape(-1, 3)


class Grower:
    """Regions of a mesh.

    Parameters
    ----------
    points : (p, 3) float
        Denoised as far as angles can.
    faces : (t, 3) int
    noise : float
        Metres.
    """

    def __init__(self, points: np.ndarray, faces: np.ndarray, noise: float):
        self.points, self.faces, self.noise = points, faces, noise
        self.across, self.winding = neighbours_of(faces)
        corners = points[faces]
        normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        double_area = np.linalg.norm(normal, axis=1)
        self.normal, self.area = normal / np.maximum(double_area, 1e-30)[:, None], double_area / 2
        self.length = np.linalg.norm(np.roll(corners, -1, 1) - corners, axis=2)
        tilt = noise * self.length.max(1) / np.maximum(double_area, 1e-30)  # noise / height
        # However low a triangle: front and sides of a thin plate are pi / 2 apart.
        self.min_cosine = np.cos(np.minimum(DENOISE.turn + tilt, np.pi / 4))
        self.free, self.tried = np.ones(len(faces), bool), np.zeros(len(faces), bool)
        self._seen, self._met, self._run = np.zeros(len(faces), np.int64), np.zeros(len(points), np.int64), 0

    def seeds(self) -> np.ndarray:
        """Triangles with a neighbour that faces their way, the largest first."""
        parallel = (self.normal[:, None] * self.normal[self.across]).sum(2) * self.winding > self.min_cosine[
            self.across
        ]
        seeds = np.flatnonzero((parallel & (self.across >= 0)).any(1))
        return seeds[np.argsort(-self.area[seeds], kind="stable")]

    def grow(self, seed: int) -> np.ndarray:
        """The triangles around `seed` that lie in one plane with it; those of other sheets are not free.

        A small region is tilted as it meets a step, and grows over it: what then lies farther off than the rest is left
        out again, as a picture on a wall.
        """
        region = self._reached(seed)
        corner, near = self.faces[region], np.ones(len(region), bool)
        for _ in range(LEVELS.reweighted):
            moments = Moments(self.points[corner[0, 0]])
            moments.add(self.points[np.unique(corner[near])])
            mean, axes, _ = moments.plane()
            distance = np.abs((self.points[corner] - mean) @ axes[0])
            spread = SIGMA_OF_MAD * float(np.median(distance))
            closer = (distance <= np.clip(DENOISE.reach * spread, self.noise, DENOISE.reach * self.noise)).all(1)
            if not closer.any() or (closer == near).all():
                break
            near = closer
        # What a region leaves out that was tried before is tried, too: each such triangle would only grow it once more.
        nothing_new = self.tried[region[near]].all()
        self.tried[region if nothing_new else region[near]] = True
        return region[near]

    def _reached(self, seed: int) -> np.ndarray:
        """The triangles that a region reaches that grows from `seed`, (f,) int."""
        self._run += 1
        self._seen[seed] = self._run
        facing, count = self.normal[seed], 0
        moments = Moments(self.points[self.faces[seed, 0]])
        front, sign = np.array([seed]), np.ones(1)
        region = []
        while len(front):
            region.append(front)
            points = np.unique(self.faces[front])
            points = points[self._met[points] != self._run]
            self._met[points] = self._run
            moments.add(self.points[points])
            if moments.count > 1.2 * count:
                mean, axes, scatter = moments.plane()
                axes[0] *= 1 if axes[0] @ facing > 0 else -1
                count = moments.count
            adjacent, winding = self.across[front].ravel(), (sign[:, None] * self.winding[front]).ravel()
            fit = (adjacent >= 0) & self.free[adjacent] & (self._seen[adjacent] != self._run)
            fit &= winding * (self.normal[adjacent] @ axes[0]) > self.min_cosine[adjacent]
            adjacent, first = np.unique(adjacent[fit], return_index=True)
            arm = (self.points[self.faces[adjacent]] - mean) @ axes.T
            variance = 1 + 1 / count + arm[..., 1] ** 2 / scatter[1] + arm[..., 2] ** 2 / scatter[2]
            fits = (arm[..., 0] ** 2 < (DENOISE.reach * self.noise) ** 2 * variance).all(1)
            front, sign = adjacent[fits], winding[fit][first][fits]
            self._seen[front] = self._run
        return np.concatenate(region)

    def outline(self, region: np.ndarray) -> float:
        """Length of a region's outline in metres."""
        inside = np.zeros(len(self.faces), bool)
        inside[region] = True
        across = self.across[region]
        return float(self.length[region][(across < 0) | ~inside[across]].sum())


def sheet_of(points: np.ndarray, region: np.ndarray, area: float, outline: float, noise: float) -> Sheet | None:
    """The sheet that measured points ((p, 3)) of a region lie in; None if it is not sure that they lie in one.

    `area` and `outline` are the region's, in square metres and metres.
    """
    n = len(points)
    moments = Moments(points.mean(0))
    moments.add(points)
    mean, axes, scatter = moments.plane()
    spread = np.sqrt(scatter[1:] / n)  # of y and x, metres
    if n < 4 or noise > DENOISE.known * np.sqrt(scatter[1]):
        return None
    # A rectangle's sides are sqrt(12) times its standard deviations; a strip's width is twice its area by its outline.
    if area < DENOISE.fill * 12 * spread.prod() and noise * outline > DENOISE.known * 4 * area:
        return None
    z, y, x = ((points - mean) @ axes.T).T
    x, y = x / spread[1], y / spread[0]
    flat = np.stack([np.ones(n), x, y], 1)
    bend = np.stack([x * x, x * y, y * y], 1)
    coefficients = np.linalg.lstsq(flat, bend, rcond=None)[0]
    u, s, vt = np.linalg.svd(bend - flat @ coefficients, full_matrices=False)
    determined = s > DENOISE.determined * np.sqrt(n)
    amplitude = (u.T @ z)[determined]
    # Each determined term alone, one in a row, per metre.
    terms = np.concatenate([-(coefficients @ vt[determined].T).T, vt[determined]], 1)
    terms /= np.r_[1, spread[1], spread[0], spread[1] ** 2, spread.prod(), spread[0] ** 2]
    c = (amplitude / s[determined]) @ terms
    x, y = x * spread[1], y * spread[0]

    def slope(c: np.ndarray) -> float:
        """Radians, root mean square over the points."""
        along, across = c[1] + 2 * c[3] * x + c[4] * y, c[2] + c[4] * x + 2 * c[5] * y
        return float(np.sqrt(np.mean(along**2 + across**2)))

    chance = noise * np.sqrt(sum(slope(term) ** 2 for term in terms / s[determined, None]))
    explained = (amplitude**2).sum() / noise**2
    total, freedom = (z**2).sum() / noise**2, n - 3 - determined.sum()
    bent = explained > DENOISE.bent * max(1, (total - explained) / max(freedom, 1))
    gentle = slope(c) < DENOISE.gentle if bent else np.hypot(slope(c), chance) < LEVELS.sigmas * DENOISE.gentle
    # Chi squared within three of its standard deviations.
    likely = total / DENOISE.spread**2 < n - 3 + LEVELS.sigmas * np.sqrt(2 * (n - 3))
    return Sheet(mean, axes[0], region) if likely and gentle else None


def sheets_of(measured: np.ndarray, smooth: np.ndarray, faces: np.ndarray, noise: float) -> tuple[list[Sheet], Grower]:
    """The flat parts of a mesh.

    Parameters
    ----------
    measured, smooth : (p, 3) float
        Points with their noise, and denoised as far as angles can.
    faces : (t, 3) int
    noise : float
        Metres.
    """
    grower, sheets = Grower(smooth, faces, noise), []
    for seed in grower.seeds():
        if grower.tried[seed] or not grower.free[seed]:
            continue
        region = grower.grow(seed)
        points = np.unique(faces[region])
        sheet = sheet_of(measured[points], region, float(grower.area[region].sum()), grower.outline(region), noise)
        if sheet is not None:
            grower.free[region] = False
            sheets.append(sheet)
    return sheets, grower


def onto_sheets(measured: np.ndarray, smooth: np.ndarray, faces: np.ndarray, noise: float) -> np.ndarray:
    """Points moved onto the sheets of their triangles, and onto lines and corners where sheets meet:

        minimise  |x - smooth|^2 + STIFF^2 sum over sheets (distance of x)^2

    Parameters as of `sheets_of`. A point that would go farther than `reach` from where it was measured goes to its
    largest sheet alone; one of no sheet, or too far even from that, is given back `smooth`. (p, 3) float.
    """
    sheets, grower = sheets_of(measured, smooth, faces, noise)
    moved = smooth.copy()
    if not sheets:
        return moved
    owner = np.repeat(np.arange(len(sheets)), [len(s.faces) for s in sheets])
    triangles = np.concatenate([s.faces for s in sheets])
    area = sparse.csr_matrix((np.repeat(grower.area[triangles], 3), (faces[triangles].ravel(), np.repeat(owner, 3))),
                               (len(measured), len(sheets)))  # fmt: skip
    area.sum_duplicates()
    main_sheet = np.asarray(area.argmax(1)).ravel()
    largest = area.max(1).toarray().ravel()
    pair = area.tocoo()
    point, sheet = pair.row, pair.col
    normal = np.stack([s.normal for s in sheets])[sheet]
    gap = ((smooth[point] - np.stack([s.mean for s in sheets])[sheet]) * normal).sum(1)
    facing = np.empty((len(measured), 3))
    main = sheet == main_sheet[point]
    facing[point[main]] = normal[main]
    crossing = main | (np.abs((normal * facing[point]).sum(1)) < np.cos(DENOISE.turn))
    for chosen in (main, crossing):  # last the point where all of its sheets meet, if it may go there
        p, n, g = point[chosen], DENOISE.stiff * normal[chosen], DENOISE.stiff * gap[chosen]
        rhs = np.stack([np.bincount(p, -g * n[:, k], len(measured)) for k in range(3)], 1)
        system = np.stack([np.bincount(p, n[:, i] * n[:, j], len(measured)) for i in range(3) for j in range(3)], 1)
        step = np.linalg.solve(system.reshape(-1, 3, 3) + np.eye(3), rhs[..., None])[..., 0]
        target = smooth + step
        fits = (largest > 0) & (np.linalg.norm(target - measured, axis=1) <= DENOISE.reach * noise)
        moved[fits] = target[fits]
    return moved
