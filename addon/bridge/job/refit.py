"""A few objects of a finished result fitted again, and the result folder written anew."""

from __future__ import annotations

import time
from collections.abc import Collection
from dataclasses import replace
from pathlib import Path

from ...core.pipeline.refit import REPORT, Refit, open_result
from ...core.pipeline.run import package_versions, told_in_a_sentence
from ...core.progress import Progress
from ...core.results.overrides import OVERRIDES
from ...core.results.store import Store
from ...core.stages import READ, WRITE
from ..scene.write import write_scene
from .run import versions

SCENE = "scene.blend"
WEIGHTS = {READ: 1, "surface": 2, "lit_diffuse": 0.1, "shading": 0.1, "specular": 3, WRITE: 5}
"""Rough cost of its parts, for the estimate of the time left."""
OUTDATED = f"{SCENE} shows the room as it was before objects were fitted again."


def refit(
    folder: Path | str,
    objects: Collection[int],
    progress: Progress,
    override: Path | None = None,
    heed_kept: bool = True,
    scene: bool = True,
) -> dict:
    """Fit objects of a result again with all else held; `progress`, `override`, `heed_kept` and errors as in `run`.

    Parameters
    ----------
    folder : path
        The result folder.
    objects : collection of int
        Those to fit; those of which something new is given are fitted besides.
    scene : bool
        Also write scene.blend, from an empty file: what is open in this process is lost.

    Returns
    -------
    dict
        What report.json holds.
    """
    started = time.monotonic()
    progress.stage(READ)
    result = open_result(folder, objects, override, heed_kept)
    with Store(folder) as store, told_in_a_sentence(store.folder):
        run = Refit(result, store, progress)
        progress.done()
        run.refit()
        if override is not None and heed_kept:
            store.write_json(OVERRIDES, run.overrides.as_dict())
        progress.stage(WRITE)
        run.look_closer()
        for name in (REPORT, SCENE) if scene else (REPORT,):
            store.path(name).unlink(missing_ok=True)  # a stopped run must not leave the last one's among new images
        run.write()
        progress.update(0.7)
        report = run.report()
        report["warnings"] = [one for one in report["warnings"] if one != OUTDATED]
        if scene:
            capture = result.room.capture
            posed = replace(capture, frames=run.room_poses().of(capture.frames), mesh=run.written_mesh())
            write_scene(
                store.path(SCENE),
                posed,
                run.surface().atlas.uv,
                run.materials(),
                store.folder,
                run.median_radiance(),
                fresh=True,
                facing=True,
                parts=run.parts,
            )
        else:
            report["warnings"].append(OUTDATED)
        report["versions"] = versions() | package_versions()
        report["refit"] = {"objects": sorted(run.touched), "seconds": round(time.monotonic() - started, 2)}
        store.write_json(REPORT, report)
        progress.done()
    return report
