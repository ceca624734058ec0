"""What the panels Capture and Recover show in every state, and that what they offer does what it says."""

from __future__ import annotations

import json
import shutil
import sys
import time
from pathlib import Path

import pytest

bpy = pytest.importorskip("bpy")

PANELS = (("recover.panel_capture", "SCAN_RELIGHT_PT_capture"), ("recover.panel_recover", "SCAN_RELIGHT_PT_recover"))
DEAF = [sys.executable, "-c", "import time; time.sleep(60)"]
TELLS = (
    'print(\'{"event": "progress", "stage": "shading", "share": 0.42, "overall": 0.5, '
    '"seconds_left": 125.0}\', flush=True)\n'
)


@pytest.fixture
def panels(module):
    return [getattr(module(f"operators.{name}"), cls) for name, cls in PANELS]


@pytest.fixture
def capture(module):
    return module("operators.recover.panel_capture").SCAN_RELIGHT_PT_capture


@pytest.fixture
def recover(module):
    return module("operators.recover.panel_recover").SCAN_RELIGHT_PT_recover


@pytest.fixture
def choices(ops):
    return bpy.context.scene.scan_relight


@pytest.fixture
def begin(module):
    """Begin a job as an operator would, and wait until it was heard of or has ended."""
    jobs = module("addon.bridge.job.job")

    def begun(code, phase="run", **facts):
        job = jobs.begin([sys.executable, "-c", code], phase=phase, title="Recover", **facts)
        end = time.monotonic() + 30
        while job.running and not job.stage and time.monotonic() < end:
            time.sleep(0.02)
        return job

    return begun


def test_register_twice_and_back(package):
    assert hasattr(bpy.types.Scene, "scan_relight")
    package.unregister()
    assert not hasattr(bpy.types.Scene, "scan_relight") and not hasattr(bpy.types, "SCAN_RELIGHT_PT_capture")
    package.register()
    assert hasattr(bpy.types.Scene, "scan_relight") and hasattr(bpy.types, "SCAN_RELIGHT_PT_recover")


def test_the_parts_are_in_the_order_of_the_work(panels):
    assert [panel.bl_order for panel in panels] == [0, 1]
    assert {(panel.bl_space_type, panel.bl_region_type, panel.bl_category) for panel in panels} == {
        ("VIEW_3D", "UI", "Scan Relight")
    }


@pytest.mark.parametrize("open_panels", [True, False])
@pytest.mark.parametrize("width", [300, 90, 1200])
def test_nothing_chosen(draw, panels, open_panels, width):
    words = " ".join(draw(panel, open_panels, width).text for panel in panels)
    assert "Choose the folder of a scan" in words or width == 90
    assert not bpy.ops.scan_relight.run.poll() and not bpy.ops.scan_relight.check_capture.poll()


def test_what_was_found_is_shown(draw, capture, choices, grey_capture):
    choices.capture_folder = str(grey_capture)
    assert "Check" in draw(capture).words
    assert bpy.ops.scan_relight.check_capture() == {"FINISHED"}
    shown = draw(capture)
    assert "Check Again" in shown.words and "3 frames (nerfstudio): 3 of 32x24" in shown.text
    assert "15 objects" in shown.words and "and 3 more" in shown.words and "Nothing is wrong with it." in shown.text
    choices.capture_folder = str(grey_capture.parent)
    assert "15 objects" not in draw(capture).words, "of another folder nothing is known"


def test_problems_are_told_whole(draw, capture, choices, grey_capture, tmp_path):
    """Each with its fix, over as many lines as it takes."""
    broken = shutil.copytree(grey_capture, tmp_path / "capture")
    (broken / "mesh.ply").write_bytes(b"")
    choices.capture_folder = str(broken)
    with pytest.raises(RuntimeError) as told:
        bpy.ops.scan_relight.check_capture()
    sentence = str(told.value).removeprefix("Error: ").strip()
    shown = draw(capture, width=200)
    assert sentence.replace(" ", "") in shown.text.replace(" ", "")
    assert max(len(line) for line in shown.words) < len(sentence)


