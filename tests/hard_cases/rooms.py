"""Small captures on disk whose light is known, and whole runs over them: no Blender, no renderer.

Quads, atlas and pictures are those of `tests.core.rooms`; light is prescribed, or follows from `radiosity`.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

import numpy as np

from addon.core.brdf.material import ObjectMaterial
from addon.core.io.exr import read_exr, write_exr
from addon.core.io.read import read_capture
from addon.core.passes.albedo.albedo import MEASURED
from addon.core.pipeline.recover import Recovery
from addon.core.progress import Progress
from addon.core.results.store import Store
from addon.core.scene.model import Camera
from addon.core.settings import PAPER, Settings
from tests.core.on_disk import write_mesh
from tests.core.rooms import Room, all_round, box_sides, lit_box, make_room, picture, quad, radiosity

SIZE = (2.0, 2.0, 2.0)
TEXEL = 0.2
EYES = (0.8, 0.9, 0.7), (1.3, 1.1, 1.2), (0.7, 1.3, 1.4), (1.4, 0.6, 0.9)
DEFAULT = Settings(texel_size=TEXEL, shading_rays=96, emitter_rays=16, specular_rays=16, threads=2)
"""Everything as by default, but for the number of rays."""
QUICK = replace(DEFAULT, specular="target", refine=0, mirrors=False)
"""Where it is not highlights that are looked at."""
PAPERS = replace(PAPER, texel_size=TEXEL, shading_rays=512, specular_rays=16, threads=2)
"""The paper's way with few rays: 512 uniform ones give 10 % noise in a small lamp's light, less in a median."""
GREY = {0: (0.6, 0.4, 0.2), 1: 0.8, 2: (0.7, 0.2, 0.2), 3: (0.2, 0.7, 0.2), 4: 0.5, 5: (0.3, 0.3, 0.6)}
"""Albedo of an ordinary box by object; 6 is the lamp."""
CLOSE = 0.05
"""What an albedo may be off by, relative: the 16 texels to a wall of these rooms can't follow light into corners."""
NOISY = 0.1
"""The same where a small lamp is met by chance: the paper's uniform rays, a lamp too dim to be aimed at."""
LAMP = ((0.3, 0.7), (0.3, 0.7))
"""Where in the ceiling the lamp lies."""


def cameras(eyes=EYES, width: int = 28) -> list[Camera]:
    """Six cameras at each eye."""
    return [camera for eye in eyes for camera in all_round(eye, width)]


def lamp_room(texel: float = TEXEL, lamp=LAMP) -> Room:
    """A closed box (objects 0 to 5) with a lamp in its ceiling (object 6)."""
    return make_room(lit_box(SIZE, (lamp,)), texel)


def closed_room(texel: float = TEXEL) -> Room:
    """A closed box of six objects."""
    return make_room(box_sides(SIZE), texel)


def lamp_light(room: Room, albedo=GREY, lamp=(10, 9, 8)) -> np.ndarray:
    """Radiance of each element of `lamp_room` by radiosity."""
    return radiosity(room, albedo, {6: lamp})


def lit_by(room, quads, albedo, emission) -> np.ndarray:
    """Radiance of a room's elements where `quads` are all that gives and reflects light; nonsense on others."""
    return radiosity(replace(room, quads=tuple(quads)), albedo, emission)


@dataclass(frozen=True)
class BetweenRooms:
    """A bright room, its albedo `near`, and a dim one, `far`; one quad, object 8, is the wall between them at x = 2.

    `shown(camera, index)` is what a camera sees: of the quad, the side that it stands on.
    """

    room: Room
    shown: Callable
    views: list[Camera]
    near: dict[int, float]
    far: dict[int, float]


