"""Holes of a mesh that was fused from depth, closed where evidence permits: its large planes are completed.

The planes that bound the room (`shape_parts`) are continued to where they meet each other, the other large planes
across the holes within them. They are drawn as cells behind the scan's own border, so that nothing of it is hidden and
no crack is left. Where frames look through such a cell it stays open (`sight`): they see mesh behind it, or something
brighter than the room, or something that nearly all frames would have fused, unless it shows the same colours at the
same places rather than in the same directions (photo-consistency: Seitz and Dyer 1999).
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy import ndimage

from ..significance import LEVELS
from .model import Frame, Mesh, Pixels
from .params import CLOSING, PARTS
from .rays import RayScene
from .shape_parts import Parts, Plane, plane_gap
from .sight import Shown, Sight, between_frames, colours, sight_of


@dataclass(frozen=True)
class Sheet:
    """A large plane as a picture of cells.

    Attributes
    ----------
    corner, right, up : (3,) float64
        Where the first cell begins, and unit vectors along columns and rows.
    edge : float
        Of a cell, metres.
    open : (h, w) bool
        Cells without mesh that the plane may be continued over.
    """

    plane: Plane
    corner: np.ndarray
    right: np.ndarray
    up: np.ndarray
    edge: float
    open: np.ndarray

    def points(self, row: np.ndarray, column: np.ndarray) -> np.ndarray:
        """Places on the plane, in cells from its corner: (n, 3) float64."""
        return self.corner + self.edge * (column[:, None] * self.right + row[:, None] * self.up)

    @property
    def middles(self) -> np.ndarray:
        """Of its open cells, (n, 3) float64."""
        row, column = np.nonzero(self.open)
        return self.points(row + 0.5, column + 0.5)

    def picture(self, value: np.ndarray) -> np.ndarray:
        """Of a value for each open cell ((n,) bool), False elsewhere: (h, w) bool."""
        chosen = np.zeros(self.open.shape, bool)
        chosen[self.open] = value
        return chosen

    def faces(self, chosen: np.ndarray, fine: np.ndarray, behind: float) -> tuple[np.ndarray, np.ndarray]:
        """Vertices (v, 3) and triangles (t, 3) of chosen cells ((h, w) bool), so many metres behind the plane.

        Those that are not `fine` ((h, w) bool) are drawn as squares of up to `CLOSING.block` cells.
        """
        left, wide, rings = chosen.copy(), chosen.shape[1] + 1, []
        size = CLOSING.block
        while size:
            height, width = (n // size for n in left.shape)
            part = np.s_[: height * size, : width * size]
            able = left if size == 1 else left & ~fine
            full = able[part].reshape(height, size, width, size).all((1, 3))
            row, column = np.nonzero(full)
            first = size * (row * wide + column)
            rings.append(np.stack([first, first + size, first + size * (wide + 1), first + size * wide], 1))
            left[part] &= ~full.repeat(size, 0).repeat(size, 1)
            size //= 2
        used, place = np.unique(np.concatenate(rings).ravel(), return_inverse=True)
        place = place.reshape(-1, 4)
        triangles = np.concatenate([place[:, [0, 1, 2]], place[:, [0, 2, 3]]])
        return self.points(used // wide, used % wide) - behind * self.plane.normal, triangles


@dataclass(frozen=True)
class Closing:
    """Faces that close a mesh.

    Attributes
    ----------
    vertices : (v, 3) float64
    triangles : (t, 3) int
        Of these vertices; they face the room.
    part : (t,) int
        The part of the mesh that each continues; one more than there were for a wall that nobody saw.
    names : dict of int to str
        Of all parts.
    """

    vertices: np.ndarray
    triangles: np.ndarray
    part: np.ndarray
    names: dict[int, str]


def close_holes(
    vertices: np.ndarray, triangles: np.ndarray, parts: Parts, frames: Sequence[Frame], read: Callable[[Frame], Pixels]
) -> Closing:
    """Faces for the holes of a mesh in its large planes.

    Parameters
    ----------
    vertices : (v, 3) float64
    triangles : (t, 3) int
    parts : Parts
        Of this mesh.
    read : callable
        Gives a frame's pixels, none of them valid where it is damaged; called where frames look out of the mesh.
    """
    sheets = sheets_of(vertices, triangles, parts.planes)
    number, names = len(parts.names), dict(parts.names)
    corner, face, part, first = [np.zeros((0, 3))], [np.zeros((0, 3), int)], [np.zeros(0, int)], 0
    for sheet, (shut, seen) in zip(sheets, _shut(vertices, triangles, sheets, frames, read), strict=True):
        if not shut.any():
            continue
        own = sheet.plane.part
        if own < 0:
            own, names = number, names | {number: sheet.plane.name}
        off = (vertices[triangles[sheet.plane.faces]].mean(1) - sheet.plane.point) @ sheet.plane.normal
        behind = LEVELS.likely * float(np.sqrt(np.mean(off**2))) if len(off) else 0.0
        # They go on under the scan's border, so that no crack is left.
        grown = shut | ndimage.binary_dilation(shut, np.ones((3, 3))) & ~sheet.open
        points, faces = sheet.faces(grown, seen | ~shut, behind)
        corner.append(points)
        face.append(faces + first)
        part.append(np.full(len(faces), own))
        first += len(points)
    return Closing(np.concatenate(corner), np.concatenate(face), np.concatenate(part), names)


def _shut(
    vertices: np.ndarray,
    triangles: np.ndarray,
    sheets: Sequence[Sheet],
    frames: Sequence[Frame],
    read: Callable[[Frame], Pixels],
) -> list[tuple[np.ndarray, np.ndarray]]:
    """The cells of each sheet that are to be closed, and those that frames see, (h, w) bool each."""
    if not sheets:
        return []
    gap = sheets[0].edge
    mesh = Mesh(vertices, triangles, np.zeros(len(triangles), np.int32))
    scene = RayScene(vertices, triangles)
    points, counts = np.concatenate([sheet.middles for sheet in sheets]), [int(sheet.open.sum()) for sheet in sheets]
    normals, ends = np.repeat([sheet.plane.normal for sheet in sheets], counts, 0), np.cumsum(counts)[:-1]
    sight = sight_of([frame.camera for frame in frames], scene, points, normals, gap)
    closed = 2 * sight.through < np.maximum(sight.through + sight.out, 1)
    looked_at = closed & (sight.out > 0)
    if looked_at.any():
        normal, area = mesh.geometry
        some = np.random.default_rng(0).choice(len(triangles), LEVELS.sample, p=area / area.sum())
        shown = colours(frames, read, sight, scene, vertices[triangles[some]].mean(1), normal[some], gap)
        outside = looked_at & _outside(sight, _groups(sheets, looked_at), shown, gap)
        # Of what hangs together with a window, some may be wall that was not fused: what is not bright is asked again.
        bright = np.bincount(sight.place, shown.clipped | ~(shown.value.mean(1) <= shown.bright), len(points))
        dark = outside & (2 * bright <= sight.out)
        outside &= ~dark | _outside(sight, _groups(sheets, dark), shown, gap)
        closed &= ~outside
    told = zip(sheets, np.split(closed, ends), np.split(sight.out > 0, ends), strict=True)
    return [(_without_specks(sheet.picture(own), sheet.open), sheet.picture(seen)) for sheet, own, seen in told]


def _groups(sheets: Sequence[Sheet], chosen: np.ndarray) -> np.ndarray:
    """Numbers of the open cells ((n,) bool of all sheets) that hang together, (n,) int; -1 for what is not chosen."""
    labels, groups, ends = [], 0, np.cumsum([int(sheet.open.sum()) for sheet in sheets])[:-1]
    for sheet, own in zip(sheets, np.split(chosen, ends), strict=True):
        label, count = ndimage.label(sheet.picture(own), np.ones((3, 3)))
        labels.append(np.where(own, label[sheet.open] + groups - 1, -1))
        groups += count
    return np.concatenate(labels)


def _without_specks(shut: np.ndarray, able: np.ndarray) -> np.ndarray:
    """Cells that are `shut`, and those `able` to be that lie in holes smaller than any window; (h, w) bool each."""
    label, _ = ndimage.label(able & ~shut)
    return shut | (able & ~shut & (np.bincount(label.ravel())[label] <= CLOSING.speck))


def _outside(sight: Sight, group: np.ndarray, shown: Shown, gap: float) -> np.ndarray:
    """Places whose group ((n,) int, -1 for none) frames see past the room in, (n,) bool.

    What lies within `gap` metres of each other, at a place's distance, lies in one direction.
    """
    value, count = shown.value, int(group.max(initial=-1)) + 1
    outside = np.append(np.ones(count, bool), False)  # the last for no group
    of = group[sight.place]
    for one in range(count):
        own = np.flatnonzero(of == one)
        told = own[~shown.clipped[own] & np.isfinite(value[own]).all(1)]
        if len(told) < max(len(own) / 2, 1):
            continue
        if np.median(sight.out[group == one]) <= shown.views:
            outside[one] = False
            continue
        if not np.median(value[told].mean(1)) <= shown.bright:
            continue
        way = np.floor(sight.direction[told] * (np.median(sight.distance[told]) / gap)).astype(int)
        direction = np.unique(way, axis=0, return_inverse=True)[1].ravel()
        here, far = (between_frames(value[told], of, sight.frame[told]) for of in (sight.place[told], direction))
        outside[one] = here >= far
    return outside[group]


def sheets_of(vertices: np.ndarray, triangles: np.ndarray, planes: Sequence[Plane]) -> list[Sheet]:
    """The large planes of a mesh, each with the cells that it may be continued over."""
    gap = plane_gap(vertices[triangles.ravel()])
    corners = vertices[triangles]
    outer = outermost(corners, planes, gap)
    inner = [one for one in planes if not any(_same(one, other, gap) for other in outer)]
    extent = np.concatenate(
        [corners[plane.faces].reshape(-1, 3) for plane in outer if len(plane.faces)] or [corners[0]]
    )
    walls = [plane.normal for plane in outer if plane.name == "wall"]
    found = []
    for number, plane in enumerate([*outer, *inner]):
        bounds = number < len(outer)
        own = corners[plane.faces].reshape(-1, 3)
        right, up = plane_axes(plane.normal, walls)
        reach = extent if bounds else own
        flat = np.stack([reach @ right, reach @ up], 1)
        low = np.floor(flat.min(0) / gap - 1) * gap
        count = np.ceil((flat.max(0) - low) / gap + 1).astype(int)
        corner = (plane.point @ plane.normal) * plane.normal + low[0] * right + low[1] * up
        sheet = Sheet(plane, corner, right, up, gap, np.ones(count[::-1], bool))
        near = np.flatnonzero(np.abs((corners.mean(1) - plane.point) @ plane.normal) < gap)
        covered = _covered(sheet, corners[near])
        if bounds:
            free = ~covered
            middle = sheet.middles
            for other in outer:
                if abs(other.normal @ plane.normal) < np.cos(PARTS.tilt):
                    free.ravel()[(middle - other.point) @ other.normal < -gap] = False
        else:
            free = ndimage.binary_fill_holes(covered) & ~covered
        found.append(replace(sheet, open=free))
    return found


def _same(one: Plane, other: Plane, gap: float) -> bool:
    """Whether two planes are one, to so many metres."""
    return bool(one.normal @ other.normal > np.cos(PARTS.tilt) and abs((one.point - other.point) @ other.normal) < gap)


def outermost(corners: np.ndarray, planes: Sequence[Plane], gap: float) -> list[Plane]:
    """The planes that bound a room, one for each direction; its one wall that nobody saw, if all others are there.

    Parameters
    ----------
    corners : (t, 3, 3) float64
        Of the mesh's triangles.
    """
    kept: list[Plane] = []
    named = [plane for plane in planes if plane.name]
    for plane in sorted(named, key=lambda one: float(one.point @ one.normal)):
        if all(plane.normal @ other.normal < np.cos(PARTS.tilt) for other in kept):
            kept.append(max((one for one in named if _same(one, plane, gap)), key=lambda one: len(one.faces)))
    walls = [plane for plane in kept if plane.name == "wall"]
    level = [plane for plane in kept if plane.name != "wall"]
    alone = [one for one in walls if all(one.normal @ other.normal > -np.cos(PARTS.tilt) for other in walls)]
    if len(level) == 2 and len(walls) > 2 and len(alone) == 1:
        normal = -alone[0].normal
        reach = corners[np.concatenate([plane.faces for plane in level])].reshape(-1, 3)
        point = reach[(reach @ normal).argmin()]
        kept.append(Plane(normal, point, np.zeros(0, int), name="wall"))
    return kept


def plane_axes(normal: np.ndarray, walls: Sequence[np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    """Unit vectors in a plane: level and upright in a wall, along the walls in a floor."""
    along = np.cross([0.0, 0.0, 1.0], normal)
    if np.linalg.norm(along) < np.sin(PARTS.tilt):
        along = np.cross(walls[0] if walls else np.array([1.0, 0.0, 0.0]), normal)
    right = along / np.linalg.norm(along)
    return right, np.cross(normal, right)


def _covered(sheet: Sheet, corners: np.ndarray) -> np.ndarray:
    """Cells that triangles ((n, 3, 3)) cover, (h, w) bool: all of it, as a scan is porous where depth is noisy."""
    fine = CLOSING.fine
    covered = np.zeros(np.multiply(sheet.open.shape, fine), bool)
    longest = np.linalg.norm(corners - np.roll(corners, 1, 1), axis=2).max(1, initial=0)
    steps = np.exp2(np.ceil(np.log2(np.maximum(2 * fine * longest / sheet.edge, 1)))).astype(int)
    for count in np.unique(steps):
        own = corners[steps == count]
        for i in range(count + 1):
            for j in range(count + 1 - i):
                point = own[:, 0] + (i * (own[:, 1] - own[:, 0]) + j * (own[:, 2] - own[:, 0])) / count
                away = (point - sheet.corner) * (fine / sheet.edge)
                row, column = (np.floor(away @ way).astype(int) for way in (sheet.up, sheet.right))
                inside = (row >= 0) & (column >= 0) & (row < covered.shape[0]) & (column < covered.shape[1])
                covered[row[inside], column[inside]] = True
    height, width = sheet.open.shape
    return covered.reshape(height, fine, width, fine).all((1, 3))
