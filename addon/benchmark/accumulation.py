"""Accumulation: all its time against reading the frames and the bare occlusion rays, which nothing can do without."""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..core.io.pixels import read_pixels
from ..core.io.read import read_capture
from ..core.kinds import Workload
from ..core.lit_diffuse.accumulate import accumulate
from ..core.memory import peak_memory
from ..core.parallel import ordered_map
from ..core.pipeline.published.frames import lit_diffuse
from ..core.scene.atlas import Atlas
from ..core.scene.lit_diffuse import LitDiffuse
from ..core.scene.model import Frame, Mesh, Pixels
from ..core.scene.rays import RayScene
from ..core.scene.surface import build_surface
from ..core.settings import PAPER, Settings
from .run import Options
from .synthetic import synthetic_capture
from .table import BASELINE, Curves, Table
from .timing import Timing, alternately, once

FRAMES: Workload[tuple[int, int, int]] = (12, 48, 192)
"""x1, x4, x16 of the base size."""
SCRATCH = "tmp-accumulation-"
SIZE: Workload[tuple[int, int]] = (192, 128)
ELEMENTS: Workload[int] = 60_000
LARGE_FRAMES: Workload[int] = 500
LARGE_SIZE: Workload[tuple[int, int]] = (1152, 768)
LARGE_ELEMENTS: Workload[int] = 2_000_000
ALTERNATIVES = {"p2 (paper)": PAPER.median, "exact": "exact", "default": Settings().median}
COLUMNS = ("capture", "frames", "elements", "alternative", BASELINE, "RMS log error", "seconds", "CPU seconds",
           "against the least", "observations", "rays")  # fmt: skip

NOTES = (
    "'least' is reading every frame, and one occlusion ray for each pair of element and frame that are asked for, with "
    "nothing else: EmbreeScene.run on the same rays on all cores.",
    "'against the least' is in seconds of processor time, which other programs disturb less.",
    "Errors are those of L_d against the exact median, over all elements that are seen.",
)


@dataclass(frozen=True)
class Scene:
    """What accumulation takes in."""

    name: str
    mesh: Mesh
    atlas: Atlas
    rays: RayScene
    frames: Sequence[Frame]
    read: Callable[[Frame], Pixels]


class CountedRays(RayScene):
    """A scene that keeps the occlusion rays asked for, to be asked again alone."""

    def __init__(self, mesh: Mesh):
        super().__init__(mesh.vertices, mesh.triangles)
        self.asked: list[tuple[np.ndarray, np.ndarray, np.ndarray]] = []

    def occluded(self, origins: np.ndarray, directions: np.ndarray, distances: np.ndarray) -> np.ndarray:
        """As `RayScene.occluded`."""
        self.asked.append((origins, directions, distances))
        return super().occluded(origins, directions, distances)


def run(options: Options) -> Iterator[Table]:
    """The tables of this stage."""
    rows = []
    steps = len(FRAMES) + (options.capture is not None) + options.large
    with tempfile.TemporaryDirectory(dir=options.out, prefix=SCRATCH) as folder:
        for done, count in enumerate(FRAMES):
            room = synthetic_capture(count, SIZE, ELEMENTS, options.seed, Path(folder))
            name = f"textured room, {count} frames"
            rows += _rows(Scene(name, room.mesh, room.atlas, room.rays, room.frames, read_pixels), options)
            options.progress.update((done + 1) / steps)
    notes = NOTES
    if options.capture is not None:
        scene = _captured(options.capture)
        if scene is None:
            notes += ("The capture was left out: laying out its surface elements needs Blender.",)
        else:
            rows += _rows(scene, options)
        options.progress.update((len(FRAMES) + 1) / steps)
    curves = Curves("capture", "alternative", "CPU seconds", "RMS log error")
    yield Table("accumulation", "Accumulation against reading and bare rays", COLUMNS, rows, notes, curves)
    if options.large:
        yield _large(options)


def _captured(folder: Path) -> Scene | None:
    """The capture as a run lays it out; None where there is no Blender to do it."""
    try:
        from ..bridge.data.unwrap import unwrap
    except ModuleNotFoundError:
        return None
    capture = read_capture(folder)
    surface = build_surface(capture.mesh, [frame.camera for frame in capture.frames], unwrap)
    name = capture.root.resolve().name
    return Scene(name, surface.mesh, surface.atlas, surface.scene, capture.frames, read_pixels)


