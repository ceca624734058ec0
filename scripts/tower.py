#!/usr/bin/env python3
"""A capture of a building out of one of a room: the same room many times, one above the other (+Z).

    python scripts/tower.py CAPTURE OUT [--rooms 38]

CAPTURE is in nerfstudio's layout and has truth/. Its room has to be closed above and below, and its light has to come
from lamps and from windows in the sides: so all rooms look into the same sky, and what was rendered of the room is
right for its copies. Pictures are links to one copy. Held-out views come in turn, a view of each room and then the
next, so that the first of them are of as many rooms. The lamp of relight.json stands in the first room: only its views
are relit. The mesh loses its texture coordinates.
"""

import argparse
import json
import os
import shutil
import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from addon.core.io.exr import read_numbers, write_exr
from addon.core.io.ply import ply_bytes, read_ply

GAP = 0.01
"""Metres between a room's highest point and the next room's lowest."""
FILES = "transforms.json", "truth/transforms.json", "info_semantic.json", "truth/materials.json"
"""Of frames, held-out views, objects and their materials."""


def named(room: int, path: str) -> str:
    """What a picture of the capture is called in a room."""
    folder, _, name = path.rpartition("/")
    return f"{folder}/room_{room:02d}_{name}"


def raised(frame: dict, room: int, height: float) -> dict:
    """A frame's entry in a room."""
    pose = np.array(frame["transform_matrix"])
    pose[2, 3] += room * height
    return frame | {"file_path": named(room, frame["file_path"]), "transform_matrix": pose.tolist()}


def link(source: Path, out: Path, path: str, rooms: int) -> None:
    """Copy a picture of the capture `source` for the first room, and link to that for the others."""
    first = out / named(0, path)
    first.parent.mkdir(parents=True, exist_ok=True)
    shutil.copy(source / path, first)
    for room in range(1, rooms):
        try:
            os.link(first, out / named(room, path))
        except OSError:  # a file system without links
            shutil.copy(first, out / named(room, path))


def shifted(entries: list[dict], rooms: int, count: int) -> list[dict]:
    """Entries of objects, for each room by ids of its own, `count` apart."""
    return [entry | {"id": entry["id"] + room * count} for room in range(rooms) for entry in entries]


def build(source: Path, out: Path, rooms: int) -> None:
    frames, views, objects, materials = (json.loads((source / name).read_text()) for name in FILES)
    mesh = read_ply(source / "mesh.ply")
    height = float(np.ptp(mesh.vertices[:, 2])) + GAP
    count = 1 + max(int(mesh.object_id.max()), *(entry["id"] for entry in [*objects["objects"], *materials]))

    (out / "truth/object_id").mkdir(parents=True)
    vertices = np.concatenate([mesh.vertices + [0, 0, room * height] for room in range(rooms)])
    faces = [(mesh.triangles + room * len(mesh.vertices), mesh.object_id + room * count) for room in range(rooms)]
    (out / "mesh.ply").write_bytes(ply_bytes(vertices.astype(np.float32), faces))

    for frame in frames["frames"]:
        link(source, out, frame["file_path"], rooms)
    for picture in (source / "truth").glob("*/*.exr"):
        path = picture.relative_to(source).as_posix()
        if picture.parent.name == "object_id":
            ids = read_numbers(picture)[..., 0].astype(np.float32)
            for room in range(rooms):
                write_exr(out / named(room, path), np.where(ids < 0, ids, ids + room * count))  # below 0: the sky
        else:
            link(source, out, path, 1 if picture.parent.name.startswith("relight") else rooms)

    frames["frames"] = [raised(frame, room, height) for room in range(rooms) for frame in frames["frames"]]
    views["frames"] = [raised(view, room, height) for view in views["frames"] for room in range(rooms)]
    objects["objects"] = shifted(objects["objects"], rooms, count)
    for name, value in zip(FILES, (frames, views, objects, shifted(materials, rooms, count))):
        (out / name).write_text(json.dumps(value, indent=1))
    shutil.copy(source / "truth/relight.json", out / "truth")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("capture", type=Path)
    parser.add_argument("out", type=Path)
    parser.add_argument("--rooms", type=int, default=38)
    options = parser.parse_args()
    build(options.capture, options.out, options.rooms)


if __name__ == "__main__":
    main()
