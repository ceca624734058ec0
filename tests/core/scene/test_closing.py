"""Holes of a room in one piece: closed where nobody looked, open where frames look out."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from addon.core.scene.closed_mesh import as_scanned, is_outward, with_aligned_closing, without_closing
from addon.core.scene.closing import close_holes
from addon.core.scene.model import Camera, Capture, Frame, Instance, Mesh, Pixels
from addon.core.scene.rays import RayScene
from addon.core.scene.shape_parts import parts_of, plane_gap
from tests.core.passes.mesh_denoising.test_denoise import sheet

from .test_shape_parts import AIR, fused

SIZE = np.array(AIR) / 10
NONE = np.zeros((0, 3, 3))
WALL, FLOOR, CEILING = 0, 4, 5
"""Sides: the wall at x = 0, which the cameras face, the floor and the ceiling."""


def room(cut):
    """A room in one piece without the triangles that `cut` says of their centres and sides."""
    vertices, triangles, side = fused()
    kept = ~cut(vertices[triangles].mean(1), side)
    return vertices, triangles[kept]


def window(centre, side):
    return (side == WALL) & (np.abs(centre[:, 1] - 1.2) < 0.4) & (np.abs(centre[:, 2] - 1.3) < 0.3)


def frames(count=8):
    """Cameras along the room's far end that look at the wall at x = 0; their pictures are never on disk."""
    found = []
    for i in range(count):
        pose = np.eye(4)
        pose[:3, :3] = np.array([[0, 0, 1], [1, 0, 0], [0, 1, 0]])  # right is +y, up is +z, it looks along -x
        pose[:3, 3] = 2.6, 0.8 + 0.8 * i / (count - 1), 1.2
        found.append(Frame(str(i), Path(f"{i}.exr"), Camera(48, 36, 40.0, 40.0, 24.0, 18.0, pose)))
    return tuple(found)


def turned_away(found):
    """The frames from the same places, looking along +x."""
    away = []
    for frame in found:
        pose = np.diag([-1.0, -1, 1, 1]) @ frame.camera.camera_to_world
        pose[:3, 3] = frame.camera.centre
        away.append(replace(frame, camera=replace(frame.camera, camera_to_world=pose)))
    return away


def pictures(vertices, triangles, outside):
    """What reads the frames: .1 where they see the mesh, else `outside` of the pixels' centres of view and rays."""
    scene = RayScene(vertices, triangles)

    def read(frame):
        camera = frame.camera
        rays = camera.directions(camera.pixel_centres()).astype(np.float32)
        start = np.broadcast_to(camera.centre.astype(np.float32), rays.shape)
        hit = scene.intersect(start, rays).triangle >= 0
        value = np.where(hit, 0.1, outside(start, rays)).reshape(camera.height, camera.width)
        shape = value.shape
        return Pixels(np.repeat(value[..., None], 3, 2).astype(np.float32), np.ones(shape, bool), np.zeros(shape, bool))

    return read


def stripes(x):
    """Dark enough for a room, and different from place to place."""
    return 0.08 + 0.03 * np.sin(12 * x)


def closing(mesh, outside=lambda start, rays: np.full(len(rays), 5.0), seen_by=8):
    vertices, triangles = mesh
    return close_holes(
        vertices, triangles, parts_of(vertices, triangles), frames(seen_by), pictures(vertices, triangles, outside)
    )


def leaks(mesh, added, start=(1.6, 1.2, 1.9)):
    """Share of the rays from a place in the room that leave it."""
    vertices, triangles = mesh
    if added is not None:
        triangles = np.concatenate([triangles, added.triangles + len(vertices)])
        vertices = np.concatenate([vertices, added.vertices])
    rays = np.random.default_rng(1).normal(size=(4000, 3)).astype(np.float32)
    rays /= np.linalg.norm(rays, axis=1, keepdims=True)
    hits = RayScene(vertices, triangles).intersect(np.broadcast_to(np.float32(start), rays.shape), rays)
    return float((hits.triangle < 0).mean())


