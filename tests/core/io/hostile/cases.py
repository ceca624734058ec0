"""Small valid captures of every format, whole: what the hostile tests then spoil, file by file."""

from __future__ import annotations

import json
import shutil
import struct
import zlib
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from addon.core.io.layout import Reading
from addon.core.io.png import write_png
from tests.core.io.colmap_files import images_of, write_binary, write_text
from tests.core.io.conftest import CORNERS, HEIGHT, JPEG, SIDES, WIDTH, CaptureOnDisk, ply_text
from tests.core.replica_on_disk import ReplicaOnDisk
from tests.core.rooms import lit_box, make_room

COUNT = 4
RNG = np.random.default_rng(0)
RADIANCE = RNG.random((HEIGHT, WIDTH, 3)).astype(np.float32)
CODES = RNG.integers(0, 250, (HEIGHT, WIDTH, 3), np.uint8)


class Case(NamedTuple):
    """A capture and the file of it that is spoiled.

    Attributes
    ----------
    name : str
    make : callable(root)
        Writes the whole capture.
    victim : str
        The file, relative to the root.
    reading : Reading
    """

    name: str
    make: Callable[[Path], None]
    victim: str
    reading: Reading = Reading()


def nerfstudio(root: Path) -> None:
    """JSON poses, EXR frames, PLY mesh, a mask, brackets, settings."""
    capture = CaptureOnDisk(root, COUNT)
    for i in range(COUNT):
        capture.picture(i, RADIANCE)
    write_png(root / "mask.png", CODES)
    capture.frame(
        0,
        mask_path="mask.png",
        exposure=1.0,
        saturation=5.0,
        brackets=[{"file_path": "images/001.exr", "exposure": 2.0}],
    )
    capture.transforms["frames"] = [frame for i, frame in enumerate(capture.transforms["frames"]) if i != 1]
    capture.frame(1, shutter="1/60", iso=200, fl_x=6.0, k1=0.01)
    capture.top(
        applied_transform=[[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0]],
        applied_scale=1.0,
        camera_model="OPENCV",
        train_filenames=["images/000.exr"],
    )


def with_table(root: Path) -> None:
    nerfstudio(root)
    lines = [f"{i:03d},1/60,2.8,{100 * (i + 1)}" for i in range(COUNT)]
    (root / "exposures.csv").write_text("\n".join(["name,shutter,aperture,iso", *lines]) + "\n")


def with_segments(root: Path) -> None:
    nerfstudio(root)
    (root / "ids.txt").write_text("# of each face\n" + "\n".join(map(str, range(len(SIDES)))) + "\n")
    np.save(root / "ids.npy", np.arange(len(SIDES), dtype=np.int32))
    (root / "ids.ply").write_text((root / "mesh.ply").read_text())


def with_binary_ply(root: Path) -> None:
    nerfstudio(root)
    head = (
        "ply\nformat binary_little_endian 1.0\n"
        + f"element vertex {len(CORNERS)}\n"
        + "".join(f"property float {axis}\n" for axis in "xyz")
        + f"element face {len(SIDES)}\n"
        + "property list uchar int vertex_indices\nproperty int object_id\nend_header\n"
    )
    body = b"".join(struct.pack("<3f", *corner) for corner in CORNERS)
    body += b"".join(struct.pack("<B5i", 4, *side, i) for i, side in enumerate(SIDES))
    (root / "mesh.ply").write_bytes(head.encode() + body)


def with_pictures(ending: str, content: bytes | Callable[[Path], None]) -> Callable[[Path], None]:
    """Frames of another kind than EXR; frame 0 alone is spoiled, the others are good."""

    def make(root: Path) -> None:
        capture = CaptureOnDisk(root, 6)
        for i, frame in enumerate(capture.transforms["frames"]):
            path = root / f"images/{i:03d}{ending}"
            (root / frame["file_path"]).unlink()
            frame["file_path"] = path.relative_to(root).as_posix()
            content(path) if callable(content) else path.write_bytes(content)
        capture.save()

    return make


def colmap(write) -> Callable[[Path], None]:
    def make(root: Path) -> None:
        poses = [frame["transform_matrix"] for frame in mesh_only(root).transforms["frames"]]
        camera = "OPENCV", WIDTH, HEIGHT, (6.0, 6.5, 4.0, 3.0, 0.01, 0.0, 0.0, 0.0)
        write(root / "sparse/0", {1: camera}, images_of(poses))

    return make


