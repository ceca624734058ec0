"""Marks every hard case, and gives it `expect`, which checks a figure and keeps it for the table."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from addon.core.passes.unseen_light import unseen_light
from addon.core.significance import LEVELS
from tests.hard_cases.figures import FIGURES, Figure
from tests.hard_cases.rooms import Captured

HERE = Path(__file__).parent


def pytest_collection_modifyitems(items):
    for item in items:
        if HERE in item.path.parents:
            item.add_marker(pytest.mark.hard_case)


@pytest.fixture(autouse=True)
def few_samples(monkeypatch):
    """The search for lamps looks at fewer elements than it would in a real room."""
    monkeypatch.setattr(unseen_light, "LEVELS", replace(LEVELS, sample=800))


@pytest.fixture
def expect(request) -> Callable[[str, float, float], None]:
    """`expect(known, error, within)`: the error is a number and at most `within`."""
    case = request.node.name.removeprefix("test_").replace("_", " ").replace("[", " (").replace("]", ")")

    def check(known: str, error: float, within: float) -> None:
        FIGURES.append(Figure(case, known, float(error), float(within)))
        assert np.isfinite(error) and error <= within, f"{known}: off by {error:.3g}, allowed {within:g}"

    return check


@pytest.fixture
def capture(tmp_path) -> Callable[..., Captured]:
    """`capture(room, light, ...)`: a capture folder of its own for this test."""
    count = iter(range(1000))
    return lambda room, light, **more: Captured(tmp_path / f"capture-{next(count)}", room, light, **more)
