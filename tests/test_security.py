"""What docs/security.md promises and no test of a part holds: nothing run, nothing sent, nothing written elsewhere."""

from __future__ import annotations

import ast
import os
import re
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

from addon.console import unexpected
from addon.core.errors import BadInputError
from addon.core.results.store import Store
from addon.temporary import LOCK, NAME, RunFolder, take_remains

ROOT = Path(__file__).resolve().parent.parent
SENDS = {
    "socket",
    "ssl",
    "http",
    "urllib",
    "ftplib",
    "smtplib",
    "imaplib",
    "telnetlib",
    "xmlrpc",
    "asyncio",
    "webbrowser",
}
MAY = {
    "addon/core/results/lock.py": "the machine's own name",
    "addon/core/io/self_contained.py": "undoes %20 in names",
    "addon/farm/flamenco.py": "hands rooms to the farm that the command names; not in the extension",
}


def modules():
    for folder in ("addon", "operators"):
        for path in sorted((ROOT / folder).rglob("*.py")):
            yield path.relative_to(ROOT).as_posix(), ast.parse(path.read_text(encoding="utf-8"))


def imported(tree: ast.AST):
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (one.name for one in node.names)
        elif isinstance(node, ast.ImportFrom) and not node.level:
            yield node.module


def test_nothing_is_sent():
    found = {name for name, tree in modules() for one in imported(tree) if one.split(".")[0] in SENDS}
    assert found == {name for name in MAY if (ROOT / name).exists()}


def test_nothing_that_was_read_is_run():
    """No eval, exec, unpickling, shell or template; of programs, only Blender and Python are started."""
    wrong, starts = [], set()
    for name, tree in modules():
        wrong += [(name, one) for one in imported(tree) if one.split(".")[0] in ("pickle", "marshal", "shelve", "yaml")]
        for node in ast.walk(tree):
            called = ast.unparse(node.func) if isinstance(node, ast.Call) else ""
            shell = isinstance(node, ast.Call) and any(one.arg == "shell" for one in node.keywords)
            if called in ("eval", "exec", "compile", "__import__", "os.system", "os.popen") or shell:
                wrong.append((name, called))
            if called.startswith("subprocess."):
                starts.add(name)
    assert not wrong
    assert {one for one in starts if not one.startswith("addon/farm/")} <= {
        "addon/bridge/job/job.py",
        "addon/benchmark/run.py",
        "addon/benchmark/stages.py",
        "addon/benchmark/ablation.py",
    }


def test_the_manifest_asks_for_files_alone():
    manifest = tomllib.loads((ROOT / "blender_manifest.toml").read_text(encoding="utf-8"))
    assert list(manifest["permissions"]) == ["files"]


@pytest.fixture
def precious(tmp_path):
    (tmp_path / "elsewhere").mkdir()
    (tmp_path / "elsewhere/precious").write_text("precious")
    (tmp_path / "result").mkdir()
    return tmp_path / "elsewhere/precious"


links = pytest.mark.skipif(os.name == "nt", reason="links need rights there")


@links
def test_a_lock_that_is_a_link_empties_nothing(tmp_path, precious):
    (tmp_path / "result/.lock").symlink_to(precious)
    with pytest.raises(BadInputError, match="can't be written"):
        Store(tmp_path / "result")
    assert precious.read_text() == "precious"


@links
@pytest.mark.parametrize("name", ["stages", "objects", "kept"])
def test_a_folder_of_a_result_that_is_a_link_is_refused(tmp_path, precious, name):
    (precious.parent / ".partial-1-a").write_text("precious")
    (tmp_path / "result" / name).symlink_to(precious.parent)
    with pytest.raises(BadInputError, match="is a link"):
        Store(tmp_path / "result")
    assert sorted(one.name for one in precious.parent.iterdir()) == [".partial-1-a", "precious"]


@links
@pytest.mark.parametrize("name", ["error.log", "report.json", "albedo.exr"])
def test_a_file_of_a_result_that_is_a_link_is_replaced(tmp_path, precious, name):
    import numpy as np

    link = tmp_path / "result" / name
    link.symlink_to(precious)
    with Store(tmp_path / "result") as store:
        if name == "error.log":
            unexpected(ValueError("x"), store.folder)
        elif name == "report.json":
            store.write_json(name, {})
        else:
            store.write_exr(name, np.ones((2, 2, 3)))
    assert precious.read_text() == "precious" and link.is_file() and not link.is_symlink()


# --- temporary files

KILLED = "import time, tempfile; from addon.temporary import use_own_folder; use_own_folder(); " + (
    "open(tempfile.mkstemp()[0], 'w').write('x'); print(tempfile.gettempdir(), flush=True); time.sleep(60)"
)


@pytest.mark.skipif(os.name == "nt", reason="made of fork and locks as Unix has them")
def test_what_a_killed_run_left_goes_at_the_next_start(tmp_path):
    environment = os.environ | {"TMPDIR": str(tmp_path)}
    other = subprocess.Popen(
        [sys.executable, "-c", KILLED], cwd=ROOT, env=environment, stdout=subprocess.PIPE, text=True
    )
    folder = Path(other.stdout.readline().strip())
    assert folder.parent == tmp_path and len(list(folder.iterdir())) == 2
    (tmp_path / f"{NAME}mine").mkdir()  # of another program: it has no lock
    (tmp_path / "elsewhere").mkdir()
    (tmp_path / "elsewhere" / LOCK).write_text("")
    (tmp_path / f"{NAME}link").symlink_to(tmp_path / "elsewhere")
    take_remains(tmp_path)
    assert folder.exists()  # it lives
    other.kill()
    other.communicate()
    take_remains(tmp_path)
    assert not folder.exists()
    assert (tmp_path / "elsewhere" / LOCK).exists() and (tmp_path / f"{NAME}mine").exists()


def test_a_run_takes_its_folder_away(tmp_path, monkeypatch):
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    folder = RunFolder()
    assert folder.path.parent == tmp_path and folder.environment["TMPDIR"] == str(folder.path)
    folder.close()
    assert not list(tmp_path.iterdir())


def test_no_room_for_temporary_files_is_no_reason_not_to_run(tmp_path, monkeypatch):
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path / "gone"))
    folder = RunFolder()
    assert folder.path is None and folder.environment == {}
    folder.close()


def test_what_is_promised_is_named_by_its_tests():
    """Each promise of docs/security.md names a file of tests that is there."""
    text = (ROOT / "docs/security.md").read_text(encoding="utf-8")
    named = re.findall(r"`(tests/[\w/]+\.py)`", text)
    assert len(named) > 5 and all((ROOT / one).exists() for one in named)
