#!/usr/bin/env python3
"""A capture of a real one's size from a small one: windows of its frames, enlarged, and its triangles cut up.

    python scripts/large_capture.py CAPTURE OUT [--frames 500] [--size 1152 768] [--doublings 0]

CAPTURE is in nerfstudio's layout, without distortion. Each new frame is what a longer lens in the same place and pose
would show: a window of .7 to 1 of a frame's edge, bilinear. So radiance stays right where it was; detail is not added,
and what depends on the sharpness of frames is not to be judged by it: this is for memory and time. Each doubling
cuts all triangles in two, through the middle of an edge.
"""

import argparse
import json
import shutil
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
from scipy.ndimage import map_coordinates

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from addon.core.io.exr import read_exr, write_exr
from addon.core.io.ply import ply_bytes, read_ply

SHARES = (0.7, 1.0)
"""Edges of the windows, of the frame's."""


def window(image: np.ndarray, corner: np.ndarray, step: np.ndarray, size: tuple[int, int]) -> np.ndarray:
    """`size` (width, height) pixels from a corner (x, y) on, `step` (x, y) apart, in the image's pixels."""
    x, y = (corner[i] + (np.arange(size[i]) + 0.5) * step[i] - 0.5 for i in range(2))
    coordinates = np.meshgrid(y, x, indexing="ij")
    return np.stack([map_coordinates(image[..., c], coordinates, order=1, mode="nearest") for c in range(3)], -1)


def halved(vertices: np.ndarray, triangles: np.ndarray, owner: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The same surface with twice the triangles."""
    i, j, k = triangles.T
    midpoints = np.arange(len(triangles), dtype=triangles.dtype) + len(vertices)
    vertices = np.concatenate([vertices, (vertices[i] + vertices[j]) / 2])
    halves = np.stack([np.stack([k, i, midpoints], 1), np.stack([j, k, midpoints], 1)], 1)
    return vertices, halves.reshape(-1, 3), np.repeat(owner, 2)


def enlarge(source: Path, out: Path, frames: int, size: tuple[int, int], doublings: int) -> None:
    transforms = json.loads((source / "transforms.json").read_text())
    (out / "images").mkdir(parents=True)
    shutil.copy(source / "info_semantic.json", out)
    mesh = read_ply(source / "mesh.ply")
    parts = mesh.vertices, mesh.triangles, mesh.object_id
    for _ in range(doublings):
        parts = halved(*parts)
    (out / "mesh.ply").write_bytes(ply_bytes(parts[0], [(parts[1], parts[2])]))
    rng = np.random.default_rng(0)
    old = np.array([transforms["w"], transforms["h"]])
    focal, centre = np.array([transforms["fl_x"], transforms["fl_y"]]), np.array([transforms["cx"], transforms["cy"]])
    jobs = []
    for number in range(frames):
        frame = transforms["frames"][number % len(transforms["frames"])]
        share = rng.uniform(*SHARES)
        corner = rng.uniform(0, 1, 2) * (1 - share) * old
        jobs.append((number, frame, corner, share * old / size))

    def make(job) -> dict:
        number, frame, corner, step = job
        name = f"images/frame_{number:05d}.exr"
        image = np.asarray(read_exr(source / frame["file_path"]).rgb, np.float32)
        write_exr(out / name, window(image, corner, step, size), half=True)
        (fl_x, fl_y), (cx, cy) = focal / step, (centre - corner) / step
        lens = {"fl_x": fl_x, "fl_y": fl_y, "cx": cx, "cy": cy}
        return {"file_path": name, "transform_matrix": frame["transform_matrix"], **lens}

    with ThreadPoolExecutor() as pool:
        entries = list(pool.map(make, jobs))
    shared = {
        name: value
        for name, value in transforms.items()
        if name not in ("frames", "w", "h", "fl_x", "fl_y", "cx", "cy")
    }
    new = shared | {"w": size[0], "h": size[1], "frames": entries}
    (out / "transforms.json").write_text(json.dumps(new, indent=1))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("capture", type=Path)
    parser.add_argument("out", type=Path)
    parser.add_argument("--frames", type=int, default=500)
    parser.add_argument("--size", type=int, nargs=2, default=(1152, 768), metavar=("WIDTH", "HEIGHT"))
    parser.add_argument("--doublings", type=int, default=0, help="times that the number of triangles is doubled")
    options = parser.parse_args()
    enlarge(options.capture, options.out, options.frames, tuple(options.size), options.doublings)


if __name__ == "__main__":
    main()
