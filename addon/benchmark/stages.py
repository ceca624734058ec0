"""One stage under each of its alternatives, over the same stages before it: how wrong its result is, what it costs.

Alternatives are settings, so what is measured is what a user gets; the paper's are among them. Wrong is what differs
from the same stage under the settings of `FINEST`; of the specular stage, from the capture's truth.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from ..api import unwrapper
from ..core.io.read import read_capture
from ..core.pipeline.recover import Recovery
from ..core.progress import Progress
from ..core.results.store import Store
from ..core.settings import Settings
from ..core.stages import STAGES
from .run import Options, SkippedStage, room_and_scratch
from .table import BASELINE, Curves, Table
from .timing import Timing, once
from .truth_materials import UNTOLD, found_roughness, true_roughness

Changes = dict[str, Any]
PAPERS = "as in the paper"
ALTERNATIVES: dict[str, tuple[tuple[str, Changes], ...]] = {
    "lit_diffuse": (
        ("default", {}),
        ("exact", {"median": "exact"}),
        ("mean", {"median": "mean"}),
        (PAPERS, {"median": "p2"}),
    ),
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
}
"""Name and changed settings of each, by stage; those of one name are a line in the plot."""
ALONE: dict[str, Changes] = {"lit_diffuse": {"refine_poses": False, "sharpen": False}}
"""What is left out of a stage in all of its alternatives: the median is measured by itself."""
FINEST: dict[str, Changes] = {
    "lit_diffuse": {"median": "exact"},
    "shading": {"shading_rays": 2048, "emitter_rays": 512, "portal_rays": 512, "interpolate": False},
}
ERRORS = {
    "lit_diffuse": "RMS log error of L_d",
    "shading": "relative RMSE of E",
    "specular": "roughness error by object",
}


def run(stage: str, options: Options) -> Iterator[Table]:
    """The table of a stage of `ALTERNATIVES`."""
    with room_and_scratch(options) as (folder, scratch):
        yield Table(
            stage,
            f"{stage.replace('_', ' ').capitalize()}: its alternatives",
            ("capture", "alternative", BASELINE, "settings", ERRORS[stage], "seconds", "CPU seconds"),
            list(_rows(stage, folder, scratch, options)),
            ("Error of elements that frames saw, against the finest settings; of the specular stage, against truth.",),
            Curves("capture", "alternative", "CPU seconds", ERRORS[stage]),
        )


def _rows(stage: str, folder: Path, scratch: Path, options: Options) -> Iterator[tuple]:
    capture, unwrap = read_capture(folder), unwrapper()
    base = Settings(threads=options.threads, seed=options.seed, detail=2.0 if options.large else 1.0)
    before = STAGES[: STAGES.index(stage)]

    def under(changes: Changes) -> tuple[Recovery, Timing]:
        with Store(scratch / "stages") as store:
            store.drop([stage])
            recovery = Recovery(capture, store, replace(base, **ALONE.get(stage, {}), **changes), Progress(), unwrap)
            for one in before:
                getattr(recovery, one)()
            return recovery, once(getattr(recovery, stage))

    error = _against_truth(folder) if stage == "specular" else _against(stage, under(FINEST[stage])[0])
    for done, (name, changes) in enumerate(ALTERNATIVES[stage]):
        recovery, timing = under(changes)
        told = ", ".join(f"{key} {value}" for key, value in changes.items())
        yield folder.name, name, name == PAPERS, told, error(recovery), timing.seconds, timing.cpu_seconds
        options.progress.update((done + 1) / len(ALTERNATIVES[stage]))


def _against(stage: str, finest: Recovery) -> Callable[[Recovery], float]:
    """How far L_d or E is from that of the finest settings, where frames saw the surface."""
    seen = finest.lit_diffuse().seen

    def of_lit_diffuse(one: Recovery) -> float:
        found, true = one.lit_diffuse().radiance, finest.lit_diffuse().radiance
        both = seen[:, None] & (found > 0) & (true > 0)
        return float(np.sqrt(np.mean(np.log(found[both] / true[both]) ** 2)))

    def of_shading(one: Recovery) -> float:
        found, true = one.shading().irradiance[seen].mean(1), finest.shading().irradiance[seen].mean(1)
        lit = true > 0
        return float(np.sqrt(np.mean((found[lit] / true[lit] - 1) ** 2)))

    return {"lit_diffuse": of_lit_diffuse, "shading": of_shading}[stage]


def _against_truth(folder: Path) -> Callable[[Recovery], float]:
    """Mean absolute error of roughness over the objects that have one in truth."""
    path = folder / "truth" / "materials.json"
    if not path.is_file():
        raise SkippedStage("It needs a capture with truth/materials.json beside its frames.")
    truth = {one["id"]: true_roughness(one) for one in json.loads(path.read_text(encoding="utf-8"))}

    def error(one: Recovery) -> float:
        pairs = [(found_roughness(m), truth.get(m.object_id)) for m in one.materials()]
        off = [abs((UNTOLD if found is None else found) - true) for found, true in pairs if true is not None]
        return float(np.mean(off))

    return error
