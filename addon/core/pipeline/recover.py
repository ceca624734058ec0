"""The stages in their order. The only place that knows all of them."""

from __future__ import annotations

import dataclasses
import time
from collections.abc import Callable, Container
from functools import cached_property
from typing import Any

import numpy as np

from ..atomic import write_bytes
from ..brdf.compensation import base_colors, with_metals
from ..errors import BadInputError
from ..evidence.collect import Evidence, collect
from ..evidence.findings import Findings
from ..evidence.page import make_page
from ..io.fingerprint import fingerprint
from ..io.pixels import read_pixels
from ..io.read import MAX_BAD_SHARE
from ..json_values import key
from ..light.environment import Environment
from ..light.field import LightField
from ..light.mirrors import Mirror, in_their_planes, known_mirror
from ..light.shading import Shading
from ..lit_diffuse.from_texture import face_edge, lit_from_tiles
from ..memory import peak_memory
from ..overrides import NONE as NO_OVERRIDES
from ..overrides import Overrides
from ..parallel import ordered_map
from ..passes.albedo.albedo import Albedo, albedo_of
from ..passes.clipped_lamps.clipped import shade_clipped
from ..passes.clipped_lamps.fringes import Fringes
from ..passes.mesh_denoising.denoise import without_noise
from ..passes.mirrors.flat_mirrors import find_mirrors
from ..passes.pose_refinement.poses import Poses
from ..passes.registry import check, left_out_of
from ..progress import Progress
from ..results.store import Store
from ..scene.lit_diffuse import LitDiffuse
from ..scene.model import Capture, Frame, Mesh, Pixels
from ..scene.recentre import near_origin
from ..scene.samples import Samples
from ..scene.surface import Surface, build_surface, from_uv
from ..scene.two_sides import laid_apart, with_backs
from ..settings import ROOM, Settings
from ..stages import STAGES, WRITE
from .corrected import Corrected
from .frames import all_passes
from .parts import LOOKED, Parting, Parts, look_closer, remove_parts, write_parts
from .report import make_report
from .shading import shade
from .shading_store import from_store, to_store
from .specular import Held, Specular, fit_specular

CODE = 59
"""Counted up whenever a stage computes something else than before: stored stages of older code are done again."""
ELEMENTS = ("texel", "triangle", "position")
"""What is stored of the elements, as finding it takes seconds; older stages lack it."""