def sheet_between_rooms() -> BetweenRooms:
    """See `BetweenRooms`; the quad has albedo 0.4 towards the bright room and 0.8 towards the dim one."""
    left = [q for q in lit_box(SIZE, (LAMP,)) if q.object_id != 3]
    right = [replace(q, corner=q.corner + np.array([2.0, 0, 0]), object_id=q.object_id + 10)
             for q in lit_box(SIZE, (LAMP,)) if q.object_id != 2]  # fmt: skip
    sheet = replace(box_sides(SIZE)[3], object_id=8)
    room = make_room([*left, sheet, *right], TEXEL)
    near, far = {0: 0.5, 1: 0.7, 2: 0.3, 4: 0.5, 5: 0.6, 8: 0.4}, {10: 0.5, 11: 0.7, 13: 0.3, 14: 0.5, 15: 0.6, 8: 0.8}
    back = quad((2, 0, 0), (0, 2, 0), (0, 0, 2), 8)
    bright = lit_by(room, [*left, sheet], near, {6: (10, 10, 10)})
    dim = lit_by(room, [*right, back], far, {16: (0.5, 0.5, 0.5)})
    on_sheet = room.atlas.object_id == 8
    light = np.where((room.atlas.object_id >= 10)[:, None], dim, bright)
    turned = replace(room.atlas, normal=np.where(on_sheet[:, None], -room.atlas.normal, room.atlas.normal))
    other = replace(room)
    other.__dict__["atlas"] = turned
    behind = lit_by(other, [*right, back], far, {16: (0.5, 0.5, 0.5)})
    from_right = np.where(on_sheet[:, None], behind, light)
    eyes = (0.8, 0.9, 0.7), (1.3, 1.1, 1.2), (0.7, 1.3, 1.4)
    views = cameras([*eyes, *eyes[:2], *[(x + 2, y, z) for x, y, z in eyes]])

    def shown(camera, _):
        return picture(room, camera, from_right if camera.centre[0] > 2 else light).radiance

    return BetweenRooms(room, shown, views, near, far)


class Captured:
    """A capture folder with the pictures of a room.

    Parameters
    ----------
    light : (n, 3) float, or callable(camera, index) -> (h, w, 3)
        Radiance of each element, the same in every view; or the pictures themselves.
    scale, shift
        The room as built is made larger, then moved away from the origin.
    edit : callable(picture, index) -> picture, optional
        What happens to a picture before it is written.
    half : bool
        16-bit pictures; what is too bright for them becomes inf, as it does in a renderer's.
    """

    def __init__(
        self,
        root: Path,
        room: Room,
        light: np.ndarray | Callable,
        views: list[Camera] | None = None,
        outside=0.0,
        scale: float = 1.0,
        shift=(0.0, 0.0, 0.0),
        edit: Callable | None = None,
        half: bool = False,
        classes: dict[int, str] | None = None,
        triangles: tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray] | None = None,
    ):
        self.root, self.room, self.scale = root, room, scale
        views = cameras() if views is None else views
        (root / "images").mkdir(parents=True)
        entries = []
        for i, camera in enumerate(views):
            image = light(camera, i) if callable(light) else picture(room, camera, light, outside).radiance
            image = np.asarray(image if edit is None else edit(image, i), np.float32)
            if half:
                with np.errstate(over="ignore"):
                    image = image.astype(np.float16)
                # `write_exr` holds finite values at a half's end; what has become inf stays so.
            write_exr(root / "images" / f"{i:04d}.exr", image, half=half)
            pose = camera.camera_to_world.copy()
            pose[:3, 3] = pose[:3, 3] * scale + shift
            entries.append({
                "file_path": f"images/{i:04d}.exr", "transform_matrix": pose.tolist(), "w": camera.width,
                "h": camera.height, "fl_x": camera.fx, "fl_y": camera.fy, "cx": camera.cx, "cy": camera.cy,
            })  # fmt: skip
        (root / "transforms.json").write_text(json.dumps({"frames": entries}))
        mesh = room.mesh
        vertices, faces, ids, self.uv = triangles or (mesh.vertices, mesh.triangles, mesh.object_id, room.uv)
        write_mesh(root, vertices * scale + np.array(shift), faces, ids, classes)

    def unwrap(self, mesh, size: int) -> np.ndarray:
        backs = len(mesh.triangles) - len(self.uv)
        assert backs == (0 if mesh.backs is None else len(mesh.backs))
        if not backs:
            return self.uv
        return np.concatenate([0.5 * self.uv, 0.5 * self.uv[mesh.backs][:, [0, 2, 1]] + np.float32([0.5, 0])])

    def recover(self, settings: Settings = QUICK) -> Result:
        """A whole run; whatever it gives has been looked through for values that are none."""
        settings = replace(settings, texel_size=settings.texel_size * self.scale)
        result = self.root.parent / f"result-{len(list(self.root.parent.iterdir()))}"
        with Store(result) as store:
            run = Recovery(read_capture(self.root), store, settings, Progress(), self.unwrap)
            return Result(run, result)


