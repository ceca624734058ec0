"""Bad input through the command line, from end to end: the right exit code and one sentence, or a finished run with a
warning; never a traceback, never a half-written file taken for a whole one."""

from __future__ import annotations

import errno
import json
import os
import re
import shutil
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("bpy")

from addon import cli
from addon.bridge.scene import write as scene_module
from addon.core import atomic
from addon.core.io.exr import read_exr, write_exr
from addon.core.io.ply import read_ply

QUICK = "--shading-rays 8 --specular-rays 2 --emitter-rays 2 --refine 0 --texel-size 0.2 --atlas-size 256".split()
FRAMES = 10
IMAGES = {"albedo", "albedo_error", "base_color", "coverage", "environment", "evidence", "lit_diffuse", "shading"}
RESULTS = {f"{name}.exr" for name in IMAGES} | {
    "capture.json", "materials.json", "report.html", "report.json", "room.npz", "scene.blend"
}  # fmt: skip
STAGES = ("surface", "lit_diffuse", "shading", "specular")


@pytest.fixture
def capture(tiny_capture, tmp_path) -> Path:
    """A copy of the rendered capture, to be broken."""
    return Path(shutil.copytree(tiny_capture, tmp_path / "capture"))


@pytest.fixture(scope="module")
def finished(tiny_capture, tmp_path_factory) -> Path:
    """What a good run of the capture leaves."""
    out = tmp_path_factory.mktemp("finished") / "out"
    assert cli.main(["recover", str(tiny_capture), "--out", str(out), *QUICK]) == 0
    return out


@pytest.fixture
def recover(capture, tmp_path, capsys):
    """Run `recover` within this process: `recover(*options, out=)` gives the exit code and standard error."""

    def run(*options, out=tmp_path / "out"):
        capsys.readouterr()
        code = cli.main(["recover", str(capture), "--out", str(out), *QUICK, *options])
        err = capsys.readouterr().err
        assert "Traceback" not in err and "Unexpected" not in err
        assert err == "" if code == 0 else err.startswith("scan-relight: ") and err.count("\n") == 1
        return code, err

    return run


def command(*arguments) -> list[str]:
    """The program as a process of its own."""
    return [sys.executable, "-c", "import sys; from addon.cli import main; sys.exit(main())", *map(str, arguments)]


def files(folder: Path) -> set[str]:
    """All files of a result folder but its lock, by their path in it."""
    return {path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.is_file()} - {".lock"}


def warnings_of(out: Path) -> str:
    return "\n".join(json.loads((out / "report.json").read_text())["warnings"])


def whole(out: Path) -> bool:
    """Whether everything is there, and nothing else."""
    return files(out) == RESULTS | {f"stages/{name}.npz" for name in STAGES}


def finished_stages(out: Path) -> list[str]:
    return [name for name in STAGES if (out / "stages" / f"{name}.npz").exists()]


# How to break a capture.


def picture(capture, k=2):
    return capture / "images" / f"frame_{k:04d}.exr"


def cut(capture, share):
    content = picture(capture).read_bytes()
    picture(capture).write_bytes(content[: int(share * len(content))])


def garble(capture, k=2):
    """Damage that only decoding finds: the header and the length are as they should be."""
    content = bytearray(picture(capture, k).read_bytes())
    middle = len(content) // 2
    content[middle : middle + 400] = bytes(200) + b"\xff" * 200
    picture(capture, k).write_bytes(content)


def paint(capture, value, k=2, where=np.s_[:]):
    rgb = read_exr(picture(capture, k)).rgb.copy()
    rgb[where] = value
    write_exr(picture(capture, k), rgb)


def poses(capture, change, which=(2,)):
    """Change the 4 x 4 matrices of some frames."""
    path = capture / "transforms.json"
    transforms = json.loads(path.read_text())
    for k in which:
        frame = transforms["frames"][k]
        frame["transform_matrix"] = change(np.array(frame["transform_matrix"])).tolist()
    path.write_text(json.dumps(transforms))


def keep(capture, count):
    path = capture / "transforms.json"
    transforms = json.loads(path.read_text())
    transforms["frames"] = transforms["frames"][:count]
    path.write_text(json.dumps(transforms))