def test_what_nobody_looked_at_is_closed():
    """The ceiling's border, which is torn, and a wall behind the cameras."""
    mesh = room(lambda centre, side: ((side == CEILING) & (centre[:, 1] > 1.9) & (centre[:, 0] > 1.2)) | (side == 1))
    assert leaks(mesh, None) > 0.1
    added = closing(mesh)
    assert leaks(mesh, added) < 1e-3  # hairlines between the scan's own triangles
    middle = added.vertices[added.triangles].mean(1)
    assert (middle > -0.1).all() and (middle < SIZE + 0.1).all()


def test_faces_belong_to_the_part_that_they_continue():
    mesh = room(lambda centre, side: (side == CEILING) & (centre[:, 1] > 1.9) & (centre[:, 0] > 1.2))
    parts, added = parts_of(*mesh), closing(mesh)
    a, b, c = (added.vertices[corner] for corner in added.triangles.T)
    normal = np.cross(b - a, c - a)
    down = normal[:, 2] < -0.9 * np.linalg.norm(normal, axis=1)
    assert down.any() and {added.names[int(one)] for one in added.part[down]} == {"ceiling"}
    assert added.names == parts.names


def test_a_wall_that_nobody_saw_is_a_part_of_its_own():
    mesh = room(lambda centre, side: side == 1)
    parts, added = parts_of(*mesh), closing(mesh)
    assert added.names == parts.names | {len(parts.names): "wall"}
    assert (added.part == len(parts.names)).any()


def test_a_window_stays_open():
    mesh = room(window)
    before = leaks(mesh, None)
    assert before > 0.005
    assert leaks(mesh, closing(mesh)) == pytest.approx(before, rel=0.15)


def test_the_corner_of_a_window_that_no_frame_saw_is_open():
    """Three in four frames see its left side, and the others its lower part."""
    mesh = room(lambda centre, side: window(centre, side) & (centre[:, 2] < 1.6))
    seeing = []
    for i, frame in enumerate(frames(16)):
        pose = frame.camera.camera_to_world.copy()
        left = i % 4 > 0
        pose[1, 3] = 0.6 if left else 1.2
        camera = replace(frame.camera, camera_to_world=pose)
        seeing.append(replace(frame, camera=replace(camera, width=33) if left else replace(camera, height=20, cy=2.0)))
    read = pictures(*mesh, lambda start, rays: np.full(len(rays), 5.0))
    added = close_holes(*mesh, parts_of(*mesh), tuple(seeing), read)
    assert leaks(mesh, added) == pytest.approx(leaks(mesh, None), rel=0.15)


def test_a_hole_in_the_floor_is_closed_however_bright_it_looks():
    """Where the sun lies on it, depth may be missing."""
    mesh = room(lambda centre, side: (side == FLOOR) & (np.abs(centre[:, :2] - (2.4, 1.2)) < 0.3).all(1))
    down = [replace(frame, camera=replace(frame.camera, camera_to_world=np.eye(4))) for frame in frames()]
    for i, frame in enumerate(down):
        frame.camera.camera_to_world[:3, 3] = 2.2 + 0.05 * i, 1.2, 1.8
    read = pictures(*mesh, lambda start, rays: np.full(len(rays), 5.0))
    added = close_holes(*mesh, parts_of(*mesh), tuple(down), read)
    assert leaks(mesh, added) < 1e-3 < leaks(mesh, None)


def test_what_so_few_frames_see_is_closed_however_bright():
    """One frame sees the wall and its hole; seven look the other way."""
    vertices, triangles = room(window)
    read = pictures(vertices, triangles, lambda start, rays: np.full(len(rays), 5.0))
    added = close_holes(
        vertices, triangles, parts_of(vertices, triangles), (frames()[0], *turned_away(frames()[1:])), read
    )
    assert leaks((vertices, triangles), added) < 1e-3 < leaks((vertices, triangles), None)


