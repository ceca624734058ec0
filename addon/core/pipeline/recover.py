"""A whole recovery: the stages, what is made of them, and what is written into the result folder."""

import dataclasses
import hashlib
from collections.abc import Callable
from dataclasses import replace
from functools import cached_property, partial
from typing import Any

import numpy as np

from ..atomic import write_bytes
from ..evidence.page import make_page
from ..memory import give_back
from ..parallel import ordered_map
from ..passes.albedo.albedo import CLOSED, FILLED, MEASURED, TEXTURED
from ..passes.albedo.neighbourhood import relative_error
from ..passes.texture_fill.texture_fill import NOTHING, Texture, texture_of
from ..results.room_file import OPENINGS
from ..scene.closed_mesh import is_outward
from ..settings import ROOM
from .corrected import Corrected
from .parts import LOOKED, Parting, Parts, look_closer, remove_parts, write_parts
from .report import make_report
from .stages import code
from .surface import STAGE as SURFACE


class Recovery(Corrected):
    """One run over one capture (parameters and attributes: `Stages`), and what is written of it.

    Attributes
    ----------
    parts : Parts or None
        What `write_images` wrote besides the room's images, as `Settings.atlas` asks for.
    """

    parts: Parts | None = None
    _parting: Parting | None = None

    def look_closer(self) -> None:
        """All that takes long. It may fail and be stopped: done before what was written is touched."""
        if self.settings.atlas != ROOM and self._parting is None:
            self._parting = look_closer(self)
        self.albedo, self.materials()  # made first: both of the next ask for them
        give_back()
        for _ in ordered_map(partial(getattr, self), ("evidence", "texture"), self.settings.threads):
            pass

    def let_go(self) -> None:
        """Hold surface, materials and median radiance alone, which a scene is made of; nothing else may be used then.

        Blender takes as much for the room's mesh as all the stages' values.
        """
        self._materials, self.median_radiance  # noqa: B018  (made now: they are kept)
        for name in ("field", "irradiance", "albedo", "evidence", "texture"):
            self.__dict__.pop(name, None)
        self.done = {SURFACE.name: replace(self.surface())}  # without what it has cached
        give_back()

    @property
    def layout_key(self) -> str:
        """16 hex digits that are the same where the images are laid out alike: pictures of another layout fit nothing.

        Only after `write_images` has made the parts.
        """
        coordinates = [self.surface().atlas.uv, *([self.parts.uv] if self.parts else [])]
        return hashlib.sha256(b"".join(np.ascontiguousarray(uv).tobytes() for uv in coordinates)).hexdigest()[:16]

    def write_images(self) -> dict[str, Any]:
        """Write the result folder's images, materials.json and report.html; returns the report that this shows."""
        self.look_closer()
        lit_diffuse = self.lit_diffuse()
        # Each is made when its turn comes: all of them at once were a tenth of a large room's memory.
        images: dict[str, Callable[[], np.ndarray]] = {
            "albedo": lambda: self.albedo.rho,
            "base_color": self.base_color,
            "shading": lambda: self.irradiance,
            "lit_diffuse": lambda: np.where(lit_diffuse.seen[:, None], lit_diffuse.radiance, np.float32(0)),
            "coverage": self._coverage,
            "albedo_error": lambda: self.evidence.texels.albedo,
            "evidence": self.evidence.shares,
        }
        give_back()

        def write(name: str) -> None:
            self.store.write_exr(f"{name}.exr", self.over_atlas(name, images[name]())[::-1])

        first_share = LOOKED if self._parting else 0.0
        for done, _ in enumerate(ordered_map(write, images, self.settings.threads)):
            self.progress.update(first_share + (0.5 - first_share) * done / len(images))
        self.store.write_exr("environment.exr", self.sky()[::-1])
        self._write_openings()
        if self.settings.atlas == ROOM:
            remove_parts(self)
        elif self._parting is not None:
            self.parts = write_parts(self, self._parting, self.over_atlas("base_color", images["base_color"]()))
        details: dict[int, dict[str, Any]] = {
            evidence.object_id: {"evidence": dataclasses.asdict(evidence)} for evidence in self.evidence.objects
        }
        for number, name in (self.parts.images if self.parts else {}).items():
            details.setdefault(number, {})["image"] = name
        for instance in self.capture.instances:
            if instance.part_of is not None:
                details.setdefault(instance.object_id, {})["part_of"] = instance.part_of
        objects = [{"name": m.name} | m.as_dict() | details.get(m.object_id, {}) for m in self.materials()]
        materials = {
            "run": self.run_key,
            "layout": self.layout_key,
            "capture": self.capture.root.name,
            "objects": objects,
        }
        materials |= {name: value for name, value in self.overrides.as_dict().items() if name == "white"}
        self.store.write_json("materials.json", materials)
        self.progress.update(0.6)
        report = self.report()
        write_bytes(self.store.path("report.html"), make_page(self.findings, self.evidence, report).encode())
        return report

    @cached_property
    def texture(self) -> Texture:
        """Texture of what was filled in."""
        if not self.settings.texture_fill or "texture-fill" in self.settings.without:
            return NOTHING
        surface, albedo = self.surface(), self.albedo
        measured = albedo.origin == MEASURED
        # What was segmented by its shape alone may hold several materials: a wall its pictures.
        guessed = [
            instance.object_id
            for instance in self.capture.instances
            if instance.guess and instance.class_name != "floor"
        ]
        to_texture = (albedo.origin == FILLED) & ~np.isin(surface.atlas.object_id, guessed)
        # E is off for neighbours alike, which makes no texture.
        error = relative_error(
            self.specular().rest, surface.atlas.object_id, "object-spread" not in self.settings.without
        )
        return texture_of(surface.atlas, surface.mesh, albedo.rho, measured, to_texture, error)

    def over_atlas(self, name: str, values: np.ndarray) -> np.ndarray:
        """The image `name` of the elements' values ((n, c) float32), with texture where there is any, (s, s, c)."""
        atlas, texture = self.surface().atlas, self.texture
        image = atlas.image(values)
        texels = image.reshape(-1, image.shape[2])  # a view
        if name == "albedo":
            texels[texture.texel] = texture.rho
        elif name == "base_color":
            texels[texture.texel] = self.base_color_of(texture.rho, atlas.object_id[atlas.padding[texture.texel]])
        elif name == "coverage":
            texels[texture.texel, 2] += TEXTURED - FILLED
        return image

    def _coverage(self) -> np.ndarray:
        """Count of observations, their relative spread, and where the albedo comes from, (n, 3) float32."""
        lit_diffuse = self.lit_diffuse()
        dark = max(1e-6 * self.median_radiance, 1e-30)
        spread = lit_diffuse.interquartile_range.mean(1) / np.maximum(np.nan_to_num(lit_diffuse.radiance).mean(1), dark)
        parts = (lit_diffuse.count, spread, self.albedo.origin + CLOSED * self.closing)
        return np.stack([part.astype(np.float32) for part in parts], -1)

    def _write_openings(self) -> None:
        """What is bright behind the mesh's openings, as panels; no file where nothing is."""
        openings, sky = self.shading().openings, self.shading().environment
        panels = [] if openings is None else openings.panels(self._unseen_closing(), sky)
        if not panels:
            self.store.path(OPENINGS).unlink(missing_ok=True)
            return
        shift = self.capture.mesh.vertices[0] - self._centred.mesh.vertices[0]
        light = np.ones(3) if self.white is None else self.white.of_light
        entries = [
            {"radiance": (panel.radiance * light).tolist(), "corners": (panel.corners + shift).tolist()}
            for panel in panels
        ]
        self.store.write_json(OPENINGS, {"openings": entries})

    def _unseen_closing(self) -> np.ndarray:
        """Corners of the faces that close the mesh towards the outside and that no frame saw, (t, 3, 3) float32."""
        mesh, atlas = self.surface().mesh, self.surface().atlas
        unseen = np.ones(len(mesh.triangles), bool)
        unseen[atlas.triangle[self.lit_diffuse().seen]] = False
        faces = np.zeros(0, int) if mesh.closed is None else mesh.closed[unseen[mesh.closed]]
        corners = mesh.vertices[mesh.triangles[faces]].astype(np.float32)
        normal = mesh.geometry[0][faces].astype(np.float32)
        return corners[is_outward(self.surface().scene, corners.mean(1), normal)]

    def report(self) -> dict[str, Any]:
        """What report.json holds so far: stages, settings, figures and warnings."""
        return make_report(self) | {"code": code()}