def test_a_warning_is_shown(draw, capture, choices, grey_capture, tmp_path):
    odd = shutil.copytree(grey_capture, tmp_path / "capture")
    transforms = json.loads((odd / "transforms.json").read_text())
    transforms["frames"] = transforms["frames"][:1]
    (odd / "transforms.json").write_text(json.dumps(transforms))
    choices.capture_folder = str(odd)
    bpy.ops.scan_relight.check_capture()
    assert "The capture has a single frame" in draw(capture).text


def test_facts_of_further_readers_are_shown(draw, capture, choices, module):
    choices.capture_folder = "/somewhere"
    module("operators.recover.findings").put(
        choices,
        {
            "frames": 2,
            "warnings": [],
            "proposals": ["Give --transfer srgb."],
            "scale": "unknown",
            "nested": {"left": "out"},
        },
    )
    assert "Give --transfer srgb." in draw(capture).text and "Scale: unknown" in draw(capture).text


@pytest.mark.slow
def test_a_check_beside_the_window(draw, capture, choices, module, grey_capture):
    findings = module("operators.recover.findings")
    choices.capture_folder = str(grey_capture)
    findings.begin(choices)
    assert "Reading the capture" in draw(capture).words
    end = time.monotonic() + 60
    while not isinstance(findings.look(choices), dict) and time.monotonic() < end:
        time.sleep(0.05)
    assert "15 objects" in draw(capture).words


def test_every_setting_has_its_place(draw, recover, module):
    from addon.settings_info import setting_infos

    placed = [name for _, names in module("operators.recover.panel_recover").groups() for name in names]
    assert sorted(placed) == sorted(info.name for info in setting_infos())
    words, labels = draw(recover).words, module("operators.recover.settings_words").words
    assert all(labels(info)[0] in words for info in setting_infos())


@pytest.fixture
def chosen(choices, module):
    """The settings as a run gets them."""
    props = module("operators.recover.settings_props")
    return lambda: props.Settings(
        **{info.name: props.setting_value(choices.settings, info) for info in props.setting_infos()}
    )


def test_a_preset_fills_the_settings(choices, chosen):
    from addon.core.settings import PRESETS

    for name, preset in PRESETS.items():
        choices.settings.threads, choices.settings.seed = 3, 7
        choices.preset = name
        value = chosen()
        assert (value.detail, value.shading_rays, value.median) == (preset.detail, preset.shading_rays, preset.median)
        assert (value.threads, value.seed) == (3, 7) and choices.settings.changed(name) == []
    choices.settings.texel_size = 0.12
    assert chosen().texel_size == 0.12 and choices.settings.changed("paper") == ["texel_size"]


def test_a_run_is_shown_with_stage_share_and_time(draw, recover, begin, choices):
    choices.capture_folder = "/somewhere"
    begin(TELLS + "import time; time.sleep(60)")
    shown = draw(recover)
    [(factor, text)] = shown.bars
    assert factor == 0.5 and text.startswith("Light and albedo 42%, 2 min 0") and text.endswith(" left")
    assert "scan_relight.stop" in shown.buttons and "scan_relight.run" not in shown.buttons
    assert not bpy.ops.scan_relight.run.poll() and bpy.ops.scan_relight.stop.poll()


@pytest.mark.parametrize(
    ("code", "said"),
    [
        ("import sys; sys.exit('scan-relight: The mesh is empty; scan again.')", "The mesh is empty; scan again."),
        ("import sys; sys.exit(130)", "Stopped; the finished stages are kept"),
        ('print(\'{"event": "warning", "text": "This was odd."}\')', "This was odd."),
        ("", "Recover: done in"),
    ],
)
def test_the_outcome_is_shown(draw, recover, begin, choices, code, said):
    choices.capture_folder = "/somewhere"
    job = begin(code, phase="end", result_folder="/there", until="write")
    job.wait(30)
    shown = draw(recover)
    assert said in shown.text and "scan_relight.run" in shown.buttons and not shown.bars


