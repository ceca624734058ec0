"""Each pass left out in turn, over rooms with ground truth and several seeds: what it improves, and what it costs.

For each room and seed the whole method, then the method without each pass. Stages before the first that a pass changes
are taken from the whole run's store; where that stage comes out the same without the pass, the rest does, too. One line
of JSON for each run goes to `LINES`: what the same source has done is not done again, and files of several machines can
be joined.
"""

import contextlib
import json
import shutil
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from ..core.errors import BadInputError
from ..core.io.read import read_capture
from ..core.memory import peak_memory
from ..core.passes.registry import PASSES, check, stage_of
from ..core.pipeline import corrected
from ..core.pipeline.recover import Recovery
from ..core.pipeline.source import digest
from ..core.progress import Progress
from ..core.results.store import Store
from ..core.scene.unwrap import by_xatlas
from ..core.settings import PRESETS, Settings
from ..core.stages import RUN_STAGES, STAGES, WRITE
from .rerender import rerender_psnr
from .run import make_folder
from .truth_materials import score_materials
from .truth_views import pairs, psnr, views

LINES = "ablation.jsonl"
WHOLE = ""
"""The name of no pass: the run that has all of them."""
TOGETHER = "+"
SURFACE = "surface"


@dataclass(frozen=True)
class Ablation:
    """The runs of an ablation study.

    Attributes
    ----------
    rooms : sequence of Path
        Captures with truth beside them.
    out : Path
        Folder for the lines and the stages.
    passes : sequence of str
        Empty for all. Names joined by '+' are taken out together.
    limit : float
        Seconds after which no further run is begun; 0 for none.
    unwrap : callable, optional
        Lays meshes out; where not given Blender's, or xatlas where there is no Blender.
    """

    rooms: Sequence[Path]
    out: Path
    seeds: Sequence[int] = (0, 1)
    passes: Sequence[str] = ()
    preset: str = "normal"
    threads: int = 1
    limit: float = 0.0
    unwrap: Callable | None = None
    started: float = field(default_factory=time.monotonic)

    @property
    def names(self) -> tuple[str, ...]:
        """The passes to leave out, in the registry's order, then the groups left out together."""
        check([name for entry in self.passes for name in parts(entry)])
        together = tuple(name for name in self.passes if TOGETHER in name)
        return tuple(item.name for item in PASSES if not self.passes or item.name in self.passes) + together

    @property
    def over(self) -> bool:
        return bool(self.limit) and time.monotonic() - self.started > self.limit

    def settings(self, seed: int, name: str = WHOLE) -> Settings:
        """The settings of one run."""
        return replace(PRESETS[self.preset], seed=seed, threads=self.threads, without=parts(name))


def parts(name: str) -> tuple[str, ...]:
    """The passes left out in one line: none for the whole method, several where they were left out together."""
    return tuple(name.split(TOGETHER)) if name != WHOLE else ()


def read_lines(paths: Sequence[Path]) -> list[dict[str, Any]]:
    """The runs in files of JSON lines; of a run that occurs twice, the last one counts."""
    runs = {}
    for path in paths:
        try:
            lines = path.read_text(encoding="utf-8").splitlines()
        except OSError as error:
            raise BadInputError(f"'{path}' can't be read ({error.strerror or error}).") from error
        for number, line in enumerate(lines, 1):
            try:
                run = json.loads(line)
                runs[run["room"], run["preset"], run["seed"], run["without"]] = run
            except (ValueError, KeyError, TypeError) as error:
                if number == len(lines):  # a run was stopped as it wrote
                    continue
                raise BadInputError(f"Line {number} of '{path}' is no run of the ablation.") from error
    return list(runs.values())


def run_ablation(ablation: Ablation, tell: Callable[[str], None] = lambda text: None) -> Path:
    """Do the runs that are not done yet; returns the file of lines.

    Parameters
    ----------
    tell : callable
        Gets a line for each finished run.

    Raises
    ------
    BadInputError
        A room without truth, an unknown pass, a folder that can't be written.
    """
    for room in ablation.rooms:
        if not (room / "truth" / "transforms.json").is_file():
            raise BadInputError(f"Room '{room}' has no truth/transforms.json; the ablation needs rooms with truth.")
    names = ablation.names
    make_folder(ablation.out)
    path = ablation.out / LINES
    lines = read_lines([path]) if path.exists() else []
    source = digest(Path(corrected.__file__))[:16]
    done = {(run["room"], run["preset"], run["seed"], run["without"]) for run in lines if run.get("code") == source}
    for seed in ablation.seeds:
        for room in ablation.rooms:
            todo = [name for name in (WHOLE, *names) if (room.name, ablation.preset, seed, name) not in done]
            if not todo or ablation.over:
                continue
            bench = Bench(ablation, room, seed)
            for name in todo:
                if ablation.over:
                    break
                line = bench.run(name) | {"code": source}
                with open(path, "a", encoding="utf-8") as file:
                    file.write(json.dumps(line) + "\n")
                tell(_describe(line))
    return path


