"""The interface in other languages: Blender's own table, filled from .po files; and sentences with values in them.

`scripts/collect_strings.py` lists the strings to translate.
"""

import ast
import re
from functools import lru_cache
from pathlib import Path

import bpy

LANGUAGES = {"de_DE": "de.po"}
OWN = "Scan Relight"
"""Translation context of words that have another meaning in Blender: its 'Normal' is a surface's."""
CONTEXTS = ("*", "Operator", OWN)
"""Blender looks up a button's text in the second, everything else in the first."""


@lru_cache
def texts(locale: str) -> dict[str, str]:
    """Each English text with its translation: the entries `msgid` and `msgstr` of the language's file, a line each."""
    path = Path(__file__).with_name(LANGUAGES[locale])
    entries = re.findall(r'^msgid (".*")\nmsgstr (".*")$', path.read_text(encoding="utf-8"), re.MULTILINE)
    return {ast.literal_eval(english): ast.literal_eval(translation) for english, translation in entries}


def register() -> None:
    """Register the translations with Blender."""
    bpy.app.translations.register(
        __name__,
        {
            locale: {
                (context, english): translation
                for english, translation in texts(locale).items()
                for context in CONTEXTS
            }
            for locale in LANGUAGES
        },
    )


def unregister() -> None:
    """Unregister them."""
    bpy.app.translations.unregister(__name__)


def translated(sentence: str) -> str:
    """`sentence` in the interface's language; one with numbers or names in it by the entry with {} in their places."""
    if not bpy.context.preferences.view.use_translate_interface:
        return sentence
    locale = bpy.app.translations.locale
    return composed(sentence, locale) if locale in LANGUAGES else sentence


@lru_cache(maxsize=512)
def composed(sentence: str, locale: str) -> str:
    """As `translated`, in the language `locale`; values filled in are translated too where there is an entry."""
    table = texts(locale)
    if sentence in table:
        return table[sentence]
    for pattern, template in _patterns(locale):
        if match := pattern.fullmatch(sentence):
            return template.format(*(table.get(part, part) for part in match.groups()))
    return sentence


@lru_cache
def _patterns(locale: str) -> list[tuple[re.Pattern, str]]:
    """The entries with '{}', those with more fixed text first: '{} left' matches much."""
    entries = [(english, template) for english, template in texts(locale).items() if "{}" in english]
    entries.sort(key=lambda entry: -len(entry[0]))
    return [
        (re.compile("(.+?)".join(map(re.escape, english.split("{}"))), re.DOTALL), template)
        for english, template in entries
    ]