def hdr_content() -> bytes:
    rgbe = np.concatenate([CODES | 128, np.full((HEIGHT, WIDTH, 1), 127, np.uint8)], -1)
    body = b""
    for line in rgbe:
        body += bytes((2, 2, 0, WIDTH)) + b"".join(bytes((WIDTH,)) + channel.tobytes() for channel in line.T)
    return f"#?RADIANCE\nEXPOSURE=2\nFORMAT=32-bit_rle_rgbe\n\n-Y {HEIGHT} +X {WIDTH}\n".encode() + body


ADAM7 = ((0, 0, 8, 8), (0, 4, 8, 8), (4, 0, 8, 4), (0, 2, 4, 4), (2, 0, 4, 2), (0, 1, 2, 2), (1, 0, 2, 1))
"""Passes of an interlaced PNG: first row and column, and steps of both."""


def png_content() -> bytes:
    """16 bits, interlaced, all filters."""

    def chunk(kind: bytes, data: bytes) -> bytes:
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    lines = b""
    for y, x, down, right in ADAM7:
        part = CODES[y::down, x::right].astype(">u2")
        lines += b"".join(bytes((k % 5,)) + line.tobytes() for k, line in enumerate(part) if part.size)
    header = struct.pack(">IIBBBBB", WIDTH, HEIGHT, 16, 2, 0, 0, 1)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(lines)) + chunk(b"IEND", b"")


def mesh_only(root: Path) -> CaptureOnDisk:
    """The mesh and the frames; the poses are for the caller to write in another way."""
    capture = CaptureOnDisk(root, COUNT)
    (root / "transforms.json").unlink()
    return capture


def traj(root: Path) -> None:
    capture = mesh_only(root)
    (root / "images").rename(root / "results")
    flip = np.diag([1.0, -1, -1, 1])
    for i in range(COUNT):
        (root / f"results/{i:03d}.exr").rename(root / f"results/frame{i:06d}.exr")
    poses = [np.array(frame["transform_matrix"]) @ flip for frame in capture.transforms["frames"]]
    (root / "traj.txt").write_text("".join(" ".join(map(repr, pose.ravel().tolist())) + "\n" for pose in poses))
    (root / "cam_params.json").write_text(
        json.dumps({"camera": {"w": WIDTH, "h": HEIGHT, "fx": 6.0, "fy": 6.5, "cx": 4.0, "cy": 3.0, "scale": 6553.5}})
    )


Y_UP = np.array([[1.0, 0, 0, 0], [0, 0, 1, 0], [0, -1, 0, 0], [0, 0, 0, 1]])
"""From +Z up to +Y up, as ARKit has it."""


def turn_mesh(root: Path, move: np.ndarray) -> None:
    """Move the vertices of `mesh.ply` by a (4, 4) matrix."""
    corners = np.array(CORNERS, float) @ move[:3, :3].T + move[:3, 3]
    (root / "mesh.ply").write_text(ply_text(corners.tolist(), SIDES, range(6)))


def jpegs(root: Path, folder: str, name: Callable[[int], str]) -> None:
    """JPEG frames in place of the EXR ones."""
    shutil.rmtree(root / "images")
    (root / folder).mkdir(parents=True)
    for i in range(COUNT):
        (root / folder / f"{name(i)}.jpg").write_bytes(JPEG)


def polycam(root: Path, corrected: bool = True) -> None:
    """Raw data as Polycam exports it; the mesh, a PLY, is turned and moved against the cameras."""
    frames = mesh_only(root).transforms["frames"]
    kind = "corrected_" if corrected else ""
    jpegs(root, f"keyframes/{kind}images", lambda i: str(1000 + i))
    (root / f"keyframes/{kind}cameras").mkdir()
    for i, frame in enumerate(frames):
        pose = Y_UP @ frame["transform_matrix"]
        told = {f"t_{j}{k}": pose[j, k] for j in range(3) for k in range(4)}
        told |= {"width": WIDTH, "height": HEIGHT, "fx": 6.0, "fy": 6.5, "cx": 4.0, "cy": 3.0, "blur_score": 90.0 + i}
        (root / f"keyframes/{kind}cameras/{1000 + i}.json").write_text(json.dumps(told))
    move = np.array([[0.0, 0, 1, 2], [0, 1, 0, -1], [-1, 0, 0, 0.5], [0, 0, 0, 1]])
    turn_mesh(root, move @ Y_UP)
    info = {"alignmentTransform": move.T.ravel().tolist(), "faceCount": 6}
    (root / "mesh_info.json").write_text(json.dumps(info))