def _describe(line: dict[str, Any]) -> str:
    variant = f"without {line['without']}" if line["without"] else "whole"
    same = " (no difference)" if line["same"] else ""
    figures = ", ".join(f"{name} {value:.3f}" for name, value in line["figures"].items() if value is not None)
    return f"{line['room']} seed {line['seed']} {variant}: {figures}; {sum(line['seconds'].values()):.1f} s{same}"


class Bench:
    """One room with one seed: the whole run is done or taken from the store, the others start from its stages."""

    def __init__(self, ablation: Ablation, room: Path, seed: int):
        self._ablation, self._seed, self.room = ablation, seed, room
        self._capture = read_capture(room)
        self._folder = ablation.out / "stages" / f"{room.name}-{ablation.preset}-{seed}"
        self._truth = {o["id"]: o for o in json.loads((room / "truth" / "materials.json").read_text())}
        self._views: dict[str, list[dict]] = {}
        self._whole: dict[str, Any] | None = None

    def run(self, name: str) -> dict[str, Any]:
        """The line of one run: the whole (`WHOLE`), or without a pass."""
        if name == WHOLE:
            shutil.rmtree(self._folder, ignore_errors=True)
            self._whole = self._run(WHOLE, self._folder, SURFACE)
            return self._whole
        if self._whole is None:
            self._whole = self._run(WHOLE, self._folder, SURFACE)
        folder = self._folder.with_name(f"{self._folder.name}-without")
        shutil.rmtree(folder, ignore_errors=True)
        try:
            return self._run(name, folder, min(map(stage_of, parts(name)), key=RUN_STAGES.index))
        finally:
            shutil.rmtree(folder, ignore_errors=True)

    def _run(self, name: str, folder: Path, first: str) -> dict[str, Any]:
        before = RUN_STAGES[: RUN_STAGES.index(first)]
        (folder / "stages").mkdir(parents=True, exist_ok=True)
        for stage in before:
            (folder / "stages" / f"{stage}.npz").symlink_to((self._folder / "stages" / f"{stage}.npz").resolve())
        forget_peak_memory()
        seconds, same = {}, False
        with Store(folder) as store:
            settings = self._ablation.settings(self._seed, name)
            recovery = Recovery(self._capture, store, settings, Progress(), self._ablation.unwrap or _unwrap())
            for stage in STAGES:
                started = time.process_time()
                getattr(recovery, stage)()
                if stage not in before:
                    seconds[stage] = round(time.process_time() - started, 2)
                # Of a later stage it would not do, nor for several passes: later ones may change later stages.
                if name != WHOLE and TOGETHER not in name and stage == first and self._same(stage, store):
                    same = True
                    break
            if same:
                memory, figures = peak_memory(), dict(self._whole["figures"])
            else:
                started = time.process_time()
                recovery.base_color()
                seconds[WRITE] = round(time.process_time() - started, 2)
                memory = peak_memory()
                figures = self._figures(recovery, store)
                same = name != WHOLE and figures == self._whole["figures"]
        return {
            "room": self.room.name, "preset": self._ablation.preset, "seed": self._seed, "without": name, "same": same,
            "figures": figures, "seconds": seconds, "peak_mib": None if memory is None else round(memory / 2**20),
        }  # fmt: skip

    def _same(self, stage: str, store: Store) -> bool:
        """Whether a stage's result equals that of the whole run."""
        with Store(self._folder) as whole:
            (arrays, meta), (whole_arrays, whole_meta) = (_stored(source, stage) for source in (store, whole))
        return (
            meta == whole_meta
            and arrays.keys() == whole_arrays.keys()
            and all(_equal(arrays[key], whole_arrays[key]) for key in arrays)
        )

    def _figures(self, recovery: Recovery, store: Store) -> dict[str, float | None]:
        surface = store.stored_key(SURFACE) or ""
        if surface not in self._views:
            self._views = {surface: views(self.room, recovery)}
        seen = self._views[surface]
        scores = score_materials(recovery.materials(), self._truth, pairs(seen))
        figures = {
            "albedo": psnr(seen, recovery.base_color()),
            "rerender": rerender_psnr(recovery, seen),
            "roughness_by_pixel": scores.roughness_by_pixel,
            "roughness_by_object": scores.roughness_by_object,
            "right": scores.right,
            "objects": scores.objects,
        }
        return {key: None if np.isnan(value) else round(float(value), 5) for key, value in figures.items()}


def _unwrap() -> Callable:
    try:
        from ..bridge.data.unwrap import unwrap
    except ImportError:  # a machine without Blender, as of a farm
        return by_xatlas
    return unwrap


def _stored(store: Store, stage: str) -> tuple[dict[str, np.ndarray], dict[str, Any]]:
    key = store.stored_key(stage) or ""
    return store.load(stage, key) or {}, store.load_meta(stage, key) or {}


def _equal(a: np.ndarray, b: np.ndarray) -> bool:
    return a.dtype == b.dtype and np.array_equal(a, b, equal_nan=a.dtype.kind == "f")


def forget_peak_memory() -> None:
    """Measure the peak of this process from now on, where the system can (Linux)."""
    with contextlib.suppress(OSError):
        Path("/proc/self/clear_refs").write_text("5")
