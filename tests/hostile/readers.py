"""All that reads a file from outside: captures of every format, meshes, pictures, result folders."""

from __future__ import annotations

import base64
import importlib.util
import json
import re
import struct
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from addon.core.errors import ScanRelightError
from addon.core.io.exr import write_exr
from addon.core.io.layout import AS_FOUND, Reading
from addon.core.io.pictures import picture_size
from addon.core.io.pixels import read_pixels
from addon.core.io.png import write_png
from addon.core.io.read import describe, read_capture
from tests.core.io import test_phone_pictures, test_video
from tests.core.io.conftest import CORNERS, HEIGHT, SIDES, WIDTH
from tests.core.io.hostile import cases, test_coded_spoiled, test_exr_spoiled
from tests.core.rooms import lit_box, make_room
from tests.core.textured_on_disk import write_textured

TEXTURED = make_room(lit_box(), 0.5)
STAGE = {"values": np.arange(30.0).reshape(10, 3), "names": np.array(["a", "bc"])}


@dataclass(frozen=True)
class Reader:
    """`make(root)` writes what is good and gives the file that is spoiled; `read(root)` reads all that a run would."""

    make: Callable[[Path], Path]
    read: Callable[[Path], None]
    blender: bool = False


def capture(root: Path, reading: Reading = AS_FOUND) -> None:
    """Read a capture whole; a sentence on a frame is no failure."""
    found = read_capture(root, reading)
    describe(found)
    for one in found.warnings:
        assert "\n" not in one and len(one) < 5000, one
    for frame in found.frames:
        try:
            pixels = read_pixels(frame)
        except ScanRelightError as error:
            assert str(error).endswith(".") and len(str(error)) < 5000, str(error)
        else:
            assert pixels.radiance.shape == (frame.camera.height, frame.camera.width, 3)
            assert ((pixels.radiance >= 0) & np.isfinite(pixels.radiance)).all()


def of_case(case: cases.Case) -> Reader:
    def make(root: Path) -> Path:
        case.make(root)
        return root / case.victim

    def read(root: Path) -> None:
        reading = Reading(exposures=root / case.victim) if case.name == "exposures" else case.reading
        capture(root, cases.placed(reading, root))

    return Reader(make, read)


def picture(ending: str, write: Callable[[Path], None], reading: Reading) -> Reader:
    """A capture whose frame 0 is spoiled; the others are as it was."""

    def make(root: Path) -> Path:
        on_disk = cases.CaptureOnDisk(root, 6)
        for i, frame in enumerate(on_disk.transforms["frames"]):
            (root / frame["file_path"]).unlink()
            frame["file_path"] = f"images/{i:03d}.{ending}"
            write(root / frame["file_path"])
        width, height = picture_size(root / frame["file_path"])
        on_disk.top(w=width, h=height, fl_x=width, fl_y=width, cx=width / 2, cy=height / 2)
        return root / f"images/000.{ending}"

    return Reader(make, lambda root: capture(root, reading))


def mesh_files(root: Path, name: str, corners: Sequence = CORNERS) -> Path:
    """The mesh as OBJ, glTF or GLB, in place of the PLY."""
    corners = np.array(corners, np.float32)
    triangles = np.array([[q[0], q[i], q[i + 1]] for q in SIDES for i in (1, 2)], np.uint16)
    path = root / name
    if name.endswith(".obj"):
        lines = ["mtllib a.mtl", *(f"v {x} {y} {z}" for x, y, z in corners), "vt 0 0"]
        for k, side in enumerate(SIDES):
            lines += [f"o thing {k}", "usemtl a", "f " + " ".join(f"{i + 1}/1" for i in side)]
        path.write_text("\n".join(lines) + "\n")
        return path
    data = corners.tobytes() + triangles.tobytes()
    low, high = corners.min(0).tolist(), corners.max(0).tolist()
    count = triangles.size // 2
    accessor = {"bufferView": 1, "componentType": 5123, "count": count, "type": "SCALAR"}
    top = {
        "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0, 1]}], "extensionsUsed": ["KHR_lights"],
        "nodes": [{"mesh": 0, "name": "one", "children": [2]}, {"mesh": 1, "rotation": [0, 0, 0, 1]}, {"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1 + k}]} for k in (0, 1)],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": len(corners), "type": "VEC3", "min": low, "max": high},
            accessor, accessor | {"byteOffset": 2 * count},
        ],
        "bufferViews": [{"buffer": 0, "byteLength": corners.nbytes},
                        {"buffer": 0, "byteOffset": corners.nbytes, "byteLength": triangles.nbytes}],
        "buffers": [{"byteLength": len(data)}],
    }  # fmt: skip
    if name.endswith(".gltf"):
        top["buffers"][0]["uri"] = "data:application/octet-stream;base64," + base64.b64encode(data).decode()
        path.write_text(json.dumps(top))
        return path
    text = json.dumps(top).encode()
    text += b" " * (-len(text) % 4)
    head = struct.pack("<4sIII4s", b"glTF", 2, 28 + len(text) + len(data), len(text), b"JSON")
    path.write_bytes(head + text + struct.pack("<I4s", len(data), b"BIN\0") + data)
    return path