def mesh(capture, change):
    """Rewrite the mesh with what `change` makes of vertices, triangles and object_id."""
    ply = read_ply(capture / "mesh.ply")
    vertices, triangles, ids = change(ply.vertices.copy(), ply.triangles.copy(), ply.object_id.copy())
    record = np.empty(len(triangles), [("n", "u1"), ("v", "<i4", 3), *([("o", "<i4")] if ids is not None else [])])
    record["n"], record["v"] = 3, triangles
    if ids is not None:
        record["o"] = ids
    header = (
        f"ply\nformat binary_little_endian 1.0\nelement vertex {len(vertices)}\nproperty float x\n"
        f"property float y\nproperty float z\nelement face {len(triangles)}\n"
        "property list uchar int vertex_indices\n"
        + ("property int object_id\n" if ids is not None else "")
        + "end_header\n"
    )
    (capture / "mesh.ply").write_bytes(header.encode() + vertices.astype("<f4").tobytes() + record.tobytes())


def far_object(capture):
    """An object that no frame sees."""
    path = capture / "info_semantic.json"
    semantic = json.loads(path.read_text())
    semantic["objects"].append({"id": 99, "class_name": "attic"})
    path.write_text(json.dumps(semantic))
    corner = np.float32([[1, 1, 9], [2, 1, 9], [1, 2, 9]])
    mesh(
        capture,
        lambda v, t, o: (np.concatenate([v, corner]), np.concatenate([t, [np.arange(3) + len(v)]]), np.append(o, 99)),
    )


def unlabelled(v, t, o):
    o[:4] = -1
    return v, t, o


def infinite_corner(v, t, o):
    v[3] = np.inf
    return v, t, o


MIRROR = np.diag([-1.0, 1, 1, 1])
ALL = range(FRAMES)

FINISHED = {
    "a frame is missing": (lambda c: picture(c).unlink(), "1 of 10 frames .*frame_0002.exr' does not exist"),
    "a frame ends in its pixels": (lambda c: cut(c, 0.6), "is cut off"),
    "a frame's pixels are damaged": (garble, "is damaged .*left out"),
    "a pose is mirrored": (lambda c: poses(c, lambda m: m @ MIRROR), "mirrored"),
    "triangles without area": (
        lambda c: mesh(c, lambda v, t, o: (v, np.concatenate([t, [[0, 0, 1], [2, 2, 2]]]), np.append(o, [0, 0]))),
        "2 triangles .*no area",
    ),
    "a corner is not finite": (lambda c: mesh(c, infinite_corner), "not finite"),
    "faces without object": (lambda c: mesh(c, unlabelled), "4 of .* belong to no object"),
    "no face has an object": (lambda c: mesh(c, lambda v, t, o: (v, t, None)), "Nothing tells the mesh.s objects"),
    "no frame sees an object": (far_object, r"No frame sees attic 99"),
    "a single frame": (lambda c: keep(c, 1), "a single frame"),
}
UNTOLD = {
    "some pixels are NaN, infinite or negative": lambda c: [
        paint(c, value, k, np.s_[5:9, 5:9]) for k, value in enumerate((np.nan, np.inf, -1))
    ],
    "a frame is all NaN and one all inf": lambda c: [paint(c, value, k) for k, value in enumerate((np.nan, np.inf))],
    "all frames are black": lambda c: [paint(c, 0, k) for k in ALL],
}
REFUSED = {
    "most frames are missing": (lambda c: [picture(c, k).unlink() for k in range(5)], "5 bad frames of 10"),
    "most frames are damaged": (lambda c: [garble(c, k) for k in range(5)], "frames can't be read"),
    "all frames are NaN": (lambda c: [paint(c, np.nan, k) for k in ALL], "all pixels are invalid"),
    "all poses are elsewhere": (
        lambda c: poses(c, lambda m: m + 1000 * np.eye(4, k=3), ALL),
        "No camera of the capture looks at the mesh",
    ),
    "poses that are no JSON": (lambda c: (c / "transforms.json").write_text('{"frames": ['), "not valid JSON"),
    "no capture": (shutil.rmtree, "does not exist"),
}


@pytest.mark.slow
@pytest.mark.once  # what is wrong with a capture is the core's matter
@pytest.mark.parametrize("name", FINISHED)
def test_a_run_goes_on_and_tells(name, capture, recover, tmp_path):
    change, told = FINISHED[name]
    change(capture)
    assert recover() == (0, "")
    assert whole(tmp_path / "out")
    assert re.search(told, warnings_of(tmp_path / "out")), warnings_of(tmp_path / "out")
    assert np.isfinite(read_exr(tmp_path / "out" / "albedo.exr").rgb).all()


