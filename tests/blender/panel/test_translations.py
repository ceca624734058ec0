"""German: complete, without leftovers, and sentences with figures in them."""

from __future__ import annotations

import importlib.util
import re
from pathlib import Path

import pytest

pytest.importorskip("bpy")

ROOT = Path(__file__).resolve().parents[3]
ENOUGH = 0.95


@pytest.fixture(scope="module")
def strings(package):
    """Every string of the interface."""
    spec = importlib.util.spec_from_file_location("collect_strings", ROOT / "scripts" / "collect_strings.py")
    script = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(script)
    return script.collect()


@pytest.fixture
def translations(module):
    return module("operators.translations")


@pytest.fixture
def german(translations):
    return translations.texts("de_DE")


def test_the_script_finds_what_is_shown(strings):
    """A label, a tooltip, an item, a panel's text, a disabled button's, and one with figures."""
    assert {
        "Recover Capture",
        "Edge of a texel in metres; 0 takes what the frames resolve",
        "Estimated",
        "Resume",
        "No run is going on.",
        "{}: done in {}.",
    } <= strings


def test_german_is_complete(german, strings):
    missing = strings - set(german)
    assert len(missing) <= (1 - ENOUGH) * len(strings), "\n".join(sorted(missing))


def test_german_has_no_leftovers(german, strings):
    assert not set(german) - strings


def test_every_entry_is_one(german):
    """As many figures as in English, no full stop at a tooltip's end, nothing empty, and each line of the file read."""
    wrong = [
        english
        for english, other in german.items()
        if not other or english.count("{}") != other.count("{}") or english.endswith(".") != other.endswith(".")
    ]
    assert not wrong
    text = (ROOT / "operators" / "translations" / "de.po").read_text(encoding="utf-8")
    assert len(re.findall("^msgid", text, re.MULTILINE)) == len(german)


@pytest.mark.parametrize(
    ("english", "other"),
    [
        ("Resume", "Fortsetzen"),
        (
            "Goes on with: Light and albedo. What is finished is kept, where its settings are the same.",
            "Geht weiter mit: Licht und Albedo. Fertiges bleibt, wo die Einstellungen dieselben sind.",
        ),
        ("Recover Capture: done in 2 min 05 s.", "Aufnahme rekonstruieren: fertig in 2 min 05 s."),
        ("Nobody has translated this.", "Nobody has translated this."),
    ],
)
def test_sentences_are_put_together(translations, english, other):
    assert translations.composed(english, "de_DE") == other


def test_english_stays(translations):
    """Where Blender speaks English, or was built without languages."""
    assert translations.translated("Resume") == "Resume"