def test_pinholes_are_closed():
    """A triangle of a porous scan is often missing by itself: each shows black in a picture, however small it is."""
    vertices, triangles = room(lambda centre, side: (side == CEILING) & (centre[:, 1] > 1.9))
    corners, start = vertices[triangles], np.float32([1.6, 1.2, 1.2])
    middle = corners.mean(1)

    def hit(vertices, triangles):
        rays = (middle - start).astype(np.float32)
        rays /= np.linalg.norm(rays, axis=1, keepdims=True)
        return RayScene(vertices, triangles).intersect(np.broadcast_to(start, rays.shape), rays).triangle

    seen = hit(vertices, triangles) == np.arange(len(triangles))
    pierced = np.flatnonzero(seen & (np.abs(middle[:, 0]) < 0.02))[::40]
    offset = corners[pierced] - middle[pierced, None]
    inner = middle[pierced, None] + 0.4 * plane_gap(vertices) / np.abs(offset).max() * offset
    first = len(vertices) + 3 * np.arange(len(pierced))
    around = [np.delete(triangles, pierced, 0)]
    for i, j in ((0, 1), (1, 2), (2, 0)):
        a, b = triangles[pierced, i], triangles[pierced, j]
        around += [np.stack([a, b, first + j], 1), np.stack([a, first + j, first + i], 1)]
    vertices, triangles = np.concatenate([vertices, inner.reshape(-1, 3)]), np.concatenate(around)
    assert len(pierced) > 5 and (hit(vertices, triangles)[pierced] < 0).all()
    added = closing((vertices, triangles))
    triangles = np.concatenate([triangles, added.triangles + len(vertices)])
    assert (hit(np.concatenate([vertices, added.vertices]), triangles)[pierced] >= 0).mean() > 0.9


def test_a_porous_wall_is_closed():
    """Each cell holds some of the scan, and none is covered by it."""
    rng = np.random.default_rng(0)
    vertices, triangles = room(lambda centre, side: (side == 1) & (rng.random(len(side)) < 0.5))
    corners = vertices[triangles]
    middle = corners.mean(1, keepdims=True)
    porous = (np.abs(middle[..., 0] - 3) < 0.05).ravel()
    small = np.where(porous[:, None, None], middle + 0.5 * (corners - middle), corners)
    mesh = small.reshape(-1, 3), np.arange(3 * len(triangles)).reshape(-1, 3)
    parts = parts_of(vertices, triangles)
    added = close_holes(*mesh, parts, frames(), pictures(*mesh, lambda start, rays: np.full(len(rays), 5.0)))
    assert leaks(mesh, added) < 1e-3 < leaks(mesh, None)


def test_a_dark_view_stays_open_and_a_missed_surface_is_closed():
    """The same colours in the same directions lie far away; the same at the same places, on the wall."""
    mesh = room(window)
    far = closing(mesh, lambda start, rays: stripes(rays[:, 1] / -rays[:, 0]))
    here = closing(mesh, lambda start, rays: stripes(start[:, 1] + rays[:, 1] / -rays[:, 0] * start[:, 0]))
    assert leaks(mesh, here) == 0 < leaks(mesh, far)


def test_a_wall_missing_beside_a_window_is_closed():
    """One hole: bright outside by its left half, by its right half the wall that was not fused."""

    def outside(start, rays):
        y = start[:, 1] + rays[:, 1] / -rays[:, 0] * start[:, 0]
        return np.where(y < 1.2, 5.0, stripes(y))

    mesh = room(window)
    added = closing(mesh, outside)
    assert 0.35 * leaks(mesh, None) < leaks(mesh, added) < 0.65 * leaks(mesh, None)


def test_a_niche_stays_open():
    """Frames see mesh behind the wall's plane."""
    vertices, triangles = room(window)
    back = np.array([[-0.3, 0.5, 0.7], [-0.3, 1.9, 0.7], [-0.3, 1.9, 1.9], [-0.3, 0.5, 1.9]])
    triangles = np.concatenate([triangles, len(vertices) + np.array([[0, 1, 2], [0, 2, 3]])])
    mesh = np.concatenate([vertices, back]), triangles
    added = closing(mesh)
    assert not window(added.vertices[added.triangles].mean(1), np.full(len(added.triangles), WALL)).any()


