"""The page of figures: it is what the measurements say, and a run's scores become a line."""

from __future__ import annotations

import importlib.util
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent


@pytest.fixture(scope="module")
def standing():
    spec = importlib.util.spec_from_file_location("standing", ROOT / "scripts" / "standing.py")
    made = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(made)
    return made


def test_the_page_is_not_written_by_hand(standing):
    assert (ROOT / "docs" / "accuracy.md").read_text(encoding="utf-8") == standing.page(standing.measured())


def test_a_line_of_scores(standing):
    told = {"psnr": 28.345, "median_relative_error": 0.1}
    scores = {
        "albedo": {"psnr": 24.74, "psnr_one_scale": 25.04, "psnr_three_scales": 25.06, "scale": 1.0},
        "roughness": {"mean_abs_error_by_object": None, "mean_abs_error_by_pixel": 0.0234},
        "model": {"right": 94, "of": 110},
        "rerender": told,
        "relight_A": told | {"psnr": 24.0},
        "relight_B": told | {"psnr": 26.1},
    }
    line = standing.line_of(scores, {"seconds": 61.24, "peak_memory_bytes": 3 << 30}, "a room", 12, 32)
    old, new = ({"date": f"2026-0{month}-01", "commit": "abc"} for month in (1, 2))
    shown = standing.page([line | old, line | new])
    row = "| a room | 24.7 / 25.0 / 25.1 dB | 0.023 / - | 94 of 110 | 28.3 dB | 25.1 dB | 61.2 s | 3.0 GiB |"
    assert f"{row} 12, 32 samples | 2026-02-01, abc |" in shown
    assert "2026-01-01" not in shown  # the newest of a capture
