#!/usr/bin/env python3
"""A capture as a real scanner would have made it: poses, mesh, noise, exposure and clipping off by known amounts.

    python scripts/perturb_capture.py CAPTURE OUT [--seed N] [--poses 5 0.2] [--mesh 5] [--noise 0.02]
                                                  [--exposure 2] [--clip 4] [--mesh-smooth 0.5]
                                                  [--clip-at sensor] [--tell]

Without any of the five switches all are on, as the line above has them; with some, only those. CAPTURE is in
nerfstudio's layout. Its truth/ and its objects are copied as they are: the held-out views score what comes out.

poses      each frame on its own: so many millimetres and degrees, root mean square
mesh       millimetres along the normal, root mean square; vertices in one place (seams) move together
mesh-smooth  the share of that variance which is a smooth field (waves of 0.25 to 2 m); the rest is independent from
           vertex to vertex, with 0 all of it
noise      each channel of each pixel by itself, relative
exposure   stops in all: pixel = radiance * exposure, exposure even in its logarithm, written into transforms.json
clip       pixels above are held there; after the exposure ('sensor'), or before it ('radiance': what an HDR video
           merged from exposures of its own shows, clipped and then scaled)
tell       write the key `saturation`; without it, the reader has to find the clipping itself
"""

import argparse
import json
import shutil
import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from addon.core.io.exr import read_exr, write_exr
from addon.core.io.ply import parse_header, read_ply
from addon.core.scene.weld import point_normals, same_place

WAVES = 200
SHORTEST, LONGEST = 0.25, 2.0
"""Metres; a fused scan's error is smooth over about that, from drift and from the sensor's own depth error."""
SEAM = 1e-5
"""Vertices nearer than this, in metres, are one."""
DEFAULTS = {"poses": (5.0, 0.2), "mesh": 5.0, "noise": 0.02, "exposure": 2.0, "clip": 4.0}


def perturbed_pose(matrix: list, metres: float, radians: float, rng: np.random.Generator) -> list:
    """A camera-to-world matrix moved and turned by amounts whose root mean squares are `metres` and `radians`."""
    pose = np.array(matrix, np.float64)
    pose[:3, 3] += rng.normal(0, metres / np.sqrt(3), 3)
    pose[:3, :3] = pose[:3, :3] @ Rotation.from_rotvec(rng.normal(0, radians / np.sqrt(3), 3)).as_matrix()
    return pose.tolist()


def offsets(points: np.ndarray, metres: float, share: float, rng: np.random.Generator) -> np.ndarray:
    """How far each of the points ((p, 3)) moves along its normal, (p,): `share` of the variance is smooth."""
    wave_vectors = rng.normal(size=(WAVES, 3))
    wave_vectors /= np.linalg.norm(wave_vectors, axis=1, keepdims=True)
    wave_vectors *= 2 * np.pi / np.exp(rng.uniform(np.log(SHORTEST), np.log(LONGEST), (WAVES, 1)))
    phase = rng.uniform(0, 2 * np.pi, WAVES)
    smooth = sum(np.cos(points @ k + p) for k, p in zip(wave_vectors, phase)) * np.sqrt(2 / WAVES)
    return metres * (np.sqrt(share) * smooth + np.sqrt(1 - share) * rng.normal(size=len(points)))