def other_mesh(name: str) -> Reader:
    def make(root: Path) -> Path:
        cases.nerfstudio(root)
        (root / "mesh.ply").unlink()
        return mesh_files(root, name)

    def read(root: Path) -> None:
        from addon.bridge.data.import_mesh import import_mesh

        capture(root, Reading(mesh=root / name, import_mesh=import_mesh))

    return Reader(make, read, blender=True)


def textured(name: str, victim: str) -> Reader:
    """A mesh alone with a baked texture, within a GLB or beside an OBJ file."""

    def make(root: Path) -> Path:
        root.mkdir(parents=True, exist_ok=True)
        if name.endswith(".glb"):
            write_textured(root, TEXTURED, np.full((len(TEXTURED.atlas), 3), 0.5), name)
        else:
            whole = mesh_files(root, name).read_text().replace("vt 0 0", "vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1")
            (root / name).write_text(re.sub(r"/1 (\d+)/1 (\d+)/1 (\d+)/1", r"/1 \1/2 \2/3 \3/4", whole))
            (root / "a.mtl").write_text("newmtl b\nKd 1 1 1\nnewmtl a\nmap_Kd -s 1 1 1 t.png\n")
            write_png(root / "t.png", np.full((8, 8, 3), 90, np.uint8))
        return root / victim

    def read(root: Path) -> None:
        from addon.bridge.data.import_mesh import import_mesh
        from addon.core.lit_diffuse import from_picture

        found = read_capture(root, Reading(import_mesh=import_mesh))
        describe(found)
        from_picture.texel_edge(found.mesh, found.mesh.lit)
        for one in found.mesh.lit.pictures:
            from_picture._read(one)

    return Reader(make, read, blender=True)


def fipt_ids(ending: str) -> Reader:
    """FIPT's pictures of ids, of a mesh that tells of no objects."""

    def make(root: Path) -> Path:
        cases.fipt_real(root)
        mesh = (root / "mesh.ply").read_text().splitlines(keepends=True)
        at = next(i for i, line in enumerate(mesh) if "object_id" in line)
        count = next(int(line.split()[2]) for line in mesh if line.startswith("element face"))
        bare = [" ".join(line.split()[:-1]) + "\n" for line in mesh[-count:]]
        (root / "mesh.ply").write_text("".join(mesh[:at] + mesh[at + 1 : -count] + bare))
        (root / "segmentation").mkdir()
        for k in range(cases.COUNT):
            path = root / f"segmentation/{k:03d}.exr"
            if ending == "exr":
                write_exr(path, np.full((HEIGHT, WIDTH), 3.0))
            else:  # a PNG by its content
                write_png(path, np.full((HEIGHT, WIDTH, 3), 3, np.uint8))
        return root / "segmentation/000.exr"

    return Reader(make, lambda root: capture(root, Reading(mesh=root / "mesh.ply")))


def part(root: Path) -> Path:
    """A part of a building, beside it."""
    from addon.core.io.part import PART, write_part
    from addon.core.scene.division import Division

    root.mkdir(parents=True)
    whole = read_capture(cases.CaptureOnDisk(root / "whole", 6).root)
    triangles = np.arange(len(whole.mesh.triangles))
    write_part(root / "part", whole, Division(triangles, triangles == 0, np.arange(6)), AS_FOUND)
    return root / "part" / PART