def test_the_corner_of_a_wardrobe_is_closed_unless_frames_see_past_it():
    """No hole within its front, which ends there for all that the mesh tells. One frame may see by its pose's error."""

    def corner(centre, side):
        return (side == 7) & (np.abs(centre[:, 0] - 0.5) < 0.04) & (centre[:, 1] > 2) & (centre[:, 2] > 1.1)

    vertices, triangles = room(corner)
    back = np.array([[0.2, 1.7, 0.9], [0.2, 2.4, 0.9], [0.2, 2.4, 1.5], [0.2, 1.7, 1.5]])
    mesh = (
        np.concatenate([vertices, back]),
        np.concatenate([triangles, len(vertices) + np.array([[0, 1, 2], [0, 2, 3]])]),
    )
    share = []
    for cameras in (turned_away(frames()), frames(), frames()[-1:]):
        added = close_holes(
            *mesh, parts_of(*mesh), cameras, pictures(*mesh, lambda start, rays: np.full(len(rays), 5.0))
        )
        corners = added.vertices[added.triangles]
        in_front = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])[:, 0] / 2
        centre = corners.mean(1)
        share.append(in_front[corner(centre, np.full(len(centre), 7))].sum() / (0.4 * 0.4))
    assert 0.9 < share[0] < 1.3 and abs(share[1]) < 0.05 and 0.9 < share[2] < 1.3


def test_what_has_mesh_behind_it_lets_no_light_in():
    """The front of a cupboard by a wall, and the wall beside it."""
    wall = np.array([[0, 0, 0], [0, 1, 0], [0, 1, 1], [0, 0, 1]], float)
    front = wall * (1, 0.5, 1) + (0.4, 0, 0)
    scene = RayScene(np.concatenate([wall, front]), np.array([[0, 1, 2], [0, 2, 3], [4, 5, 6], [4, 6, 7]]))
    points, normals = np.float32([[0.4, 0.2, 0.6], [0, 0.7, 0.4]]), np.float32([[1, 0, 0], [1, 0, 0]])
    assert is_outward(scene, points, normals).tolist() == [False, True]


def test_the_scan_comes_back():
    vertices, triangles = room(window)
    more = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], float)
    mesh = Mesh(
        np.concatenate([vertices, more]), np.concatenate([triangles, len(vertices) + np.array([[0, 1, 2]])]),
        np.append(np.zeros(len(triangles), np.int32), 7), closed=np.array([len(triangles)], np.int32),
    )  # fmt: skip
    scan = as_scanned(mesh)
    assert np.array_equal(scan.vertices, vertices) and np.array_equal(scan.triangles, triangles)
    both = without_closing(Capture(Path(), mesh, (Instance(0, "room"), Instance(7, "wall")), ()))
    assert [one.object_id for one in both.instances] == [0] and both.mesh.closed is None


def closed_floor(crumbs=NONE, edge=0.1):
    """A room whose tilted floor ends at x = 1.8, loose triangles (n, 3, 3), and faces that close it 2 cm under."""
    vertices, triangles = room(lambda centre, side: (side == 4) & (centre[:, 0] > 1.8))
    vertices[:, 2] += 0.01 * vertices[:, 0]
    loose = len(vertices) + np.arange(3 * len(crumbs)).reshape(-1, 3)
    vertices, triangles = np.concatenate([vertices, crumbs.reshape(-1, 3)]), np.concatenate([triangles, loose])
    cell = edge * np.array([[0, 0], [1, 0], [1, 1], [0, 1]])
    corners = [np.array([x, y]) + cell for x in np.arange(1.7, 2.9, edge) for y in np.arange(0.1, 2.2, edge)]
    points, place = np.unique(np.round(np.concatenate(corners), 6), axis=0, return_inverse=True)
    quads = place.reshape(-1, 4)
    under = np.concatenate([points, np.full((len(points), 1), -0.005)], 1)
    faces = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
    mesh = Mesh(
        np.concatenate([vertices, under]), np.concatenate([triangles, len(vertices) + faces]),
        np.zeros(len(triangles) + len(faces), np.int32), closed=np.arange(len(triangles), len(triangles) + len(faces)),
    )  # fmt: skip
    return mesh, len(vertices)


