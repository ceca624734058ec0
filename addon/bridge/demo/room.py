"""The demo's room as plain values: shapes, colours, gloss and lamps that the demo knows and the method does not; and on
disk, as a capture without its pictures.

Everything is made of quads; metres, +Z up. `demo.render` turns it into a scene for Cycles and into a capture.
"""

import json
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ...core.io.ply import ply_bytes
from ...core.kinds import Workload

SIZE: Workload[tuple[float, float, float]] = (4.4, 3.6, 2.6)
"""The room's extent along x, y and z; its corner is the origin."""


@dataclass(frozen=True)
class Paint:
    """A known material.

    Attributes
    ----------
    albedo : (3,) or (height, width, 3) float32
        Base colour, one or a picture whose row 0 is the bottom.
    roughness, f0 : float
        Blender's, the square root of GGX alpha; reflectance at normal incidence, 0 is purely diffuse.
    emission : (3,) tuple of float or None
        Radiance of a lamp.
    """

    albedo: np.ndarray
    roughness: float = 1.0
    f0: float = 0.0
    emission: tuple[float, float, float] | None = None


@dataclass(frozen=True)
class RoomObject:
    """One object of the room.

    Attributes
    ----------
    quads : (q, 4, 3) float64
        Corners, counter-clockwise from outside.
    uv : (q, 4, 2) float64
    slot : (q,) int
        Which of `paints` each quad wears.
    paints : tuple of Paint
        All of the same gloss: one object, one roughness.
    triangles : bool
        Split every quad in two, in the scene and in the capture (quads that are not flat).
    """

    object_id: int
    class_name: str
    quads: np.ndarray
    uv: np.ndarray
    slot: np.ndarray
    paints: tuple[Paint, ...]
    triangles: bool = False

    def faces(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Vertices (v, 3), their faces (f, 3 or 4), the faces' corner uv (f, 3 or 4, 2) and slot (f,)."""
        vertices, index = np.unique(np.round(self.quads.reshape(-1, 3), 6), axis=0, return_inverse=True)
        index, uv, slot = index.reshape(-1, 4), self.uv, self.slot
        if self.triangles:
            corners = np.array([[0, 1, 2], [0, 2, 3]])
            index, uv, slot = index[:, corners].reshape(-1, 3), uv[:, corners].reshape(-1, 3, 2), np.repeat(slot, 2)
        return vertices, index, uv, slot

    def samples(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """n points on each quad, (q, n, 3), their base colours (q, n, 3) and share of the surface (q, n).

        They lie on no grid, so that no stripe of a texture falls between them.
        """
        count = max(64, 6000 // len(self.quads))
        a, b = (((np.arange(count) + 0.5) * step % 1)[None, :, None] for step in (0.7548776662, 0.5698402910))
        weights = (1 - a) * (1 - b), a * (1 - b), a * b, (1 - a) * b
        points, uv = (sum(w * corners[:, None, k] for k, w in enumerate(weights)) for corners in (self.quads, self.uv))
        colours = self.colours(self.slot, uv)
        area = np.linalg.norm(self.normals(), axis=1)
        return points, colours, np.repeat((area / area.sum())[:, None] / count, count, 1)

    def colours(self, slot: np.ndarray, uv: np.ndarray) -> np.ndarray:
        """Base colours where paint `slot` ((m,) int) has the coordinates `uv` ((m, ..., 2)), (m, ..., 3) float64."""
        result = np.empty((*uv.shape[:-1], 3))
        for k, paint in enumerate(self.paints):
            mask = slot == k
            if paint.albedo.ndim == 1:
                result[mask] = paint.albedo
            else:
                size = np.array(paint.albedo.shape[1::-1])
                x, y = np.moveaxis(np.clip((uv[mask] * size).astype(int), 0, size - 1), -1, 0)
                result[mask] = paint.albedo[y, x]
        return result

    def normals(self) -> np.ndarray:
        """Normals of the quads as long as their area, (q, 3) float64."""
        return np.cross(self.quads[:, 2] - self.quads[:, 0], self.quads[:, 3] - self.quads[:, 1]) / 2

    def mean_albedo(self) -> np.ndarray:
        """Base colour averaged over the surface, (3,) float64."""
        _, colours, share = self.samples()
        return np.einsum("qkc,qk->c", colours, share)


def grid(origin, across, up, columns=1, rows=1) -> tuple[np.ndarray, np.ndarray]:
    """A parallelogram cut into `columns` x `rows` quads: corners (q, 4, 3) and uv (q, 4, 2) over the whole of it."""
    j, i = (x.ravel() for x in np.mgrid[:rows, :columns])
    uv = np.stack([np.stack([(i + a) / columns, (j + b) / rows], -1) for a, b in ((0, 0), (1, 0), (1, 1), (0, 1))], 1)
    origin, across, up = (np.asarray(x, float) for x in (origin, across, up))
    return origin + uv[..., :1] * across + uv[..., 1:] * up, uv


def box(low, high, steps=1) -> tuple[np.ndarray, np.ndarray]:
    """The six sides of a box, each `steps` x `steps` quads with uv over its whole: top first, bottom last."""
    (x, y, z), (dx, dy, dz) = low, np.subtract(high, low)
    sides = (
        ((x, y, z + dz), (dx, 0, 0), (0, dy, 0)),
        ((x, y, z), (dx, 0, 0), (0, 0, dz)),
        ((x + dx, y, z), (0, dy, 0), (0, 0, dz)),
        ((x + dx, y + dy, z), (-dx, 0, 0), (0, 0, dz)),
        ((x, y + dy, z), (0, -dy, 0), (0, 0, dz)),
        ((x, y + dy, z), (dx, 0, 0), (0, -dy, 0)),
    )
    return joined(grid(*side, steps, steps) for side in sides)


def joined(shapes) -> tuple[np.ndarray, np.ndarray]:
    """Several shapes as one: corners and uv of all their quads."""
    quads, uv = zip(*shapes)
    return np.concatenate(quads), np.concatenate(uv)


def ball(centre, radius, steps) -> tuple[np.ndarray, np.ndarray]:
    """A sphere from the sides of a cube, each cut into `steps` x `steps` quads of like size."""
    quads, uv = box((-1, -1, -1), (1, 1, 1), steps)
    cube = np.tan(quads * np.pi / 4)
    return np.asarray(centre) + radius * cube / np.linalg.norm(cube, axis=-1, keepdims=True), uv


def cone(centre, low_radius, high_radius, height, steps) -> tuple[np.ndarray, np.ndarray]:
    """The side of a truncated cone that stands on `centre`, open above and below."""
    turn = np.linspace(0, 2 * np.pi, steps + 1)
    ring = np.stack([np.cos(turn), np.sin(turn), np.zeros(steps + 1)], -1)
    low = np.asarray(centre) + low_radius * ring
    high = np.asarray(centre) + high_radius * ring + (0, 0, height)
    return np.stack([low[:-1], low[1:], high[1:], high[:-1]], 1), np.zeros((steps, 4, 2))


def planks(size=256) -> np.ndarray:
    """A plank floor, (size, size, 3) float32."""
    random = np.random.default_rng(3)
    y, x = np.mgrid[:size, :size] / size
    row = (y * 14).astype(int)
    plank = ((x + random.random(14)[row]) * 2.5).astype(int)
    tone = random.uniform(0.75, 1.2, (14, 8))[row, plank]
    tone = tone * (1 + 0.12 * np.sin(40 * y * 14 + 3 * np.sin(9 * x + 5 * row)))
    tone[(y * 14) % 1 < 0.06] *= 0.55
    return (tone[..., None] * (0.36, 0.215, 0.11)).astype(np.float32)


def wallpaper(size=256) -> np.ndarray:
    """Diamonds in two tones, (size, size, 3) float32."""
    y, x = np.mgrid[:size, :size] / size
    u, v = x * 14 + y * 8, x * 14 - y * 8
    dark = (np.floor(u) + np.floor(v)) % 2 < 1
    line = (u % 1 < 0.09) | (v % 1 < 0.09)
    colour = np.where(dark[..., None], (0.09, 0.27, 0.29), (0.19, 0.42, 0.40))
    return np.where(line[..., None], (0.62, 0.56, 0.36), colour).astype(np.float32)


def painting(size=128) -> np.ndarray:
    """A sun over hills, (size, size, 3) float32."""
    y, x = np.mgrid[:size, :size] / size
    picture = (1 - y[..., None]) * (0.75, 0.33, 0.12) + y[..., None] * (0.10, 0.20, 0.45)
    picture[np.hypot((x - 0.62) * 1.4, y - 0.55) < 0.17] = (0.80, 0.62, 0.18)
    picture[y < 0.40 + 0.10 * np.sin(5 * x + 0.5)] = (0.10, 0.22, 0.10)
    picture[y < 0.24 + 0.08 * np.sin(7 * x + 2.4)] = (0.04, 0.10, 0.07)
    picture[np.maximum(abs(x - 0.5), abs(y - 0.5)) > 0.45] = 0.75
    return picture.astype(np.float32)


def stripes(size=128) -> np.ndarray:
    """A striped rug, (size, size, 3) float32."""
    x = np.broadcast_to(np.arange(size) / size, (size, size))
    colours = np.array([(0.55, 0.48, 0.38), (0.30, 0.07, 0.06), (0.55, 0.48, 0.38), (0.10, 0.12, 0.20)])
    return colours[(x * 16).astype(int) % 4].astype(np.float32)


def room() -> tuple[RoomObject, ...]:
    """The furnished room."""
    x, y, z = SIZE
    objects: list[RoomObject] = []

    def add(class_name, shapes, *paints, slots=None, triangles=False):
        slot = np.repeat(slots or [0] * len(shapes), [len(quads) for quads, _ in shapes])
        objects.append(RoomObject(len(objects), class_name, *joined(shapes), slot, paints, triangles))

    def plain(*colour, **gloss):
        return Paint(np.array(colour, np.float32), **gloss)

    def lamp(*radiance):
        return Paint(np.zeros(3, np.float32), emission=radiance)

    add("floor", [grid((0, 0, 0), (x, 0, 0), (0, y, 0), 16, 14)], Paint(planks()))
    add("ceiling", [grid((0, y, z), (x, 0, 0), (0, -y, 0), 16, 14)], plain(0.80, 0.79, 0.77))
    add(
        "wall",
        [
            grid((0, y, 0), (0, -y, 0), (0, 0, z), 14, 10),
            grid((0, 0, 0), (0, 0, z), (x, 0, 0), 10, 16),
            grid((x, 0, 0), (0, 0, z), (0, y, 0), 10, 14),
        ],
        plain(0.70, 0.64, 0.54),
    )
    add("papered wall", [grid((x, y, 0), (-x, 0, 0), (0, 0, z), 16, 10)], Paint(wallpaper()))
    for wall in objects[-2:]:
        face(wall, np.array([x / 2, y / 2, z / 2]))
    add("ceiling lamp", [box((1.85, 1.45, z - 0.06), (2.55, 2.15, z - 0.01))], lamp(20.0, 18.5, 16.5))
    add(
        "sofa",
        [
            box((1.05, 2.75, 0.12), (3.15, 3.5, 0.42)),
            box((1.05, 3.25, 0.42), (3.15, 3.5, 0.85)),
            box((0.85, 2.75, 0.12), (1.05, 3.5, 0.62)),
            box((3.15, 2.75, 0.12), (3.35, 3.5, 0.62)),
            box((1.12, 3.08, 0.42), (1.52, 3.25, 0.78)),
            box((2.68, 3.08, 0.42), (3.08, 3.25, 0.78)),
        ],
        plain(0.07, 0.13, 0.30),
        plain(0.60, 0.27, 0.06),
        slots=[0, 0, 0, 0, 1, 1],
    )
    legs = [box((a, b, 0.015), (a + 0.06, b + 0.06, 0.4)) for a in (1.6, 2.54) for b in (1.5, 2.04)]
    add("table", [box((1.55, 1.45, 0.4), (2.65, 2.15, 0.45)), *legs], plain(0.10, 0.05, 0.03, roughness=0.3, f0=0.04))
    add("ball", [ball((3.35, 1.05, 0.32), 0.32, 16)], plain(0.02, 0.07, 0.05, roughness=0.3, f0=0.04), triangles=True)
    add("cabinet", [box((0.02, 1.0, 0.02), (0.47, 2.3, 0.8))], plain(0.30, 0.03, 0.02, roughness=0.45, f0=0.06))
    add("painting", [box((0.01, 1.15, 1.15), (0.04, 2.15, 1.95))], plain(0.04, 0.03, 0.03), Paint(painting()))
    objects[-1].slot[2] = 1
    add("lamp shade", [cone((3.95, 3.15, 1.25), 0.24, 0.15, 0.32, 24)], lamp(11.0, 7.2, 3.8))
    add(
        "lamp stand",
        [box((3.935, 3.135, 0.03), (3.965, 3.165, 1.25)), box((3.8, 3.0, 0.0), (4.1, 3.3, 0.03))],
        plain(0.05, 0.05, 0.05),
    )
    add(
        "door",
        [
            box((1.5, 0.001, 0.0), (2.4, 0.04, 2.05)),
            box((1.62, 0.04, 1.15), (2.28, 0.06, 1.9)),
            box((1.62, 0.04, 0.15), (2.28, 0.06, 0.95)),
        ],
        plain(0.13, 0.20, 0.16),
        plain(0.20, 0.29, 0.24),
        slots=[0, 1, 1],
    )
    add("rug", [box((1.0, 0.9, 0.001), (3.0, 2.5, 0.015))], Paint(stripes()))
    books = np.random.default_rng(5)
    frame = [box((4.1, 0.3, h), (4.38, 1.5, h + 0.03)) for h in (0.02, 0.52, 1.02, 1.52)]
    frame += [box((4.1, a, 0.02), (4.38, a + 0.03, 1.55)) for a in (0.27, 1.5)]
    shelves = []
    for h in (0.05, 0.55, 1.05):
        at = 0.32
        while at < 1.40:
            thick, tall = books.uniform(0.05, 0.09), books.uniform(0.26, 0.40)
            shelves.append(box((4.15, at, h), (4.36, at + thick, h + tall)))
            at += thick + 0.004
    colours = [plain(*c) for c in ((0.45, 0.09, 0.06), (0.08, 0.20, 0.38), (0.60, 0.52, 0.36), (0.09, 0.25, 0.10))]
    slots = [0] * len(frame) + [int(k) for k in books.integers(1, 5, len(shelves))]
    add("bookshelf", frame + shelves, plain(0.55, 0.52, 0.48), *colours, slots=slots)
    return tuple(objects)


def face(obj: RoomObject, point: np.ndarray) -> None:
    """Turn the front of each of an object's quads towards `point`."""
    normal = np.cross(obj.quads[:, 1] - obj.quads[:, 0], obj.quads[:, 3] - obj.quads[:, 0])
    away = np.einsum("qk,qk->q", normal, point - obj.quads[:, 0]) < 0
    obj.quads[away], obj.uv[away] = obj.quads[away, ::-1], obj.uv[away, ::-1]


def tour(frames: int) -> np.ndarray:
    """Poses of a hand-held walk around the room, (frames, 4, 4) float64, camera to world, OpenGL axes."""
    t = 2 * np.pi * np.arange(frames) / frames
    middle = np.array([SIZE[0] / 2, SIZE[1] / 2 - 0.1, 0])
    eye = middle + np.stack([1.15 * np.cos(t), 0.8 * np.sin(t), 1.5 + 0.25 * np.sin(3 * t)], -1)
    gaze = t + np.pi + 0.9 * np.sin(2 * t + 0.4)
    target = middle + np.stack([1.5 * np.cos(gaze), 1.3 * np.sin(gaze), 1.2 + 1.15 * np.sin(5 * t + 1)], -1)
    return np.stack([look_at(a, b) for a, b in zip(eye, target)])


def look_at(eye, target) -> np.ndarray:
    """Pose (4, 4) of a camera at `eye` that looks at `target`, upright."""
    back = np.subtract(eye, target)
    back /= np.linalg.norm(back)
    right = np.cross((0, 0, 1), back)
    right /= np.linalg.norm(right)
    pose = np.eye(4)
    pose[:3] = np.column_stack([right, np.cross(back, right), back, eye])
    return pose


FIELD_OF_VIEW = np.radians(78)


def frame_path(index: int) -> str:
    """Where a capture keeps its frame `index`."""
    return f"images/frame_{index:04d}.exr"


def write_all_but_frames(
    folder: Path, objects: tuple[RoomObject, ...], poses: np.ndarray, size: tuple[int, int]
) -> None:
    """Make `folder` a capture without its pictures; `poses` as of `tour`, `size` is the frames' width and height."""
    (folder / "images").mkdir(parents=True)
    (folder / "truth").mkdir()
    write_mesh(folder / "mesh.ply", objects)
    entries = [{"id": obj.object_id, "class_name": obj.class_name} for obj in objects]
    (folder / "info_semantic.json").write_text(json.dumps({"objects": entries}, indent=1))
    (folder / "truth" / "materials.json").write_text(json.dumps([truth(obj) for obj in objects], indent=1))
    width, height = size
    focal = width / 2 / np.tan(FIELD_OF_VIEW / 2)
    frames = [{"file_path": frame_path(k), "transform_matrix": pose.tolist()} for k, pose in enumerate(poses)]
    lens = {"w": width, "h": height, "fl_x": focal, "fl_y": focal, "cx": width / 2, "cy": height / 2}
    transforms = {"camera_model": "PINHOLE", **lens, "frames": frames}
    (folder / "transforms.json").write_text(json.dumps(transforms, indent=1))


def truth(obj: RoomObject) -> dict:
    """The true values of `obj`, for the comparison at the demo's end."""
    paint = obj.paints[0]
    return {
        "id": obj.object_id,
        "class_name": obj.class_name,
        "emission": paint.emission,
        "alpha": paint.roughness**2 if paint.f0 else None,
        "f0": paint.f0,
        "metallic": 0.0,
        "base_color": [round(float(c), 4) for c in obj.mean_albedo()],
    }


def write_mesh(path: Path, objects: tuple[RoomObject, ...]) -> None:
    """All objects as one binary PLY with an `object_id` on each face."""
    corners, faces, first = [], [], 0
    for obj in objects:
        vertices, index, _, _ = obj.faces()
        corners.append(vertices.astype(np.float32))
        faces.append((index + first, obj.object_id))
        first += len(vertices)
    faces.sort(key=lambda item: item[0].shape[1])  # triangles, then quads
    path.write_bytes(ply_bytes(np.concatenate(corners), faces))