def recording(root: Path) -> Path:
    """Stray Scanner's, whose video is spoiled."""
    return test_video.write_recording(root, range(30, 200, 20)) / "rgb.mp4"


def ptex(root: Path) -> Path:
    cases.replica(root)
    return root / "textures/0-color-ptex.hdr"


def read_ptex(root: Path) -> None:
    from addon.core.lit_diffuse import from_texture

    lit = read_capture(root).mesh.lit
    for k, side in enumerate(lit.side):
        from_texture._read(lit, k, np.arange((side // lit.size) ** 2))


def result(name: str) -> Reader:
    """A file of a result folder."""

    def make(root: Path) -> Path:
        from addon.core.pipeline.stages import code
        from addon.core.results.result_folders import write_capture
        from addon.core.results.room_file import write_room
        from addon.core.results.store import Store
        from addon.core.scene.model import Capture, Instance, Mesh

        root.mkdir(parents=True, exist_ok=True)
        mesh = Mesh(np.array(CORNERS, float), np.array([[0, 1, 2], [0, 2, 3]], np.int32), np.array([0, 1], np.int32))
        frame = {"object_id": 1, "class_name": "sofa", "model": "lambertian"}
        with Store(root) as store:
            store.save("surface", "k", STAGE, {"noise": 0.5})
            store.write_json("materials.json", {"run": "0" * 16, "layout": "1" * 16, "objects": [frame]})
            store.write_json("overrides.json", {"objects": {"1": {"model": "specular", "f0": 0.04}}})
            store.write_json("report.json", {"settings": {}, "stages": {}, "warnings": ["one"], "code": code()})
            store.write_json("openings.json", {"openings": [{"corners": [[[0] * 3] * 4], "radiance": [1, 1, 1]}]})
        write_room(root, Capture(root, mesh, (Instance(0, "wall"), Instance(1, "sofa")), (), format="nerfstudio"))
        write_capture(root, root.parent)
        return root / name

    def read(root: Path) -> None:
        from addon.core.pipeline.refit import open_result
        from addon.core.results import cache, result_folders, room_file, unfinished
        from addon.core.results.store import Store

        with Store(root) as store:
            found = store.load("surface", "k")
            assert found is None or all(np.array_equal(found[name], STAGE[name]) for name in STAGE)
            store.load_meta("surface", "k"), store.stored_meta("surface"), store.stored_key("surface")
        room_file.run_of(root), room_file.layout_of(root), room_file.objects_of(root), room_file.openings_of(root)
        room_file.root_of(root), result_folders.captures(root)
        unfinished.goes_on_with(root), cache.size(root)
        room_file.read_room(root)
        open_result(root, [1])

    return Reader(make, read)


def readers() -> dict[str, Reader]:
    """All by name; those that need Blender last."""
    found = {case.name: of_case(case) for case in cases.CASES}
    for name, write in test_exr_spoiled.KINDS.items():
        found[f"exr {name}"] = picture(f"{name}.exr", write, Reading())
    for name, write in test_coded_spoiled.KINDS.items():
        found[f"picture {name}"] = picture(name, write, Reading(transfer="srgb"))
    for name, module in (("heic", "pillow_heif"), ("dng", "rawpy")):
        if importlib.util.find_spec(module):  # extras
            found[f"picture {name}"] = picture(name, test_phone_pictures.WRITERS[name], Reading())
    if importlib.util.find_spec("av"):
        found["video"] = Reader(recording, capture)
    found |= {f"ids {ending}": fipt_ids(ending) for ending in ("exr", "png")}
    found["part"] = Reader(part, lambda root: capture(root / "part"))
    found["ptex"] = Reader(ptex, read_ptex)
    found |= {f"result {name}": result(name) for name in ("room.npz", "stages/surface.npz")}
    for name in ("materials", "overrides", "report", "openings", "capture"):
        found[f"result {name}.json"] = result(f"{name}.json")
    found["textured glb"] = textured("scan.glb", "scan.glb")
    found |= {f"textured {victim}": textured("scan.obj", victim) for victim in ("scan.obj", "a.mtl", "t.png")}
    found |= {f"mesh {ending}": other_mesh(f"mesh.{ending}") for ending in ("obj", "gltf", "glb")}
    return found
