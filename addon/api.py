"""Scan Relight as a Python library, with Blender or without (docs/api.md); the package gives these names as its own."""

import importlib.util
import time
from collections.abc import Callable
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from .core.brdf.material import ObjectMaterial
from .core.errors import BadInputError, InterruptedRun, ScanRelightError
from .core.io.layout import AS_FOUND, Layout, RawMesh, Reader, Reading
from .core.io.read import read_capture
from .core.io.readers import register_reader
from .core.pipeline.run import WHOLE, Request, Run, SceneWriter, progress_of_run
from .core.progress import Progress, ProgressEvent
from .core.scene.model import Camera, Capture, Frame, Mesh
from .core.scene.unwrap import Unwrap, by_xatlas, own_coordinates
from .core.settings import PRESETS, Settings
from .core.stages import READ, WRITE
from .version import VERSION

__all__ = [
    "PRESETS",
    "BadInputError",
    "Camera",
    "Capture",
    "Frame",
    "InterruptedRun",
    "Layout",
    "Mesh",
    "ObjectMaterial",
    "ProgressEvent",
    "RawMesh",
    "Reader",
    "Reading",
    "Recovered",
    "ScanRelightError",
    "Settings",
    "read_capture",
    "recover",
    "register_reader",
    "unwrapper",
]
BLENDER, XATLAS, OWN = "blender", "xatlas", "own"
UNWRAPS = (BLENDER, XATLAS, OWN)
"""What lays out an atlas, the better before what is also possible."""


def unwrapper(name: str = "") -> Unwrap:
    """What lays out the atlas: ``"blender"``, ``"xatlas"`` or ``"own"``, the mesh's own texture coordinates.

    Parameters
    ----------
    name : str
        ``""`` takes the first of them whose package is installed.

    Returns
    -------
    callable(Mesh, int) -> (t, 3, 2) float32
        Atlas coordinates in [0, 1] without overlap, for a mesh and an atlas's edge in texels.

    Raises
    ------
    BadInputError
        There is no such, or its package is missing.
    """
    if not name:
        name = BLENDER if _is_there("bpy") else XATLAS if _is_there("xatlas") else OWN
    if name not in UNWRAPS:
        raise BadInputError(f"There is no unwrap '{name}'; choose one of {', '.join(UNWRAPS)}.")
    if name == BLENDER:
        try:
            from .bridge.data.unwrap import unwrap
        except ImportError as error:
            raise BadInputError(
                "Blender's Python package 'bpy' is missing; install it (pip install 'scan-relight[blender]') "
                f"or choose the unwrap {XATLAS} or {OWN}."
            ) from error
        return unwrap
    return by_xatlas if name == XATLAS else own_coordinates


def _is_there(module: str) -> bool:
    try:
        return importlib.util.find_spec(module) is not None
    except ValueError:  # taken out of sys.modules on purpose
        return False


class Recovered:
    """What was recovered of a capture. `recover` makes it; its arrays are computed when they are first asked for.

    Images lie over the room's atlas: (size, size, 3) float32, linear Rec.709, row 0 at the top, 0 where no surface is.

    Attributes
    ----------
    folder : Path
        The result folder, which keeps the finished stages.
    """

    def __init__(self, run: Run):
        self._run, self._recovery, self.folder = run, run.recovery, run.folder

    def _image(self, values: np.ndarray) -> np.ndarray:
        return self._recovery.surface().atlas.image(values)[::-1]

    @cached_property
    def albedo(self) -> np.ndarray:
        """Diffuse albedo, 0...1."""
        return self._recovery.over_atlas("albedo", self._recovery.albedo.rho)[::-1]

    @cached_property
    def irradiance(self) -> np.ndarray:
        """Irradiance, the hemisphere's integral of radiance times cosine: the frames' unit times steradian."""
        return self._image(self._recovery.irradiance)

    @cached_property
    def lit_diffuse(self) -> np.ndarray:
        """The lit diffuse texture: radiance, in the frames' unit; 0 where no frame saw the surface."""
        lit = self._recovery.lit_diffuse()
        return self._image(np.where(lit.seen[:, None], lit.radiance, 0).astype(np.float32))

    @property
    def environment(self) -> np.ndarray:
        """Radiance from outside, (h, 2 h, 3) float32, equirectangular as Cycles reads it, row 0 at the top."""
        return self._recovery.sky()[::-1]

    @property
    def materials(self) -> list[ObjectMaterial]:
        """The description of each object, as materials.json has it."""
        return self._recovery.materials()

    @property
    def lamps(self) -> list[ObjectMaterial]:
        """Those of the objects that give light; `emission` is the radiance that they give, linear Rec.709."""
        return [material for material in self.materials if material.model.gives_light]

    @property
    def mesh(self) -> Mesh:
        """The mesh as it was worked on: its normals face the frames, its noise is taken out; metres, world."""
        return self._recovery.room_mesh()

    @property
    def uv(self) -> np.ndarray:
        """Where the corners of `mesh` lie on the atlas, (t, 3, 2) float32; v points up, as in Blender."""
        return self._recovery.surface().shown_uv

    def write(self, scene: SceneWriter | None = None) -> dict[str, Any]:
        """Write the EXR images, materials.json, report.html and report.json into `folder`.

        Parameters
        ----------
        scene : callable(Recovery, Capture) -> tuple of str, optional
            Writes a scene from the finished recovery, and gives warnings.

        Returns
        -------
        dict
            What report.json holds.
        """
        with self._run:
            return self._run.write(scene)


