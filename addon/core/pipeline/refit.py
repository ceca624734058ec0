"""A few objects of a finished result fitted again, with all else held: seconds instead of a run.

What it needs lies in the result folder: the stages, the room and the images. The capture may be gone. Held are the
light, the other objects and what glossy things reflect onto the room; a whole run of the specular stage brings
that up to date.
"""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Collection
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from ..brdf.material import ObjectMaterial
from ..errors import BadInputError, MissingStageError
from ..evidence.collect import Evidence
from ..evidence.light import LightEvidence
from ..evidence.objects import object_evidence
from ..evidence.params import CALIBRATION
from ..evidence.texel import TexelEvidence, gloss_error
from ..io.exr import read_exr
from ..passes.albedo.albedo import CLOSED, MEASURED, Albedo
from ..passes.albedo.params import ALBEDO
from ..progress import Progress
from ..results.overrides import Given, Overrides, heeded, parse
from ..results.room_file import DAMAGE, MATERIALS, Room, read_room
from ..results.store import Store
from ..scene.model import Mesh
from ..settings import ROOM, Settings
from .params import CORRECTED
from .parts import STAGE as DETAIL
from .parts import stored_key as detail_key
from .recover import Recovery
from .specular import STAGE as SPECULAR
from .specular import Held, Specular
from .stage import Stage
from .stages import code

REPORT = "report.json"
IMAGES = ("albedo", "base_color", "coverage", "albedo_error")
"""What changes with an object's material."""


@dataclasses.dataclass(frozen=True)
class Result:
    """A finished result that is to be fitted again in part.

    Attributes
    ----------
    room : Room
    report : dict
        Its report.json.
    materials : dict
        Its materials.json.
    overrides : Overrides
        What is to be heeded now.
    asked : frozenset of int
        Objects that are to be fitted again whether something new is given of them or not.
    """

    room: Room
    report: dict[str, Any]
    materials: dict[str, Any]
    overrides: Overrides
    asked: frozenset[int]

    @property
    def settings(self) -> Settings:
        """The settings that the result was made with; what is no longer offered is at its default."""
        told = self.report["settings"]
        known = {field.name for field in dataclasses.fields(Settings)} & told.keys()
        offered = {name for name in known if told[name] in Settings.CHOICES.get(name, (told[name],))}
        return Settings(**{name: told[name] for name in offered})

    @property
    def given(self) -> dict[int, dict]:
        """What was given of each object when the result was written."""
        return {one["object_id"]: one.get("given") or {} for one in self.materials["objects"]}

    @property
    def changed(self) -> set[int]:
        """Objects of which something else is given now, and those that are the same as one of them."""
        before = self.given
        first = {i for i in before if before[i] != self.overrides.of(i).as_dict()} | self.asked
        return {i for i in before if {i, *self.overrides.chain(i)} & first}


def open_result(
    folder: Path | str, objects: Collection[int], override: Path | None = None, heed_kept: bool = True
) -> Result:
    """The result in a folder, to fit `objects` and those again of which something new is given.

    Raises
    ------
    MissingStageError
        No finished result is there.
    BadInputError
        An object is unknown, nothing is asked for, or a file is damaged.
    """
    folder = Path(folder)
    room = read_room(folder)
    known = {one.object_id: one for one in room.capture.instances}
    for one in objects:
        if one not in known:
            raise BadInputError(f"Result '{folder}' has no object {one}; its objects are listed in {MATERIALS}.")
    overrides = heeded(folder, known, override, heed_kept)
    try:
        report, materials = (json.loads((folder / name).read_text(encoding="utf-8")) for name in (REPORT, MATERIALS))
        result = Result(room, report, materials, overrides, frozenset(objects))
        result.settings, result.given  # noqa: B018  (what is damaged is told now)
    except FileNotFoundError as error:
        raise _again(folder, f"'{REPORT}' is missing") from error
    except DAMAGE as error:
        raise BadInputError(
            f"The result in '{folder}' is damaged ({type(error).__name__}: {error}); run recover again."
        ) from error
    if not result.changed and overrides.as_dict().get("white") == materials.get("white"):
        raise BadInputError(
            f"Nothing is to be fitted again in '{folder}': name objects, or give a file of corrections "
            "that changes something."
        )
    return result


def _again(folder: Path, why: str) -> MissingStageError:
    return MissingStageError(
        f"Result '{folder}' can't be fitted in part ({why}); run recover again, it heeds the corrections, too."
    )