@pytest.mark.slow
@pytest.mark.once  # what is wrong with a capture is the core's matter
@pytest.mark.parametrize("name", UNTOLD)
def test_pixels_that_say_nothing_do_no_harm(name, capture, recover, tmp_path):
    UNTOLD[name](capture)
    assert recover() == (0, "")
    assert whole(tmp_path / "out")
    for image in IMAGES:
        assert np.isfinite(read_exr(tmp_path / "out" / f"{image}.exr").rgb).all(), image
    albedo = read_exr(tmp_path / "out" / "albedo.exr").rgb
    assert 0 <= albedo.min() and albedo.max() <= 1


@pytest.mark.slow
@pytest.mark.once  # what is wrong with a capture is the core's matter
@pytest.mark.parametrize("name", REFUSED)
def test_a_capture_is_refused(name, capture, recover, tmp_path):
    change, told = REFUSED[name]
    change(capture)
    code, err = recover()
    assert code == 2 and re.search(told, err), err
    if (tmp_path / "out").exists():
        # capture.json says whose folder it is; the next run goes on there.
        assert files(tmp_path / "out") <= {"capture.json", *(f"stages/{name}.npz" for name in STAGES)}


@pytest.mark.parametrize(
    "options, told",
    [
        (("--bogus",), "Unrecognized arguments: --bogus"),
        (("--median", "middle"), "invalid choice"),
        (("--shading-rays", "many"), "invalid int value"),
        (("--seed", "-3"), "of at least 0"),
        (("--texel-size", "nan"), "texel_size"),
        (("--shading-rays", "0"), "at least 1"),
    ],
)
def test_a_bad_option_is_refused(options, told, recover, tmp_path):
    code, err = recover(*options)
    assert code == 2 and told in err
    assert not (tmp_path / "out").exists()


def test_a_capture_is_no_result_folder(capture, recover):
    before = files(capture)
    code, err = recover(out=capture)
    assert code == 2 and "is the capture itself" in err and files(capture) == before


@pytest.mark.parametrize("below", ["", "deeper"])
def test_a_file_in_the_way(below, recover, tmp_path):
    (tmp_path / "file").write_text("mine")
    code, err = recover(out=tmp_path / "file" / below)
    assert code == 2 and "a file is in its way" in err
    assert (tmp_path / "file").read_text() == "mine"


def test_a_folder_that_may_not_be_written(recover, tmp_path, monkeypatch):
    """A stand-in for permissions: tests may run as root, whom no permission stops."""

    def refuse(self, content):
        raise PermissionError(errno.EACCES, os.strerror(errno.EACCES), str(self))

    monkeypatch.setattr(Path, "write_bytes", refuse)
    code, err = recover()
    assert code == 2 and "Permission denied" in err and "choose one that you may write" in err


def test_a_folder_in_use(recover, tmp_path):
    from addon.core.results.store import Store

    with Store(tmp_path / "out"):
        code, err = recover()
    assert code == 2 and "being written by another run" in err


NO_SPACE = OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))


@pytest.mark.slow
@pytest.mark.parametrize(
    "full_at, done", [("lit_diffuse.npz", 1), ("specular.npz", 3), ("coverage.exr", 4), ("report.json", 4)]
)
def test_a_disk_that_gets_full(full_at, done, recover, tmp_path, monkeypatch):
    """What was finished is kept, and the next run goes on from it."""
    out, replace = tmp_path / "out", os.replace

    def full(source, target):
        if Path(target).name == full_at:
            raise NO_SPACE
        replace(source, target)

    monkeypatch.setattr(atomic.os, "replace", full)
    code, err = recover()
    assert code == 1 and f"{full_at}' can't be written (No space left on device)" in err
    assert finished_stages(out) == list(STAGES[:done])
    assert not (out / "report.json").exists() and not any(".partial" in name for name in files(out))
    assert (out / "scene.blend").exists() == (full_at == "report.json")
    monkeypatch.undo()
    assert recover() == (0, "") and whole(out)
    stages = json.loads((out / "report.json").read_text())["stages"]
    assert [stages[name]["stored"] for name in STAGES] == [k < done for k in range(4)]


def test_a_disk_that_is_full_of_observations(recover, tmp_path, monkeypatch):
    from addon.core.lit_diffuse.medians import Exact

    def full(self):
        raise OSError("1000 requested and 12 written")  # numpy's words for a full disk

    monkeypatch.setattr(Exact, "HELD", 100)
    monkeypatch.setattr(Exact, "_flush", full)
    code, err = recover("--median", "exact")
    assert code == 1 and "free some space" in err
    assert files(tmp_path / "out") == {"capture.json", "stages/surface.npz"}
    assert not list((tmp_path / "out").glob("tmp-*"))


