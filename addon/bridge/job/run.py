"""A whole run: capture in, result folder out. The command line and the operators both call this."""

from __future__ import annotations

import importlib.metadata
import platform
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from functools import partial
from pathlib import Path

import bpy

from ...core.agreement.look import look
from ...core.errors import BadInputError, StorageError
from ...core.io.conventions import AS_READ
from ...core.io.layout import AS_FOUND, Reading
from ...core.io.pixels import read_pixels
from ...core.io.read import read_capture
from ...core.memory import peak_memory
from ...core.pipeline.recover import Recovery
from ...core.progress import Progress, ProgressEvent
from ...core.results.overrides import OVERRIDES, heeded
from ...core.results.place import write_capture
from ...core.results.room_file import ROOM, write_room
from ...core.results.store import Store
from ...core.scene.model import Capture
from ...core.settings import Settings
from ...core.stages import READ, RUN_STAGES, STAGES, WRITE
from ...version import VERSION
from ..data.unwrap import unwrap
from ..own_scene.capture import check_own, polygons_of
from ..own_scene.write_back import AUTO, is_own, writing_back
from ..results import images as result_images
from ..room.bring import bringing
from ..scene.parts import imported
from ..scene.write import write_scene
from ..slices import whole

OWN, SCENE = "OWN", "SCENE"
"""Where a room goes: into a scene of its own, or into the one that is open."""
WEIGHTS = {READ: 1, "surface": 5, "lit_diffuse": 8, "shading": 17, "specular": 16, WRITE: 5}
"""Rough cost of the stages, for the estimate of the time left."""
LEFT_OUT = f"The corrections that the result folder keeps in {OVERRIDES} were left out of this run, as was asked."


def progress_for(
    settings: Settings,
    listener: Callable[[ProgressEvent], None] | None = None,
    should_stop: Callable[[], bool] | None = None,
) -> Progress:
    """A `Progress` that knows what the stages of a run cost under `settings`."""
    return Progress(listener, should_stop, WEIGHTS)


