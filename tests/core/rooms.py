"""Small synthetic rooms with a planar atlas, cameras in them, their light by analysis, and pictures of it."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.spatial import cKDTree

from addon.core.light.environment import Environment
from addon.core.light.field import LightField
from addon.core.passes.albedo.albedo import albedo_of
from addon.core.scene.elements import ElementLookup, make_atlas
from addon.core.scene.model import Camera, Instance, Mesh, Pixels
from addon.core.scene.rays import RayScene
from addon.core.scene.surface import Surface

GAP = 3
"""Texels between two islands."""


@dataclass(frozen=True)
class Quad:
    """A rectangle of one object; its normal is `edge_u` x `edge_v`."""

    corner: np.ndarray
    edge_u: np.ndarray
    edge_v: np.ndarray
    object_id: int


def quad(corner, edge_u, edge_v, object_id: int) -> Quad:
    return Quad(np.array(corner, float), np.array(edge_u, float), np.array(edge_v, float), object_id)


def cut(whole: Quad, u: tuple[float, float], v: tuple[float, float]) -> Quad:
    """The part of a quad between shares `u` and `v` of its edges."""
    corner = whole.corner + u[0] * whole.edge_u + v[0] * whole.edge_v
    return Quad(corner, (u[1] - u[0]) * whole.edge_u, (v[1] - v[0]) * whole.edge_v, whole.object_id)


def around(whole: Quad, u: tuple[float, float], v: tuple[float, float]) -> list[Quad]:
    """What is left of a quad when the part between shares `u` and `v` is cut out."""
    us, vs = (0.0, *u, 1.0), (0.0, *v, 1.0)
    cells = [(i, j) for i in range(3) for j in range(3) if (i, j) != (1, 1)]
    return [cut(whole, us[i : i + 2], vs[j : j + 2]) for i, j in cells if us[i + 1] > us[i] and vs[j + 1] > vs[j]]


def split(whole: Quad, count: int) -> list[Quad]:
    """A quad in count * count equal parts."""
    at = np.linspace(0, 1, count + 1)
    return [cut(whole, at[i : i + 2], at[j : j + 2]) for i in range(count) for j in range(count)]


def box_sides(size=(4.0, 3.0, 2.5), first_id: int = 0) -> list[Quad]:
    """Floor, ceiling, and the walls at x = 0, x = X, y = 0, y = Y; normals inward, one object each."""
    X, Y, Z = size
    sides = [
        ((0, 0, 0), (X, 0, 0), (0, Y, 0)),
        ((0, 0, Z), (0, Y, 0), (X, 0, 0)),
        ((0, 0, 0), (0, Y, 0), (0, 0, Z)),
        ((X, 0, 0), (0, 0, Z), (0, Y, 0)),
        ((0, 0, 0), (0, 0, Z), (X, 0, 0)),
        ((0, Y, 0), (X, 0, 0), (0, 0, Z)),
    ]
    return [quad(*side, first_id + i) for i, side in enumerate(sides)]


@dataclass(frozen=True)
class Room:
    """Quads as a mesh of two triangles each, laid out in an atlas row by row, whole texels wide."""

    quads: tuple[Quad, ...]
    mesh: Mesh
    uv: np.ndarray
    size: int
    instances: tuple[Instance, ...]

    @cached_property
    def scene(self) -> RayScene:
        return RayScene(self.mesh.vertices, self.mesh.triangles)

    @cached_property
    def atlas(self):
        return make_atlas(self.mesh, self.uv, self.size)

    @cached_property
    def surface(self) -> Surface:
        return Surface(self.mesh, self.atlas, self.scene, np.ones(len(self.mesh.triangles)), self.atlas.texel_edge)

    @cached_property
    def lookup(self) -> ElementLookup:
        return ElementLookup(self.mesh, self.atlas)

    @cached_property
    def normals(self) -> np.ndarray:
        return self.mesh.geometry[0]

    def by_object(self, values: dict[int, object], default=0.0) -> np.ndarray:
        """(n, 3) float32: a value for each object's elements."""
        result = np.empty((len(self.atlas), 3), np.float32)
        result[:] = default
        for object_id, value in values.items():
            result[self.atlas.object_id == object_id] = value
        return result

    def field(self, radiance: np.ndarray, environment: Environment | None = None) -> LightField:
        return LightField(self.mesh, self.atlas, self.scene, radiance, environment or DARK)


DARK = Environment(np.zeros((1, 2, 3), np.float32), np.zeros((1, 2), np.int32))


