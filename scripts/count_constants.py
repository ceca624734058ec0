#!/usr/bin/env python3
"""Numbers that somebody chose: module-level numeric constants, and numeric fields of `Params`, by folder.

    python scripts/count_constants.py [FOLDER] [--list]

A tuple of numbers that is bound to several names counts once for each. What a physicist or a file format fixed counts,
too: a reader can't tell it from what was tuned.
"""

from __future__ import annotations

import ast
import sys
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]


def is_number(node: ast.expr) -> bool:
    """Whether an expression is made of numeric literals alone, tuples of them included."""
    if isinstance(node, ast.Constant):
        return isinstance(node.value, (int, float)) and not isinstance(node.value, bool)
    if isinstance(node, ast.UnaryOp):
        return is_number(node.operand)
    if isinstance(node, ast.BinOp):
        return is_number(node.left) and is_number(node.right)
    return isinstance(node, (ast.Tuple, ast.List)) and bool(node.elts) and all(is_number(one) for one in node.elts)


def constants(tree: ast.Module) -> Iterator[str]:
    """Names of the module's numeric constants."""
    for node in tree.body:
        if isinstance(node, ast.AnnAssign) and node.value is not None and is_number(node.value):
            yield ast.unparse(node.target)
        if not isinstance(node, ast.Assign) or not is_number(node.value):
            continue
        for target in node.targets:
            yield from (ast.unparse(one) for one in (target.elts if isinstance(target, ast.Tuple) else [target]))


def params(tree: ast.Module) -> Iterator[str]:
    """Numeric fields of classes called `...Params`."""
    for node in ast.walk(tree):
        if isinstance(node, ast.ClassDef) and node.name.endswith("Params"):
            for one in node.body:
                if isinstance(one, ast.AnnAssign) and one.value is not None and is_number(one.value):
                    yield f"{node.name}.{ast.unparse(one.target)}"


def main(argv: list[str]) -> int:
    show = "--list" in argv
    folders = [one for one in argv if one != "--list"] or ["addon", "operators"]
    loose, fields = Counter(), Counter()
    for folder in folders:
        for path in sorted((ROOT / folder).rglob("*.py")):
            tree = ast.parse(path.read_text(encoding="utf-8"))
            where = path.parent.relative_to(ROOT).as_posix()
            for count, names in ((loose, list(constants(tree))), (fields, list(params(tree)))):
                count[where] += len(names)
                if show and names:
                    print(f"{path.relative_to(ROOT)}: {', '.join(names)}")
    for where in sorted(loose):
        if loose[where] or fields[where]:
            print(f"{loose[where]:5d} {fields[where]:5d}  {where}")
    print(f"{sum(loose.values()):5d} {sum(fields.values()):5d}  together: module-level, in Params")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
