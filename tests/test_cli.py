"""The command line: options, exit codes, sentences. Nothing here needs Blender."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from dataclasses import fields, replace
from pathlib import Path

import numpy as np
import pytest

from addon import cli
from addon.cli.common import settings_from
from addon.console import ConsoleProgress, StopSignal, duration
from addon.core.errors import BadInputError, InterruptedRun, StorageError
from addon.core.progress import Progress, ProgressEvent
from addon.core.settings import PAPER, Settings
from addon.settings_info import setting_infos
from addon.version import VERSION
from tests.core.on_disk import ALBEDO, OnDisk


def parse(*argv):
    return cli.make_parser().parse_args(["recover", "capture", "--out", "result", *argv])


def test_version(capsys):
    assert cli.main(["--version"]) == 0
    assert VERSION in capsys.readouterr().out


@pytest.mark.parametrize("argv", [["--help"], ["recover", "--help"], ["info", "--help"], ["demo", "--help"]])
def test_help_is_help(argv, capsys):
    assert cli.main(argv) == 0
    out = capsys.readouterr().out
    assert "usage" in out and "exit codes" in out


def test_help_names_every_setting_with_its_default(capsys):
    cli.main(["recover", "--help"])
    out = " ".join(capsys.readouterr().out.split())
    for info in setting_infos():
        assert f"--{info.name.replace('_', '-')}" in out
        assert info.help.split()[0] in out and f"(default {info.default})" in out


def test_every_setting_is_described():
    infos = setting_infos()
    assert [info.name for info in infos] == [field.name for field in fields(Settings) if field.name != "without"]
    assert all(info.help and not info.help.endswith(".") for info in infos)
    assert all(info.kind in (bool, int, float, str) for info in infos)


def test_passes_to_leave_out_are_collected():
    assert settings_from(parse("--without", "sun", "--without", "caustics")).without == ("sun", "caustics")


def test_no_option_gives_the_defaults():
    assert settings_from(parse()) == Settings()


def test_options_go_on_top_of_the_preset():
    given = settings_from(parse("--preset", "paper", "--shading-rays", "64", "--interpolate"))
    assert given == replace(PAPER, shading_rays=64, interpolate=True)


def test_every_option_arrives():
    given = settings_from(parse("--texel-size", "0.01", "--median", "mean", "--no-interpolate", "--seed", "7"))
    assert given == Settings(texel_size=0.01, median="mean", interpolate=False, seed=7)


@pytest.mark.parametrize(
    "argv",
    [
        [],
        ["nonsense"],
        ["recover"],
        ["recover", "capture"],
        ["recover", "c", "--out", "r", "--median", "median"],
        ["recover", "c", "--out", "r", "--shading-rays", "many"],
        ["demo"],
        ["demo", "--out", "x", "--size", "giant"],
    ],
)
def test_what_argparse_refuses_is_bad_input(argv, capsys):
    assert cli.main(argv) == 2
    err = capsys.readouterr().err
    assert err.startswith("scan-relight: ") and err.count("\n") == 1 and "--help'" in err


def test_a_setting_out_of_range_is_bad_input(tmp_path, capsys):
    assert cli.main(["recover", str(tmp_path), "--out", str(tmp_path / "out"), "--seed", "-1"]) == 2
    assert "seed" in capsys.readouterr().err


def test_info(grey_capture, capsys):
    assert cli.main(["info", str(grey_capture)]) == 0
    out = capsys.readouterr().out
    assert "3 of 32x24" in out and "papered wall" in out


def test_info_as_json(grey_capture, capsys):
    assert cli.main(["info", str(grey_capture), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["frames"] == 3


def test_segments_reach_the_reader(grey_capture, tmp_path, capsys):
    assert cli.main(["info", str(grey_capture), "--json", "--no-look", "--segments", "shape"]) == 0
    assert any("By its shape" in one for one in json.loads(capsys.readouterr().out)["warnings"])
    for given, told in (
        ("materials", "has no materials"),
        (str(tmp_path / "no.txt"), "does not exist; give --segments"),
    ):
        assert cli.main(["info", str(grey_capture), "--segments", given]) == 2
        err = capsys.readouterr().err
        assert told in err and err.count("\n") == 1


def test_info_of_nothing(tmp_path, capsys):
    assert cli.main(["info", str(tmp_path / "nowhere")]) == 2
    err = capsys.readouterr().err
    assert "nowhere" in err and "Traceback" not in err and err.count("\n") == 1


@pytest.mark.parametrize(
    "error, code",
    [
        (BadInputError("What was given is bad."), 2),
        (StorageError("The disk is full."), 1),
        (InterruptedRun("Stopped."), 130),
        (KeyboardInterrupt(), 130),
        (MemoryError(), 1),
        (ValueError("deep\ninside"), 1),
    ],
)
def test_errors_become_one_sentence_and_an_exit_code(error, code, monkeypatch, capsys, tmp_path):
    def fail(arguments, stream):
        raise error

    monkeypatch.setattr(cli.recover, "recover_command", fail)
    assert cli.main(["recover", "capture", "--out", str(tmp_path)]) == code
    out, err = capsys.readouterr()
    assert err.startswith("scan-relight: ") and err.count("\n") == 1 and "Traceback" not in err
    foreseen = not isinstance(error, ValueError)
    assert (tmp_path / "error.log").exists() != foreseen


COMMANDS = next(action for action in cli.make_parser()._actions if action.choices).choices
PATHS = [(name, action.dest) for name in COMMANDS for action in COMMANDS[name]._actions if action.type is Path]


@pytest.mark.parametrize("command, option", PATHS)
@pytest.mark.parametrize("kind", ["too long", "a link to itself"])
def test_a_path_that_no_system_looks_up_is_bad_input(command, option, kind, tmp_path, capsys):
    odd = tmp_path / ("n" * 256 if kind == "too long" else "loop")
    if kind != "too long":
        try:
            odd.symlink_to(odd)
        except OSError:
            pytest.skip("the system makes no links")
    argv = [command]
    for one in COMMANDS[command]._actions:
        if one.dest == option or one.required and one.nargs != "*":
            value = odd if one.dest == option else one.choices[0] if one.choices else tmp_path / one.dest
            argv += [*one.option_strings[:1], str(value)]
    assert cli.main(argv) == 2
    err = capsys.readouterr().err
    assert str(odd) in err and err.count("\n") == 1 and list(tmp_path.iterdir()) == [odd] * (kind != "too long")


def test_debug_shows_the_traceback(monkeypatch, capsys, tmp_path):
    def fail(arguments, stream):
        raise ValueError("deep inside")

    monkeypatch.setattr(cli.recover, "recover_command", fail)
    assert cli.main(["recover", "capture", "--out", str(tmp_path), "--debug"]) == 1
    assert "Traceback" in capsys.readouterr().err


def test_without_blender_one_sentence_says_so(tmp_path):
    """A Python that has no bpy: exit code 2, no traceback."""
    code = (
        "import sys; sys.modules['bpy'] = None\nfrom addon import cli\n"
        f"sys.exit(cli.main(['recover', {str(tmp_path)!r}, '--out', {str(tmp_path / 'out')!r}]))"
    )
    done = subprocess.run(
        [sys.executable, "-c", code],
        capture_output=True,
        text=True,
        cwd=os.path.dirname(os.path.dirname(os.path.abspath(__file__))),
    )
    assert done.returncode == 2 and "'bpy' is missing" in done.stderr and "Traceback" not in done.stderr


class Stream:
    """A text file that may claim to be a terminal."""

    def __init__(self, tty):
        self.text, self.tty = "", tty

    def write(self, text):
        self.text += text

    def flush(self):
        pass

    def isatty(self):
        return self.tty


def test_a_log_gets_whole_lines():
    stream = Stream(False)
    console = ConsoleProgress(stream)
    progress = Progress(console, weights={"read": 1, "shading": 3})
    for name in ("read", "shading"):
        progress.stage(name)
        for share in range(10):
            progress.update(share / 10)
        progress.done()
    console.close()
    lines = stream.text.splitlines()
    assert len(lines) == 4 and "\r" not in stream.text
    assert "shading" in lines[-1] and "100%" in lines[-1]


def test_a_terminal_gets_one_line_rewritten():
    stream = Stream(True)
    console = ConsoleProgress(stream)
    console(ProgressEvent("lit_diffuse", 0.0, 0.25, 75.0))
    console(ProgressEvent("lit_diffuse", 1.0, 0.5, 50.0))
    console.close()
    assert stream.text.count("\n") == 1 and stream.text.count("\r") == 2
    assert "lit diffuse" in stream.text and "1 min 15 s left" in stream.text


def test_quiet_is_quiet():
    stream = Stream(True)
    console = ConsoleProgress(stream, quiet=True)
    console(ProgressEvent("read", 0.0, 0.0, None))
    console.close()
    assert stream.text == ""


@pytest.mark.parametrize("seconds, text", [(0.4, "0 s"), (59, "59 s"), (75, "1 min 15 s"), (4200, "1 h 10 min")])
def test_durations(seconds, text):
    assert duration(seconds) == text


def test_interrupting_asks_once_and_then_insists():
    import signal

    before = signal.getsignal(signal.SIGINT)
    with StopSignal() as stop:
        assert not stop()
        signal.raise_signal(signal.SIGINT)
        assert stop()
        with pytest.raises(KeyboardInterrupt):
            signal.raise_signal(signal.SIGINT)
    assert signal.getsignal(signal.SIGINT) is before


def test_a_wished_stop_ends_the_run():
    progress = Progress(should_stop=lambda: True)
    with pytest.raises(InterruptedRun):
        progress.stage("read")


@pytest.mark.slow
@pytest.mark.once
def test_a_grey_card_fixes_the_scale_and_later_runs_heed_it(tmp_path):
    pytest.importorskip("xatlas")
    disk = OnDisk(tmp_path / "capture")
    options = "--quiet --no-scene --unwrap xatlas --texel-size 0.2 --shading-rays 64 --emitter-rays 16"
    run = ["recover", str(disk.root), "--out", str(tmp_path / "result"), *options.split()]
    for more in (["--grey", "000:20,20=0.7"], []):  # the frame's middle shows object 3
        assert cli.main([*run, *more]) == 0
        found = json.loads((tmp_path / "result/report.json").read_text())["figures"]["white_scale"]
        np.testing.assert_allclose(np.array(found) * 0.7, ALBEDO[3], rtol=0.15)
    assert json.loads((tmp_path / "result/overrides.json").read_text())["white"]["object"] == 3
