"""One stage, or all, under several alternatives: the error of the result, and its cost.

Alternatives are settings, so what is measured is what a user gets; the paper's are among them. The error is taken
against the same stage with the settings of `FINEST`; of the specular stage and of all, against the capture's truth.
"""

import gc
import json
import time
from collections.abc import Callable, Iterator
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import numpy as np

from ..api import unwrapper
from ..core.io.read import read_capture
from ..core.memory import peak_memory
from ..core.pipeline.recover import Recovery
from ..core.progress import Progress
from ..core.results.store import Store
from ..core.settings import PRESETS, Settings
from ..core.stages import STAGES
from .run import Options, SkippedStage, room_and_scratch
from .table import BASELINE, Table
from .truth_materials import true_kind, true_roughness, written_roughness
from .truth_views import psnr, views

Changes = dict[str, Any]
PAPERS = "as in the paper"
WHOLE = "pipeline"
FEW_RAYS: Changes = {"shading_rays": 100, "specular_rays": 100}
"""The smaller of the paper's two settings; its 10,000 rays at each texel would take hours."""
ALTERNATIVES: dict[str, tuple[tuple[str, Changes], ...]] = {
    "lit_diffuse": (("default", {}), ("mean", {"median": "mean"}), (PAPERS, {"median": "p2"})),
    "shading": (
        *(("aimed rays", {"shading_rays": n, "emitter_rays": n // 4, "portal_rays": n // 4}) for n in (16, 64, 256)),
        ("default", {}),
        ("default, not interpolated", {"interpolate": False}),
        *((PAPERS, {"shading": "uniform", "shading_rays": n}) for n in (100, 1000)),
    ),
    "specular": (
        *(("several frames", {"specular_rays": n}) for n in (64, 1024)),
        ("default", {}),
        (PAPERS, {"specular": "target", "refine": 0, "specular_rays": 1000}),
    ),
    WHOLE: tuple(
        (PAPERS if name == "paper" else name, asdict(preset) | (FEW_RAYS if name == "paper" else {}))
        for name, preset in PRESETS.items()
    ),
}
"""Name and changed settings of each, by stage; those of one name are a line in the plot. Of all stages: the presets."""
ALONE: dict[str, Changes] = {"lit_diffuse": {"refine_poses": False, "sharpen": False}}
"""What is left out of a stage in all of its alternatives: the median is measured by itself."""
AGAINST_TRUTH = ("specular", WHOLE)
FINEST: dict[str, Changes] = {
    "lit_diffuse": {"median": "exact"},
    "shading": {"shading_rays": 2048, "emitter_rays": 512, "portal_rays": 512, "interpolate": False},
}
ERRORS = {
    "lit_diffuse": "RMS log error of L_d",
    "shading": "relative RMSE of E",
    "specular": "roughness error by object",
    WHOLE: "roughness error by object",
}


def run(stage: str, options: Options) -> Table:
    """The table of a stage of `ALTERNATIVES`."""
    columns = ("capture", "alternative", BASELINE, "settings", ERRORS[stage], "seconds", "CPU seconds")
    notes = ("Error of elements that frames saw, against the finest settings.",)
    if stage in AGAINST_TRUTH:
        columns += ("right models", "albedo PSNR (dB)", "peak MiB")
        notes = ("Against the capture's truth; albedo where it has held-out views. Peak memory only grows downwards.",)
    with room_and_scratch(options) as (folder, scratch):
        title = f"{stage.replace('_', ' ').capitalize()}: its alternatives"
        rows = list(_rows(stage, folder, scratch, options))
    return Table(stage, title, columns, rows, "CPU seconds", ERRORS[stage], notes)


def _rows(stage: str, folder: Path, scratch: Path, options: Options) -> Iterator[tuple]:
    capture, unwrap = read_capture(folder), unwrapper()
    base = replace(Settings(**ALONE.get(stage, {})), detail=2.0 if options.large else 1.0)
    measured = STAGES if stage == WHOLE else (stage,)

    def under(changes: Changes) -> tuple[Recovery, float, float]:
        """Wall-clock seconds, and processor seconds of all threads of this process, which others disturb less."""
        with Store(scratch / "stages") as store:
            store.drop(measured)
            settings = replace(base, **changes | {"threads": options.threads, "seed": options.seed})
            recovery = Recovery(capture, store, settings, Progress(), unwrap)
            for name in STAGES[: STAGES.index(measured[0])]:
                getattr(recovery, name)()
            gc.collect()  # not in the middle, at one alternative's expense
            started, cpu_started = time.perf_counter(), time.process_time()
            for name in measured:
                getattr(recovery, name)()
            return recovery, time.perf_counter() - started, time.process_time() - cpu_started

    judge = _against_truth(folder) if stage in AGAINST_TRUTH else _against(stage, under(FINEST[stage])[0])
    for done, (name, changes) in enumerate(ALTERNATIVES[stage]):
        recovery, seconds, cpu_seconds = under(changes)
        description = "" if stage == WHOLE else ", ".join(f"{key} {value}" for key, value in changes.items())
        error, *more = judge(recovery)
        yield folder.name, name, name == PAPERS, description, error, seconds, cpu_seconds, *more
        options.progress.update((done + 1) / len(ALTERNATIVES[stage]))


def _against(stage: str, finest: Recovery) -> Callable[[Recovery], tuple]:
    """Error of L_d or E against the finest settings, where frames saw the surface."""
    seen = finest.lit_diffuse().seen

    def of_lit_diffuse(recovery: Recovery) -> tuple:
        estimate, true = recovery.lit_diffuse().radiance, finest.lit_diffuse().radiance
        both = seen[:, None] & (estimate > 0) & (true > 0)
        return (float(np.sqrt(np.mean(np.log(estimate[both] / true[both]) ** 2))),)

    def of_shading(recovery: Recovery) -> tuple:
        estimate, true = recovery.shading().irradiance[seen].mean(1), finest.shading().irradiance[seen].mean(1)
        lit = true > 0
        return (float(np.sqrt(np.mean((estimate[lit] / true[lit] - 1) ** 2))),)

    return {"lit_diffuse": of_lit_diffuse, "shading": of_shading}[stage]


def _against_truth(folder: Path) -> Callable[[Recovery], tuple]:
    """Mean absolute error of roughness, right models of all, PSNR of Base Color, and the memory that it took."""
    path = folder / "truth" / "materials.json"
    if not path.is_file():
        raise SkippedStage("It needs a capture with truth/materials.json beside its frames.")
    truth = {entry["id"]: entry for entry in json.loads(path.read_text(encoding="utf-8"))}
    has_views = (folder / "truth" / "transforms.json").is_file()

    def judge(recovery: Recovery) -> tuple:
        known = [(m, truth[m.object_id]) for m in recovery.materials() if m.object_id in truth]
        pairs = [(written_roughness(m), true_roughness(t)) for m, t in known]
        errors = [abs(estimate - true) for estimate, true in pairs if true is not None]
        right = sum(m.model.name == true_kind(t) for m, t in known)
        albedo = psnr(views(folder, recovery), recovery.base_color()) if has_views else None
        memory = peak_memory()
        return float(np.mean(errors)), f"{right} of {len(known)}", albedo, None if memory is None else memory / 2**20

    return judge
