"""A whole run: a capture in, the result folder out, but for the Blender scene, which the caller writes."""

from __future__ import annotations

import importlib.metadata
import platform
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from ..agreement.look import look
from ..errors import BadInputError, MissingStageError, StorageError, check_path
from ..io.conventions import AS_READ
from ..io.layout import AS_FOUND, Reading
from ..io.pixels import read_pixels
from ..memory import peak_memory
from ..progress import Progress, ProgressEvent
from ..results.known_white import white_of
from ..results.overrides import OVERRIDES, Overrides, heeded, merge
from ..results.result_folders import write_capture
from ..results.room_file import ROOM, objects_of, write_room
from ..results.store import Store
from ..scene.model import Capture
from ..scene.unwrap import Unwrap
from ..settings import Settings
from ..stages import READ, RUN_STAGES, STAGES, WRITE
from .recover import Recovery
from .stages import STAGES as DECLARED

WEIGHTS: dict[str, float] = {READ: 1, "surface": 5, "lit_diffuse": 8, "shading": 17, "specular": 16, WRITE: 5}
"""Rough cost of the stages, for the estimate of the time left."""
PACKAGES = ("numpy", "scipy", "embreex", "OpenEXR")
LEFT_OUT = f"The corrections that the result folder keeps in {OVERRIDES} were left out of this run, as was asked."
SceneWriter = Callable[[Recovery, Capture], tuple[str, ...]]
"""Writes the scene of a finished recovery, given the capture with the frames' poses and the mesh as they were found to
be; gives sentences on what is doubtful."""


def progress_of_run(
    listener: Callable[[ProgressEvent], None] | None = None, should_stop: Callable[[], bool] | None = None
) -> Progress:
    """A `Progress` that knows what the stages of a run cost."""
    return Progress(listener, should_stop, WEIGHTS)


@dataclass(frozen=True)
class Request:
    """What is requested of a run besides its settings.

    Attributes
    ----------
    until : str
        The last stage to do, one of `stages.RUN_STAGES`; `WRITE` for all of them and what is written.
    from_stage : str or None
        Do this stage and all later ones anew, though the result folder holds them.
    alone : bool
        Do `until` and none that comes before it.
    block : tuple of int, or None
        I and N: of the last stage, this part alone; the result folder is shared with those who do the others.
    reading : Reading
        How the capture is to be read, or was.
    override : Path or None
        File of what the artist gives (`results.overrides`), merged into what the result folder keeps.
    heed_kept : bool
        False leaves out, for this run, what the result folder keeps.
    white : str
        What has a known albedo: a part, 'ceiling' or 'wall=0.7', or a frame's pixel, '0012:320,200=0.18'; '' for none.
        Kept as what is in `override` is.
    """

    until: str = WRITE
    from_stage: str | None = None
    alone: bool = False
    block: tuple[int, int] | None = None
    reading: Reading = AS_FOUND
    override: Path | None = None
    heed_kept: bool = True
    white: str = ""

    def check(self, capture_folder: Path, out_folder: Path) -> None:
        """Raise `BadInputError` for a stage that is not, or not divided, and a result folder that is the capture's."""
        for stage in (self.until, self.from_stage):
            if stage is not None and stage not in RUN_STAGES:
                raise BadInputError(f"There is no stage '{stage}'; choose one of {', '.join(RUN_STAGES)}.")
        if self.block is not None and self.until not in [stage.name for stage in DECLARED if stage.divided_by]:
            raise BadInputError(f"Stage '{self.until}' can't be divided into blocks; leave --block out.")
        check_path(out_folder)
        if out_folder.resolve() == capture_folder.resolve():
            raise BadInputError(f"Result folder '{out_folder}' is the capture itself; choose another.")


WHOLE = Request()
"""A whole run."""