def test_run_hands_over_what_was_chosen(choices, module, monkeypatch, tmp_path):
    asked = []
    monkeypatch.setattr(
        module("addon.bridge.job.run"),
        "run",
        lambda capture, result, settings, progress, what, **where: (
            asked.append((capture, result, settings, what)) or {"warnings": []}
        ),
    )
    monkeypatch.setattr(module("addon.core.results.room_file"), "read_room", lambda folder: None)
    monkeypatch.setattr(module("operators.recover.settings_props"), "whole", lambda slices: ())  # there is no result
    monkeypatch.setenv("HOME", str(tmp_path / "me"))
    monkeypatch.delenv("XDG_CONFIG_HOME", raising=False)
    choices.capture_folder, choices.preset = str(tmp_path / "room"), "draft"
    choices.settings.texel_size = 0.12
    assert bpy.ops.scan_relight.run(from_stage="shading") == {"FINISHED"}
    [(capture, result, settings, what)] = asked
    from dataclasses import asdict, replace

    from addon.core.settings import DRAFT

    assert asdict(settings) == asdict(replace(DRAFT, texel_size=0.12))
    assert capture == str(tmp_path / "room") and (what.until, what.from_stage) == ("write", "shading")
    assert result == str(tmp_path / "me" / "Scan Relight" / "room")
    choices.result_folder = str(tmp_path / "mine")
    bpy.ops.scan_relight.run()
    assert asked[-1][1] == str(tmp_path / "mine")


def test_choices_of_older_files_are_what_they_were(choices, chosen):
    """A choice that has gone is the default; the others have not moved up."""
    settings = choices.settings
    own = settings.bl_system_properties_get(do_create=True) if bpy.app.version >= (5, 0) else settings
    for number, name in ((0, "exact"), (1, "exact"), (2, "exact"), (3, "p2"), (4, "mean")):
        own["median"] = number
        assert chosen().median == name


def test_run_tells_what_goes_wrong_once(choices, tmp_path):
    choices.capture_folder, choices.result_folder = str(tmp_path / "nowhere"), str(tmp_path / "result")
    with pytest.raises(RuntimeError, match="nowhere' does not exist") as told:
        bpy.ops.scan_relight.run()
    assert str(told.value).count("does not exist") == 1


def test_no_state_of_a_run_is_saved(begin, choices, tmp_path, module, grey_capture):
    choices.capture_folder = str(grey_capture)
    bpy.ops.scan_relight.check_capture()
    begin(TELLS + "import time; time.sleep(60)")
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "saved.blend"))
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "saved.blend"))
    saved = bpy.context.scene.scan_relight
    assert saved.capture_folder and module("addon.bridge.job.job").current() is None
    names = {prop.identifier for prop in saved.bl_rna.properties} - {"rna_type", "name"}
    assert not {name for name in names if any(word in name for word in ("job", "progress", "running", "stage"))}


def test_long_words_are_cut_and_nothing_is_lost(module):
    lines = module("operators.base.panel").lines
    sentence = "Frame '/a/very/long/path/that/does/not/end/anywhere/at/all/frame_0001.exr' is damaged; write it again."
    for width in (40, 120, 260, 2000):
        found = lines(sentence, width, 11.0)
        assert "".join(found).replace(" ", "") == sentence.replace(" ", "")
        assert all(module("operators.base.panel").measure(line, 11.0) <= width or len(line) <= 4 for line in found)
    assert lines(sentence, 2000, 11.0) == (sentence,) and lines("", 100, 11.0) == ("",)


def test_reading_options_match_the_command_line(choices, module):
    """Each property becomes an option that the command line knows, and the same `Reading`."""
    from addon.cli import make_parser

    reading_props = module("operators.recover.reading_props")
    owner = choices.reading
    assert reading_props.options(owner) == []
    owner.reading_format, owner.reading_outside, owner.reading_transfer = "nerfstudio", True, "srgb"
    owner.reading_mesh, owner.reading_exposures, owner.reading_convention = "/m.ply", "/e.csv", "y-up"
    owner.reading_segments, owner.reading_segments_file = "FILE", "/s.txt"
    given = make_parser().parse_args(["info", "/capture", *reading_props.options(owner)])
    here = reading_props.reading(owner)
    assert (given.format, given.mesh, given.outside, given.transfer, given.exposures, given.convention) == (
        here.format,
        here.mesh,
        here.outside,
        here.transfer,
        here.exposures,
        here.convention,
    )
    assert given.segments == here.segments == Path("/s.txt")
    owner.reading_segments = "materials"
    assert reading_props.options(owner)[-3:-1] == ["--segments", reading_props.reading(owner).segments]
    assert "reading_segments_file" not in reading_props.visible_names(owner)