def make_room(
    quads: list[Quad], texel: float = 0.1, flip: np.ndarray | None = None, most: dict[int, int] | None = None
) -> Room:
    """Parameters: edge of a texel in metres; `flip`: (2 * quads,) bool, triangles whose winding is turned; `most`: of
    some objects' quads, texels along an edge at most."""
    least = [(most or {}).get(q.object_id, 1 << 20) for q in quads]
    wide = [min(max(round(float(np.linalg.norm(q.edge_u)) / texel), 1), n) for q, n in zip(quads, least)]
    high = [min(max(round(float(np.linalg.norm(q.edge_v)) / texel), 1), n) for q, n in zip(quads, least)]
    row = max(max(wide) + 2 * GAP, int(np.sqrt(sum((w + GAP) * (h + GAP) for w, h in zip(wide, high)))) + 2 * GAP)
    x = y = GAP
    tallest, places = 0, []
    for w, h in zip(wide, high):
        if x + w + GAP > row:
            x, y, tallest = GAP, y + tallest + GAP, 0
        places.append((x, y))
        x, tallest = x + w + GAP, max(tallest, h)
    size = max(row, y + tallest + GAP)
    vertices, uv = [], []
    for q, (x, y), w, h in zip(quads, places, wide, high):
        vertices += [q.corner, q.corner + q.edge_u, q.corner + q.edge_u + q.edge_v, q.corner + q.edge_v]
        a, b, c, d = (x, y), (x + w, y), (x + w, y + h), (x, y + h)
        uv += [(a, b, c), (a, c, d)]
    triangles = np.array([(4 * i, 4 * i + k, 4 * i + k + 1) for i in range(len(quads)) for k in (1, 2)], np.int32)
    uv = np.array(uv, np.float32) / np.float32(size)
    if flip is not None:
        triangles[flip], uv[flip] = triangles[flip][:, [0, 2, 1]], uv[flip][:, [0, 2, 1]]
    object_id = np.repeat(np.array([q.object_id for q in quads], np.int32), 2)
    instances = tuple(Instance(int(i), "thing") for i in np.unique(object_id))
    return Room(tuple(quads), Mesh(np.array(vertices), triangles, object_id), uv, size, instances)


def lit_box(size=(4.0, 3.0, 2.5), lamps=(((0.4, 0.6), (0.4, 0.6)),)) -> list[Quad]:
    """A closed box of six objects; pieces of the ceiling are lamps, objects 6, 7 ... (at most two, along its y)."""
    sides = box_sides(size)
    ceiling = sides.pop(1)
    if len(lamps) == 2:
        halves = [cut(ceiling, (0, 0.5), (0, 1)), cut(ceiling, (0.5, 1), (0, 1))]
    else:
        halves = [ceiling]
    for i, (half, (u, v)) in enumerate(zip(halves, lamps, strict=True)):
        lamp = cut(half, u, v)
        sides += around(half, u, v) + [Quad(lamp.corner, lamp.edge_u, lamp.edge_v, 6 + i)]
    return sides


# Cameras and pictures


def patches(room: Room, edge: float, seed: int = 0) -> np.ndarray:
    """A value for each cube of space with edges of so many metres, (n, 3) float32."""
    cell = np.floor(room.atlas.position / edge).astype(int) % 16
    return np.random.default_rng(seed).uniform(0.2, 2, (16, 16, 16, 3)).astype(np.float32)[tuple(cell.T)]


def look_at(eye, target, width: int = 48, height: int = 48, fov: float = 90.0) -> Camera:
    """A camera at `eye`; `fov` is the horizontal angle in degrees."""
    eye, target = np.array(eye, float), np.array(target, float)
    back = (eye - target) / np.linalg.norm(eye - target)
    up = np.array([0, 0, 1.0]) if abs(back[2]) < 0.99 else np.array([0, 1.0, 0])
    right = np.cross(up, back)
    right /= np.linalg.norm(right)
    pose = np.eye(4)
    pose[:3, :3] = np.stack([right, np.cross(back, right), back], 1)
    pose[:3, 3] = eye
    f = width / 2 / np.tan(np.radians(fov / 2))
    return Camera(width, height, f, f, width / 2, height / 2, pose)


def all_round(eye, width: int = 48, fov: float = 100.0) -> list[Camera]:
    """Six cameras that together look everywhere."""
    eye = np.array(eye, float)
    return [look_at(eye, eye + s * axis, width, width, fov) for axis in np.eye(3) for s in (1, -1)]


def picture(room: Room, camera: Camera, radiance: np.ndarray, outside=0.0) -> Pixels:
    """What a camera sees: at each hit the radiance ((n, 3)) of the nearest element of the same object."""
    directions = camera.directions(camera.pixel_centres())
    hits = room.scene.intersect(np.broadcast_to(camera.centre.astype(np.float32), directions.shape), directions)
    image = np.empty((len(directions), 3), np.float32)
    image[:] = outside
    hit = np.flatnonzero(hits.triangle >= 0)
    where = camera.centre + hits.distance[hit, None] * directions[hit]
    seen = room.mesh.object_id[hits.triangle[hit]]
    for object_id in np.unique(seen):
        own, mine = np.flatnonzero(room.atlas.object_id == object_id), hit[seen == object_id]
        image[mine] = radiance[own[cKDTree(room.atlas.position[own]).query(where[seen == object_id])[1]]]
    return pixels_of(image.reshape(camera.height, camera.width, 3))


