"""Lenses that bend by polynomials: Brown-Conrady, OpenCV's rational one, Kannala-Brandt fisheyes, thin prisms.

Their inverses are found by Newton's method, in the disc on which the model is one to one.
"""

import functools
import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ..kinds import Block, Unit
from ..parallel import blocks
from .lens import ahead

STEEPEST = math.tan(math.radians(89.99))
"""Tangent of the widest angle that a perspective lens is followed to."""
ROOT: Unit[float] = 1e-12
"""A denominator up to this counts as 0: where it only touches 0, rounding hides on which side of the root it is."""
ENTRIES: Block[int] = 2049
"""Of the table from which the search for a radius starts."""
AZIMUTHS = 64
RIM = 0.999
"""Share of the radius that was found by samples in `AZIMUTHS` directions, for what lies between them."""
STEPS: Block[int] = 60
STEPS_2D: Block[int] = 20
CLOSE: Unit[float] = 1e-13
"""A search ends when it is this near its target, relative to 1 plus the radius."""
BLOCK: Block[int] = 1 << 16
"""Points at a time: their numbers stay in the processor's cache."""


def _poly(coefficients: tuple[float, ...], s: np.ndarray) -> np.ndarray:
    """1 + c0 s + c1 s^2 + ..."""
    value = np.zeros_like(s)
    for c in reversed(coefficients):
        value = (value + c) * s
    return value + 1


def _slope(coefficients: tuple[float, ...], s: np.ndarray) -> np.ndarray:
    """Derivative of `_poly` by s."""
    value = np.zeros_like(s)
    for power, c in reversed(list(enumerate(coefficients, 1))):
        value = value * s + power * c
    return value


def _by_blocks(
    function: Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]], values: np.ndarray, width: int
) -> tuple[np.ndarray, np.ndarray]:
    """What a function of rows ((n, k)) gives, (n, width) and (n,) bool, called with `BLOCK` of them at a time."""
    values = np.asarray(values, np.float64)
    result, valid = np.empty((len(values), width)), np.empty(len(values), bool)
    for block in blocks(len(values), BLOCK):
        result[block], valid[block] = function(values[block])
    return result, valid


