"""The interface in other languages: Blender's own table, filled from .po files; and sentences that are put together.

`scripts/collect_strings.py` lists what there is to translate.
"""

import ast
import re
from functools import lru_cache
from pathlib import Path

import bpy

LANGUAGES = {"de_DE": "de.po"}
OWN = "Scan Relight"
"""Translation context of words that Blender has too and means otherwise: its 'Normal' is a surface's."""
CONTEXTS = ("*", "Operator", OWN)
"""Blender asks for a button's text under the second, for everything else under the first."""


@lru_cache
def texts(locale: str) -> dict[str, str]:
    """Each English text with its translation: the entries `msgid` and `msgstr` of the language's file, a line each."""
    path = Path(__file__).with_name(LANGUAGES[locale])
    found = re.findall(r'^msgid (".*")\nmsgstr (".*")$', path.read_text(encoding="utf-8"), re.MULTILINE)
    return {ast.literal_eval(english): ast.literal_eval(other) for english, other in found}


def register() -> None:
    """Hand the table to Blender."""
    bpy.app.translations.register(
        __name__,
        {
            locale: {(context, english): other for english, other in texts(locale).items() for context in CONTEXTS}
            for locale in LANGUAGES
        },
    )


def unregister() -> None:
    """Take it back."""
    bpy.app.translations.unregister(__name__)


def told(sentence: str) -> str:
    """`sentence` in the interface's language; one with figures or names in it by the entry with {} in their places."""
    if not bpy.context.preferences.view.use_translate_interface:
        return sentence
    locale = bpy.app.translations.locale
    return composed(sentence, locale) if locale in LANGUAGES else sentence


@lru_cache(maxsize=512)
def composed(sentence: str, locale: str) -> str:
    """As `told`, in the language `locale`; what is filled in is translated where it is known too."""
    known = texts(locale)
    if sentence in known:
        return known[sentence]
    for pattern, other in _patterns(locale):
        if found := pattern.fullmatch(sentence):
            return other.format(*(known.get(part, part) for part in found.groups()))
    return sentence


@lru_cache
def _patterns(locale: str) -> list[tuple[re.Pattern, str]]:
    """The entries with '{}', those with more words of their own first: '{} left' fits much."""
    entries = [(english, other) for english, other in texts(locale).items() if "{}" in english]
    entries.sort(key=lambda entry: -len(entry[0]))
    return [
        (re.compile("(.+?)".join(map(re.escape, english.split("{}"))), re.DOTALL), other) for english, other in entries
    ]