def _accumulate(scene: Scene, median: str, options: Options, rays: RayScene | None = None) -> LitDiffuse:
    if median == PAPER.median:
        where = scene.mesh, scene.atlas, rays or scene.rays, scene.frames, scene.read
        return lit_diffuse(*where, threads=options.threads)
    with tempfile.TemporaryDirectory(dir=options.out, prefix=SCRATCH) as folder:
        return accumulate(
            scene.mesh, scene.atlas, rays or scene.rays, scene.frames, scene.read,
            median=median, seed=options.seed, threads=options.threads, folder=Path(folder),
        )  # fmt: skip


def _rows(scene: Scene, options: Options) -> list[tuple]:
    """Reading, rays, their sum and every alternative, of one scene."""
    counted = CountedRays(scene.mesh)
    exact = _accumulate(scene, "exact", options, counted)
    functions = {
        "reading": lambda: sum(1 for _ in ordered_map(scene.read, scene.frames, options.threads)),
        "rays": lambda: sum(
            1 for _ in ordered_map(lambda asked: scene.rays.occluded(*asked), counted.asked, options.threads)
        ),
    }
    for name, median in ALTERNATIVES.items():
        functions[name] = lambda median=median: _accumulate(scene, median, options)
    times = alternately(functions, repeats=2 if len(scene.frames) > FRAMES[0] else 3)
    least = Timing(
        times["reading"].seconds + times["rays"].seconds, times["reading"].cpu_seconds + times["rays"].cpu_seconds, None
    )
    rays = sum(len(origins) for origins, _, _ in counted.asked)
    rows = []
    for name, timing in (("reading", times["reading"]), ("rays", times["rays"]), ("least", least)):
        rows.append((scene.name, len(scene.frames), len(scene.atlas), name, False, None, timing.seconds,
                     timing.cpu_seconds, timing.cpu_seconds / least.cpu_seconds, None, rays))  # fmt: skip
    for name in ALTERNATIVES:
        timing, lit = times[name], times[name].value
        rows.append((scene.name, len(scene.frames), len(scene.atlas), name, name == "p2 (paper)", _error(lit, exact),
                     timing.seconds, timing.cpu_seconds, timing.cpu_seconds / least.cpu_seconds, int(lit.count.sum()),
                     rays))  # fmt: skip
    return rows


def _error(lit: LitDiffuse, exact: LitDiffuse) -> float:
    """RMS log error of L_d over the elements that are seen."""
    both = exact.seen[:, None] & (exact.radiance > 0) & (lit.radiance > 0)
    return float(np.sqrt(np.mean(np.log(lit.radiance[both] / exact.radiance[both]) ** 2)))


def _large(options: Options) -> Table:
    """The real size in a process of its own, whose peak memory is its alone."""
    task = {"count": LARGE_FRAMES, "size": LARGE_SIZE, "elements": LARGE_ELEMENTS, "seed": options.seed,
            "threads": options.threads, "out": str(options.out.resolve())}  # fmt: skip
    command = f"import sys; from {__name__} import alone; alone(sys.argv[1])"
    root = Path(__file__).resolve().parents[len(__name__.split(".")) - 1]  # where our top package lies, by any name
    done = subprocess.run(
        [sys.executable, "-c", command, json.dumps(task)], capture_output=True, text=True, cwd=root, check=True
    )
    found = json.loads(done.stdout.splitlines()[-1])
    return Table(
        "accumulation-large",
        "Accumulation at its real size, alone in its process",
        ("frames", "width", "height", "elements", "observations", "seconds", "CPU seconds", "peak memory (GiB)"),
        [
            (
                LARGE_FRAMES,
                *LARGE_SIZE,
                found["elements"],
                found["observations"],
                found["seconds"],
                found["cpu_seconds"],
                found["peak"] / 2**30,
            )
        ],  # fmt: skip
        ("Frames are made by ray casting when they are read, which is part of the time.",),
    )


def alone(task: str) -> None:
    """One accumulation of a synthetic capture by the default settings; figures as JSON on standard output."""
    given = json.loads(task)
    room = synthetic_capture(given["count"], tuple(given["size"]), given["elements"], given["seed"])
    scene = Scene("large", room.mesh, room.atlas, room.rays, room.frames, room.make)
    options = Options(seed=given["seed"], threads=given["threads"], out=Path(given["out"]))
    timing = once(lambda: _accumulate(scene, *ALTERNATIVES["default"], options))
    sys.stdout.write(json.dumps({
        "elements": len(scene.atlas), "observations": int(timing.value.count.sum()), "seconds": timing.seconds,
        "cpu_seconds": timing.cpu_seconds, "peak": peak_memory(),
    }) + "\n")  # fmt: skip
