"""A capture written anew in other layouts."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import numpy as np

from addon.core.scene.model import Capture, Frame, Mesh
from tests.core.io.colmap_files import images_of, write_text

OPENCV = np.diag([1.0, -1.0, -1.0, 1.0])
FIPT = np.diag([-1.0, 1.0, -1.0, 1.0])


def put(source: Path, target: Path) -> None:
    target.parent.mkdir(parents=True, exist_ok=True)
    shutil.copyfile(source, target)


def write_ply(path: Path, mesh: Mesh, ids: bool = True) -> None:
    """Binary, double coordinates: nothing is rounded."""
    path.parent.mkdir(parents=True, exist_ok=True)
    header = ["ply", "format binary_little_endian 1.0", f"element vertex {len(mesh.vertices)}"]
    header += [f"property double {axis}" for axis in "xyz"]
    header += [f"element face {len(mesh.triangles)}", "property list uchar int vertex_indices"]
    header += ["property int object_id"] if ids else []
    faces = np.zeros(len(mesh.triangles), [("n", "u1"), ("v", "<i4", 3)] + ([("id", "<i4")] if ids else []))
    faces["n"], faces["v"] = 3, mesh.triangles
    if ids:
        faces["id"] = mesh.object_id
    path.write_bytes(
        "\n".join([*header, "end_header\n"]).encode() + mesh.vertices.astype("<f8").tobytes() + faces.tobytes()
    )


def write_obj(path: Path, mesh: Mesh, names: dict[int, str] | None = None) -> None:
    """All vertices, then the faces of each object behind its name; without names one unnamed surface."""
    lines = [f"v {x!r} {y!r} {z!r}" for x, y, z in mesh.vertices.tolist()]
    for object_id in np.unique(mesh.object_id).tolist() if names else [None]:
        own = mesh.triangles if names is None else mesh.triangles[mesh.object_id == object_id]
        lines += [] if names is None else [f"o {names[object_id]}"]
        lines += [f"f {a} {b} {c}" for a, b, c in (own + 1).tolist()]
    path.write_text("\n".join(lines) + "\n")


def as_fipt(capture: Capture, root: Path, **obj) -> None:
    camera = capture.frames[0].camera
    frames = [
        {"file_path": "x", "transform_matrix": (f.camera.camera_to_world @ FIPT).tolist()} for f in capture.frames
    ]
    for i, frame in enumerate(capture.frames):
        put(frame.path, root / f"train/Image/{i:03d}_0001.exr")
    angle = 2 * np.arctan(camera.width / 2 / camera.fx)
    (root / "train/transforms.json").write_text(json.dumps({"camera_angle_x": angle, "frames": frames}))
    write_obj(root / "scene.obj", capture.mesh, **obj)


def as_fipt_real(capture: Capture, root: Path, **obj) -> None:
    cam, ks = [str(len(capture.frames))], [str(len(capture.frames))]
    for i, frame in enumerate(capture.frames):
        camera = frame.camera
        put(frame.path, root / f"Image/{i:03d}_0001.exr")
        pose = camera.camera_to_world
        for row in (pose[:3, 3], pose[:3, 3] - 2.5 * pose[:3, 2], pose[:3, 1]):
            cam.append(" ".join(map(repr, row.tolist())))
        ks += [f"{camera.fx!r} 0.0 {camera.cx!r}", f"0.0 {camera.fy!r} {camera.cy!r}", "0.0 0.0 1.0"]
    (root / "cam.txt").write_text("\n".join(cam) + "\n")
    (root / "K_list.txt").write_text("\n".join(ks) + "\n")
    write_obj(root / "scene.obj", capture.mesh, **obj)


def as_traj(capture: Capture, root: Path, beside: bool = False) -> None:
    camera = capture.frames[0].camera
    lines = []
    for i, frame in enumerate(capture.frames):
        put(frame.path, root / f"results/frame{i:06d}.exr")
        lines.append(" ".join(map(repr, (frame.camera.camera_to_world @ OPENCV).ravel().tolist())))
    (root / "traj.txt").write_text("\n".join(lines) + "\n")
    values = {"w": camera.width, "h": camera.height, "fx": camera.fx, "fy": camera.fy, "cx": camera.cx,
              "cy": camera.cy, "scale": 6553.5}  # fmt: skip
    (root.parent if beside else root).joinpath("cam_params.json").write_text(json.dumps({"camera": values}))
    write_ply(root.parent / f"{root.name}_mesh.ply" if beside else root / "mesh.ply", capture.mesh)


def as_scannetpp(capture: Capture, root: Path, names: dict[int, str]) -> None:
    """Each triangle gets vertices of its own, as a segment is told for each vertex."""
    mesh = capture.mesh
    loose = Mesh(
        mesh.vertices[mesh.triangles].reshape(-1, 3), np.arange(3 * len(mesh.triangles)).reshape(-1, 3), mesh.object_id
    )
    write_ply(root / "scans/mesh_aligned_0.05.ply", loose, ids=False)
    segment = np.repeat(2 * mesh.object_id + np.arange(len(mesh.triangles)) % 2, 3)
    (root / "scans/segments.json").write_text(json.dumps({"segIndices": segment.tolist()}))
    groups = [{"id": i, "objectId": i, "label": name, "segments": [2 * i, 2 * i + 1]} for i, name in names.items()]
    (root / "scans/segments_anno.json").write_text(json.dumps({"segGroups": groups}))
    for i, frame in enumerate(capture.frames):
        put(frame.path, root / f"dslr/resized_images/DSC{i:05d}.exr")
    write_colmap(capture.frames, root / "dslr/colmap", "DSC{:05d}.JPG")
    listed = [f"DSC{i:05d}.JPG" for i in range(len(capture.frames))]
    (root / "dslr/train_test_lists.json").write_text(json.dumps({"train": listed, "test": []}))


def write_colmap(frames: tuple[Frame, ...], folder: Path, name: str) -> None:
    camera = frames[0].camera
    cameras = {1: ("PINHOLE", camera.width, camera.height, (camera.fx, camera.fy, camera.cx, camera.cy))}
    write_text(folder, cameras, images_of([frame.camera.camera_to_world for frame in frames], name=name))
