"""A whole run: capture in, result folder out. The command line and the operators both call this."""

from __future__ import annotations

import time
from functools import partial
from pathlib import Path

import bpy

from ...core.io.layout import AS_FOUND, Reading
from ...core.io.read import read_capture
from ...core.pipeline.recover import Recovery
from ...core.pipeline.run import Run, check_run
from ...core.progress import Progress
from ...core.scene.model import Capture
from ...core.settings import Settings
from ...core.stages import READ, WRITE
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
    out_folder : path
        Made where absent.
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
    capture_folder, out_folder = Path(capture_folder), Path(out_folder)
    check_run(capture_folder, out_folder, until, from_stage)
    if scene is not None:
        result_images.check(images)
    started = time.monotonic()
    progress.stage(READ)
    capture = read_capture(capture_folder, reading)
    own = is_own(capture.root, target)
    if scene is not None and own:
        check_own(capture.root)  # what is absent is told now, not after the work
    elif scene is not None and not import_first:
        imported(capture.root)
    whole_run = Run(capture, out_folder, settings, progress, reading, override, heed_kept, versions(), started)
    faces = polygons_of(capture.root, capture.mesh)

    def write(recovery: Recovery, facing: Capture) -> tuple[str, ...]:
        surface, materials, folder = recovery.surface(), recovery.materials(), recovery.store.folder
        warnings = write_scene(
            folder / "scene.blend",
            facing,
            surface.atlas.uv,
            materials,
            folder,
            recovery.median_radiance(),
            fresh=scene is None,
            facing=True,
            parts=recovery.parts,
        )
        if scene is not None and own:
            return warnings + whole(writing_back(scene, capture, surface.first_uv, materials, folder, images, copies))
        if scene is not None:
            return (
                warnings
                + whole(bringing(folder, scene if into == SCENE else None, images, known=not import_first)).warnings
            )
        return warnings

    with whole_run:
        report = whole_run.stages(partial(unwrap, polygons=faces), until, from_stage)
        return whole_run.write(write) if until == WRITE else report


def versions() -> dict[str, str]:
    """What a report names of Scan Relight and Blender."""
    return {"scan_relight": VERSION, "blender": bpy.app.version_string}
