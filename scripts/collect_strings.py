"""The interface's strings, as Blender's translation table wants them, and what a language lacks of them.

    .venv/bin/python scripts/collect_strings.py [--missing de_DE]

Labels and tooltips are asked of Blender (all that we register); texts of panels and of disabled buttons are read off
the code in operators/. A sentence with figures in it is listed with '{}' in their places.
"""

import argparse
import ast
import importlib
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
TEXTS = {"label", "operator", "prop", "menu", "operator_menu_enum"}
"""Methods of a layout whose `text` is displayed."""
SENTENCES = {"say": 1, "check": 2, "poll_message_set": 0, "translated": 0, "needs": 1, "folded": 2}
"""Functions that take a sentence, and its index among their arguments."""


def main() -> None:
    import scan_relight  # the checkout, as `.venv` has it

    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--missing", metavar="LANGUAGE", help="only what operators/translations lacks of a language")
    arguments = parser.parse_args()
    scan_relight.register()
    strings = collect()
    if arguments.missing:
        strings -= set(importlib.import_module("scan_relight.operators.translations").texts(arguments.missing))
    print("\n".join(sorted(strings)))
    scan_relight.unregister()


def collect() -> set[str]:
    """Every string of the registered package `scan_relight`."""
    return {text for text in registered() | written() if any(c.isalpha() for c in text)}


def registered() -> set[str]:
    """Labels and tooltips of classes, properties, and items of enumerations."""
    import bpy
    from scan_relight import operators
    from scan_relight.addon.core.stages import LABELS

    strings = set(LABELS.values())
    for cls in operators.classes():
        strings |= {getattr(cls, "bl_label", ""), getattr(cls, "bl_description", "")}
        if issubclass(cls, bpy.types.Operator):
            properties = getattr(bpy.ops.scan_relight, cls.bl_idname.partition(".")[2]).get_rna_type().properties
        else:
            annotated = {name for base in cls.__mro__ for name in getattr(base, "__annotations__", ())}
            properties = [prop for prop in cls.bl_rna.properties if prop.identifier in annotated]
        for prop in properties:
            if prop.identifier == "rna_type" or prop.is_hidden:
                continue
            strings |= {prop.name, prop.description}
            if prop.type == "ENUM":
                strings |= {text for item in prop.enum_items for text in (item.name, item.description)}
    return strings


def written() -> set[str]:
    """Texts in the code of panels and polls."""
    strings = set()
    for path in (ROOT / "operators").rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if not isinstance(node, ast.Call) or not isinstance(node.func, (ast.Attribute, ast.Name)):
                continue
            name = node.func.attr if isinstance(node.func, ast.Attribute) else node.func.id
            if name in TEXTS:
                values = [keyword.value for keyword in node.keywords if keyword.arg == "text"]
                strings |= {text for value in values for text in texts(value) if "{}" not in text}
            elif name in SENTENCES and len(node.args) > SENTENCES[name]:
                strings |= set(texts(node.args[SENTENCES[name]]))
    return strings


def texts(node: ast.expr) -> list[str]:
    """The strings that an expression may be."""
    if isinstance(node, ast.Constant):
        return [node.value] if isinstance(node.value, str) else []
    if isinstance(node, ast.Lambda):
        return texts(node.body)
    if isinstance(node, ast.IfExp):
        return texts(node.body) + texts(node.orelse)
    if isinstance(node, ast.JoinedStr):
        return ["".join(part.value if isinstance(part, ast.Constant) else "{}" for part in node.values)]
    return []


if __name__ == "__main__":
    main()
