"""What several tests of whole runs share."""

from __future__ import annotations

from dataclasses import replace

import pytest

from addon.core.passes.unseen_light import unseen_light
from addon.core.significance import LEVELS
from tests.core.on_disk import OnDisk


@pytest.fixture
def few_samples(monkeypatch):
    """The search for lamps looks at fewer elements than it would in a real room."""
    monkeypatch.setattr(unseen_light, "LEVELS", replace(LEVELS, sample=1500))


@pytest.fixture(scope="module")
def disk(tmp_path_factory) -> OnDisk:
    return OnDisk(tmp_path_factory.mktemp("room") / "capture")