class Run:
    """A run over a capture that was read: its stages, then what they are written as.

    The result folder is its own while it is entered (`with`), and both are done there.

    Parameters
    ----------
    capture : Capture
    out_folder : Path
        The result folder; made where absent.
    settings : Settings
    progress : Progress
        In the stage `READ`.
    request : Request
    versions : mapping of str to str
        What the report names besides Python and its packages.
    started : float
        When it began, by `time.monotonic`.

    Attributes
    ----------
    recovery : Recovery
        Once `stages` was called.

    Raises
    ------
    BadInputError
        What was given can't be heeded, or the poses are surely read wrongly and how they would be right is known.
    """

    recovery: Recovery

    def __init__(
        self,
        capture: Capture,
        out_folder: Path,
        settings: Settings,
        progress: Progress,
        request: Request,
        versions: Mapping[str, str],
        started: float,
    ):
        self.capture, self.folder, self._request, self._started = capture, out_folder, request, started
        self._settings, self._progress, self._versions = settings, progress, dict(versions)
        known_ids = {instance.object_id for instance in capture.instances} | objects_of(out_folder)
        self._given = heeded(out_folder, known_ids, request.override, request.heed_kept)
        if request.white:
            self._given = merge(self._given, Overrides(white=white_of(request.white, capture)))
        self._warnings = _look(capture, request.reading) if capture.frames else []
        if not request.heed_kept and (out_folder / OVERRIDES).is_file():
            self._warnings = [LEFT_OUT, *self._warnings]

    def __enter__(self) -> Run:
        self._store = Store(self.folder, shared=self._request.block is not None)
        return self

    def __exit__(self, *exception: object) -> None:
        self._store.close()

    def stages(self, unwrap: Unwrap) -> dict[str, Any]:
        """Do the stages that are requested, over an atlas by `unwrap`; returns the report of a run that ends there.

        It is empty where all are, for `write` reports itself. What was written before stays untouched then.

        Raises
        ------
        MissingStageError
            One is to be done alone, and what comes before is not stored.
        """
        store, request = self._store, self._request
        with storage_errors_as_sentences(self.folder):
            if request.block is None:
                write_capture(store.folder, self.capture.root)
                if request.from_stage in STAGES:
                    store.drop(STAGES[STAGES.index(request.from_stage) :])
                if request.heed_kept and (request.override is not None or request.white):
                    store.write_json(OVERRIDES, self._given.as_dict())
            self._progress.done()
            self.recovery = Recovery(self.capture, store, self._settings, self._progress, unwrap, self._given)
            for stage in STAGES:
                if request.alone and stage != request.until and store.stored_key(stage) != self.recovery.keys[stage]:
                    raise MissingStageError(
                        f"Result folder '{self.folder}' holds no stage '{stage}' of this capture, these settings and "
                        "this version; do it first."
                    )
                if stage == request.until and request.block is not None:
                    getattr(self.recovery, f"{stage}_block")(request.block)
                    break
                getattr(self.recovery, stage)()
                if stage == request.until:
                    break
            if request.until == WRITE:
                return {}
            report = self._report(self.recovery.report())
            if request.block is None:
                store.write_json("report.json", report)
            return report

    def write(self, scene: SceneWriter | None = None) -> dict[str, Any]:
        """Write images, materials.json and the page, what an interface needs, then the scene and report.json."""
        recovery, store = self.recovery, self._store
        recovery.store = store
        with storage_errors_as_sentences(self.folder):
            self._progress.stage(WRITE)
            started = time.monotonic()
            recovery.look_closer()
            # A stopped run must not leave the last one's among new images.
            for name in ("report.json", "scene.blend", ROOM):
                store.path(name).unlink(missing_ok=True)
            report = recovery.write_images()
            self._progress.update(0.7)
            # The scene gets the mesh whose normals face the frames: its lamps shine on that side. And the one that the
            # materials were measured on: their colours fit its normals.
            posed = replace(recovery.capture, frames=recovery.room_poses().of(recovery.capture.frames))
            write_room(store.folder, posed, recovery.surface().first_uv)
            warnings: tuple[str, ...] = ()
            if scene is not None:
                posed = replace(posed, mesh=recovery.written_mesh())
                recovery.let_go()
                warnings = scene(recovery, posed)
            self._progress.done()
            figures = {"seconds": round(time.monotonic() - started, 2), "stored": False}
            report["stages"] |= {WRITE: figures | {"peak_memory_bytes": peak_memory()}}
            report = self._report(report, warnings)
            store.write_json("report.json", report)
            return report

    def _report(self, report: dict[str, Any], warnings: tuple[str, ...] = ()) -> dict[str, Any]:
        """The recovery's report with what only the run knows."""
        report["warnings"] += (*self._warnings, *warnings)
        report["versions"] = self._versions | package_versions()
        report["peak_memory_bytes"] = peak_memory()
        report["seconds"] = round(time.monotonic() - self._started, 2)
        return report


def _look(capture: Capture, reading: Reading) -> list[str]:
    """Sentences on what does not fit between frames and mesh; none where all does.

    Raises
    ------
    BadInputError
        The poses are surely read wrongly, and how they would be right is known.
    """
    fit = look(capture, read_pixels, search=not reading.convention)
    if fit.best is not None:
        raise BadInputError(
            f"Capture '{capture.root}': {fit.sentence()} Give that, or --convention {AS_READ} to go on all the same."
        )
    return fit.sentences()[fit.fits :]


@contextmanager
def storage_errors_as_sentences(folder: Path) -> Iterator[None]:
    """Turn the system's errors while `folder` is written into a `StorageError`, one sentence long."""
    try:
        yield
    except OSError as error:
        where = f" for '{error.filename}'" if error.filename else ""
        raise StorageError(
            f"Result folder '{folder}' can't be written any more ({error.strerror or error}{where}); "
            "free some space or choose another."
        ) from error


def package_versions() -> dict[str, str]:
    """Python and the packages that a report names, so that a run can be repeated."""
    return {"python": platform.python_version(), **{name: importlib.metadata.version(name) for name in PACKAGES}}
