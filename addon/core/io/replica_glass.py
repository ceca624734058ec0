"""Replica's `glass.sur`: the planes of glass and mirrors, and which object of the mesh each of them is."""

import json
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..kinds import Limit
from ..scene.model import KnownMirror
from ..scene.params import COPLANAR
from .layout import RawMesh
from .mesh_repair import MAX_COORDINATE

FILE = "glass.sur"
MIRROR = 0.5
"""From this reflectivity on a pane counts as a mirror; below it is glass."""
OWN_SHARE = 0.7
"""Share of an object's surface that lies in the pane from which on the object is that pane."""
MAX_BYTES: Limit[int] = 1 << 26


@dataclass(frozen=True)
class Pane:
    """A flat piece of glass or mirror.

    Attributes
    ----------
    normal : (3,) float64
        Unit; points x of the pane have normal . x = offset.
    boundary : (k, 3) float64
        Its corners.
    """

    normal: np.ndarray
    offset: float
    boundary: np.ndarray
    reflectivity: float


def read_panes(path: Path) -> tuple[list[Pane], list[str]]:
    """The panes that the file lists, and a sentence where some can't be used; a file that is none is told, not raised.

    A pane is `plane_w` (n, d with n x + d = 0), `boundary_w` and `reflectivity`.
    """
    try:
        if path.stat().st_size > MAX_BYTES:
            raise ValueError("it is too large")
        listed = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError) as error:
        return [], [f"'{path}' can't be read ({error}); its mirrors are not known."]
    listed = listed if isinstance(listed, list) else []
    panes = []
    for item in listed:
        try:
            plane = np.array(item["plane_w"], np.float64).ravel()
            boundary = np.array(item["boundary_w"], np.float64).reshape(-1, 3)
            reflectivity = float(item["reflectivity"])
        except (KeyError, TypeError, ValueError, OverflowError):
            continue
        good = plane.size == 4 and len(boundary) >= 3 and 0 <= reflectivity <= 1
        good = good and bool((np.abs(np.append(plane, boundary)) < MAX_COORDINATE).all())  # nor NaN
        length = np.linalg.norm(plane[:3]) if good else 0.0
        if length > 0:
            panes.append(Pane(plane[:3] / length, -plane[3] / length, boundary, reflectivity))
    bad = len(listed) - len(panes)
    return panes, [f"{bad} of {len(listed)} panes in '{path}' are damaged and left out."] if bad else []


def mirrors_of(panes: list[Pane], mesh: RawMesh, names: dict[int, str]) -> tuple[list[KnownMirror], list[str]]:
    """The panes that are mirrors and an object of the mesh, and a sentence on all of them."""
    mirrors: dict[int, KnownMirror] = {}
    lost = 0
    for pane in panes:
        if pane.reflectivity < MIRROR:
            continue
        hit = _object(pane, mesh)
        if hit is None:
            lost += 1
            continue
        object_id, point = hit
        if object_id not in mirrors or mirrors[object_id].reflectivity < pane.reflectivity:
            mirrors[object_id] = KnownMirror(object_id, point, pane.normal, pane.reflectivity)
    glass = sum(pane.reflectivity < MIRROR for pane in panes)
    notes = []
    if panes:
        listing = ", ".join(f"{names.get(i, 'object')} ({i}) {m.reflectivity:.0%}" for i, m in sorted(mirrors.items()))
        notes.append(
            f"'{FILE}' lists {glass} panes of glass, which are taken as opaque, and {len(panes) - glass} "
            f"mirrors: {listing or 'none that is an object'}."
        )
    if lost:
        notes.append(
            f"{lost} mirrors of '{FILE}' are part of a larger object, or none; they are taken as a picture of "
            "what they show."
        )
    return list(mirrors.values()), notes


def _object(pane: Pane, mesh: RawMesh) -> tuple[int, np.ndarray] | None:
    """The object that is the pane, and a point of its surface; None where it is no object of its own."""
    if mesh.object_id is None or not len(mesh.triangles):
        return None
    a, b, c = (mesh.vertices[mesh.triangles[:, i]] for i in range(3))
    cross = np.cross(b - a, c - a)
    area = np.linalg.norm(cross, axis=1) / 2
    centre = (a + b + c) / 3
    off = np.abs(centre @ pane.normal - pane.offset)
    within = (
        (off < COPLANAR.off) & (np.abs(cross @ pane.normal) > np.cos(COPLANAR.turn) * 2 * area) & _inside(centre, pane)
    )
    if not within.any():
        return None
    ids, place = np.unique(mesh.object_id, return_inverse=True)
    covered, whole = np.bincount(place, area * within), np.bincount(place, area)
    best = int(np.argmax(covered))
    if ids[best] < 0 or covered[best] < OWN_SHARE * whole[best]:
        return None
    return int(ids[best]), np.median(centre[within & (place == best)], 0)


def _inside(points: np.ndarray, pane: Pane) -> np.ndarray:
    """Whether points lie within the boundary, seen along the normal: an odd number of edges to their right."""
    axis = np.eye(3)[np.abs(pane.normal).argmin()]
    u = np.cross(pane.normal, axis)
    u /= np.linalg.norm(u)
    v = np.cross(pane.normal, u)
    x, y = points @ u, points @ v
    ring = np.stack([pane.boundary @ u, pane.boundary @ v], -1)
    # Triangles whose centres lie on its rim are its own as well.
    middle = (ring.max(0) + ring.min(0)) / 2
    ring = middle + (ring - middle) * (1 + 2 * COPLANAR.off / max(float(np.ptp(ring, axis=0).max()), COPLANAR.off))
    odd = np.zeros(len(points), bool)
    for (x0, y0), (x1, y1) in zip(ring, np.roll(ring, 1, 0)):
        if y0 != y1:
            odd ^= ((y0 > y) != (y1 > y)) & (x < (x1 - x0) * (y - y0) / (y1 - y0) + x0)
    return odd
