#!/usr/bin/env python3
"""A capture as it is segmented by what things are called: small objects belong to what they touch.

    python scripts/coarse_objects.py CAPTURE OUT [--within 0.02]

A cupboard gets its handles, a table its cloth, a wall its panels. Each object becomes part of the larger one that most
of its surface is near to. What is larger than all camera positions along two axes bounds the room: it takes nothing in.
Lamps stay by themselves (`truth/` tells them). Frames and truth are those of CAPTURE, which is in nerfstudio's layout;
they are copied.
"""

import argparse
import json
import shutil
import sys
from pathlib import Path

import numpy as np
from scipy.spatial import cKDTree

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from addon.core.io.ply import ply_bytes, read_ply

DENSITY, FEWEST, MOST = 4000, 300, 60_000
"""Points on each object: per square metre, at least, at most."""
TOUCHING = 3
"""More points than these have to be near."""


def points_on(corners: np.ndarray, area: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Random points on triangles ((t, 3, 3) corners, (t,) areas), (n, 3)."""
    count = int(np.clip(area.sum() * DENSITY, FEWEST, MOST))
    a, b, c = corners[rng.choice(len(area), count, p=area / area.sum())].transpose(1, 0, 2)
    u, v = rng.random((2, count, 1))
    u, v = np.where(u + v > 1, 1 - u, u), np.where(u + v > 1, 1 - v, v)
    return a + u * (b - a) + v * (c - a)


def coarse(
    vertices: np.ndarray,
    triangles: np.ndarray,
    object_id: np.ndarray,
    cameras: np.ndarray,
    fixed: set[int],
    within: float,
) -> dict:
    """What each object becomes part of, by their numbers."""
    corners = vertices[triangles]
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1) / 2
    rng, ids = np.random.default_rng(0), np.unique(object_id).tolist()
    size = {i: area[object_id == i].sum() for i in ids}
    points = {i: points_on(corners[object_id == i], area[object_id == i], rng) for i in ids}
    fixed = fixed | {i for i in ids if (np.ptp(points[i], axis=0) > np.ptp(cameras, axis=0)).sum() >= 2}
    host = {i: i for i in ids}
    for i in sorted(set(ids) - fixed, key=lambda i: size[i]):
        nearest = TOUCHING
        for j in set(ids) - fixed:
            apart = (points[i].max(0) < points[j].min(0) - within) | (points[i].min(0) > points[j].max(0) + within)
            if size[j] <= size[i] or apart.any():
                continue
            near = (cKDTree(points[j]).query(points[i], distance_upper_bound=within)[0] < np.inf).sum()
            if near > nearest:
                host[i], nearest = j, near
    for i in sorted(ids, key=lambda i: -size[i]):
        host[i] = host[host[i]]
    return host


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("capture", type=Path)
    parser.add_argument("out", type=Path)
    parser.add_argument("--within", type=float, default=0.02, metavar="METRES")
    options = parser.parse_args()
    shutil.copytree(options.capture, options.out)
    mesh = read_ply(options.out / "mesh.ply")
    objects = json.loads((options.out / "truth" / "materials.json").read_text())
    lamps = {entry["id"] for entry in objects if entry["emission"]}
    frames = json.loads((options.out / "transforms.json").read_text())["frames"]
    cameras = np.array([frame["transform_matrix"] for frame in frames])[:, :3, 3]
    host = coarse(mesh.vertices, mesh.triangles, mesh.object_id, cameras, lamps, options.within)
    ids = np.array([host[int(i)] for i in mesh.object_id], np.int32)
    (options.out / "mesh.ply").write_bytes(ply_bytes(mesh.vertices, [(mesh.triangles, ids)]))
    named = json.loads((options.out / "info_semantic.json").read_text())
    named["objects"] = [entry for entry in named["objects"] if entry["id"] in set(host.values())]
    (options.out / "info_semantic.json").write_text(json.dumps(named, indent=1))
    print(f"{len(host)} objects are {len(set(host.values()))}.")


if __name__ == "__main__":
    main()
