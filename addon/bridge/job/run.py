"""A whole run, capture in, result folder out, and a few objects fitted again: what command line and operators call."""

import time
from collections.abc import Collection
from dataclasses import replace
from functools import partial
from pathlib import Path

import bpy

from ...core.io.folder import REPORT, SCENE
from ...core.io.read import read_capture
from ...core.pipeline.recover import Recovery
from ...core.pipeline.refit import Refit, open_result
from ...core.pipeline.run import WHOLE, Request, Run, package_versions, storage_errors_as_sentences
from ...core.progress import Progress
from ...core.results.overrides import OVERRIDES
from ...core.results.store import Store
from ...core.scene.model import Capture
from ...core.settings import Settings
from ...core.stages import READ, WRITE
from ...version import VERSION
from ..data.unwrap import unwrap
from ..own_scene.capture import polygons_of
from ..refused import check_backslash
from ..scene.write import write_scene

REFIT_WEIGHTS = {READ: 1, "surface": 2, "lit_diffuse": 0.1, "shading": 0.1, "specular": 3, WRITE: 5}
"""Rough cost of a refit's parts, for the estimate of the time left."""
OUTDATED = f"{SCENE} shows the room as it was before objects were fitted again."


def run(
    capture_folder: Path | str,
    out_folder: Path | str,
    settings: Settings,
    progress: Progress,
    request: Request = WHOLE,
    fresh: bool = True,
) -> dict:
    """Recover a capture as far as is requested; stages that the result folder holds already are not done again.

    With `fresh` scene.blend is made from an empty file: what is open in this process is lost; else that stays as it is.
    Returns what report.json holds. Raises `ScanRelightError`: one sentence for the user.
    """
    capture_folder, out_folder = Path(capture_folder), Path(out_folder)
    request.check(capture_folder, out_folder)
    check_backslash(out_folder, "choose one without, or run with --no-scene")
    started = time.monotonic()
    progress.stage(READ)
    capture = read_capture(capture_folder, request.reading)
    whole_run = Run(capture, out_folder, settings, progress, request, versions(), started)
    with whole_run:
        lay_out = partial(unwrap, polygons=polygons_of(capture.root, capture.mesh))
        report = whole_run.stages(lay_out)
        return whole_run.write(partial(write_recovered, fresh=fresh)) if request.until == WRITE else report


def refit(
    folder: Path | str,
    objects: Collection[int],
    progress: Progress,
    override: Path | None = None,
    heed_kept: bool = True,
    scene: bool = True,
) -> dict:
    """Fit objects of a result again with all else held; what is not named below is as in `run` and in `Request`.

    Parameters
    ----------
    folder : path
        The result folder.
    objects : collection of int
        Those to fit; those of which something new is given are fitted besides.
    scene : bool
        Also write scene.blend, from an empty file: what is open in this process is lost.
    """
    started = time.monotonic()
    progress.stage(READ)
    result = open_result(folder, objects, override, heed_kept)
    with Store(folder) as store, storage_errors_as_sentences(store.folder):
        refitting = Refit(result, store, progress)
        progress.done()
        refitting.refit()
        if override is not None and heed_kept:
            store.write_json(OVERRIDES, refitting.overrides.as_dict())
        progress.stage(WRITE)
        refitting.look_closer()
        for name in (REPORT, SCENE) if scene else (REPORT,):
            store.path(name).unlink(missing_ok=True)  # a stopped run must not leave the last one's among new images
        report = refitting.write_images()
        progress.update(0.7)
        report["warnings"] = [text for text in report["warnings"] if text != OUTDATED] + [OUTDATED] * (not scene)
        if scene:
            capture = result.room.capture
            frames = refitting.room_poses().of(capture.frames)
            write_recovered(refitting, replace(capture, frames=frames, mesh=refitting.written_mesh()), fresh=True)
        report["versions"] = versions() | package_versions()
        report["refit"] = {"objects": sorted(refitting.touched), "seconds": round(time.monotonic() - started, 2)}
        store.write_json(REPORT, report)
        progress.done()
    return report


def write_recovered(recovery: Recovery | Refit, capture: Capture, fresh: bool) -> tuple[str, ...]:
    """Write scene.blend of what was recovered; `capture`: the capture with the mesh that is written."""
    uv, materials, folder = recovery.surface().shown_uv, recovery.materials(), recovery.store.folder
    return write_scene(folder / SCENE, capture, uv, materials, folder, recovery.median_radiance, fresh, recovery.parts)


def versions() -> dict[str, str]:
    """Versions of Scan Relight and Blender, for a report."""
    return {"scan_relight": VERSION, "blender": bpy.app.version_string}