def quaternion(pose: np.ndarray) -> list[float]:
    """x, y, z, w of a pose's rotation."""
    return Rotation.from_matrix(pose[:3, :3]).as_quat().tolist()


def write_odometry(path: Path, poses: Sequence, lens: Sequence[float]) -> None:
    """Stray Scanner's table of the poses ((4, 4), +Z up, OpenGL axes), all with fx, fy, cx, cy of `lens`."""
    lines = ["timestamp, frame, x, y, z, qx, qy, qz, qw, fx, fy, cx, cy, distortion_center_x, distortion_center_y"]
    for i, pose in enumerate(poses):
        pose = Y_UP @ pose @ np.diag([1.0, -1, -1, 1])
        values = [i / 60, f"{i:06d}", *pose[:3, 3], *quaternion(pose), *lens]
        lines.append(", ".join(map(str, values)) + ", , ")
    path.write_text("\n".join(lines) + "\n")


def record3d(root: Path) -> None:
    """A recording as Record3D exports it, and a mesh in its coordinates."""
    frames = mesh_only(root).transforms["frames"]
    jpegs(root, "rgbd", str)
    poses = [[*quaternion(pose), *pose[:3, 3]] for pose in (Y_UP @ frame["transform_matrix"] for frame in frames)]
    told = {"w": WIDTH, "h": HEIGHT, "fps": 60, "K": [6.0, 0, 0, 0, 6.5, 0, 4.0, 3.0, 1]}
    told["poses"] = [[float(x) for x in pose] for pose in poses]
    told["perFrameIntrinsicCoeffs"] = [[6.0, 6.5, 4.0, 3.0]] * COUNT
    (root / "metadata").write_text(json.dumps(told))
    turn_mesh(root, Y_UP)


def stray(root: Path) -> None:
    """A recording as Stray Scanner exports it, and a mesh in its coordinates; its frames were taken out before."""
    frames = mesh_only(root).transforms["frames"]
    shutil.rmtree(root / "images")
    (root / "rgb.mp4").write_bytes(b"mp4")
    (root / "rgb.mp4-3").mkdir()
    for i in range(COUNT):
        write_png(root / f"rgb.mp4-3/{i:06d}.png", CODES)
    write_odometry(root / "odometry.csv", [frame["transform_matrix"] for frame in frames], (6.0, 6.5, 4.0, 3.0))
    turn_mesh(root, Y_UP)