def _laid_out(mesh: Mesh, size: int) -> np.ndarray:
    """No atlas is laid out here: the result has one."""
    raise AssertionError("the surface stage of a finished result is stored")


class Refit(Recovery):
    """A finished run of which some objects are fitted again.

    Parameters
    ----------
    result : Result
    store : Store
        Of its folder.
    progress : Progress

    Raises
    ------
    MissingStageError
        Its stages were cleared, or are another version's.
    """

    def __init__(self, result: Result, store: Store, progress: Progress):
        super().__init__(result.room.capture, store, result.settings, progress, _laid_out, result.overrides)
        self.result = result
        self._before = {m.object_id: m for m in result.room.materials}
        self.whole = self.overrides.as_dict().get("white") != result.materials.get("white") or not self._has_images()
        if result.report.get("code", code()) != code():
            raise _again(store.folder, "another version of Scan Relight made it")
        for name in ("surface", "lit_diffuse", "shading"):
            if store.stored_key(name) is None or store.stored_key(name) != self.keys[name]:
                raise _again(store.folder, "its stages were cleared or are another run's")
        if self.settings.atlas != ROOM and store.stored_key(DETAIL) != detail_key(self):
            raise _again(store.folder, "what its frames show of finer texels was cleared")
        self._specular_before = self._load_specular()

    def _has_images(self) -> bool:
        return all(self.store.path(f"{name}.exr").is_file() for name in (*IMAGES, "evidence"))

    def _first_key(self, stage: Stage) -> str:
        return self.store.stored_key(stage.name) or ""

    def _load_specular(self) -> tuple[Specular, dict[int, Given]]:
        """The specular stage as it is stored, and what was given to it."""
        stored = self.store.stored_key("specular")
        meta = self.store.load_meta("specular", stored) if stored else None
        known = [one.object_id for one in self.capture.instances]
        was = parse((meta or {}).get("overrides", {}), "specular", known)
        arrays = self.store.load("specular", stored) if stored and stored == self.keys_under(was)["specular"] else None
        if arrays is None:
            raise _again(self.store.folder, "its stages were cleared or are another run's")
        return Specular.from_store(arrays, meta or {}), was.lobes()

    @cached_property
    def touched(self) -> set[int]:
        """Objects whose material is made anew."""
        return self.result.changed

    @cached_property
    def fitted_again(self) -> set[int]:
        """Those of them that are fitted: something else is given of their highlight, or nothing new at all."""
        before, now, given = self._specular_before[1], self.overrides.lobes(), self.result.given
        first = {
            i
            for i in self.touched
            if before.get(i) != now.get(i) or i in self.result.asked and given[i] == self.overrides.of(i).as_dict()
        }
        return {i for i in self.touched if {i, *self.overrides.chain(i)} & first}

    def refit(self) -> None:
        """Fit the objects again and store the stage."""
        found, again = self._specular_before[0], self.fitted_again
        for stage in ("surface", "lit_diffuse", "shading"):
            getattr(self, stage)()
        self.progress.stage("specular")
        if again:
            found = self.fitted(SPECULAR.settings(self.settings), Held(found, again))
            self.store.save("specular", self.keys["specular"], *found.to_store(self.overrides))
        self.done["specular"] = found
        self.progress.done()

    # What is written: of what was touched anew, of all else as it was.

    def _image(self, name: str) -> np.ndarray:
        """Values of the elements in an image of the result, (n, 3) float32."""
        image = self._image_before(name)
        return image.reshape(-1, image.shape[-1])[self.surface().atlas.texel]

    def _image_before(self, name: str) -> np.ndarray:
        """An image of the result, (s, s, 3) float32, row 0 at the bottom."""
        size = self.surface().atlas.size
        image = read_exr(self.store.path(f"{name}.exr")).rgb[::-1]
        if image.shape[:2] != (size, size):
            raise _again(self.store.folder, f"'{name}.exr' is not the run's")
        return image.astype(np.float32)

    def _to_texture(self) -> np.ndarray:
        found = super()._to_texture()
        return found if self.whole else found & self._own

    def over_atlas(self, name: str, values: np.ndarray) -> np.ndarray:
        """As `Recovery.over_atlas`; texels of what was not touched stay as they were."""
        found = super().over_atlas(name, values)
        if self.whole or name not in IMAGES:
            return found
        touched = self.surface().atlas.image(self._own, True)
        return np.where(touched[..., None], found, self._image_before(name))

    @cached_property
    def _own(self) -> np.ndarray:
        return np.isin(self.surface().atlas.object_id, list(self.touched))

    @cached_property
    def _albedo_before(self) -> Albedo:
        origin = self._image("coverage")[:, 2].astype(np.int8) % CLOSED
        return Albedo(self._image("albedo"), origin, np.zeros(len(origin), np.float32))

    @cached_property
    def albedo(self) -> Albedo:
        """As `Recovery.albedo`, of the touched objects anew."""
        if self.whole:
            return super().albedo
        before, atlas = self._albedo_before, self.surface().atlas
        others = {i.object_id for i in self.capture.instances} - self.touched
        found = self.albedo_of_all_but(self.emitters | others)
        rho, origin = found.rho.copy(), found.origin
        measured = before.rho[before.origin == MEASURED]
        middle = np.median(measured, 0) if len(measured) else np.full(3, 0.5, np.float32)
        for i in self.touched - self.emitters:
            own = atlas.elements_of(i)
            if not (origin[own] == MEASURED).any() and not self.overrides.of(i).base_color:
                # What is taken over from its class is held; a lamp had nothing.
                was = before.rho[own]
                rho[own] = was if was.any() else middle
        own = self._own
        origin, error = np.where(own, origin, before.origin), np.where(own, found.error, before.error)
        return Albedo(np.where(own[:, None], rho, before.rho), origin, error)

    def base_color(self) -> np.ndarray:
        """As `Recovery.base_color`, of the touched objects anew."""
        found = super().base_color()
        return found if self.whole else np.where(self._own[:, None], found, self._image("base_color"))

    @cached_property
    def _materials(self) -> list[ObjectMaterial]:
        found = super()._materials
        return (
            found
            if self.whole
            else [m if m.object_id in self.touched else self._before.get(m.object_id, m) for m in found]
        )

    @cached_property
    def evidence(self) -> Evidence:
        """As `Recovery.evidence`, of the touched objects anew: what gloss and albedo have to do with it."""
        if self.whole:
            return super().evidence
        atlas, lit = self.surface().atlas, self.lit_diffuse()
        error, (shading, clipped, unseen) = self._image("albedo_error"), self._image("evidence").T
        before, now = self._albedo_before, self.albedo
        mine = [m for m in self.materials() if m.object_id in self.touched]
        was = [self._before[m.object_id] for m in mine]
        gloss_was, gloss = (
            gloss_error(atlas, albedo, told, specular, self.irradiance)[:, None]
            for albedo, told, specular in (
                (before, was, self._specular_before[0].specular),
                (now, mine, self.specular().specular),
            )
        )
        relative = np.sqrt(np.maximum(np.square(error) - np.square(gloss_was), 0)) / np.maximum(
            before.rho, ALBEDO.floor
        )
        bare = ~(error > 0).any(1, keepdims=True)
        relative = np.where(bare, np.hypot(shading, CORRECTED.unknown_before)[:, None], relative)
        fresh = np.minimum(np.sqrt(np.square(relative * now.rho) + np.square(gloss)), CALIBRATION.nothing_known)
        known = {m.object_id for m in mine if m.model.gives_light or "base_color" in m.given}
        fresh = np.where(np.isin(atlas.object_id, list(known))[:, None], 0, fresh)
        texels = TexelEvidence(shading, np.where(self._own[:, None], fresh, error).astype(np.float32), unseen, clipped)
        zeros = np.zeros(len(atlas), np.float32)
        count = int(self.result.report["figures"].get("evidence", {}).get("spots_checked", 0))
        return Evidence(
            LightEvidence(zeros, unseen, zeros, {}, count), texels, object_evidence(atlas, lit, now, texels)
        )

    def write(self) -> None:
        """Images, materials.json and report.html of the result folder."""
        self.write_images(None if self.whole else IMAGES)

    def report(self) -> dict[str, Any]:
        """The result's report.json with what has changed."""
        old, new = self.result.report, super().report()
        models = {
            name: new["figures"][name]
            for name in ("models", "evidence", "white_scale", "white_light")
            if name in new["figures"]
        }
        figures = {name: value for name, value in old["figures"].items() if not name.startswith("white_")} | models
        warnings = [one for one in old["warnings"] if one != old.get("white_warning")]
        told = {"white_warning": self.white.warning} if self.white is not None and self.white.warning else {}
        result = {name: value for name, value in old.items() if name != "white_warning"} | told
        return result | {"figures": figures, "warnings": [*warnings, *told.values()], "code": code()}
