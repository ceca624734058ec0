"""The stages in their order: each is computed when it is first needed, or taken from the result folder."""

import time
from collections.abc import Callable
from dataclasses import replace
from functools import cached_property
from typing import Any, TypeVar

import numpy as np

from ..brdf.registry import origin as brdf_origin
from ..errors import MissingStageError
from ..io import readers
from ..io.fingerprint import fingerprint
from ..json_values import key
from ..kinds import Block
from ..light.field import LightField
from ..light.mirrors import in_their_planes
from ..light.shading import Shading
from ..memory import BUDGET, give_back, peak_memory
from ..passes.pose_refinement.poses import Poses
from ..passes.registry import check, followed, left_out_of
from ..progress import Progress
from ..results.overrides import NONE as NO_OVERRIDES
from ..results.overrides import Overrides
from ..results.store import Store
from ..results.values import from_store, to_store
from ..scene.closed_mesh import without_closing
from ..scene.frame_choice import with_frames_that_add
from ..scene.lit_diffuse import LitDiffuse
from ..scene.model import Capture, Frame, Mesh
from ..scene.surface import Surface
from ..scene.two_sides import laid_apart
from ..scene.unwrap import Unwrap
from ..scene.visibility import bytes_of_frame
from ..settings import ROOM, Settings
from ..stages import WRITE
from . import frames, shading, specular, surface
from .choose_models import LOOKED, Looked, Room
from .frames import FrameReader, Observed
from .source import digest
from .specular import Held, Pictures, Specular, fit_specular, look_at_block
from .stage import Stage

STAGES = (surface.STAGE, frames.STAGE, shading.STAGE, specular.STAGE)
"""Those that are stored, in their order."""
ELEMENT_BYTES: Block[int] = 300
"""Lower bound of what the stages after the surface take for each element: in three rooms 400 to 500 in all."""
Arrays = dict[str, np.ndarray]
Stored = tuple[Arrays, dict[str, Any]]
T = TypeVar("T")


def code() -> str:
    """16 hex digits that identify the source of the stages."""
    return key(*(digest(stage.source) for stage in STAGES))[:16]