class Result:
    """What a run found. Making one checks that no output holds a value that is none."""

    def __init__(self, run: Recovery, folder: Path):
        self.folder = folder
        self.materials: dict[int, ObjectMaterial] = {m.object_id: m for m in run.materials()}
        self.albedo, self.base_color = run.albedo, run.base_color()
        self.lit, self.shading, self.atlas = run.lit_diffuse(), run.shading(), run.surface().atlas
        self.specular = run.specular()
        run.write_images()
        self.report = run.report()
        self.figures, self.warnings = self.report["figures"], self.report["warnings"]
        self._check()

    def _check(self) -> None:
        shading, rho = self.shading, self.albedo.rho
        for name, values in {
            "albedo": rho, "base color": self.base_color, "irradiance": shading.irradiance, "escaped": shading.escaped,
            "relative_error": shading.relative_error, "light": shading.radiance, "sky": shading.environment.radiance,
            "specular": self.specular.specular, "L_d": self.lit.radiance[self.lit.seen],
            "interquartile range": self.lit.interquartile_range,
            "position": self.atlas.position, "normal": self.atlas.normal, "area": self.atlas.area,
        }.items():  # fmt: skip
            assert np.isfinite(values).all(), f"{name} holds values that are none"
        assert rho.min() >= 0 and rho.max() <= 1 and self.base_color.min() >= 0 and self.base_color.max() <= 1
        assert shading.irradiance.min() >= 0 and shading.radiance.min() >= 0
        assert not (self.albedo.origin[~self.lit.seen] == MEASURED).any(), "what nobody saw counts as measured"
        written = json.loads((self.folder / "materials.json").read_text())["objects"]
        assert [m["model"] for m in written] == [m.model.name for m in self.materials.values()]
        for material in self.materials.values():
            numbers = [material.alpha, material.residual, material.residual_lambertian]
            numbers += [*np.ravel(material.f0 if material.f0 is not None else []), *(material.emission or ())]
            assert all(np.isfinite(x) and x >= 0 for x in numbers if x is not None), material
        assert all(np.isfinite(x) for x in self.figures.values() if isinstance(x, float)), self.figures
        for path in self.folder.glob("*.exr"):
            assert np.isfinite(read_exr(path).rgb).all(), path.name

    @cached_property
    def text(self) -> str:
        """All warnings in one."""
        return " ".join(self.warnings)

    def of(self, object_id: int) -> np.ndarray:
        """The object's elements, (n,) bool."""
        return self.atlas.object_id == object_id

    def measured(self, object_id: int) -> np.ndarray:
        """Those of them whose albedo is said to be measured."""
        return self.of(object_id) & (self.albedo.origin == MEASURED)

    def off(self, object_id: int, truth) -> float:
        """Relative error of the object's median albedo, the worst channel; inf where nothing is measured."""
        own = self.measured(object_id)
        if not own.any():
            return float("inf")
        return float(np.abs(np.median(self.albedo.rho[own], 0) / np.float32(truth) - 1).max())

    def worst(self, truths: dict[int, object]) -> float:
        """The largest `off` over several objects."""
        return max(self.off(object_id, truth) for object_id, truth in truths.items())

    def everywhere_off(self, object_id: int, truth) -> float:
        """Relative error of the worst measured element and channel of an object."""
        own = self.measured(object_id)
        return float(np.abs(self.albedo.rho[own] / np.float32(truth) - 1).max()) if own.any() else float("inf")
