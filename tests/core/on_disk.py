"""A small room of known albedo as a capture on disk, and whole runs over it."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np

from addon.core.io.exr import write_exr
from addon.core.io.read import read_capture
from addon.core.pipeline.recover import Recovery
from addon.core.progress import Progress
from addon.core.results.overrides import NONE
from addon.core.results.store import Store
from addon.core.settings import Settings
from tests.core.rooms import all_round, lit_box, make_room, picture, radiosity

ALBEDO = {0: (0.6, 0.4, 0.2), 1: 0.8, 2: (0.7, 0.2, 0.2), 3: (0.2, 0.7, 0.2), 4: 0.5, 5: (0.3, 0.3, 0.6)}
LAMP = (10, 9, 8)
QUICK = Settings(texel_size=0.1, shading_rays=64, emitter_rays=16, specular_rays=16, threads=2)
CHEAP = replace(QUICK, specular="target", refine=0, mirrors=False)
"""Where it is not the choice of models that is looked at."""
EYES = (1.7, 1.3, 1.1), (2.3, 1.7, 1.4), (1.1, 1.9, 1.6), (2.9, 1.2, 0.9)


def write_mesh(root: Path, vertices: np.ndarray, faces: np.ndarray, ids: np.ndarray, classes=None) -> None:
    """A capture's mesh and what its objects are: `classes` by object_id, "thing 0" and so on where absent."""
    lines = ["ply", "format ascii 1.0", f"element vertex {len(vertices)}"]
    lines += [f"property double {axis}" for axis in "xyz"]
    lines += [f"element face {len(faces)}", "property list uchar int vertex_indices"]
    lines += ["property int object_id", "end_header"]
    lines += [" ".join(map(repr, vertex)) for vertex in vertices.tolist()]
    lines += [f"3 {a} {b} {c} {i}" for (a, b, c), i in zip(faces.tolist(), ids.tolist(), strict=True)]
    (root / "mesh.ply").write_text("\n".join(lines) + "\n")
    classes = classes or {}
    objects = [{"id": int(i), "class_name": classes.get(int(i), f"thing {i}")} for i in np.unique(ids)]
    (root / "info_semantic.json").write_text(json.dumps({"objects": objects}))


class OnDisk:
    """A room, its pictures and the capture they are written to. `shift` moves all of it away from the origin."""

    def __init__(self, root: Path, quads=None, shift=(0.0, 0.0, 0.0), light=None, outside=0.0, eyes=EYES):
        self.root = root
        (root / "images").mkdir(parents=True)
        self.room = make_room(quads or lit_box(lamps=(((0.3, 0.7), (0.3, 0.7)),)), 0.1)
        self.light = radiosity(self.room, ALBEDO, {6: LAMP}) if light is None else light(self.room)
        self.shift = np.array(shift)
        cameras = [c for eye in eyes for c in all_round(eye, 40)]
        entries = []
        for i, camera in enumerate(cameras):
            pose = camera.camera_to_world.copy()
            pose[:3, 3] += self.shift
            entries.append({"file_path": f"images/{i:03d}.exr", "transform_matrix": pose.tolist()})
            write_exr(self.path(i), picture(self.room, camera, self.light, outside).radiance)
        self.count = len(cameras)
        one = cameras[0]
        same = {"w": one.width, "h": one.height, "fl_x": one.fx, "fl_y": one.fy, "cx": one.cx, "cy": one.cy}
        (root / "transforms.json").write_text(json.dumps(same | {"frames": entries}))
        mesh = self.room.mesh
        write_mesh(root, mesh.vertices + self.shift, mesh.triangles, mesh.object_id)

    def path(self, i: int) -> Path:
        return self.root / "images" / f"{i:03d}.exr"

    def unwrap(self, mesh, size):
        assert len(mesh.triangles) == len(self.room.mesh.triangles)
        return self.room.uv

    def recovery(self, store: Store, settings: Settings = CHEAP, progress: Progress | None = None) -> Recovery:
        """A run that has not begun."""
        return Recovery(read_capture(self.root), store, settings, progress or Progress(), self.unwrap)

    def run(
        self, result: Path, settings: Settings = CHEAP, progress: Progress | None = None, capture=None, overrides=NONE
    ):
        """A finished run: its albedo, materials, report and the stages' arrays."""
        with Store(result) as store:
            capture = capture or read_capture(self.root)
            return Finished(Recovery(capture, store, settings, progress or Progress(), self.unwrap, overrides))


class Finished:
    def __init__(self, recovery: Recovery):
        self.materials = recovery.materials()
        self.albedo = recovery.albedo
        self.base_color = recovery.base_color()
        self.shading = recovery.shading()
        self.lit = recovery.lit_diffuse()
        self.atlas = recovery.surface().atlas
        recovery.write_images()
        self.report = recovery.report()
        self.stored = {name: log["stored"] for name, log in self.report["stages"].items()}

    def off(self, object_id: int, truth) -> np.ndarray:
        """Relative error of the measured albedo of an object's elements."""
        own = (self.atlas.object_id == object_id) & self.lit.seen
        return self.albedo.rho[own] / np.float32(truth) - 1

    def arrays(self) -> list[np.ndarray]:
        return [
            self.albedo.rho, self.albedo.origin, self.base_color, self.shading.irradiance, self.shading.radiance,
            self.lit.radiance, self.lit.count, self.atlas.position, self.atlas.normal,
        ]  # fmt: skip
