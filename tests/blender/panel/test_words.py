"""All words of the interface: every property is explained, plainly, and as Blender writes."""

from __future__ import annotations

import ast
import re
from pathlib import Path

import pytest

bpy = pytest.importorskip("bpy")

OPERATORS = Path(__file__).resolve().parents[3] / "operators"
JARGON = re.compile(r"\b(L_d|phi|psi|BRDF|GGX|RNA|enum|kwargs|None|True|False|stdin|[a-z]+_[a-z_]+)\b(?!\.\w)|--\w")
"""What only the method or the code knows; words with underscores are names of code."""
OF_BLENDER = {"rna_type", "name", "bl_idname"}


def described(package):
    """(owner, property) of everything that we have registered and that is ever shown."""
    from scan_relight import operators

    for cls in operators.classes():
        if issubclass(cls, bpy.types.Operator):
            known = getattr(bpy.ops.scan_relight, cls.bl_idname.split(".")[1]).get_rna_type().properties
        elif issubclass(cls, (bpy.types.PropertyGroup, bpy.types.AddonPreferences)):
            known = cls.bl_rna.properties
        elif issubclass(cls, bpy.types.UIList):
            known = [prop for prop in cls.bl_rna.properties if prop.identifier in cls.__annotations__]
        else:
            continue
        yield from ((cls.__name__, prop) for prop in known if prop.identifier not in OF_BLENDER and not prop.is_hidden)


def wrong_with(text):
    """What is wrong with a tooltip; '' where nothing is."""
    if not text:
        return "is empty"
    if text.endswith("."):
        return "ends with a full stop, which Blender adds"
    found = JARGON.search(text)
    return f"holds '{found[0]}'" if found else ""


def test_every_property_is_explained_in_plain_words(package, ops):
    wrong = []
    for owner, prop in described(package):
        wrong += [f"{owner}.{prop.identifier} {wrong_with(prop.description)}"] * bool(wrong_with(prop.description))
        if prop.type == "ENUM":
            wrong += [
                f"{owner}.{prop.identifier}, {one.identifier}: {wrong_with(one.description)}"
                for one in prop.enum_items
                if wrong_with(one.description)
            ]
    assert not wrong, "\n".join(wrong)


def test_every_operator_has_a_label_and_a_tooltip(package, ops):
    from scan_relight import operators

    wrong = []
    for cls in operators.classes():
        if issubclass(cls, bpy.types.Operator):
            assert cls.bl_label, cls
            text = getattr(cls, "bl_description", "") or "description" in vars(cls) and "its own" or ""
            wrong += [f"{cls.__name__} {wrong_with(text)}"] * bool(wrong_with(text))
    assert not wrong, "\n".join(wrong)


def test_labels_are_title_case(package, ops):
    """As Blender's are; small words stay small."""
    small = {
        "a",
        "an",
        "and",
        "as",
        "at",
        "by",
        "for",
        "from",
        "in",
        "it",
        "not",
        "of",
        "on",
        "or",
        "the",
        "to",
        "px",
        "m",
        "with",
        "is",
        "its",
        "x",
    }
    wrong = [
        f"{owner}.{prop.identifier}: {prop.name}"
        for owner, prop in described(package)
        if any(word[0].islower() and word not in small for word in re.findall(r"[A-Za-z][\w']*", prop.name))
    ]
    assert not wrong, "\n".join(wrong)


def test_no_animation_dots():
    """Wherever a layout splits label and value, Blender would draw a dot for keyframes beside it."""
    for path in OPERATORS.rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.FunctionDef):
                inner = [one for one in ast.walk(node) if isinstance(one, ast.Attribute)]
                names = [one.attr for one in inner if isinstance(one.ctx, ast.Store)]
                assert names.count("use_property_split") <= names.count("use_property_decorate"), (path, node.name)


def test_the_settings_words_are_of_settings_that_there_are(module):
    """Each choice that the words tell of is one, and all of a setting's are told of."""
    from addon.settings_info import setting_infos

    known = {info.name: set(info.choices) for info in setting_infos()}
    told = module("operators.recover.settings_words")
    assert {*told.LABELS, *told.CHOICES} <= set(known)
    assert all(set(choices) == known[name] for name, choices in told.CHOICES.items())
