#!/usr/bin/env python3
"""Numbers that somebody chose: fields of `...Params`, and numeric constants of modules, by folder.

    python scripts/count_constants.py [FOLDER] [--list]

A constant whose annotation names a kind of `addon/core/kinds.py` (a format's code, a unit, a bound for hostile files,
a block's size, what is shown, a benchmark's workload) is counted apart: by kind, below. A tuple of numbers that is
bound to several names counts once for each.

`in code` counts the numbers that stand in functions, but for 0 to 4 in halves and what is no more than 1e-5 (which
keeps a quotient from dividing by 0). Most are a formula's, a format's or a layout's, and some are chosen: the count
shows whether constants move there.
"""

import ast
import sys
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
KINDS = [
    node.targets[0].id
    for node in ast.parse((ROOT / "addon" / "core" / "kinds.py").read_text(encoding="utf-8")).body
    if isinstance(node, ast.Assign) and ast.unparse(node.value).startswith("Annotated[")
]
PLAIN = {value / 2 for value in range(9)}
"""Numbers that are not counted in code: 0, 0.5, 1, ... 4."""
SMALLEST = 1e-5
"""Smaller ones keep quotients and logarithms finite."""


def is_number(node: ast.expr) -> bool:
    """Whether an expression is made of numeric literals alone, tuples of them included."""
    if isinstance(node, ast.Constant):
        return isinstance(node.value, (int, float)) and not isinstance(node.value, bool)
    if isinstance(node, ast.UnaryOp):
        return is_number(node.operand)
    if isinstance(node, ast.BinOp):
        return is_number(node.left) and is_number(node.right)
    return (
        isinstance(node, (ast.Tuple, ast.List)) and bool(node.elts) and all(is_number(element) for element in node.elts)
    )


def constants(tree: ast.Module) -> Iterator[tuple[str, str]]:
    """Names of the module's numeric constants, and the kind of each: "" where it was chosen."""
    for node in tree.body:
        if isinstance(node, ast.AnnAssign) and node.value is not None and is_number(node.value):
            kind = ast.unparse(node.annotation).split("[")[0]
            yield ast.unparse(node.target), kind if kind in KINDS else ""
        if not isinstance(node, ast.Assign) or not is_number(node.value):
            continue
        for target in node.targets:
            for element in target.elts if isinstance(target, ast.Tuple) else [target]:
                yield ast.unparse(element), ""


def params(tree: ast.Module) -> Iterator[str]:
    """Numeric fields of classes called `...Params`."""
    for node in ast.walk(tree):
        if isinstance(node, ast.ClassDef) and node.name.endswith("Params"):
            for statement in node.body:
                if isinstance(statement, ast.AnnAssign) and statement.value is not None and is_number(statement.value):
                    yield f"{node.name}.{ast.unparse(statement.target)}"


def in_code(tree: ast.Module) -> Iterator[str]:
    """Numbers that stand in functions, with their lines."""
    for function in ast.walk(tree):
        if isinstance(function, (ast.FunctionDef, ast.Lambda)):
            for node in ast.walk(function):
                if isinstance(node, ast.Constant) and type(node.value) in (int, float):
                    if abs(node.value) not in PLAIN and abs(node.value) > SMALLEST:
                        yield f"{node.value:g} ({node.lineno})"


def main(argv: list[str]) -> None:
    show = "--list" in argv
    folders = [argument for argument in argv if argument != "--list"] or ["addon", "operators"]
    loose, fields, inline, kinds = Counter(), Counter(), Counter(), Counter()
    for folder in folders:
        for path in sorted((ROOT / folder).rglob("*.py")):
            tree = ast.parse(path.read_text(encoding="utf-8"))
            parent = path.parent.relative_to(ROOT).as_posix()
            numbers = list(constants(tree))
            kinds.update(kind for _, kind in numbers if kind)
            chosen = [name for name, kind in numbers if not kind]
            for count, names in ((loose, chosen), (fields, list(params(tree))), (inline, sorted(set(in_code(tree))))):
                count[parent] += len(names)
                if show and names:
                    print(f"{path.relative_to(ROOT)}: {', '.join(names)}")
    print("loose Params in code")
    for parent in sorted(loose):
        if loose[parent] or fields[parent]:
            print(f"{loose[parent]:5d} {fields[parent]:6d} {inline[parent]:7d}  {parent}")
    print(f"{sum(loose.values()):5d} {sum(fields.values()):6d} {sum(inline.values()):7d}  together")
    print(f"Chosen: {sum(loose.values()) + sum(fields.values())}. Of a kind, not chosen by results:")
    print(", ".join(f"{kinds[kind]} {kind}" for kind in KINDS))


if __name__ == "__main__":
    main(sys.argv[1:])