def scannetpp(root: Path) -> None:
    capture = mesh_only(root)
    poses = [frame["transform_matrix"] for frame in capture.transforms["frames"]]
    (root / "dslr").mkdir()
    (root / "scans").mkdir()
    (root / "images").rename(root / "dslr/resized_images")
    (root / "mesh.ply").rename(root / "scans/mesh_aligned_0.05.ply")
    write_text(root / "dslr/colmap", {1: ("PINHOLE", WIDTH, HEIGHT, (6.0, 6.5, 4.0, 3.0))}, images_of(poses))
    (root / "scans/segments.json").write_text(json.dumps({"segIndices": [i // 2 for i in range(len(CORNERS))]}))
    groups = [{"objectId": i, "id": i, "label": f"thing {i}", "segments": [i]} for i in range(4)]
    (root / "scans/segments_anno.json").write_text(json.dumps({"segGroups": groups}))
    (root / "dslr/train_test_lists.json").write_text(json.dumps({"train": ["000.exr"], "test": ["003.exr"]}))


def fipt_real(root: Path) -> None:
    capture = mesh_only(root)
    (root / "Image").mkdir()
    lines = [str(COUNT)]
    for i, frame in enumerate(capture.transforms["frames"]):
        (root / f"images/{i:03d}.exr").rename(root / f"Image/{i:03d}_0001.exr")
        pose = np.array(frame["transform_matrix"])
        for row in (pose[:3, 3], pose[:3, 3] - pose[:3, 2], pose[:3, 1]):
            lines.append(" ".join(map(repr, row.tolist())))
    (root / "cam.txt").write_text("\n".join(lines) + "\n")
    k = "6.0 0.0 4.0\n0.0 6.5 3.0\n0.0 0.0 1.0\n"
    (root / "K_list.txt").write_text(f"{COUNT}\n" + k * COUNT)


def replica(root: Path) -> None:
    room = make_room(lit_box(lamps=(((0.3, 0.7), (0.3, 0.7)),)), 0.3)
    ReplicaOnDisk(root, room, np.ones((len(room.atlas.object_id), 3)), edge=1.0)
    pane = {"plane_w": [0, 0, 1, 0], "boundary_w": [[0, 0, 0], [1, 0, 0], [1, 1, 0]], "reflectivity": 0.9}
    (root / "glass.sur").write_text(json.dumps([pane]))


def tiff_content() -> bytes:
    """8 bits, no compression, an EXIF pointer that leads back to the first directory."""
    tags = (
        (256, 3, WIDTH),
        (257, 3, HEIGHT),
        (258, 3, 8),
        (259, 3, 1),
        (262, 3, 2),
        (273, 4, 8),
        (277, 3, 3),
        (278, 3, HEIGHT),
        (279, 4, CODES.size),
        (0x8769, 4, 8 + CODES.size),
    )
    directory = b"".join(struct.pack("<HHII", tag, kind, 1, value) for tag, kind, value in tags)
    return (
        b"II*\0"
        + struct.pack("<I", 8 + CODES.size)
        + CODES.tobytes()
        + struct.pack("<H", len(tags))
        + directory
        + struct.pack("<I", 0)
    )


CODED = Reading(transfer="srgb")
ON_PLY = Reading(mesh=Path("mesh.ply"))
"""The format's own mesh is an OBJ file, which needs Blender."""

CASES = (
    Case("poses", nerfstudio, "transforms.json"),
    Case("objects", nerfstudio, "info_semantic.json"),
    Case("ply", nerfstudio, "mesh.ply"),
    Case("binary_ply", with_binary_ply, "mesh.ply"),
    Case("mask", nerfstudio, "mask.png"),
    Case("exposures", with_table, "exposures.csv"),
    *(
        Case(f"segments_{one}", with_segments, f"ids.{one}", Reading(segments=f"ids.{one}"))
        for one in ("txt", "npy", "ply")
    ),
    Case("hdr", with_pictures(".hdr", hdr_content()), "images/000.hdr"),
    Case("png", with_pictures(".png", png_content()), "images/000.png", CODED),
    Case("jpeg", with_pictures(".jpg", JPEG), "images/000.jpg", CODED),
    Case("tiff", with_pictures(".tif", tiff_content()), "images/000.tif", CODED),
    Case("colmap_cameras", colmap(write_text), "sparse/0/cameras.txt"),
    Case("colmap_images", colmap(write_text), "sparse/0/images.txt"),
    Case("colmap_binary_cameras", colmap(write_binary), "sparse/0/cameras.bin"),
    Case("colmap_binary_images", colmap(write_binary), "sparse/0/images.bin"),
    Case("replica_tiles", replica, "textures/parameters.json"),
    Case("replica_order", replica, "habitat/sorted_faces.bin"),
    Case("replica_mesh", replica, "mesh.ply"),
    Case("replica_objects", replica, "habitat/mesh_semantic.ply"),
    Case("replica_panes", replica, "glass.sur"),
    Case("traj", traj, "traj.txt"),
    Case("traj_camera", traj, "cam_params.json"),
    Case("polycam_camera", polycam, "keyframes/corrected_cameras/1001.json"),
    Case("polycam_mesh_info", polycam, "mesh_info.json"),
    Case("record3d", record3d, "metadata"),
    Case("stray", stray, "odometry.csv"),
    Case("scannetpp_segments", scannetpp, "scans/segments.json"),
    Case("scannetpp_objects", scannetpp, "scans/segments_anno.json"),
    Case("scannetpp_lists", scannetpp, "dslr/train_test_lists.json"),
    Case("fipt_cameras", fipt_real, "cam.txt", ON_PLY),
    Case("fipt_intrinsics", fipt_real, "K_list.txt", ON_PLY),
)


def placed(reading: Reading, root: Path) -> Reading:
    """The same of a capture in `root`."""
    paths = {name: root / value for name in ("mesh", "segments") if (value := getattr(reading, name))}
    return replace(reading, **paths)


def fresh(case: Case, root: Path) -> tuple[Path, Reading]:
    """The capture written anew; gives the victim's path and how to read the capture."""
    shutil.rmtree(root, ignore_errors=True)
    case.make(root)
    reading = Reading(exposures=root / case.victim) if case.name == "exposures" else case.reading
    return root / case.victim, placed(reading, root)
