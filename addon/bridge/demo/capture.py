"""The demo's room on disk, all but its pictures: poses, mesh, objects, and what is true of them. Knows no Blender."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np

from ...core.io.ply_write import ply_bytes
from .room import Thing

FIELD_OF_VIEW = np.radians(78)


def frame_path(index: int) -> str:
    """Where a capture keeps its frame `index`."""
    return f"images/frame_{index:04d}.exr"


def write_all_but_frames(folder: Path, things: tuple[Thing, ...], poses: np.ndarray, size: tuple[int, int]) -> None:
    """Make `folder` a capture without its pictures.

    Parameters
    ----------
    poses : (n, 4, 4) float
        Camera to world.
    size : tuple of int
        Width and height of the frames.
    """
    (folder / "images").mkdir(parents=True)
    (folder / "truth").mkdir()
    write_mesh(folder / "mesh.ply", things)
    objects = [{"id": thing.object_id, "class_name": thing.class_name} for thing in things]
    (folder / "info_semantic.json").write_text(json.dumps({"objects": objects}, indent=1))
    (folder / "truth" / "materials.json").write_text(json.dumps([truth(thing) for thing in things], indent=1))
    width, height = size
    focal = width / 2 / np.tan(FIELD_OF_VIEW / 2)
    transforms = {
        "camera_model": "PINHOLE",
        "w": width,
        "h": height,
        "fl_x": focal,
        "fl_y": focal,
        "cx": width / 2,
        "cy": height / 2,
        "frames": [{"file_path": frame_path(k), "transform_matrix": pose.tolist()} for k, pose in enumerate(poses)],
    }
    (folder / "transforms.json").write_text(json.dumps(transforms, indent=1))


def truth(thing: Thing) -> dict:
    """What the room's maker knows of `thing`, for the comparison at the demo's end."""
    paint = thing.paints[0]
    return {
        "id": thing.object_id,
        "class_name": thing.class_name,
        "emission": paint.emission,
        "alpha": paint.roughness**2 if paint.f0 else None,
        "f0": paint.f0,
        "metallic": 0.0,
        "base_color": [round(float(c), 4) for c in thing.mean_albedo()],
    }


def write_mesh(path: Path, things: tuple[Thing, ...]) -> None:
    """All things as one binary PLY with an `object_id` on each face."""
    corners, faces, first = [], [], 0
    for thing in things:
        vertices, index, _, _ = thing.faces()
        corners.append(vertices.astype(np.float32))
        faces.append((index + first, thing.object_id))
        first += len(vertices)
    faces.sort(key=lambda one: one[0].shape[1])  # triangles, then quads
    path.write_bytes(ply_bytes(np.concatenate(corners), faces))
