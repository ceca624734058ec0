"""Holes of a mesh that was fused from depth, closed where evidence permits: its planes are completed.

The planes that bound the room (`shape_parts`) are continued to where they meet each other, other planes across the
holes within them, and to the corners of the rectangle around them where frames show that they fill it. They are drawn
as cells behind the scan's own border, so that nothing of it is hidden and no crack is left. Where frames look through
such a cell it stays open (`sight`): they see mesh behind it, or something brighter than the room, or something that
nearly all frames would have fused, unless it shows the same colours at the same places rather than in the same
directions (photo-consistency: Seitz and Dyer 1999).
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy import ndimage

from ..kinds import Block
from ..significance import LEVELS
from .model import Frame, Mesh, Pixels
from .params import CLOSING, PARTS
from .rays import RayScene
from .shape_parts import WALL, Parts, Plane, plane_gap
from .sight import RadianceBeyond, Sight, between_frames, colours, sight_of

AT_ONCE: Block[int] = 1 << 18
"""Points on triangles."""


@dataclass(frozen=True)
class PlaneGrid:
    """A large plane as a grid of cells.

    Attributes
    ----------
    corner, right, up : (3,) float64
        Where the first cell begins, and unit vectors along columns and rows.
    edge : float
        Of a cell, metres.
    bounds : bool
        Whether the plane bounds the room.
    covered : (h, w) bool
        Cells with mesh in all of their parts.
    open : (h, w) bool
        Cells without, that the plane may be continued over.
    """

    plane: Plane
    corner: np.ndarray
    right: np.ndarray
    up: np.ndarray
    edge: float
    bounds: bool
    covered: np.ndarray
    open: np.ndarray

    def points(self, row: np.ndarray, column: np.ndarray) -> np.ndarray:
        """Places on the plane, in cells from its corner: (n, 3) float64."""
        return self.corner + self.edge * (column[:, None] * self.right + row[:, None] * self.up)

    @property
    def centres(self) -> np.ndarray:
        """Centres of its open cells, (n, 3) float64."""
        row, column = np.nonzero(self.open)
        return self.points(row + 0.5, column + 0.5)

    def mask(self, value: np.ndarray) -> np.ndarray:
        """A value for each open cell ((n,) bool) as an image, False elsewhere: (h, w) bool."""
        mask = np.zeros(self.open.shape, bool)
        mask[self.open] = value
        return mask

    def faces(self, chosen: np.ndarray, fine: np.ndarray, behind: float) -> tuple[np.ndarray, np.ndarray]:
        """Vertices (v, 3) and triangles (t, 3) of chosen cells ((h, w) bool), so many metres behind the plane.

        Those that are not `fine` ((h, w) bool) are drawn as squares of up to `CLOSING.block` cells.
        """
        remaining, stride, squares = chosen.copy(), chosen.shape[1] + 1, []
        size = CLOSING.block
        while size:
            height, width = (n // size for n in remaining.shape)
            whole_blocks = np.s_[: height * size, : width * size]
            candidates = remaining if size == 1 else remaining & ~fine
            full = candidates[whole_blocks].reshape(height, size, width, size).all((1, 3))
            row, column = np.nonzero(full)
            corner = size * (row * stride + column)
            squares.append(np.stack([corner, corner + size, corner + size * (stride + 1), corner + size * stride], 1))
            remaining[whole_blocks] &= ~full.repeat(size, 0).repeat(size, 1)
            size //= 2
        vertices, index = np.unique(np.concatenate(squares).ravel(), return_inverse=True)
        index = index.reshape(-1, 4)
        triangles = np.concatenate([index[:, [0, 1, 2]], index[:, [0, 2, 3]]])
        return self.points(vertices // stride, vertices % stride) - behind * self.plane.normal, triangles


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
    viewpoints = np.stack([frame.camera.centre for frame in frames])
    grids = plane_grids(vertices, triangles, parts.planes, viewpoints)
    new_part, names = len(parts.names), dict(parts.names)
    corner, face, part, first = [np.zeros((0, 3))], [np.zeros((0, 3), int)], [np.zeros(0, int)], 0
    for grid, (closed, seen) in zip(grids, _cells_to_close(vertices, triangles, grids, frames, read), strict=True):
        if not closed.any():
            continue
        part_id = grid.plane.part
        if part_id < 0:
            part_id, names = new_part, names | {new_part: grid.plane.name}
        deviation = (vertices[triangles[grid.plane.faces]].mean(1) - grid.plane.point) @ grid.plane.normal
        behind = LEVELS.likely * float(np.sqrt(np.mean(deviation**2))) if len(deviation) else 0.0
        # They continue under the scan's border, so that no crack is left.
        dilated = closed | ndimage.binary_dilation(closed, np.ones((3, 3))) & ~grid.open
        points, faces = grid.faces(dilated, seen | ~closed, behind)
        corner.append(points)
        face.append(faces + first)
        part.append(np.full(len(faces), part_id))
        first += len(points)
    return Closing(np.concatenate(corner), np.concatenate(face), np.concatenate(part), names)


def _cells_to_close(
    vertices: np.ndarray,
    triangles: np.ndarray,
    grids: Sequence[PlaneGrid],
    frames: Sequence[Frame],
    read: Callable[[Frame], Pixels],
) -> list[tuple[np.ndarray, np.ndarray]]:
    """The cells of each grid that are to be closed, and those that frames see, (h, w) bool each."""
    if not grids:
        return []
    gap = grids[0].edge
    mesh = Mesh(vertices, triangles, np.zeros(len(triangles), np.int32))
    scene = RayScene(vertices, triangles)
    points, counts = np.concatenate([grid.centres for grid in grids]), [int(grid.open.sum()) for grid in grids]
    normals, ends = np.repeat([grid.plane.normal for grid in grids], counts, 0), np.cumsum(counts)[:-1]
    sight = sight_of([frame.camera for frame in frames], scene, points, normals, gap)
    closed = 2 * sight.through < np.maximum(sight.through + sight.out, 1)
    # Past furniture one frame may see by its pose's error.
    furniture = np.repeat([not grid.bounds for grid in grids], counts)
    closed |= furniture & (sight.through + sight.out == 1)
    # Nobody looks outside through a floor: what is bright there is the sun on it.
    floor = np.repeat([grid.plane.name == "floor" for grid in grids], counts)
    looked_at = closed & (sight.out > 0) & ~floor
    if looked_at.any():
        normal, area = mesh.geometry
        sample = np.random.default_rng(0).choice(len(triangles), LEVELS.sample, p=area / area.sum())
        beyond = colours(frames, read, sight, scene, vertices[triangles[sample]].mean(1), normal[sample], gap)
        outside = looked_at & _outside(sight, _groups(grids, looked_at), beyond, gap)
        # Of what is connected with a window, some may be wall that was not fused: what is not bright is tested again.
        bright = np.bincount(sight.place, beyond.clipped | ~(beyond.value.mean(1) <= beyond.bright), len(points))
        dark = outside & (2 * bright <= sight.out)
        outside &= ~dark | _outside(sight, _groups(grids, dark), beyond, gap)
        closed &= ~outside
    by_grid = zip(grids, np.split(closed, ends), np.split(sight.out > 0, ends), strict=True)
    cells = []
    for grid, closed_cells, seen_cells in by_grid:
        grid_closed, seen = _with_specks_closed(grid.mask(closed_cells), grid.open), grid.mask(seen_cells)
        if not grid.bounds:
            # Of a rim narrower than 3 cells the scan covers a part.
            wide = ndimage.binary_opening(grid_closed, np.ones((3, 3))) & _is_rectangle(grid, grid_closed)
            grid_closed &= wide | ndimage.binary_fill_holes(grid.covered)
        if grid.plane.name == WALL:
            grid_closed = _with_windows_whole(grid_closed, seen, grid.open)
        cells.append((grid_closed, seen))
    return cells


def _groups(grids: Sequence[PlaneGrid], chosen: np.ndarray) -> np.ndarray:
    """Labels of the open cells ((n,) bool of all grids) that are connected, (n,) int; -1 for what is not chosen."""
    labels, groups, ends = [], 0, np.cumsum([int(grid.open.sum()) for grid in grids])[:-1]
    for grid, cells in zip(grids, np.split(chosen, ends), strict=True):
        label, count = ndimage.label(grid.mask(cells), np.ones((3, 3)))
        labels.append(np.where(cells, label[grid.open] + groups - 1, -1))
        groups += count
    return np.concatenate(labels)


def _is_rectangle(grid: PlaneGrid, closed: np.ndarray) -> bool:
    """Whether a plane fills the rectangle around it, as frames see it: they see past an L, and past a round table.

    `closed`, (h, w) bool, are the open cells that frames don't see past.
    """
    known = grid.covered | grid.open & ~closed
    return bool(grid.covered.sum() > CLOSING.rectangle * known.sum())


def _with_specks_closed(closed: np.ndarray, candidates: np.ndarray) -> np.ndarray:
    """`closed` cells, and those of the `candidates` that lie in holes smaller than any window; (h, w) bool each."""
    label, _ = ndimage.label(candidates & ~closed)
    return closed | (candidates & ~closed & (np.bincount(label.ravel())[label] <= CLOSING.speck))


def _with_windows_whole(closed: np.ndarray, seen: np.ndarray, candidates: np.ndarray) -> np.ndarray:
    """`closed` cells without what no frame saw of a window that frames look out by; (h, w) bool each.

    A window is a rectangle. Where its top is out of every picture it would let in too little of the sky, and no sun.
    """
    looked_through, closed = candidates & ~closed, closed.copy()
    # Glazing bars are narrower than two cells.
    label, _ = ndimage.label(ndimage.binary_dilation(looked_through, np.ones((3, 3))), np.ones((3, 3)))
    for box in ndimage.find_objects(np.where(looked_through, label, 0)):
        unseen = closed[box] & ~seen[box]
        if unseen.sum() < looked_through[box].sum():
            closed[box] &= ~unseen
    return closed


def _outside(sight: Sight, group: np.ndarray, beyond: RadianceBeyond, gap: float) -> np.ndarray:
    """Places whose group ((n,) int, -1 for none) frames see past the room in, (n,) bool.

    What lies within `gap` metres of each other, at a place's distance, lies in one direction.
    """
    value, count = beyond.value, int(group.max(initial=-1)) + 1
    outside = np.append(np.ones(count, bool), False)  # the last for no group
    group_of = group[sight.place]
    for i in range(count):
        members = np.flatnonzero(group_of == i)
        usable = members[~beyond.clipped[members] & np.isfinite(value[members]).all(1)]
        if len(usable) < max(len(members) / 2, 1):
            continue
        if np.median(sight.out[group == i]) <= beyond.views:
            outside[i] = False
            continue
        if not np.median(value[usable].mean(1)) <= beyond.bright:
            continue
        cell = np.floor(sight.direction[usable] * (np.median(sight.distance[usable]) / gap)).astype(int)
        direction = np.unique(cell, axis=0, return_inverse=True)[1].ravel()
        by_place, by_direction = (
            between_frames(value[usable], label, sight.frame[usable]) for label in (sight.place[usable], direction)
        )
        outside[i] = by_place >= by_direction
    return outside[group]


def plane_grids(
    vertices: np.ndarray, triangles: np.ndarray, planes: Sequence[Plane], viewpoints: np.ndarray
) -> list[PlaneGrid]:
    """The large planes of a mesh that was seen from (f, 3) viewpoints, each with the cells that it may go on over."""
    gap = plane_gap(vertices[triangles.ravel()])
    corners = vertices[triangles]
    outer = outermost(corners, planes, gap, viewpoints)
    inner = [plane for plane in planes if not any(_coincide(plane, outer_plane, gap) for outer_plane in outer)]
    extent = np.concatenate(
        [corners[plane.faces].reshape(-1, 3) for plane in outer if len(plane.faces)] or [corners[0]]
    )
    walls = [plane.normal for plane in outer if plane.name == WALL]
    grids = []
    for number, plane in enumerate([*outer, *inner]):
        bounds = number < len(outer)
        points = corners[plane.faces].reshape(-1, 3)
        right, up = plane_axes(plane.normal, walls)
        span = extent if bounds else points
        coordinates = np.stack([span @ right, span @ up], 1)
        low = np.floor(coordinates.min(0) / gap - 1) * gap
        count = np.ceil((coordinates.max(0) - low) / gap + 1).astype(int)
        corner = (plane.point @ plane.normal) * plane.normal + low[0] * right + low[1] * up
        near = np.flatnonzero(np.abs((corners.mean(1) - plane.point) @ plane.normal) < gap)
        none = np.zeros(count[::-1], bool)
        grid = PlaneGrid(plane, corner, right, up, gap, bounds, none, ~none)
        covered = _covered(grid, corners[near])
        free, middle = ~covered, grid.centres
        for other in outer:
            if abs(other.normal @ plane.normal) < np.cos(PARTS.tilt):
                free.ravel()[(middle - other.point) @ other.normal < -gap] = False
        if not bounds:
            free &= _rectangle_around(_covered(grid, corners[plane.faces]))
        grids.append(replace(grid, covered=covered, open=free))
    return grids


def _rectangle_around(cells: np.ndarray) -> np.ndarray:
    """The least rectangle that holds all of the cells, (h, w) bool each."""
    rectangle = np.zeros_like(cells)
    for box in ndimage.find_objects(cells.astype(np.int8)):
        rectangle[box] = True
    return rectangle


def _coincide(a: Plane, b: Plane, gap: float) -> bool:
    """Whether two planes coincide, to within `gap` metres."""
    return bool(a.normal @ b.normal > np.cos(PARTS.tilt) and abs((a.point - b.point) @ b.normal) < gap)


def outermost(corners: np.ndarray, planes: Sequence[Plane], gap: float, viewpoints: np.ndarray) -> list[Plane]:
    """The planes that bound a room, one for each direction; its one wall that nobody saw, if all others are there.

    Parameters
    ----------
    corners : (t, 3, 3) float64
        Of the mesh's triangles.
    viewpoints : (f, 3) float64
        Where frames were taken from. What has more than a few of them behind it would hang in the midst of the room.
    """
    bounds: list[Plane] = []
    named = [
        plane
        for plane in planes
        if plane.name and np.mean((viewpoints - plane.point) @ plane.normal > 0) >= PARTS.outer
    ]
    for plane in sorted(named, key=lambda plane: float(plane.point @ plane.normal)):
        if all(plane.normal @ other.normal < np.cos(PARTS.tilt) for other in bounds):
            bounds.append(
                max(
                    (candidate for candidate in named if _coincide(candidate, plane, gap)),
                    key=lambda candidate: len(candidate.faces),
                )
            )
    walls = [plane for plane in bounds if plane.name == WALL]
    level = [plane for plane in bounds if plane.name != WALL]
    alone = [wall for wall in walls if all(wall.normal @ other.normal > -np.cos(PARTS.tilt) for other in walls)]
    if len(level) == 2 and len(walls) > 2 and len(alone) == 1:
        normal = -alone[0].normal
        points = corners[np.concatenate([plane.faces for plane in level])].reshape(-1, 3)
        depth = min((points @ normal).min(), np.quantile(viewpoints @ normal, 1 - PARTS.outer))
        bounds.append(Plane(normal, depth * normal, np.zeros(0, int), name=WALL))
    return bounds


def plane_axes(normal: np.ndarray, walls: Sequence[np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    """Unit vectors in a plane: level and upright in a wall, along the walls in a floor."""
    along = np.cross([0.0, 0.0, 1.0], normal)
    if np.linalg.norm(along) < np.sin(PARTS.tilt):
        along = np.cross(walls[0] if walls else np.array([1.0, 0.0, 0.0]), normal)
    right = along / np.linalg.norm(along)
    return right, np.cross(normal, right)


def _covered(grid: PlaneGrid, corners: np.ndarray) -> np.ndarray:
    """Cells that triangles ((n, 3, 3)) cover, (h, w) bool: all of it, as a scan is porous where depth is noisy."""
    fine = CLOSING.fine
    covered = np.zeros(np.multiply(grid.open.shape, fine), bool)
    place = (corners - grid.corner) @ np.stack([grid.up, grid.right], 1) / grid.edge
    corners = corners[((place.max(1) >= 0) & (place.min(1) <= grid.open.shape)).all(1)]
    longest = np.linalg.norm(corners - np.roll(corners, 1, 1), axis=2).max(1, initial=0)
    steps = np.exp2(np.ceil(np.log2(np.maximum(2 * fine * longest / grid.edge, 1)))).astype(int)
    for count in np.unique(steps):
        first, second, third = corners[steps == count].swapaxes(0, 1)
        size = max(AT_ONCE // len(first), 1)
        for i in range(count + 1):
            for at in range(0, count + 1 - i, size):
                j = np.arange(at, min(at + size, count + 1 - i))[:, None, None]
                point = (first + (i * (second - first) + j * (third - first)) / count).reshape(-1, 3)
                offset = (point - grid.corner) * (fine / grid.edge)
                row, column = (np.floor(offset @ axis).astype(int) for axis in (grid.up, grid.right))
                inside = (row >= 0) & (column >= 0) & (row < covered.shape[0]) & (column < covered.shape[1])
                covered[row[inside], column[inside]] = True
    height, width = grid.open.shape
    return covered.reshape(height, fine, width, fine).all((1, 3))