def perturb_mesh(source: Path, target: Path, metres: float, share: float, rng: np.random.Generator) -> None:
    """Copy a PLY whose first element is the vertices, and move those."""
    content = bytearray(source.read_bytes())
    order, elements, start = parse_header(bytes(content[: 1 << 20]))
    head = elements[0]
    if head.name != "vertex" or any(p.count_kind for p in head.properties):
        raise SystemExit(f"'{source}' does not begin with its vertices.")
    ply = read_ply(source)
    vertices, triangles = np.asarray(ply.vertices, np.float64), np.asarray(ply.triangles)
    first, point_index = same_place(vertices, SEAM)
    normal = point_normals(vertices[first], point_index[triangles])
    moved = vertices + (normal * offsets(vertices[first], metres, share, rng)[:, None])[point_index]
    columns = [next(i for i, p in enumerate(head.properties) if p.name == name) for name in "xyz"]
    if order:
        kind = np.dtype([(p.name, order + p.kind) for p in head.properties])
        records = np.frombuffer(content, kind, head.count, start)  # a view: what is written goes into `content`
        for axis, name in enumerate("xyz"):
            records[name] = moved[:, axis]
    else:
        lines = content[start:].decode("latin-1").splitlines()
        for i, point in enumerate(moved.tolist()):
            words = lines[i].split()
            for k, value in zip(columns, point):
                words[k] = repr(value)
            lines[i] = " ".join(words)
        content[start:] = ("\n".join(lines) + "\n").encode("latin-1")
    target.write_bytes(content)


def perturb_picture(
    source: Path, target: Path, noise: float, exposure: float, clip: float, sensor: bool, rng: np.random.Generator
) -> None:
    """Copy a picture with noise, exposed and clipped."""
    rgb = read_exr(source).rgb
    rgb = rgb * (1 + noise * rng.normal(size=rgb.shape))
    rgb = np.minimum(rgb * exposure, clip) if sensor else np.minimum(rgb, clip) * exposure
    target.parent.mkdir(parents=True, exist_ok=True)
    write_exr(target, rgb.astype(np.float32), half=True)


def arguments(argv: Sequence[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("capture", type=Path)
    parser.add_argument("out", type=Path)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--poses", type=float, nargs=2, metavar=("MM", "DEGREES"))
    parser.add_argument("--mesh", type=float, metavar="MM")
    parser.add_argument("--noise", type=float, metavar="SHARE")
    parser.add_argument("--exposure", type=float, metavar="STOPS")
    parser.add_argument("--clip", type=float, metavar="VALUE")
    parser.add_argument("--mesh-smooth", type=float, default=0.5, metavar="SHARE")
    parser.add_argument("--clip-at", choices=("sensor", "radiance"), default="sensor")
    parser.add_argument("--tell", action="store_true")
    options = parser.parse_args(argv)
    if all(getattr(options, name) is None for name in DEFAULTS):
        for name, value in DEFAULTS.items():
            setattr(options, name, value)
    return options


def main(argv: Sequence[str] | None = None) -> int:
    options = arguments(argv)
    source, out = options.capture, options.out
    # A generator for each: one perturbation alone is the same as among all.
    poses, mesh, exposures, pictures = (np.random.default_rng([options.seed, k]) for k in range(4))
    transforms = json.loads((source / "transforms.json").read_text())
    out.mkdir(parents=True)
    for name in ("info_semantic.json", "README.md"):
        if (source / name).exists():
            shutil.copyfile(source / name, out / name)
    if (source / "truth").is_dir():
        shutil.copytree(source / "truth", out / "truth", copy_function=shutil.copyfile)
    if options.mesh:
        perturb_mesh(source / "mesh.ply", out / "mesh.ply", options.mesh / 1000, options.mesh_smooth, mesh)
    else:
        shutil.copyfile(source / "mesh.ply", out / "mesh.ply")
    clip, sensor = np.inf if options.clip is None else options.clip, options.clip_at == "sensor"
    for frame in transforms["frames"]:
        if options.poses:
            millimetres, degrees = options.poses
            frame["transform_matrix"] = perturbed_pose(
                frame["transform_matrix"], millimetres / 1000, np.radians(degrees), poses
            )
        exposure = 1.0
        if options.exposure:
            exposure = float(2 ** exposures.uniform(-options.exposure / 2, options.exposure / 2))
            frame["exposure"] = exposure
        if options.tell and options.clip:
            frame["saturation"] = clip if sensor else clip * exposure
        paths = source / frame["file_path"], out / frame["file_path"]
        perturb_picture(*paths, options.noise or 0.0, exposure, clip, sensor, pictures)
    (out / "transforms.json").write_text(json.dumps(transforms, indent=1))
    return 0


if __name__ == "__main__":
    sys.exit(main())
