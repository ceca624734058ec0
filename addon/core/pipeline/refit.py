"""A few objects of a finished result fitted again, with all else held: seconds instead of a run.

What it needs lies in the result folder: the stages and the room. The capture may be gone. Held are the light, the
fits of the other objects and what glossy things reflect onto the room; a whole run of the specular stage brings that up
to date. What is made of them is made anew for all of the room.
"""

import dataclasses
import json
from collections.abc import Collection
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import BadInputError, MissingStageError
from ..progress import Progress
from ..results.overrides import Given, Overrides, heeded, parse
from ..results.room_file import DAMAGE, MATERIALS, Room, read_room
from ..results.store import Store
from ..scene.model import Capture, Mesh
from ..settings import ROOM, Settings
from .parts import STAGE as DETAIL
from .parts import stored_key as detail_key
from .recover import Recovery
from .specular import STAGE as SPECULAR
from .specular import Held, Specular
from .stage import Stage
from .stages import code

REPORT = "report.json"


@dataclasses.dataclass(frozen=True)
class Result:
    """A finished result that is to be fitted again in part.

    Attributes
    ----------
    report : dict
        Its report.json.
    materials : dict
        Its materials.json.
    overrides : Overrides
        What is to be heeded now.
    requested : frozenset of int
        Objects that are to be fitted again whether something new is given of them or not.
    """

    room: Room
    report: dict[str, Any]
    materials: dict[str, Any]
    overrides: Overrides
    requested: frozenset[int]

    @property
    def settings(self) -> Settings:
        """The settings that the result was made with."""
        return Settings(**self.report["settings"])

    @property
    def given(self) -> dict[int, dict]:
        """What was given of each object when the result was written."""
        return {entry["object_id"]: entry.get("given") or {} for entry in self.materials["objects"]}

    @property
    def changed(self) -> set[int]:
        """Objects of which something else is given now, and those that are the same as one of them."""
        before = self.given
        first = {i for i in before if before[i] != self.overrides.of(i).as_dict()} | self.requested
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
        An object is unknown, nothing is requested, or a file is damaged.
    """
    folder = Path(folder)
    room = read_room(folder)
    known = {instance.object_id: instance for instance in room.capture.instances}
    for object_id in objects:
        if object_id not in known:
            raise BadInputError(f"Result '{folder}' has no object {object_id}; its objects are listed in {MATERIALS}.")
    overrides = heeded(folder, known, override, heed_kept)
    try:
        report, materials = (json.loads((folder / name).read_text(encoding="utf-8")) for name in (REPORT, MATERIALS))
        if report.get("code") != code():
            raise _again(folder, "another version of Scan Relight made it")
        result = Result(room, report, materials, overrides, frozenset(objects))
        result.settings, result.given  # noqa: B018  (damage is reported now)
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
        for name in ("surface", "lit_diffuse", "shading"):
            if store.stored_key(name) is None or store.stored_key(name) != self.keys[name]:
                raise _again(store.folder, "its stages were cleared or are another run's")
        if self.settings.atlas != ROOM and store.stored_key(DETAIL) != detail_key(self):
            raise _again(store.folder, "what its frames show of finer texels was cleared")
        self._specular_before = self._load_specular()

    def _with_chosen_frames(self, capture: Capture, settings: Settings) -> Capture:
        return capture  # the room has those that the run looked at

    def _first_key(self, stage: Stage) -> str:
        return self.store.stored_key(stage.name) or ""

    def _load_specular(self) -> tuple[Specular, dict[int, Given]]:
        """The specular stage as it is stored, and what was given to it."""
        stored = self.store.stored_key("specular")
        meta = self.store.load_meta("specular", stored) if stored else None
        known = [instance.object_id for instance in self.capture.instances]
        overrides = parse((meta or {}).get("overrides", {}), "specular", known)
        arrays = (
            self.store.load("specular", stored) if stored and stored == self.keys_under(overrides)["specular"] else None
        )
        if arrays is None:
            raise _again(self.store.folder, "its stages were cleared or are another run's")
        return Specular.from_store(arrays, meta or {}, self.lit_diffuse()), overrides.lobes()

    @cached_property
    def touched(self) -> set[int]:
        """Objects whose material is made anew."""
        return self.result.changed

    @cached_property
    def fitted_again(self) -> set[int]:
        """Those of them that are fitted: something else is given of their highlight, or nothing new at all."""
        before, current, given = self._specular_before[1], self.overrides.lobes(), self.result.given
        changed = {
            i
            for i in self.touched
            if before.get(i) != current.get(i)
            or i in self.result.requested
            and given[i] == self.overrides.of(i).as_dict()
        }
        return {i for i in self.touched if {i, *self.overrides.chain(i)} & changed}

    def refit(self) -> None:
        """Fit the objects again and store the stage."""
        specular, objects = self._specular_before[0], self.fitted_again
        for stage in ("surface", "lit_diffuse", "shading"):
            getattr(self, stage)()
        self.progress.stage("specular")
        if objects:
            specular = self.fitted(SPECULAR.settings(self.settings), Held(specular, objects))
            self.store.save("specular", self.keys["specular"], *specular.to_store(self.overrides))
        self.done["specular"] = specular
        self.progress.done()

    def report(self) -> dict[str, Any]:
        """The result's report.json with what has changed."""
        old, new = self.result.report, super().report()
        models = {
            name: new["figures"][name]
            for name in ("models", "evidence", "white_scale", "white_light")
            if name in new["figures"]
        }
        figures = {name: value for name, value in old["figures"].items() if not name.startswith("white_")} | models
        warnings = [warning for warning in old["warnings"] if warning != old.get("white_warning")]
        white_warning = {"white_warning": self.white.warning} if self.white is not None and self.white.warning else {}
        result = {name: value for name, value in old.items() if name != "white_warning"} | white_warning
        return result | {"figures": figures, "warnings": [*warnings, *white_warning.values()], "code": code()}
