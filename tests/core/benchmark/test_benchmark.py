"""The benchmark's frame: tables, files, sentences. What the stages measure is tested beside it."""

from __future__ import annotations

import csv
import json
import shutil
import types
from dataclasses import replace

import numpy as np
import pytest

from addon import cli
from addon.benchmark import run as bench
from addon.benchmark import stages
from addon.benchmark.run import Options, SkippedStage, describe_machine, run_benchmark
from addon.benchmark.table import Table
from addon.core.errors import BadInputError, InterruptedRun
from addon.core.progress import Progress
from tests.core.on_disk import CHEAP
from tests.core.rooms import cut_in_four, lit_box, make_room

COLUMNS = ("room", "alternative", "baseline", "error", "seconds", "rays")


def table(error=0.012345678) -> Table:
    rows = [
        ("box", "uniform", True, 0.5, 2.0, 10000),
        ("box", "aimed", False, np.float32(0.25), 0.000012345, np.int64(192)),
        ("box|2", "aimed", False, error, None, 16),
        ("box|2", "exact", False, 0.0, 12345.678, 16),
    ]
    return Table("toy", "A toy", COLUMNS, rows, "seconds", "error", ("One note.",))


@pytest.fixture
def toy(monkeypatch):
    """A stage 'toy' that gives one table, and one 'shy' that needs a capture."""

    def run(options):
        options.progress.update(0.5)
        return table(float(np.random.default_rng(options.seed).random()))

    def shy(options):
        if options.capture is None:
            raise SkippedStage("It needs a capture; give --capture.")
        return table()

    monkeypatch.setattr(bench, "STAGES", ("toy", "shy"))
    monkeypatch.setattr(stages, "run", lambda stage, options: {"toy": run, "shy": shy}[stage](options))
    return types.SimpleNamespace(run=run)


def test_csv_holds_full_precision(tmp_path):
    table().write_csv(tmp_path / "t.csv")
    with open(tmp_path / "t.csv", newline="") as file:
        head, *rows = csv.reader(file)
    assert tuple(head) == COLUMNS
    assert rows[1] == ["box", "aimed", "False", "0.25", "1.2345e-05", "192"]
    assert rows[2] == ["box|2", "aimed", "False", "0.012345678", "", "16"]


def test_markdown_is_rounded():
    lines = table().markdown().splitlines()
    assert lines[0] == "## A toy"
    assert lines[4] == "| box | uniform | yes | 0.5 | 2 | 10000 |"
    assert lines[5] == "| box | aimed |  | 0.25 | 1.23e-05 | 192 |"
    assert lines[6] == "| box\\|2 | aimed |  | 0.0123 |  | 16 |"
    assert lines[7] == "| box\\|2 | exact |  | 0 | 12346 | 16 |"
    assert lines[9] == "- One note."


def test_a_row_of_the_wrong_length_is_refused():
    with pytest.raises(ValueError):
        Table("toy", "A toy", ("a", "b"), [(1,)], "a", "b")


def test_files_and_index(toy, tmp_path):
    pytest.importorskip("matplotlib")
    out = tmp_path / "new" / "folder"
    results = run_benchmark([], Options(out=out, seed=3))
    assert sorted(p.name for p in out.iterdir()) == ["index.md", "toy.csv", "toy.md", "toy.png"]
    index = (out / "index.md").read_text()
    for wanted in ("cores", "seed: 3", "| box | aimed", "toy.png", "Skipped: It needs a capture", "none given"):
        assert wanted in index
    assert results["shy"].startswith("It needs") and results["toy"].title == "A toy"


@pytest.mark.slow
def test_the_same_seed_gives_the_same_files(toy, tmp_path):
    for name, seed in (("a", 1), ("b", 1), ("c", 2)):
        run_benchmark(["toy"], Options(out=tmp_path / name, seed=seed))
    files = [sorted((tmp_path / name).glob("toy.*")) for name in "abc"]
    same = [[a.read_bytes() == b.read_bytes() for a, b in zip(files[0], other, strict=True)] for other in files[1:]]
    assert all(same[0]) and not any(same[1][:2])  # the csv and the md; the row that differs is not drawn


def test_without_matplotlib_the_tables_are_written(toy, tmp_path, monkeypatch):
    monkeypatch.setattr(bench, "plots_are_possible", lambda: False)
    run_benchmark(["toy"], Options(out=tmp_path))
    assert sorted(p.name for p in tmp_path.iterdir()) == ["index.md", "toy.csv", "toy.md"]
    assert bench.NO_PLOTS in (tmp_path / "index.md").read_text()