def pixels_of(image: np.ndarray, valid=None, saturated=None) -> Pixels:
    shape = image.shape[:2]
    valid = np.ones(shape, bool) if valid is None else valid
    return Pixels(image.astype(np.float32), valid, np.zeros(shape, bool) if saturated is None else saturated)


# Light by analysis


def polygon_irradiance(points: np.ndarray, normals: np.ndarray, quads: list[Quad]) -> np.ndarray:
    """E at `points` from each quad at radiance 1, wholly above their horizon (Lambert's formula): (n, q) float64."""
    result = np.zeros((len(points), len(quads)))
    x, n = points.T.copy(), normals.T.copy()  # three long rows are quicker than n short ones
    for j, q in enumerate(quads):
        corners = [q.corner, q.corner + q.edge_u, q.corner + q.edge_u + q.edge_v, q.corner + q.edge_v]
        way = [np.asarray(c)[:, None] - x for c in corners]
        way = [w / np.maximum(np.sqrt((w * w).sum(0)), 1e-12) for w in way]
        for a, b in zip(way, way[1:] + way[:1]):
            cross = np.stack([a[i] * b[k] - a[k] * b[i] for i, k in ((1, 2), (2, 0), (0, 1))])
            sine = np.sqrt((cross * cross).sum(0))
            angle = np.arctan2(sine, (a * b).sum(0))
            result[:, j] += angle / np.maximum(sine, 1e-12) * (cross * n).sum(0) / 2
    return np.abs(result)


def radiosity(room: Room, albedo: dict[int, object], emission: dict[int, object], parts: int = 5) -> np.ndarray:
    """Radiance of every element of a convex closed room: patches by collocation, then one last gather; (n, 3)."""
    patches = [p for q in room.quads for p in (split(q, parts) if np.linalg.norm(q.edge_u) > 1 else [q])]
    ids = np.array([p.object_id for p in patches])
    middle = np.array([p.corner + (p.edge_u + p.edge_v) / 2 for p in patches])
    normal = np.array([np.cross(p.edge_u, p.edge_v) for p in patches])
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    rho, own = np.zeros((len(ids), 3)), np.zeros((len(ids), 3))
    for object_id, value in albedo.items():
        rho[ids == object_id] = value
    for object_id, value in emission.items():
        own[ids == object_id] = value
    apart = np.abs(((middle[None] - middle[:, None]) * normal[:, None]).sum(-1)) > 1e-9  # nothing within one plane
    E = polygon_irradiance(middle, normal, patches) * apart / np.pi
    light = np.stack([np.linalg.solve(np.eye(len(ids)) - rho[:, c, None] * E, own[:, c]) for c in range(3)], 1)
    atlas = room.atlas
    reaches = polygon_irradiance(atlas.position.astype(float), atlas.normal.astype(float), patches)
    # A patch in the element's own plane throws nothing at it; Lambert's formula is unstable there.
    height = middle @ atlas.normal.T - (atlas.position * atlas.normal).sum(1)
    above = np.abs(height.T) > 1e-4
    return room.by_object(albedo) * ((reaches * above) @ light) / np.pi + room.by_object(emission)


def albedo_in(room, lit, found):
    """The `Albedo` that L_d has under the E of a `Shading`."""
    return albedo_of(room.atlas, lit, found.irradiance, found.relative_error, room.instances, found.emitters)


def cut_in_four(mesh: Mesh, times: int) -> Mesh:
    """The same surface with four times the triangles, `times` over."""
    for _ in range(times):
        a, b, c = (mesh.vertices[mesh.triangles[:, i]] for i in range(3))
        count, first = len(mesh.triangles), len(mesh.vertices)
        middles = np.concatenate([(a + b) / 2, (b + c) / 2, (c + a) / 2])
        ab, bc, ca = (np.arange(count, dtype=np.int32) + first + i * count for i in range(3))
        i, j, k = mesh.triangles.T
        triangles = np.stack([np.stack(t, 1) for t in ((i, ab, ca), (ab, j, bc), (ca, bc, k), (ab, bc, ca))], 1)
        mesh = Mesh(
            np.concatenate([mesh.vertices, middles]), triangles.reshape(-1, 3).astype(np.int32),
            np.repeat(mesh.object_id, 4),
        )  # fmt: skip
    return mesh
