"""The result folder: what is stored is whole, keyed, and guarded against second runs and full disks."""

from __future__ import annotations

import errno
import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from addon.core.errors import BadInputError, StorageError
from addon.core.io.exr import read_exr
from addon.core.json_values import key
from addon.core.results.store import Store
from addon.core.settings import PAPER, Settings

ROOT = Path(__file__).resolve().parents[3]
ARRAYS = {
    "albedo": np.random.default_rng(0).random((5, 3), np.float32),
    "file": np.arange(4),
    "none": np.zeros((0, 3)),
    "flag": np.array(True),
    "names": np.array(["a", "bc"]),
}


@pytest.fixture
def store(tmp_path):
    with Store(tmp_path / "deep" / "result") as one:
        yield one


def names(store) -> list[str]:
    return sorted(path.relative_to(store.folder).as_posix() for path in store.folder.rglob("*") if path.is_file())


def test_what_is_saved_is_loaded(store):
    store.save("accumulate", "k", ARRAYS, {"frames": 96, "mean": np.float32(0.5)})
    loaded = store.load("accumulate", "k")
    assert loaded.keys() == ARRAYS.keys()
    for name, array in ARRAYS.items():
        np.testing.assert_array_equal(loaded[name], array)
        assert loaded[name].dtype == array.dtype
    assert store.load_meta("accumulate", "k") == {"frames": 96, "mean": 0.5}
    assert names(store) == [".lock", "stages/accumulate.npz"]


def test_absent_or_under_another_key(store):
    store.save("accumulate", "k", ARRAYS)
    assert store.load("accumulate", "other") is None and store.load_meta("accumulate", "other") is None
    assert store.load("shading", "k") is None and store.load_meta("shading", "k") is None


def test_the_same_content_makes_the_same_file(store):
    store.save("a", "k", ARRAYS, {"x": 1})
    store.save("b", "k", ARRAYS, {"x": 1})
    assert (store.folder / "stages/a.npz").read_bytes() == (store.folder / "stages/b.npz").read_bytes()


def test_a_half_written_or_damaged_stage_is_none(store):
    store.save("a", "k", ARRAYS)
    path = store.folder / "stages/a.npz"
    whole = path.read_bytes()
    for length in range(0, len(whole), 97):
        path.write_bytes(whole[:length])
        assert store.load("a", "k") is None
    at = whole.index(ARRAYS["albedo"].tobytes()) + 8  # one byte of the pixels: only the checksum can tell
    path.write_bytes(whole[:at] + bytes([whole[at] ^ 1]) + whole[at + 1 :])
    assert store.load("a", "k") is None
    path.write_bytes(b"not an archive")
    assert store.load("a", "k") is None
    with open(path, "wb") as file:
        np.save(file, np.arange(3))  # an array, but no archive
    assert store.load("a", "k") is None


def test_objects_and_bad_names_are_the_callers_mistake(store):
    with pytest.raises(ValueError, match="objects"):
        store.save("a", "k", {"x": np.array([{}])})
    for name in ("../a", "a/b", "", "a.b"):
        with pytest.raises(ValueError, match="no name"):
            store.save(name, "k", {})
    for name in ("../a.json", "/etc/a.json"):
        with pytest.raises(ValueError, match="leads out"):
            store.write_json(name, {})
    assert names(store) == [".lock"]


def test_keys():
    one = key("upstream", Settings(), {"b": 1, "a": (1, 2)}, np.float32(2), Path("x"))
    assert one == key("upstream", Settings(), {"a": [1, 2], "b": 1}, 2.0, Path("x")) and len(one) == 64
    others = [key("upstream", PAPER), key("other"), key("upstream", Settings(seed=1)), key(), key("a", "b"), key("ab")]
    assert len({one, *others}) == 1 + len(others)
    with pytest.raises(TypeError):
        key(object())


def test_results(store):
    path = store.write_json(
        "report/run.json", {"psnr": np.float32(20), "bad": float("nan"), "ids": np.arange(2), "settings": Settings()}
    )
    told = json.loads(path.read_text())
    assert (told["psnr"], told["bad"], told["ids"], told["settings"]["refine"]) == (20, None, [0, 1], 2)
    picture = store.write_exr("textures/albedo.exr", np.full((4, 5, 3), 0.25), half=True)
    assert (read_exr(picture).rgb == 0.25).all()


# --- folders that can't be used


@pytest.mark.parametrize("name", ["file", "file/below"])
def test_a_file_in_the_way(tmp_path, name):
    (tmp_path / "file").write_text("precious")
    with pytest.raises(BadInputError, match="a file is in its way"):
        Store(tmp_path / name)
    assert (tmp_path / "file").read_text() == "precious"


def test_a_read_only_folder(tmp_path, monkeypatch):
    def refuse(self, data):
        raise PermissionError(errno.EACCES, os.strerror(errno.EACCES), str(self))

    monkeypatch.setattr(Path, "write_bytes", refuse)  # the tests may run as root, whom no mode binds
    with pytest.raises(BadInputError, match="can't be written .Permission denied"):
        Store(tmp_path)
    monkeypatch.undo()
    Store(tmp_path).close()  # the refusal left no lock behind


def test_a_read_only_disk(tmp_path, monkeypatch):
    def refuse(*args, **kwargs):
        raise OSError(errno.EROFS, os.strerror(errno.EROFS))

    monkeypatch.setattr(Path, "mkdir", refuse)
    with pytest.raises(BadInputError, match="Read-only file system"):
        Store(tmp_path / "new")


