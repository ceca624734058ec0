"""The interface's strings, as Blender's translation table wants them, and what a language lacks of them.

    .venv/bin/python scripts/collect_strings.py [--missing de_DE]

Labels and tooltips are asked of Blender (all that we register); texts of panels and of disabled buttons are read off
the code in operators/. A sentence with figures in it is listed with '{}' in their places.
"""

import argparse
import ast
import importlib
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
TEXTS = {"label", "operator", "prop", "menu", "operator_menu_enum"}
"""Calls on a layout whose `text` is shown."""
SENTENCES = {"say": 1, "check": 2, "poll_message_set": 0, "translated": 0, "needs": 1, "folded": 2}
"""Calls that take a sentence, and where it stands among their arguments."""


def main() -> int:
    import scan_relight  # the checkout, as `.venv` has it

    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--missing", metavar="LANGUAGE", help="only what operators/translations lacks of a language")
    arguments = parser.parse_args()
    scan_relight.register()
    found = collect()
    if arguments.missing:
        found -= set(importlib.import_module("scan_relight.operators.translations").texts(arguments.missing))
    print("\n".join(sorted(found)))
    scan_relight.unregister()
    return 0


def collect() -> set[str]:
    """Every string of the registered package `scan_relight`."""
    return {text for text in registered() | written() if any(c.isalpha() for c in text)}


def registered() -> set[str]:
    """Labels and tooltips of classes, properties, and items of enumerations."""
    import bpy
    from scan_relight import operators
    from scan_relight.addon.core.stages import LABELS

    found = set(LABELS.values())
    for cls in operators.classes():
        found |= {getattr(cls, "bl_label", ""), getattr(cls, "bl_description", "")}
        if issubclass(cls, bpy.types.Operator):
            known = getattr(bpy.ops.scan_relight, cls.bl_idname.partition(".")[2]).get_rna_type().properties
        else:
            own = {name for base in cls.__mro__ for name in getattr(base, "__annotations__", ())}
            known = [prop for prop in cls.bl_rna.properties if prop.identifier in own]
        for prop in known:
            if prop.identifier == "rna_type" or prop.is_hidden:
                continue
            found |= {prop.name, prop.description}
            if prop.type == "ENUM":
                found |= {text for item in prop.enum_items for text in (item.name, item.description)}
    return found


def written() -> set[str]:
    """Texts in the code of panels and polls."""
    found = set()
    for path in (ROOT / "operators").rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if not isinstance(node, ast.Call) or not isinstance(node.func, (ast.Attribute, ast.Name)):
                continue
            name = node.func.attr if isinstance(node.func, ast.Attribute) else node.func.id
            if name in TEXTS:
                shown = [one.value for one in node.keywords if one.arg == "text"]
                found |= {text for one in shown for text in texts(one) if "{}" not in text}
            elif name in SENTENCES and len(node.args) > SENTENCES[name]:
                found |= set(texts(node.args[SENTENCES[name]]))
    return found


def texts(node: ast.expr) -> list[str]:
    """The strings that an expression may be."""
    if isinstance(node, ast.Constant):
        return [node.value] if isinstance(node.value, str) else []
    if isinstance(node, ast.Lambda):
        return texts(node.body)
    if isinstance(node, ast.IfExp):
        return texts(node.body) + texts(node.orelse)
    if isinstance(node, ast.JoinedStr):
        return ["".join(one.value if isinstance(one, ast.Constant) else "{}" for one in node.values)]
    return []


if __name__ == "__main__":
    sys.exit(main())