class Stages:
    """One run over one capture.

    Parameters
    ----------
    capture : Capture
    store : Store
    settings : Settings
    progress : Progress
    unwrap : callable(Mesh, int) -> (t, 3, 2) float32, optional
        Lays the mesh out in an atlas of so many texels; Blender's, in the extension. None: only what is stored is
        looked at.
    overrides : Overrides
        What the artist gives.

    Attributes
    ----------
    capture : Capture
        As read, without frames that add nothing; with the lamps set apart that were found in other objects, once
        `shading` was called.
    done : dict
        Values of the stages so far.
    log : dict
        Time, memory and whether it was stored, of each.
    read : FrameReader
        Gives a frame's pixels, and knows the damaged ones.
    """

    def __init__(
        self,
        capture: Capture,
        store: Store,
        settings: Settings,
        progress: Progress,
        unwrap: Unwrap | None,
        overrides: Overrides = NO_OVERRIDES,
    ):
        check(settings.without)
        if "close-holes" in settings.without:
            capture = without_closing(capture)
        capture = self._with_chosen_frames(capture, settings)
        self.capture, self.store, self.settings, self.progress = capture, store, settings, progress
        self._as_read = capture
        self.overrides = overrides
        self.read = FrameReader(len(capture.frames))
        self._centred = surface.centred(capture)
        self._unwrap = unwrap
        self.done: dict[str, Any] = {}
        self.log: dict[str, dict[str, Any]] = {}

    def _with_chosen_frames(self, capture: Capture, settings: Settings) -> Capture:
        """A capture with the frames that are used."""
        if "frame-choice" in settings.without or "lit_diffuse" in settings.published:
            return capture
        return with_frames_that_add(capture, settings.threads)

    @property
    def frames(self) -> tuple[Frame, ...]:
        """The capture's, in the coordinates that the stages work in, where they were found to be."""
        return self.observed().of(self._centred.frames)

    @cached_property
    def keys(self) -> dict[str, str]:
        """The key of each stage, by name."""
        return self.keys_under(self.overrides)

    def keys_under(self, overrides: Overrides) -> dict[str, str]:
        """What they are under other overrides."""
        keys: dict[str, str] = {}
        for stage in STAGES:
            given: tuple[Any, ...] = ()
            if stage is specular.STAGE:
                brdfs = {lobe.brdf for lobe in overrides.lobes().values() if lobe.brdf is not None}
                given = (*overrides.lobes_key(), *sorted(filter(None, map(brdf_origin, brdfs))))
            keys[stage.name] = stage.key(self.settings, keys, *given) if stage.takes else self._first_key(stage)
        return keys

    def _first_key(self, stage: Stage) -> str:
        origins = tuple(filter(None, (readers.origin(self._as_read.format), self._laid_out_by)))
        return stage.key(self.settings, {}, fingerprint(self._as_read), *origins)

    @cached_property
    def _laid_out_by(self) -> str:
        """What lays out the atlas; what did, where that is not given as stored results are only read."""
        if self._unwrap is not None:
            return surface.laid_out_by(self._unwrap)
        return str(self.store.stored_meta(surface.STAGE.name).get("unwrap", ""))

    @property
    def run_key(self) -> str:
        """16 hex digits that are the same where a capture and all that was requested are, and differ otherwise."""
        parts: tuple[Any, ...] = (self.overrides.as_dict(),) if self.overrides.any else ()
        parts += () if self.settings.atlas == ROOM else (self.settings.atlas,)
        parts += () if self.settings.texture_fill else ("no texture fill",)
        parts += left_out_of(WRITE, self.settings.without)
        return key("run", self.keys[specular.STAGE.name], *parts)[:16]

    def _stage(
        self,
        stage: Stage,
        compute: Callable[[Settings], T],
        stored_as: Callable[[T], Stored],
        restored: Callable[[Arrays, dict[str, Any]], T],
    ) -> T:
        """The value of a stage: kept, stored, or computed now and stored."""
        name = stage.name
        if name in self.done:
            return self.done[name]
        started = time.monotonic()
        stored = self.store.load(name, self.keys[name])
        self.progress.stage(name)
        if stored is not None:
            value = restored(stored, self.store.load_meta(name, self.keys[name]) or {})
        else:
            value = compute(stage.settings(self.settings))
            value = followed(name, value, self.done, self.settings.without)
            self.store.save(name, self.keys[name], *stored_as(value))
        give_back()
        self.log[name] = {"seconds": round(time.monotonic() - started, 2), "stored": stored is not None}
        self.log[name]["peak_memory_bytes"] = peak_memory()
        self.progress.done(stored=stored is not None)
        self.done[name] = value
        return value

    def surface(self) -> Surface:
        """Surface elements over the room; around the origin where the room lies far from it.

        Once `shading` was called, this and the capture have the lamps set apart that it found in other objects.
        """
        capture = self._centred
        return self._stage(
            surface.STAGE,
            lambda settings: surface.make_surface(capture, self._needed_unwrap(), settings),
            lambda result: surface.to_store(result, capture.mesh, self._laid_out_by),
            lambda arrays, meta: surface.from_store(arrays, meta, capture.mesh),
        )

    @property
    def closing(self) -> np.ndarray:
        """Elements of faces that close the capture's holes, (n,) bool."""
        mesh = self.surface().mesh
        faces = np.zeros(len(mesh.triangles), bool)
        faces[mesh.closed if mesh.closed is not None else []] = True
        return faces[self.surface().atlas.triangle]

    def _needed_unwrap(self) -> Unwrap:
        if self._unwrap is None:
            raise MissingStageError("The stage 'surface' is not stored for this capture and these settings; run it.")
        return self._unwrap

    def room_mesh(self) -> Mesh:
        """The mesh that the stages worked on, where the capture has it: normals face the frames, noise is out of it.

        A sheet's second side is a little apart from the first.
        """
        mesh, before = self.surface().mesh, self._centred.mesh.vertices
        moved = mesh.vertices[: len(before)] - before  # by itself, so that what did not move is exact
        return laid_apart(mesh, self.capture.mesh.vertices + moved)

    def written_mesh(self) -> Mesh:
        """`room_mesh` as the scene gets it. Mirrors of a noisy mesh lie in planes that follow from what they show."""
        mesh = self.room_mesh()
        if not self.surface().noise:
            return mesh
        return replace(mesh, vertices=in_their_planes(mesh, self.shading().mirrors))

    def room_poses(self) -> Poses:
        """Where the frames were found to be, in the capture's coordinates."""
        poses = self.observed().poses
        moved = poses.camera_to_world.copy()
        for pose, original, centred in zip(moved, self.capture.frames, self._centred.frames, strict=True):
            pose[:3, 3] += original.camera.centre - centred.camera.centre
        return replace(poses, camera_to_world=moved)

    def observed(self) -> Observed:
        """What the frames show."""
        room, cameras = self.surface(), [frame.camera for frame in self._centred.frames]

        def observe(settings: Settings) -> Observed:
            needs = ELEMENT_BYTES * len(room.atlas) + bytes_of_frame(cameras)
            BUDGET.require(needs, f"The room's {len(room.atlas):,} surface elements and its frames")
            if cameras and settings.median == "exact":
                frames.check_disk_space(room, self._centred.frames, self.store.folder)
            passes = frames.Passes(room, self.read, settings, self.store.folder)
            return frames.observe(passes, self._centred, self.progress)

        def restored(arrays: Arrays, meta: dict[str, Any]) -> Observed:
            observed, self.read.bad, self.read.blind = from_store(arrays, meta, frames.OBSERVED)
            return observed

        return self._stage(
            frames.STAGE, observe, lambda observed: to_store((observed, self.read.bad, self.read.blind)), restored
        )

    def lit_diffuse(self) -> LitDiffuse:
        """L_d of every element."""
        return self.observed().lit_diffuse

    def shading(self) -> Shading:
        """Lamps and irradiance."""
        room, observed, first = self.surface(), self.observed(), shading.STAGE.name not in self.done
        result = self._stage(
            shading.STAGE,
            lambda settings: shading.find_shading(self._centred, room, observed, settings, self.progress),
            to_store,
            lambda arrays, meta: from_store(arrays, meta, shading.SHADING),
        )
        if first and len(result.patches):
            self.done[surface.STAGE.name] = result.patches.surface(room)
            self.capture, self._centred = result.patches.capture(self.capture), result.patches.capture(self._centred)
        return result

    @cached_property
    def field(self) -> LightField:
        """The room as a light source, with all that was found of its light."""
        light = self.shading()  # first, as it sets lamps apart from the surface
        return shading.lit_room(self.surface(), light)

    def specular(self) -> Specular:
        """phi, psi and the model of every object."""
        self.shading()
        result = self._stage(
            specular.STAGE,
            self.fitted,
            lambda result: result.to_store(self.overrides),
            lambda arrays, meta: Specular.from_store(arrays, meta, self.lit_diffuse()),
        )
        self.store.drop(self.store.parts(specular.STAGE.name))  # they are in it
        return result

    def specular_block(self, block: tuple[int, int]) -> None:
        """Store what is found of some of the objects, which `specular` begins with: the I-th of N parts, I from 1."""
        name, key = f"{specular.STAGE.name}-{block[0]}-of-{block[1]}", self.keys[specular.STAGE.name]
        settings = specular.STAGE.settings(self.settings)
        self.shading()
        if self.store.stored_key(name) == key:
            return
        self.progress.stage(specular.STAGE.name)
        looked = look_at_block(self._room(settings), block)
        self.store.save(name, key, *to_store(looked))
        self.progress.done()

    def _stored_looks(self) -> dict[int, Looked]:
        """What blocks of objects have stored."""
        looked: dict[int, Looked] = {}
        for name in self.store.parts(specular.STAGE.name):
            arrays = self.store.load(name, self.keys[specular.STAGE.name])
            if arrays is not None:
                looked |= from_store(arrays, self.store.stored_meta(name), LOOKED)
        return looked

    def _room(self, settings: Settings) -> Room:
        light, names = self.shading(), [frame.name for frame in self.capture.frames]
        return Room(
            self.capture.instances, self.field, self.lit_diffuse(), light.irradiance, self.observed().samples, names,
            light.lamps, self.surface().noise, self.overrides.lobes(), settings, self.progress,
        )  # fmt: skip

    def fitted(self, settings: Settings, held: Held | None = None) -> Specular:
        """The specular stage as it is computed, of all objects or with some `held`."""
        room = self._room(settings)
        pictures = Pictures(self.frames, self.read, self.store.folder, self.surface().groups)
        return fit_specular(room, pictures if room.frame_names else None, held, None if held else self._stored_looks())

    @cached_property
    def median_radiance(self) -> float:
        """Median of L_d over all that was seen: what a picture's exposure is set by."""
        lit_diffuse = self.lit_diffuse()
        return float(np.median(lit_diffuse.radiance[lit_diffuse.seen]))