def test_a_disk_that_is_full_at_the_start(tmp_path, monkeypatch):
    def full(self, data):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(Path, "write_bytes", full)
    with pytest.raises(StorageError, match="No space left"):
        Store(tmp_path)


# --- a disk that fills up


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="the system has no /dev/full")
@pytest.mark.parametrize("write", [
    lambda store: store.save("a", "new", {"x": np.ones(100_000)}),
    lambda store: store.write_json("a.json", {"new": 1}),
    lambda store: store.write_exr("a.exr", np.ones((8, 8, 3))),
], ids=["save", "write_json", "write_exr"])  # fmt: skip
def test_a_full_disk_keeps_what_was_there(store, monkeypatch, write):
    store.save("a", "old", {"x": np.zeros(3)})
    store.write_json("a.json", {"old": 1})
    store.write_exr("a.exr", np.zeros((8, 8, 3)))
    before = {name: (store.folder / name).read_bytes() for name in names(store)}
    real = open

    def full(path, *args, **kwargs):
        # /dev/full fails as a full disk does: some writes pass into the buffer, a later one does not.
        target = "/dev/full" if ".partial-" in str(path) else path
        if target != path:
            Path(path).touch()
        return real(target, *args, **kwargs)

    monkeypatch.setattr("builtins.open", full)
    with pytest.raises(StorageError, match="No space left") as caught:
        write(store)
    monkeypatch.undo()
    assert str(caught.value).count("\n") == 0
    assert {name: (store.folder / name).read_bytes() for name in names(store)} == before


def test_an_interrupt_leaves_no_remains(store, monkeypatch):
    def stop(fd):
        raise KeyboardInterrupt

    monkeypatch.setattr(os, "fsync", stop)
    with pytest.raises(KeyboardInterrupt):
        store.save("a", "k", ARRAYS)
    assert names(store) == [".lock"]


# --- what other machines and programs do to files


@pytest.mark.parametrize("held", [1, 3, 9])
def test_a_file_that_a_scanner_holds_open_is_tried_again(store, monkeypatch, held):
    from addon.core import atomic

    tries, real = [], os.replace

    def replace(*paths):
        tries.append(paths)
        if len(tries) <= held:
            raise PermissionError(errno.EACCES, "The process cannot access the file")
        real(*paths)

    monkeypatch.setattr(atomic, "HELD_OPEN", True)
    monkeypatch.setattr(atomic, "PAUSES", (0.001,) * 5)
    monkeypatch.setattr(os, "replace", replace)
    if held < 6:
        store.write_json("a.json", {})
        assert store.path("a.json").exists()
    else:
        with pytest.raises(StorageError, match="cannot access"):
            store.write_json("a.json", {})


def test_a_stale_handle_of_a_network_disk(store, monkeypatch):
    """Read: the stage is done anew, and said. Written: one sentence."""
    store.save("a", "k", ARRAYS)
    real, stale = open, OSError(errno.ESTALE, os.strerror(errno.ESTALE))

    def refuse(path, *args, **kwargs):
        if str(path).endswith("a.npz"):
            raise stale
        return real(path, *args, **kwargs)

    monkeypatch.setattr("builtins.open", refuse)
    assert store.load("a", "k") is None and store.damaged == ["a"]
    with pytest.raises(StorageError, match="[Ss]tale"):
        store.save("a", "k", ARRAYS)


@pytest.mark.skipif(os.name == "nt", reason="descriptors are counted otherwise")
def test_no_free_descriptors(tmp_path):
    code = """
import os, resource, sys
from addon.core.errors import ScanRelightError
from addon.core.results.store import Store
store = Store(sys.argv[1])
resource.setrlimit(resource.RLIMIT_NOFILE, (16, 16))
held = []
try:
    while True:
        held.append(os.open(os.devnull, os.O_RDONLY))
except OSError:
    pass
try:
    store.write_json("a.json", {})
except ScanRelightError as error:
    print(error)
"""
    done = subprocess.run([sys.executable, "-c", code, str(tmp_path)], cwd=ROOT, capture_output=True, text=True)
    assert "Too many open files" in done.stdout and not done.stderr, done.stderr


# --- two runs, dead runs


def test_two_runs_at_once(tmp_path):
    with Store(tmp_path):
        with pytest.raises(BadInputError, match=f"another run .process {os.getpid()}"):
            Store(tmp_path)
    Store(tmp_path).close()


KILLED = """
import os, sys, time
from addon.core.results.store import Store
store = Store(sys.argv[1])
(store.folder / "stages" / ".partial-1-a.npz").write_bytes(b"half")
print("ready", flush=True)
time.sleep(60)
"""


def test_a_killed_run_leaves_no_lock_and_its_remains_go(tmp_path):
    with subprocess.Popen([sys.executable, "-c", KILLED, str(tmp_path)], cwd=ROOT, stdout=subprocess.PIPE) as other:
        assert other.stdout.readline() == b"ready\n"
        with pytest.raises(BadInputError, match=f"process {other.pid}"):
            Store(tmp_path)
        other.kill()
    with Store(tmp_path) as store:
        assert names(store) == [".lock"]


def test_a_disk_without_locks(tmp_path, monkeypatch):
    fcntl = pytest.importorskip("fcntl")

    def no_locks(file, how):
        raise OSError(errno.ENOLCK, os.strerror(errno.ENOLCK))

    monkeypatch.setattr(fcntl, "flock", no_locks)
    Store(tmp_path).close()