@dataclass(frozen=True)
class Polynomial:
    """x_d = x N(s) / D(s) + tangential + prism, s = x^2 + y^2; (x, y) is the ray's point before distortion.

    Tangential and prism, of the point (a, b) with t = a^2 + b^2::

        2 p1 a b + p2 (t + 2 a^2) + s0 t + s1 t^2
        2 p2 a b + p1 (t + 2 b^2) + s2 t + s3 t^2

    Brown, "Decentering distortion of lenses" (1966); OpenCV's calib3d; Kannala and Brandt, "A generic camera model"
    (2006); Project Aria's Fisheye624. Names as COLMAP's src/colmap/sensor/models.h.

    Attributes
    ----------
    fisheye : bool
        (x, y) has the ray's angle from z as its length (up to pi); else it is (X, Y) / Z.
    numerator, denominator : tuple of float
        N = 1 + n0 s + n1 s^2 + ..., D likewise.
    tangential : (p1, p2)
    prism : (s0, s1, s2, s3)
    chained : bool
        (a, b) is the point after the radial part; else (x, y).
    """

    name: str
    fisheye: bool
    numerator: tuple[float, ...] = ()
    denominator: tuple[float, ...] = ()
    tangential: tuple[float, float] = (0.0, 0.0)
    prism: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 0.0)
    chained: bool = False

    @property
    def radial(self) -> bool:
        """Whether nothing but the radius changes."""
        return not any(self.tangential) and not any(self.prism)

    @property
    def widest(self) -> float:
        return self.limit if self.fisheye else math.atan(self.limit)

    @functools.cached_property
    def limit(self) -> float:
        """Radius of the disc of points before distortion on which the model is one to one.

        A map whose Jacobian's symmetric part is positive definite on a convex domain is one to one there. Without
        tangential part and prism that is just where r_d grows with r.
        """
        end = math.pi if self.fisheye else STEEPEST
        end = float(_first_fall(self._growing, self._spread(end), np.zeros(1))[0])
        if self.radial:
            return end * (1 - 1e-12)
        phi = np.arange(AZIMUTHS) * (2 * np.pi / AZIMUTHS)
        return RIM * float(_first_fall(self._definite, self._spread(end)[::4], phi).min())

    def _spread(self, end: float) -> np.ndarray:
        """`ENTRIES` radii from 0 to `end`, evenly by angle."""
        share = np.linspace(0, 1, ENTRIES)
        return share * end if self.fisheye else np.tan(share * math.atan(end))

    def _growing(self, r: np.ndarray, phi: np.ndarray) -> np.ndarray:
        """Whether r_d grows with r, before the denominator's first root."""
        s = r * r
        n, d = _poly(self.numerator, s), _poly(self.denominator, s)
        return (d > ROOT) & ((n + 2 * s * _slope(self.numerator, s)) * d > 2 * s * n * _slope(self.denominator, s))

    def _definite(self, r: np.ndarray, phi: np.ndarray) -> np.ndarray:
        """Whether the Jacobian's symmetric part is positive definite."""
        with np.errstate(divide="ignore", over="ignore", invalid="ignore"):  # the last radius may be the root itself
            j = self._distort(r * np.cos(phi), r * np.sin(phi))[2]
            return (j[0] + j[3]) / 2 > np.hypot((j[0] - j[3]) / 2, (j[1] + j[2]) / 2)

    def _distort(self, x: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray, tuple[np.ndarray, ...]]:
        """The distorted point, and the Jacobian's four entries row by row."""
        s = x * x + y * y
        n, d = _poly(self.numerator, s), _poly(self.denominator, s)
        ratio = n / d
        twice = 2 * (_slope(self.numerator, s) - ratio * _slope(self.denominator, s)) / d  # 2 d(ratio)/ds
        j = ratio + twice * x * x, twice * x * y, twice * x * y, ratio + twice * y * y
        u, v = x * ratio, y * ratio
        if self.radial:
            return u, v, j
        (p1, p2), (s0, s1, s2, s3) = self.tangential, self.prism
        a, b = (u, v) if self.chained else (x, y)
        t = a * a + b * b
        across, down = 2 * (s0 + 2 * s1 * t), 2 * (s2 + 2 * s3 * t)
        e = (2 * p1 * b + 6 * p2 * a + across * a, 2 * p1 * a + 2 * p2 * b + across * b,
             2 * p2 * b + 2 * p1 * a + down * a, 2 * p2 * a + 6 * p1 * b + down * b)  # fmt: skip
        u = u + 2 * p1 * a * b + p2 * (t + 2 * a * a) + (s0 + s1 * t) * t
        v = v + 2 * p2 * a * b + p1 * (t + 2 * b * b) + (s2 + s3 * t) * t
        if not self.chained:
            return u, v, tuple(i + k for i, k in zip(j, e))
        e = 1 + e[0], e[1], e[2], 1 + e[3]
        return u, v, (e[0] * j[0] + e[1] * j[2], e[0] * j[1] + e[1] * j[3],
                      e[2] * j[0] + e[3] * j[2], e[2] * j[1] + e[3] * j[3])  # fmt: skip

    def project(self, rays: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        return _by_blocks(self._project, rays, 2)

    def _project(self, rays: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        x, y, z = rays.T
        radius = np.hypot(x, y)
        if self.fisheye:
            theta = np.arctan2(radius, z)
            axis = radius <= 1e-12 * np.abs(z)
            valid = (theta <= self.limit) & ~(axis & (z <= 0))  # straight behind lies a whole circle
            scale = np.where(axis, 1, theta) / np.where(axis, np.where(z > 0, z, 1), np.maximum(radius, 1e-300))
        else:
            valid = (z > 0) & (radius <= self.limit * z)
            scale = 1 / np.where(valid, z, 1)
        scale = np.where(valid, scale, 0)
        u, v, _ = self._distort(x * scale, y * scale)
        return np.stack([u, v], -1), valid

    def unproject(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        return _by_blocks(self._unproject, points, 3)

    def _unproject(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        u, v = points.T
        radius = np.hypot(u, v)
        if self.radial:
            r, valid = self._radius(radius)
        else:
            r = np.interp(radius, *self._table[::-1])
        scale = np.where(radius > 1e-12, r / np.maximum(radius, 1e-300), 1)
        x, y = u * scale, v * scale
        if not self.radial:
            x, y, valid = self._refine(u, v, x, y)
            r = np.hypot(x, y)
        if self.fisheye:
            rays = np.stack([x * np.sinc(r / np.pi), y * np.sinc(r / np.pi), np.cos(r)], -1)
        else:
            level = 1 / np.sqrt(1 + r * r)
            rays = np.stack([x * level, y * level, level], -1)
        return ahead(rays, valid), valid

    @functools.cached_property
    def _table(self) -> tuple[np.ndarray, np.ndarray]:
        """Radii before and after the radial part, rising."""
        before = self._spread(self.limit)
        return before, np.maximum.accumulate(self._bent(before)[0])

    def _bent(self, r: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The radius after the radial part, and its derivative."""
        s = r * r
        n, d = _poly(self.numerator, s), _poly(self.denominator, s)
        ratio = n / d
        slope = ratio + 2 * s * (_slope(self.numerator, s) - ratio * _slope(self.denominator, s)) / d
        return r * ratio, slope

    def _radius(self, target: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The radius before the radial part: Newton's method between two entries of the table."""
        before, after = self._table
        valid = target <= after[-1]
        target = np.where(valid, target, after[-1])
        index = np.clip(np.searchsorted(after, target), 1, len(after) - 1)
        low, high = before[index - 1], before[index]
        span = after[index] - after[index - 1]
        r = low + (high - low) * np.where(span > 0, (target - after[index - 1]) / np.where(span > 0, span, 1), 0)
        return _bracketed(self._bent, target, r, low, high), valid

    def _refine(self, u: np.ndarray, v: np.ndarray, x: np.ndarray, y: np.ndarray):
        """Newton's method in two dimensions, from the radial part's inverse; steps are halved where they lead astray.

        Returns x, y, and whether they converged within the disc.
        """
        x, y, converged = x.copy(), y.copy(), np.zeros(len(x), bool)
        active = np.arange(len(x))  # those still searched for
        goal = CLOSE * (1 + np.hypot(u, v))
        du, dv, j = self._off(u, v, x, y)
        for _ in range(STEPS_2D):
            size = np.hypot(du, dv)
            done = size <= goal[active]
            converged[active[done]] = True
            todo = ~done
            if not todo.any():
                break
            active, du, dv, size, j = active[todo], du[todo], dv[todo], size[todo], tuple(i[todo] for i in j)
            safe = np.maximum(j[0] * j[3] - j[1] * j[2], 1e-12)
            dx, dy = (j[3] * du - j[1] * dv) / safe, (j[0] * dv - j[2] * du) / safe
            step = np.ones(len(active))
            for _ in range(8):
                nx, ny = x[active] - step * dx, y[active] - step * dy
                inward = np.minimum(1, self.limit / np.maximum(np.hypot(nx, ny), 1e-300))
                nx, ny = nx * inward, ny * inward
                du, dv, j = self._off(u[active], v[active], nx, ny)
                worse = np.hypot(du, dv) > np.maximum(size, goal[active])
                if not worse.any():
                    break
                step[worse] /= 2
            stuck = worse | (nx == x[active]) & (ny == y[active])
            x[active], y[active] = nx, ny
            # As near as rounding lets it come.
            converged[active[stuck & (np.hypot(du, dv) <= 1e3 * goal[active])]] = True
            active, du, dv, j = active[~stuck], du[~stuck], dv[~stuck], tuple(i[~stuck] for i in j)
        return x, y, converged

    def _off(self, u: np.ndarray, v: np.ndarray, x: np.ndarray, y: np.ndarray):
        u_d, v_d, j = self._distort(x, y)
        return u_d - u, v_d - v, j


def _first_fall(condition: Callable, radii: np.ndarray, phi: np.ndarray) -> np.ndarray:
    """The radius up to which `condition` holds in each direction `phi`: found among `radii`, then by bisection."""
    holds = condition(radii[:, None] + 0 * phi, phi)
    first = np.where(holds.all(0), len(radii), holds.argmin(0))
    low, high = radii[np.maximum(first - 1, 0)], radii[np.minimum(first, len(radii) - 1)]
    for _ in range(50):
        middle = (low + high) / 2
        holds_at = condition(middle, phi)
        low, high = np.where(holds_at, middle, low), np.where(holds_at, high, middle)
    return np.where(first == len(radii), radii[-1], low)


def _bracketed(function: Callable, target: np.ndarray, r: np.ndarray, low: np.ndarray, high: np.ndarray) -> np.ndarray:
    """Where a rising function of the radius reaches `target`, known to be between `low` and `high`."""
    result = r.copy()
    active = np.arange(len(r))
    goal = CLOSE * (1 + target)
    for _ in range(STEPS):
        value, slope = function(r)
        residual = value - target[active]
        result[active] = r
        todo = np.abs(residual) > goal[active]
        if not todo.any():
            break
        active, r, residual, slope, low, high = (x[todo] for x in (active, r, residual, slope, low, high))
        low, high = np.where(residual < 0, r, low), np.where(residual > 0, r, high)
        step = r - residual / np.maximum(slope, 1e-300)
        r = np.where((step > low) & (step < high), step, (low + high) / 2)
    return result