class Recovery(Corrected):
    """One run over one capture. Each stage is computed when it is first asked for, or taken from the store.

    Parameters
    ----------
    capture : Capture
    store : Store
    settings : Settings
    progress : Progress
    unwrap : callable(Mesh, int) -> (t, 3, 2) float32
        Lays the mesh out in an atlas of so many texels; Blender's, in the extension.
    overrides : Overrides
        What the artist gives.

    Attributes
    ----------
    done : dict
        Values of the stages so far.
    log : dict
        Time, memory and whether it was stored, of each.
    bad_frames, blind_frames : list of str
        Sentences on frames that turned out damaged; names of those without a valid pixel.
    parts : Parts or None
        What `write_images` wrote besides the room's images, as `Settings.atlas` asks for.
    """

    def __init__(
        self,
        capture: Capture,
        store: Store,
        settings: Settings,
        progress: Progress,
        unwrap: Callable[[Mesh, int], np.ndarray],
        overrides: Overrides = NO_OVERRIDES,
    ):
        check(settings.without)
        self.capture, self.store, self.settings, self.progress = capture, store, settings, progress
        self.overrides = overrides
        self._near = near_origin(capture)
        self._unwrap = unwrap
        self.done: dict[str, Any] = {}
        self.log: dict[str, dict[str, Any]] = {}
        self.bad_frames: list[str] = []
        self.blind_frames: list[str] = []
        self.parts: Parts | None = None
        self._parting: Parting | None = None

    @property
    def frames(self) -> tuple[Frame, ...]:
        """The capture's, in the coordinates that the stages work in, where they were found to be."""
        return self.poses().of(self._near.frames)

    # Each stage's key: the stage before, and the settings that it heeds.

    @cached_property
    def _surface_key(self) -> str:
        s = self.settings
        of_mesh = (fingerprint(self.capture), s.texel_size, s.detail, s.atlas_size, s.denoise_mesh)
        return key("surface", CODE, *of_mesh, *left_out_of("surface", s.without))

    @cached_property
    def _keys(self) -> dict[str, str]:
        s, surface = self.settings, self._surface_key
        out = {stage: left_out_of(stage, s.without) for stage in STAGES}
        lit = key(
            "lit_diffuse", surface, s.refine_poses, s.median, s.sharpen, s.frame_order, s.seed, *out["lit_diffuse"]
        )
        of_light = (s.shading, s.shading_rays, s.emitter_rays, s.portal_rays, s.interpolate, s.mirrors, s.seed)
        shading = key("shading", lit, *of_light, *out["shading"])
        of_lobes = (s.specular, s.specular_rays, s.refine, *self.overrides.lobes_key())
        specular = key("specular", shading, *of_lobes, *out["specular"])
        return {"surface": surface, "lit_diffuse": lit, "shading": shading, "specular": specular}

    @property
    def run_key(self) -> str:
        """16 hex digits that are the same where a capture and all that was asked of it are, and else differ."""
        told = (self.overrides.as_dict(),) if self.overrides.any else ()
        told += () if self.settings.coat else ("no coat",)
        told += () if self.settings.atlas == ROOM else (self.settings.atlas,)
        told += left_out_of(WRITE, self.settings.without)
        return key("run", self._keys["specular"], *told)[:16]

    def _stage(
        self, name: str, load: Callable[[dict, dict], Any], compute: Callable[[], tuple[Any, dict, dict]]
    ) -> Any:
        """The value of a stage: kept, stored, or computed now and stored."""
        if name in self.done:
            return self.done[name]
        started = time.monotonic()
        stored = self.store.load(name, self._keys[name])
        self.progress.stage(name)
        if stored is not None:
            meta = self.store.load_meta(name, self._keys[name]) or {}
            value = load(stored, meta)
            self.log[name] = {"seconds": round(time.monotonic() - started, 2), "stored": True}
        else:
            value, arrays, meta = compute()
            self.store.save(name, self._keys[name], arrays, meta)
            self.log[name] = {"seconds": round(time.monotonic() - started, 2), "stored": False}
        self.log[name]["peak_memory_bytes"] = peak_memory()
        self.progress.done(stored=stored is not None)
        self.done[name] = value
        return value

    def surface(self) -> Surface:
        """Surface elements over the room; around the origin where the room lies far from it."""
        capture = self._near

        def compute():
            out = self.settings.without
            noisy = self.settings.denoise_mesh and "mesh-denoising" not in out
            mesh, noise = without_noise(capture.mesh, out) if noisy else (capture.mesh, 0.0)
            texel = self.settings.texel_size
            if mesh.lit is not None:
                texel = texel or face_edge(mesh) / self.settings.detail
            found = build_surface(
                mesh,
                [frame.camera for frame in capture.frames],
                self._unwrap,
                texel,
                self.settings.detail,
                self.settings.atlas_size,
                two_sides="two-sides" not in out,
            )
            first = found.mesh.triangles[: len(mesh.triangles)]
            sign = np.where((first == mesh.triangles).all(1), 1, -1).astype(np.int8)
            arrays = {"uv": found.uv, "sign": sign, "backs": found.backs}
            arrays |= {"vertices": mesh.vertices} if noise else {}
            arrays |= {name: getattr(found.atlas, name) for name in ELEMENTS}
            return dataclasses.replace(found, noise=noise), arrays, {"size": found.atlas.size, "noise": noise}

        def load(arrays, meta):
            mesh = capture.mesh
            if "vertices" in arrays:
                mesh = dataclasses.replace(mesh, vertices=arrays["vertices"])
            mesh = with_backs(mesh, arrays["backs"])
            known = tuple(arrays[name] for name in ELEMENTS) if "texel" in arrays else None
            return from_uv(mesh, arrays["sign"], arrays["uv"], int(meta["size"]), float(meta["noise"]), known)

        return self._stage("surface", load, compute)

    def room_mesh(self) -> Mesh:
        """The mesh that the stages worked on, where the capture has it: normals face the frames, noise is out of it.

        A sheet's second side is a little apart from the first.
        """
        mesh, before = self.surface().mesh, self._near.mesh.vertices
        moved = mesh.vertices[: len(before)] - before  # by itself, so that what did not move is exact
        return laid_apart(mesh, self.capture.mesh.vertices + moved)

    def written_mesh(self) -> Mesh:
        """`room_mesh` as the scene gets it. Mirrors of a noisy mesh lie in the planes that what they show tells."""
        mesh = self.room_mesh()
        if not self.surface().noise:
            return mesh
        return dataclasses.replace(mesh, vertices=in_their_planes(mesh, self.shading().mirrors))

    def room_poses(self) -> Poses:
        """Where the frames were found to be, in the capture's coordinates."""
        poses = self.poses().camera_to_world.copy()
        for pose, was, near in zip(poses, self.capture.frames, self._near.frames, strict=True):
            pose[:3, 3] += was.camera.centre - near.camera.centre
        return dataclasses.replace(self.poses(), camera_to_world=poses)

    def read(self, frame: Frame) -> Pixels:
        """A frame's pixels; one that turns out damaged counts as blind, unless too many are."""
        try:
            pixels = read_pixels(frame)
            if not pixels.valid.any() and frame.name not in self.blind_frames:
                self.blind_frames.append(frame.name)
            return pixels
        except BadInputError as error:
            if (told := f"{error} It was left out.") not in self.bad_frames:
                self.bad_frames.append(told)
            if len(self.bad_frames) > MAX_BAD_SHARE * len(self.capture.frames):
                raise BadInputError(
                    f"{len(self.bad_frames)} of {len(self.capture.frames)} frames can't be read; the first: {error}"
                ) from error
            shape = (frame.camera.height, frame.camera.width)
            return Pixels(np.zeros((*shape, 3), np.float32), np.zeros(shape, bool), np.zeros(shape, bool))

    def _accumulated(self) -> tuple[LitDiffuse, Environment, Samples, Fringes, Poses]:
        """What the passes over all frames give."""
        surface, frames = self.surface(), self._near.frames

        def compute():
            value = (
                all_passes(surface, frames, self.read, self.settings, self.store.folder, self.progress)
                if frames else from_mesh()
            )  # fmt: skip
            arrays = {f"{i}.{f.name}": getattr(v, f.name) for i, v in enumerate(value) for f in dataclasses.fields(v)}
            return value, arrays, {"bad_frames": self.bad_frames, "blind_frames": self.blind_frames}

        def from_mesh():
            mesh = dataclasses.replace(self._near.mesh, vertices=surface.mesh.vertices)
            lit = lit_from_tiles(mesh, surface.atlas, self.progress)
            return lit, Environment.dark(), Samples.none(), Fringes.none(), Poses.as_read(())

        def load(arrays, meta):
            self.bad_frames = list(meta.get("bad_frames", ()))
            self.blind_frames = list(meta.get("blind_frames", ()))
            kinds = (LitDiffuse, Environment, Samples, Fringes, Poses)
            return tuple(
                kind(**{f.name: arrays[f"{i}.{f.name}"] for f in dataclasses.fields(kind)})
                for i, kind in enumerate(kinds)
            )

        return self._stage("lit_diffuse", load, compute)

    def lit_diffuse(self) -> LitDiffuse:
        """L_d of every element."""
        return self._accumulated()[0]

    def environment(self) -> Environment:
        """Light from outside, as the frames saw it."""
        return self._accumulated()[1]

    def samples(self) -> Samples:
        """Observations kept one by one for the specular fit."""
        return self._accumulated()[2]

    def poses(self) -> Poses:
        """Where the frames were found to be."""
        return self._accumulated()[4]

    def shading(self) -> Shading:
        """Lamps and irradiance."""
        surface, lit, sky = self.surface(), self.lit_diffuse(), self.environment()
        s = self.settings

        def compute():
            def shaded(known: LitDiffuse) -> Shading:
                return shade(
                    surface.mesh, self.capture.instances, surface.atlas, surface.scene, known, sky,
                    sampler=s.shading, rays=s.shading_rays, emitter_rays=s.emitter_rays, portal_rays=s.portal_rays,
                    interpolate=s.interpolate, threads=s.threads, seed=s.seed, progress=self.progress,
                    find_mirrors=self._find_mirrors if s.mirrors else None, noise=surface.noise,
                    colours=self._accumulated()[3].colours(), without=s.without,
                )  # fmt: skip

            found = shaded(lit) if "clipped-lamps" in s.without else shade_clipped(shaded, lit, surface.atlas)
            return found, *to_store(found)

        return self._stage("shading", from_store, compute)

    def _find_mirrors(self, field: LightField, lamps: tuple | None) -> tuple[Mirror, ...]:
        noisy = lamps is not None and self.surface().noise > 0 and "facets" not in self.settings.without
        found = find_mirrors(field, lamps or (), self.samples(), self.capture.instances, self.settings.seed, noisy)
        told = [known_mirror(mirror, field.mesh) for mirror in self._near.mirrors]
        return (*found, *(one for one in told if one.object_id not in {mirror.object_id for mirror in found}))

    @cached_property
    def field(self) -> LightField:
        """The room as a light source, with all that was found of its light."""
        surface, shading = self.surface(), self.shading()
        lamps = [lamp.object_id for lamp in shading.lamps]
        room = LightField(surface.mesh, surface.atlas, surface.scene, shading.radiance, shading.environment, lamps)
        return room.with_mirrors(shading.mirrors).with_sun(shading.sun)

    def specular(self) -> Specular:
        """phi, psi and the model of every object."""
        self.shading()

        return self._stage("specular", Specular.from_store, self.fitted)

    def fitted(self, held: Held | None = None) -> tuple[Specular, dict[str, np.ndarray], dict[str, Any]]:
        """The specular stage as it is computed, of all objects or with some `held`, and what is stored of it."""
        s, lit, shading = self.settings, self.lit_diffuse(), self.shading()
        found = fit_specular(
            self.capture.instances, self.field, lit, shading.irradiance, shading.lamps, self.samples(),
            [frame.name for frame in self.capture.frames],
            way=s.specular, rays=s.specular_rays, refine=s.refine, threads=s.threads, seed=s.seed,
            noise=self.surface().noise, given=self.overrides.lobes(), held=held, without=s.without,
            progress=self.progress,
        )  # fmt: skip
        meta = {"materials": [dataclasses.asdict(m) for m in found.materials], "overrides": self.overrides.as_dict()}
        return found, {"specular": found.specular, "excess": found.excess}, meta

    def albedo_under(
        self, irradiance: np.ndarray, specular: np.ndarray | float = 0.0, without: set[int] | None = None
    ) -> Albedo:
        """The albedo that L_d less a `specular` part has under an E, both (n, 3) float32.

        The objects `without` get none; by default the lamps that were found.
        """
        atlas, lit, shading = self.surface().atlas, self.lit_diffuse(), self.shading()
        without = shading.emitters if without is None else without
        return albedo_of(
            atlas, lit, irradiance, shading.doubt, self.capture.instances, without, specular, self.settings.without
        )

    def base_color(self) -> np.ndarray:
        """Base Color of each element for Cycles' Principled, (n, 3) float32."""
        if "compensation" in self.settings.without:
            return with_metals(self.albedo.rho, self.surface().atlas.object_id, self.materials())
        return base_colors(self.albedo.rho, self.surface().atlas.object_id, self.materials())

    @property
    def findings(self) -> Findings:
        """All that was found; asks for every stage."""
        return Findings(
            name=self.capture.root.name,
            instances=self.capture.instances,
            frames=self.frames,
            surface=self.surface(),
            lit_diffuse=self.lit_diffuse(),
            samples=self.samples(),
            shading=self.shading(),
            field=self.field,
            specular=self.specular().specular,
            irradiance=self.irradiance,
            albedo=self.albedo,
            materials=self.materials(),
            coloured=frozenset(i for i, one in self.overrides.objects.items() if one.base_color is not None),
            threads=self.settings.threads,
            seed=self.settings.seed,
        )

    @cached_property
    def evidence(self) -> Evidence:
        """How sure all of it is."""
        return collect(self.findings)

    def median_radiance(self) -> float:
        """Median of L_d over all that was seen: what a picture's exposure is set by."""
        lit = self.lit_diffuse()
        return float(np.median(lit.radiance[lit.seen]))

    def look_closer(self) -> None:
        """All that writing asks of the frames. It may fail and be stopped: done before what was written is touched."""
        if self.settings.atlas != ROOM and self._parting is None:
            self._parting = look_closer(self)

    def write_images(self, wanted: Container[str] | None = None) -> None:
        """The result folder's images, all or the `wanted` ones by name, materials.json and report.html."""
        self.look_closer()
        atlas, lit = self.surface().atlas, self.lit_diffuse()
        dark = max(1e-6 * self.median_radiance(), 1e-30)
        spread = (lit.upper - lit.lower).mean(1) / np.maximum(np.nan_to_num(lit.radiance).mean(1), dark)
        coverage = np.stack([lit.count, np.nan_to_num(spread), self.albedo.origin], -1).astype(np.float32)
        images = {
            "albedo": self.albedo.rho,
            "base_color": self.base_color(),
            "shading": self.irradiance,
            "lit_diffuse": np.where(lit.seen[:, None], lit.radiance, 0).astype(np.float32),
            "coverage": coverage,
            **self.evidence.images(),
        }
        images = {name: image for name, image in images.items() if wanted is None or name in wanted}

        def write(name: str) -> None:
            self.store.write_exr(f"{name}.exr", atlas.image(images[name])[::-1])

        begun = LOOKED if self._parting else 0.0
        for done, _ in enumerate(ordered_map(write, images, self.settings.threads)):
            self.progress.update(begun + (0.5 - begun) * done / len(images))
        if wanted is None or "environment" in wanted:
            self.store.write_exr("environment.exr", self.sky()[::-1])
        if self.settings.atlas == ROOM:
            remove_parts(self)
        elif "base_color" in images:
            self.parts = write_parts(self, self._parting, atlas.image(images["base_color"]))
        known = {one.object_id: {"evidence": dataclasses.asdict(one)} for one in self.evidence.objects}
        for number, name in (self.parts.images if self.parts else {}).items():
            known.setdefault(number, {})["image"] = name
        objects = [{"name": m.name} | dataclasses.asdict(m) | known.get(m.object_id, {}) for m in self.materials()]
        told = {"run": self.run_key, "capture": self.capture.root.name, "objects": objects}
        told |= {name: value for name, value in self.overrides.as_dict().items() if name == "white"}
        self.store.write_json("materials.json", told)
        self.progress.update(0.6)
        write_bytes(self.store.path("report.html"), make_page(self.findings, self.evidence, self.report()).encode())

    def report(self) -> dict[str, Any]:
        """What report.json holds so far: stages, settings, figures and warnings."""
        return make_report(self) | {"code": CODE}