def test_a_stopped_run_keeps_what_is_finished(toy, tmp_path, monkeypatch):
    stop = []
    progress = Progress(lambda event: stop.append(event.stage == "shy"), should_stop=lambda: any(stop))
    with pytest.raises(InterruptedRun):
        run_benchmark([], Options(out=tmp_path, capture=tmp_path, progress=progress))
    assert {"index.md", "toy.csv"} <= {p.name for p in tmp_path.iterdir()}


def test_unknown_stage_and_no_capture_folder(tmp_path):
    with pytest.raises(BadInputError, match="no benchmark 'speed'.*lit_diffuse, shading, specular"):
        run_benchmark(["speed"], Options(out=tmp_path))
    with pytest.raises(BadInputError, match="nowhere"):
        run_benchmark(["shading"], Options(out=tmp_path, capture=tmp_path / "nowhere"))


def test_command_line(toy, tmp_path, capsys):
    assert cli.main(["benchmark", "toy", "--out", str(tmp_path), "--seed", "4"]) == 0
    out = capsys.readouterr().out
    assert "| box | aimed" in out and "index.md" in out
    assert cli.main(["benchmark", "speed", "--out", str(tmp_path)]) == 2
    error = capsys.readouterr().err
    assert "choose among toy, shy" in error and error.count("\n") == 1
    assert cli.main(["benchmark", "toy", "--out", str(tmp_path), "--seed", "-1"]) == 2
    assert cli.main(["benchmark", "toy"]) == 2


def test_the_machine_is_described_without_its_name():
    import platform

    found = describe_machine()
    assert found["NumPy"] == np.__version__ and int(found["cores"]) >= 1
    assert not any(platform.node() and platform.node() in text for text in found.values())


@pytest.mark.slow
@pytest.mark.parametrize("stage", bench.STAGES)
def test_a_stage_is_measured_under_its_alternatives(stage, disk, tmp_path, monkeypatch):
    """On a capture with truth; the alternative that is the reference has no error, the paper's has one."""
    capture = tmp_path / "capture"
    shutil.copytree(disk.root, capture)
    (capture / "truth").mkdir()
    known = [{"id": i, "alpha": None if i else 0.09, "emission": None, "metallic": 0.0} for i in range(7)]
    (capture / "truth" / "materials.json").write_text(json.dumps(known))
    monkeypatch.setattr(stages, "unwrapper", lambda: disk.unwrap)
    monkeypatch.setattr(stages, "Settings", lambda **given: replace(CHEAP, **given))
    quick = {"specular_rays": 16} | ({"texel_size": 0.2} if stage == "pipeline" else {})
    few = {name: changes | quick for name, changes in stages.ALTERNATIVES[stage] if name not in ("aimed rays", "fine")}
    monkeypatch.setitem(stages.ALTERNATIVES, stage, tuple(few.items()))
    monkeypatch.setitem(stages.FINEST, "shading", {"shading_rays": 256})
    table = stages.run(stage, Options(out=tmp_path, capture=capture, threads=2))
    records = {record["alternative"]: record for record in table.records()}
    assert [name for name, record in records.items() if record["baseline"]] == [stages.PAPERS]
    errors = {name: record[stages.ERRORS[stage]] for name, record in records.items()}
    assert all(0 <= error < 1 for error in errors.values()), errors
    assert stage != "lit_diffuse" or errors["default"] == 0 < errors[stages.PAPERS]
    assert [path.name for path in tmp_path.iterdir()] == ["capture"]


def test_without_truth_the_specular_stage_is_skipped(disk, tmp_path, monkeypatch):
    monkeypatch.setattr(stages, "unwrapper", lambda: disk.unwrap)
    with pytest.raises(SkippedStage, match="truth"):
        stages.run("specular", Options(out=tmp_path, capture=disk.root))


def test_cutting_triangles_keeps_the_surface():
    mesh = make_room(lit_box(), 0.5).mesh
    cut = cut_in_four(mesh, 2)
    assert len(cut.triangles) == 16 * len(mesh.triangles)
    areas = [one.geometry[1].sum() for one in (mesh, cut)]
    assert areas[0] == pytest.approx(areas[1])
    assert np.array_equal(np.bincount(cut.object_id), 16 * np.bincount(mesh.object_id))
