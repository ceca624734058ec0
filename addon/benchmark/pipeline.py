"""The whole pipeline: quality presets, and what more texels and triangles cost. Needs Blender, to unwrap and render."""

from __future__ import annotations

import dataclasses
import importlib.util
import shutil
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from ..core.io.read import read_capture
from ..core.kinds import Workload
from ..core.memory import peak_memory
from ..core.pipeline.recover import Recovery
from ..core.progress import Progress
from ..core.results.store import Store
from ..core.scene.model import Capture, Mesh
from ..core.settings import PRESETS, Settings
from ..core.stages import STAGES
from .run import Options, SkippedStage, room_and_scratch
from .table import BASELINE, Curves, Table
from .timing import once

PAPER_RAYS: Workload[int] = 100
"""The smaller of the paper's two settings; its 10,000 rays at each texel would take hours."""
DETAILS: Workload[tuple[float, float, float]] = (0.25, 0.5, 1.0)
"""x1, x4, x16 texels of the default size; `--large` doubles them."""
CUTS: Workload[tuple[int, int, int]] = (0, 1, 2)
"""How often every triangle is cut in four: x1, x4, x16."""


def presets() -> dict[str, Settings]:
    """The named presets, the paper's in its smaller setting."""
    return PRESETS | {"paper": dataclasses.replace(PRESETS["paper"], shading_rays=PAPER_RAYS, specular_rays=PAPER_RAYS)}


def cut_in_four(mesh: Mesh, times: int) -> Mesh:
    """The same surface with four times the triangles, `times` over."""
    for _ in range(times):
        a, b, c = (mesh.vertices[mesh.triangles[:, i]] for i in range(3))
        count, first = len(mesh.triangles), len(mesh.vertices)
        middles = np.concatenate([(a + b) / 2, (b + c) / 2, (c + a) / 2])
        ab, bc, ca = (np.arange(count, dtype=np.int32) + first + i * count for i in range(3))
        i, j, k = mesh.triangles.T
        triangles = np.stack([np.stack(t, 1) for t in ((i, ab, ca), (ab, j, bc), (ca, bc, k), (ab, bc, ca))], 1)
        mesh = Mesh(
            np.concatenate([mesh.vertices, middles]), triangles.reshape(-1, 3).astype(np.int32),
            np.repeat(mesh.object_id, 4),
        )  # fmt: skip
    return mesh


def recovered(capture: Capture, settings: Settings, folder: Path, progress: Progress) -> Recovery:
    """All stages but writing, without anything stored before."""
    from ..bridge.data.unwrap import unwrap

    shutil.rmtree(folder, ignore_errors=True)
    with Store(folder) as store:
        recovery = Recovery(capture, store, settings, progress, unwrap)
        for stage in STAGES:
            getattr(recovery, stage)()
    shutil.rmtree(folder, ignore_errors=True)
    return recovery


def run(options: Options) -> Iterator[Table]:
    """Tables of presets, of texels and of triangles."""
    if importlib.util.find_spec("bpy") is None:
        raise SkippedStage("It unwraps and renders with Blender; run it where bpy can be imported.")
    with room_and_scratch(options) as (folder, scratch):
        options.progress.update(0.2)
        yield _presets_table(folder, scratch, options)
        options.progress.update(0.6)
        yield _cost_table(read_capture(folder), scratch, options)


def _presets_table(folder: Path, scratch: Path, options: Options) -> Table:
    """Seconds and memory against what comes out."""
    from ..bridge.job.run import run as run_all
    from .scores import score

    rows = []
    chosen = presets()
    for done, name in enumerate(("draft", "normal", "fine", "paper")):  # from the least memory to the most
        settings = dataclasses.replace(chosen[name], threads=options.threads, seed=options.seed)
        result = scratch / name
        took = once(lambda: run_all(folder, result, settings, Progress()))  # noqa: B023
        found = score(folder, result)
        rows.append(
            (
                folder.name,
                name,
                name == "paper",
                took.seconds,
                took.cpu_seconds,
                peak_memory() / 2**20,
                found.albedo,
                found.albedo_error,
                found.roughness,
                found.specular,
                found.models,
                found.relight,
            )
        )
        shutil.rmtree(result, ignore_errors=True)
        options.progress.update(0.2 + 0.1 * (done + 1))
    return Table(
        "pipeline", "Whole pipeline: quality presets",
        ("capture", "preset", BASELINE, "seconds", "CPU seconds", "peak MiB", "albedo PSNR (dB)", "albedo error",
         "roughness error", "F0 error", "right models", "relight error"), rows,
        (f"'paper' with {PAPER_RAYS} uniform rays. Albedo error: root mean square over "
         "pixels of held-out views where the capture has their truth, else over objects' means. Roughness and F0: mean "
         "absolute error over truly glossy objects. Relight: root mean square of the picture under new lights in "
         "display values.", "Peak memory is this process's so far: it can only grow down the table."),
        Curves("capture", "preset", "seconds", "albedo error"),
    )  # fmt: skip


def _cost_table(capture: Capture, scratch: Path, options: Options) -> Table:
    """Seconds by stage for more texels and more triangles."""
    rows = []
    plain = Settings(threads=options.threads, seed=options.seed)
    factor = 2 if options.large else 1
    cases = [("texels", detail * factor, 0) for detail in DETAILS] + [("triangles", 0.5, cut) for cut in CUTS]
    first: dict[str, float] = {}
    for what, detail, cut in cases:
        changed = dataclasses.replace(capture, mesh=cut_in_four(capture.mesh, cut)) if cut else capture
        settings = dataclasses.replace(plain, detail=detail)
        took = once(lambda: recovered(changed, settings, scratch / "cost", Progress()))  # noqa: B023
        recovery = took.value
        seconds = [recovery.log[stage]["seconds"] for stage in STAGES]
        first.setdefault(what, took.cpu_seconds)
        rows.append(
            (
                what,
                len(recovery.surface().atlas),
                len(capture.mesh.triangles) * 4**cut,
                False,
                *seconds,
                took.cpu_seconds,
                took.cpu_seconds / first[what],
            )
        )
    return Table(
        "pipeline-cost", "Whole pipeline: cost of texels and triangles",
        ("more", "texels", "triangles", BASELINE, "surface s", "lit diffuse s", "shading s", "specular s",
         "CPU seconds", "times the first"), rows,
        ("Normal preset; the cost of frames is in the accumulation stage's table.",),
    )  # fmt: skip