def test_what_closes_a_floor_lies_just_under_the_scan_beside_it():
    """A step would throw a shadow where light comes in low. The floor is tilted, and the faces lie 2 cm under it."""
    mesh, scanned = closed_floor()
    moved = with_aligned_closing(mesh)
    scan = np.flatnonzero(mesh.vertices[:scanned, 0] < 1.65)  # beside them, not over them
    assert np.array_equal(moved.vertices[scan], mesh.vertices[scan])
    x, z = moved.vertices[scanned:, [0, 2]].T
    beside = x < 1.9
    depth = 0.01 * x - z
    assert (depth[beside] > 0).all() and (depth[beside] < 0.005).all() and (np.abs(depth) < 0.02).all()


@pytest.mark.parametrize(("edge", "kept"), [(0.025, False), (0.1, True)])
def test_crumbs_of_a_floor_lie_flat_over_what_closes_it(edge, kept):
    """Where a scan ends far from all cameras it is crumbs at all heights of its noise, which throw shadows. They stay
    over what no frame saw and is closed in large squares: there they may be anything before it."""
    rng = np.random.default_rng(0)
    middle = np.concatenate([rng.uniform((2.1, 0.4), (2.6, 1.8), (200, 2)), np.zeros((200, 1))], 1)
    middle[:, 2] = 0.01 * middle[:, 0] + rng.uniform(-0.01, 0.01, 200)
    crumbs = middle[:, None] + rng.uniform(-0.006, 0.006, (200, 3, 3))
    vase = np.array([[[2.3, 1.0, 0.3], [2.4, 1.0, 0.3], [2.3, 1.0, 0.5]]])
    mesh, scanned = closed_floor(np.concatenate([crumbs, vase]), edge)
    moved = with_aligned_closing(mesh).vertices
    own, vase = np.arange(scanned - 603, scanned - 3), np.arange(scanned - 3, scanned)
    spread = [np.ptp(points[own, 2] - 0.01 * points[own, 0]) for points in (moved, mesh.vertices)]
    assert spread[0] == spread[1] if kept else spread[0] < 0.3 * spread[1]
    assert np.array_equal(moved[vase], mesh.vertices[vase])


def test_what_cameras_stand_behind_is_no_wall_of_the_room():
    """The side of a cupboard, in a room whose far end was not fused: no curtain hangs beside it."""
    vertices, triangles = room(lambda centre, side: (side == 1) | (centre[:, 0] > 2.1))
    board = sheet(np.linspace(1.5, 2.3, 9), np.linspace(0.1, 1.7, 17), lambda y, z: np.full(y.shape, 1.8))
    facing = board.triangles[:, ::-1] + len(vertices)
    mesh = np.concatenate([vertices, board.vertices[:, [2, 0, 1]]]), np.concatenate([triangles, facing])
    (plane,) = (plane for plane in parts_of(*mesh).planes if plane.name == "wall" and plane.normal[0] < -0.9)
    assert plane.point[0] == pytest.approx(1.8, abs=0.01)
    added = closing(mesh)
    a, b, c = (added.vertices[corner] for corner in added.triangles.T)
    normal = np.cross(b - a, c - a)
    upright = np.abs(normal[:, 0]) > 0.9 * np.linalg.norm(normal, axis=1)
    assert (a[upright, 0] > 2.5).any() and not ((a[upright, 0] > 0.1) & (a[upright, 0] < 2.5)).any()