def recover(
    capture: Capture | Path | str,
    folder: Path | str,
    settings: Settings | None = None,
    *,
    progress: Callable[[ProgressEvent], None] | None = None,
    should_stop: Callable[[], bool] | None = None,
    unwrap: Unwrap | str = "",
    reading: Reading = AS_FOUND,
    overrides: Path | None = None,
    white: str = "",
) -> Recovered:
    """Recover a capture: albedo, irradiance, materials and lamps.

    Parameters
    ----------
    capture : Capture or path
        What `read_capture` gave, or a folder.
    folder : path
        The result folder, made where absent. It keeps each finished stage: what is there already is not done again.
    settings : Settings, optional
        The preset 'normal', unless given.
    progress : callable(ProgressEvent), optional
        Called from this thread as the work goes on.
    should_stop : callable() -> bool, optional
        Called at each of those; True ends the run by `InterruptedRun`, with the finished stages kept.
    unwrap : callable or str
        What lays out the atlas; see `unwrapper`.
    reading : Reading
        How the capture is to be read, or was.
    overrides : path, optional
        JSON file of what is known of objects (docs/corrections.md), which the result folder then keeps.
    white : str
        What has a known albedo: a part, 'ceiling' or 'wall=0.7', or a frame's pixel, '0012:320,200=0.18'.

    Raises
    ------
    ScanRelightError
        One sentence on what is wrong; `BadInputError` where it is with what was given.
    """
    request = Request(reading=reading, override=overrides, white=white)
    run_progress = progress_of_run(progress, should_stop)
    run, lay_out = _read(capture, Path(folder), settings or Settings(), run_progress, request, unwrap)
    with run:
        run.stages(lay_out)
    return Recovered(run)


def run_without_scene(
    capture: Path, folder: Path, settings: Settings, progress: Progress, request: Request = WHOLE, unwrap: str = ""
) -> dict[str, Any]:
    """Recover as far as is requested, and write all but scene.blend; as `bridge.job.run.run`, without Blender."""
    run, lay_out = _read(capture, folder, settings, progress, request, unwrap)
    with run:
        report = run.stages(lay_out)
        return run.write() if request.until == WRITE else report


def _read(
    capture: Capture | Path | str,
    folder: Path,
    settings: Settings,
    progress: Progress,
    request: Request,
    unwrap: Unwrap | str,
) -> tuple[Run, Unwrap]:
    """The run over a capture, which is read now unless it was, and what lays out its atlas."""
    request.check(capture.root if isinstance(capture, Capture) else Path(capture), folder)
    started = time.monotonic()
    lay_out = unwrapper(unwrap) if isinstance(unwrap, str) else unwrap
    progress.stage(READ)
    if not isinstance(capture, Capture):
        capture = read_capture(capture, request.reading)
    return Run(capture, folder, settings, progress, request, {"scan_relight": VERSION}, started), lay_out