def run(
    capture_folder: Path | str,
    out_folder: Path | str,
    settings: Settings,
    progress: Progress,
    until: str = WRITE,
    scene: bpy.types.Scene | None = None,
    import_first: bool = True,
    reading: Reading = AS_FOUND,
    from_stage: str | None = None,
    target: str = AUTO,
    images: str = result_images.RESULT,
    copies: bool = False,
    override: Path | None = None,
    heed_kept: bool = True,
    into: str = OWN,
) -> dict:
    """Recover a capture up to a stage; stages that the result folder holds already are not done again.

    Parameters
    ----------
    capture_folder : path
    out_folder : path
        Made where absent.
    settings : Settings
    progress : Progress
    until : str
        One of `stages.RUN_STAGES`; `WRITE` for all of them, the images and scene.blend.
    scene : bpy.types.Scene, optional
        With `WRITE`: also bring the room into the file that this scene is of, and leave all else that is open as it
        is. Without one, scene.blend is made from an empty file.
    import_first : bool
        Bring the room where it is not there; False updates one that is.
    reading : Reading
        How the capture is to be read.
    from_stage : str, optional
        Do this stage and all later ones anew, though the result folder holds them.
    target, images, copies
        With `scene`: what the materials go onto, see `own_scene.write_back.is_own`, and where their images go, see
        `results.images`. No room comes where they go onto the artist's own objects.
    override : Path, optional
        File of what the artist gives (`core.results.overrides`), merged into what the result folder keeps.
    heed_kept : bool
        False leaves out, for this run, what the result folder keeps.
    into : str
        `OWN`: the room has a scene of its own; `SCENE`: it comes into `scene`.

    Returns
    -------
    dict
        What report.json holds.

    Raises
    ------
    ScanRelightError
        One sentence for the user.
    """
    for stage in (until, from_stage):
        if stage is not None and stage not in RUN_STAGES:
            raise BadInputError(f"There is no stage '{stage}'; choose one of {', '.join(RUN_STAGES)}.")
    capture_folder, out_folder = Path(capture_folder), Path(out_folder)
    if out_folder.resolve() == capture_folder.resolve():
        raise BadInputError(f"Result folder '{out_folder}' is the capture itself; choose another.")
    if scene is not None:
        result_images.check(images)
    started = time.monotonic()
    progress.stage(READ)
    capture = read_capture(capture_folder, reading)
    given = heeded(out_folder, (one.object_id for one in capture.instances), override, heed_kept)
    own = is_own(capture.root, target)
    if scene is not None and own:
        check_own(capture.root)  # what is absent is told now, not after the work
    elif scene is not None and not import_first:
        imported(capture.root)
    told = _look(capture, reading) if capture.frames else []
    with Store(out_folder) as store, told_in_a_sentence(out_folder):
        write_capture(store.folder, capture.root)
        if from_stage in STAGES:
            store.drop(STAGES[STAGES.index(from_stage) :])
        if override is not None and heed_kept:
            store.write_json(OVERRIDES, given.as_dict())
        faces = polygons_of(capture.root, capture.mesh)
        progress.done()
        recovery = Recovery(capture, store, settings, progress, partial(unwrap, polygons=faces), given)
        for stage in STAGES:
            getattr(recovery, stage)()
            if stage == until:
                break
        warnings: tuple[str, ...] = ()
        if until == WRITE:
            progress.stage(WRITE)
            writing = time.monotonic()
            recovery.look_closer()
            # A stopped run must not leave the last one's among new images.
            for name in ("report.json", "scene.blend", ROOM):
                store.path(name).unlink(missing_ok=True)
            recovery.write_images()
            progress.update(0.7)
            surface, materials = recovery.surface(), recovery.materials()
            # The file gets the mesh whose normals face the frames: its lamps shine on that side. And the one that the
            # materials were measured on: their colours fit its normals.
            posed = replace(capture, frames=recovery.room_poses().of(capture.frames))
            facing = replace(posed, mesh=recovery.written_mesh())
            write_room(store.folder, posed, surface.first_uv)
            warnings = write_scene(
                store.path("scene.blend"),
                facing,
                surface.atlas.uv,
                materials,
                store.folder,
                recovery.median_radiance(),
                fresh=scene is None,
                facing=True,
                parts=recovery.parts,
            )
            if scene is not None and own:
                warnings += whole(
                    writing_back(scene, capture, surface.first_uv, materials, store.folder, images, copies)
                )
            elif scene is not None:
                warnings += whole(
                    bringing(store.folder, scene if into == SCENE else None, images, known=not import_first)
                ).warnings
            progress.done()
        report = recovery.report()
        if until == WRITE:
            report["stages"][WRITE] = {
                "seconds": round(time.monotonic() - writing, 2),
                "stored": False,
                "peak_memory_bytes": peak_memory(),
            }
        left = [] if heed_kept or not (store.folder / OVERRIDES).is_file() else [LEFT_OUT]
        report["warnings"] += (*left, *told, *warnings)
        report["versions"] = versions()
        report["peak_memory_bytes"] = peak_memory()
        report["seconds"] = round(time.monotonic() - started, 2)
        store.write_json("report.json", report)
    return report


def _look(capture: Capture, reading: Reading) -> list[str]:
    """Sentences on what does not fit between frames and mesh; none where all does.

    Raises
    ------
    BadInputError
        The poses are surely read wrongly, and how they would be right is known.
    """
    found = look(capture, read_pixels, search=not reading.convention)
    if found.best is not None:
        raise BadInputError(
            f"Capture '{capture.root}': {found.sentence()} Give that, or --convention {AS_READ} to go on all the same."
        )
    return found.sentences()[found.fits :]


@contextmanager
def told_in_a_sentence(folder: Path) -> Iterator[None]:
    """Turn what the system refuses while `folder` is written into one sentence."""
    try:
        yield
    except OSError as error:
        where = f" for '{error.filename}'" if error.filename else ""
        raise StorageError(
            f"Result folder '{folder}' can't be written any more ({error.strerror or error}{where}); "
            "free some space or choose another."
        ) from error


def versions() -> dict[str, str]:
    """What a report has to name so that a run can be repeated."""
    packages = {name: importlib.metadata.version(name) for name in ("numpy", "scipy", "embreex", "OpenEXR")}
    return {"scan_relight": VERSION, "blender": bpy.app.version_string, "python": platform.python_version(), **packages}