@pytest.mark.slow
@pytest.mark.parametrize("share", [0.0, 0.99])
def test_half_a_scene_is_never_taken_for_a_whole_one(share, finished, recover, tmp_path, monkeypatch):
    """Blender does not notice that a disk is full; the program does, and takes the last run's scene away too."""
    out, save = tmp_path / "out", scene_module._save

    def half(name, *others):
        save(name, *others)
        os.truncate(name, int(share * os.path.getsize(name)))

    shutil.copytree(finished, out)
    monkeypatch.setattr(scene_module, "_save", half)
    code, err = recover()
    assert code == 1 and "scene.blend can't be saved (No space left on device)" in err
    assert files(out) == RESULTS - {"scene.blend", "report.json"} | {f"stages/{name}.npz" for name in STAGES}
    monkeypatch.undo()
    assert recover() == (0, "") and whole(out)


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="mounts a small file system")
@pytest.mark.parametrize("left", ["a third", "all but a bit of the scene"])
def test_a_disk_that_is_really_full(left, finished, recover, tmp_path):
    sizes = {name: (finished / name).stat().st_size for name in files(finished)}
    room = (
        sum(sizes.values()) // 3
        if left == "a third"
        else sum(-(-size // 4096) * 4096 for size in sizes.values()) - sizes["scene.blend"] // 4
    )
    disk = tmp_path / "disk"
    disk.mkdir()
    mount = ["mount", "-t", "tmpfs", "-o", f"size={room // 4096 * 4}k", "tmpfs", disk]
    if not shutil.which("mount") or subprocess.run(mount, capture_output=True).returncode:
        pytest.skip("file systems can't be mounted here")
    try:
        code, err = recover(out=disk / "out")
        assert code == 1 and "No space left on device" in err
        assert not files(disk / "out") & {"scene.blend", "report.json"}
        assert all(".partial" not in name and "being-written" not in name for name in files(disk / "out"))
    finally:
        subprocess.run(["umount", "--lazy", disk], check=True)


def test_the_memory_is_used_up(recover, monkeypatch):
    from addon.core.pipeline.recover import Recovery

    def too_much(self):
        raise MemoryError

    monkeypatch.setattr(Recovery, "shading", too_much)
    code, err = recover()
    assert code == 1 and "memory is used up" in err


@pytest.mark.slow
def test_a_stage_that_was_damaged_is_done_again(finished, recover, tmp_path):
    shutil.copytree(finished, tmp_path / "out")
    stage = tmp_path / "out" / "stages" / "shading.npz"
    stage.write_bytes(stage.read_bytes()[:-1000])
    assert recover() == (0, "") and whole(tmp_path / "out")
    stages = json.loads((tmp_path / "out" / "report.json").read_text())["stages"]
    assert [stages[name]["stored"] for name in STAGES] == [True, True, False, True]


@pytest.mark.slow
def test_interrupted_in_the_middle_and_gone_on(capture, tmp_path, root):
    out = tmp_path / "out"
    options = "--shading-rays 2048 --no-interpolate --specular-rays 2 --refine 0 --texel-size 0.1".split()
    slow = command("recover", capture, "--out", out, *options)
    process = subprocess.Popen(slow, cwd=root, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    for line in process.stdout:
        if line.startswith("shading"):
            process.send_signal(signal.SIGINT)
            break
    _, err = process.communicate(timeout=120)
    assert process.returncode == 130
    assert err == (
        "scan-relight: Stopped on request; the finished stages are kept and the next run goes on from them.\n"
    )
    assert files(out) == {"capture.json", "stages/surface.npz", "stages/lit_diffuse.npz"}
    quick = [word if word != "2048" else "8" for word in slow]
    done = subprocess.run(quick, cwd=root, capture_output=True, text=True)
    assert done.returncode == 0 and done.stderr == "" and whole(out)
    stages = json.loads((out / "report.json").read_text())["stages"]
    assert [stages[name]["stored"] for name in STAGES] == [True, True, False, False]


@pytest.mark.slow
def test_the_console_is_the_programs_own(capture, tmp_path, root):
    """Neither Blender's chatter nor OpenEXR's remarks on damaged pixels; a warning is told at the end."""
    garble(capture)
    done = subprocess.run(
        command("recover", capture, "--out", tmp_path / "out", *QUICK), cwd=root, capture_output=True, text=True
    )
    assert done.returncode == 0 and done.stderr == ""
    lines = done.stdout.splitlines()
    told = [line for line in lines if "   whole " not in line]
    assert told[-1].startswith("Done in ") and all(line.startswith("Warning: ") for line in told[:-1])
    assert any("is damaged" in line for line in told)
