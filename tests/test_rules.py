"""Guards over the tree itself: who may import what, and that the pinned versions agree everywhere."""

from __future__ import annotations

import ast
import re
import sys
import tomllib
from pathlib import Path

import pytest

from addon.version import VERSION

ROOT = Path(__file__).resolve().parent.parent
CODE = [ROOT / "__init__.py", *sorted((ROOT / "addon").rglob("*.py")), *sorted((ROOT / "operators").rglob("*.py"))]
CORE = sorted((ROOT / "addon" / "core").rglob("*.py"))
REQUIREMENTS = sorted((ROOT / "requirements").iterdir())
BLENDER_MODULES = {"bpy", "bmesh", "mathutils", "gpu", "blf", "bl_math", "addon_utils"}


def imports(path: Path, nodes=ast.walk) -> list[tuple[int, str]]:
    """Level and module of every import in `path`."""
    found = []
    for node in nodes(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            found += [(0, alias.name) for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            found.append((node.level, node.module or ""))
    return found


def relative(path: Path) -> str:
    return path.relative_to(ROOT).as_posix()


def absolute(path: Path) -> set[str]:
    """Top packages that `path` imports by their names."""
    return {name.split(".")[0] for level, name in imports(path) if level == 0}


def test_the_core_knows_neither_blender_nor_what_uses_it():
    for path in CORE:
        assert not absolute(path) & BLENDER_MODULES, relative(path)
        depth = len(path.relative_to(ROOT / "addon").parts) - 1  # level that reaches addon/
        assert all(level <= depth for level, _ in imports(path)), relative(path)


def test_imports_of_our_own_code_are_relative():
    for path in CODE:
        assert "bl_ext." not in path.read_text(encoding="utf-8"), relative(path)
        assert not absolute(path) & {"addon", "operators", "scan_relight"}, relative(path)


LAYERS = (
    ("",),
    ("scene",),
    ("io", "paper"),
    ("brdf",),
    ("results",),
    ("light",),
    ("lit_diffuse", "agreement"),
    ("fit",),
    ("passes",),
    ("evidence",),
    ("pipeline",),
)
"""Folders of addon/core from the bottom up; '' are the modules at its root. Each may import from lower ones alone."""
BRIDGE_LAYERS = (
    ("",),
    ("data",),
    ("light",),
    ("scene", "export"),
    ("results", "relight"),
    ("own_scene",),
    ("corrections",),
    ("room",),
    ("job",),
    ("demo",),
)
"""The same of addon/bridge."""
Graph = dict[tuple[str, ...], set[tuple[str, ...]]]


def graph(root: Path) -> Graph:
    """Which module below `root` imports which, those for type checkers alone included; names relative to `root`."""
    modules = {path.relative_to(root).with_suffix("").parts: path for path in root.rglob("*.py")}
    modules = {name[:-1] if name[-1] == "__init__" else name: path for name, path in modules.items()}
    result: Graph = {}
    for name, path in modules.items():
        package = name if path.name == "__init__.py" else name[:-1]
        result[name] = set()
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.ImportFrom) and 0 < node.level <= len(package) + 1:
                base = package[: len(package) - (node.level - 1)] + tuple(filter(None, (node.module or "").split(".")))
                inner = [base + (alias.name,) for alias in node.names]
                result[name] |= {one for one in inner if one in modules} or {base}
    return result


def circle(imports: Graph) -> list[tuple[str, ...]]:
    """The modules of a circle of imports; [] where there is none."""
    state: dict[tuple[str, ...], bool] = {}  # True: done, False: on the way

    def follow(one: tuple[str, ...], way: list[tuple[str, ...]]) -> list[tuple[str, ...]]:
        if one in state:
            return [] if state[one] else [*way[way.index(one) :], one]
        state[one] = False
        for other in sorted(imports.get(one, ())):
            if found := follow(other, [*way, one]):
                return found
        state[one] = True
        return []

    return next((found for one in sorted(imports) if (found := follow(one, []))), [])


def test_a_circle_is_found():
    assert circle({("a",): {("b",)}, ("b",): {("c",)}, ("c",): {("b",)}}) == [("b",), ("c",), ("b",)]
    assert circle({("a",): {("b",), ("c",)}, ("b",): {("c",)}, ("c",): set()}) == []


@pytest.mark.parametrize("part", ["core", "bridge"])
def test_there_is_no_circle_of_imports(part):
    assert not circle(graph(ROOT / "addon" / part))


@pytest.mark.parametrize(("part", "layers"), [("core", LAYERS), ("bridge", BRIDGE_LAYERS)])
def test_dependencies_point_down(part, layers):
    level = {folder: i for i, folders in enumerate(layers) for folder in folders}
    assert {path.name for path in (ROOT / "addon" / part).iterdir() if (path / "__init__.py").is_file()} < set(level)

    def folder(name: tuple[str, ...]) -> str:
        return name[0] if name and (len(name) > 1 or name[0] in level) else ""

    wrong = [
        f"{'.'.join(one)} imports {'.'.join(other)}"
        for one, others in graph(ROOT / "addon" / part).items()
        for other in others
        if folder(one) != folder(other) and level[folder(one)] <= level[folder(other)]
    ]
    assert not wrong


def test_no_pass_imports_another():
    wrong = [
        f"{'.'.join(one)} imports {'.'.join(other)}"
        for one, others in graph(ROOT / "addon" / "core" / "passes").items()
        for other in others
        if len(one) > 1 and other[:1] != one[:1]
    ]
    assert not wrong


def test_nothing_under_addon_reaches_above_it():
    for path in sorted((ROOT / "addon").rglob("*.py")):
        depth = len(path.relative_to(ROOT).parts) - 1
        assert all(level <= depth for level, _ in imports(path)), path


def test_the_farm_knows_the_core_and_the_command_line_alone():
    for path in sorted((ROOT / "addon" / "farm").rglob("*.py")):
        above = [name for level, name in imports(path) if level == 2]
        assert {name.split(".")[0] for name in above} <= {"cli", "console", "core", "settings_info"}, relative(path)
        assert not absolute(path) - set(sys.stdlib_module_names) - {"__future__"}, relative(path)
    for path in (
        *CORE,
        *sorted((ROOT / "addon" / "bridge").rglob("*.py")),
        *sorted((ROOT / "operators").rglob("*.py")),
    ):
        assert not [name for _, name in imports(path) if "farm" in name.split(".")], relative(path)


@pytest.mark.parametrize("name", ["__init__.py", "addon/cli/__init__.py", "operators/__init__.py"])
def test_no_blender_at_module_level(name):
    found = imports(ROOT / name, nodes=ast.iter_child_nodes)
    assert not {module.split(".")[0] for _, module in found} & BLENDER_MODULES


@pytest.mark.parametrize("path", REQUIREMENTS, ids=relative)
def test_requirements_hold_no_address_and_no_path(path):
    text = path.read_text(encoding="utf-8")
    assert "://" not in text
    assert "--find-links" not in text and "index-url" not in text
    assert not re.search(r"(^|\s)/\w", text)


def pinned(name: str) -> dict[str, str]:
    """Version of each package in a lock."""
    return dict(re.findall(r"^([A-Za-z0-9_.-]+)==([^\s;]+)", (ROOT / "requirements" / name).read_text(), re.MULTILINE))


def test_one_version_everywhere():
    manifest = tomllib.loads((ROOT / "blender_manifest.toml").read_text())
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    assert manifest["version"] == project["version"] == VERSION
    assert f"## {VERSION}" in (ROOT / "CHANGELOG.md").read_text()


def test_the_bundled_wheels_are_the_locked_ones():
    manifest = tomllib.loads((ROOT / "blender_manifest.toml").read_text())
    bundled = {}
    for wheel in manifest["wheels"]:
        package, version, python, _, platform = Path(wheel).stem.split("-")
        bundled.setdefault((package, version), set()).add((python, re.sub(r"[_.\d]*\d_", " ", platform).split()[0]))
    openimageio = bundled.pop(("openimageio", pinned("extension.txt")["openimageio"]))
    assert openimageio == {("cp314", "manylinux")}  # Blender's own builds, on the other Pythons, bring it
    assert {package for package, _ in bundled} == {"scipy", "embreex", "openexr"}
    for lock in ("blender-4.5.txt", "blender-5.2.txt"):
        versions = pinned(lock)
        assert all(versions[package] == version for package, version in bundled)
    for wheels in bundled.values():
        assert {python for python, _ in wheels} == {"cp311", "cp313", "cp314"}
    assert len(manifest["wheels"]) == 3 * 3 * len(manifest["platforms"]) + 1


def test_the_tagline_is_what_blender_takes():
    tagline = tomllib.loads((ROOT / "blender_manifest.toml").read_text())["tagline"]
    assert len(tagline) <= 64 and not tagline.endswith(".")


def test_every_module_is_short_and_says_what_it_is():
    for path in CODE:
        text = path.read_text(encoding="utf-8")
        assert ast.get_docstring(ast.parse(text)), f"{relative(path)} has no docstring"
        assert text.count("\n") <= 480, f"{relative(path)} is too long: is it one thing?"


def has_a_quick_test(path: Path) -> bool:
    """Whether `scripts/test.py --quick` runs a test of the module."""
    tests = [one for one in ast.parse(path.read_text(encoding="utf-8")).body if isinstance(one, ast.FunctionDef)]
    slow = [any("mark.slow" in ast.unparse(mark) for mark in one.decorator_list) for one in tests]
    return any(one.name.startswith("test_") and not marked for one, marked in zip(tests, slow))


def test_every_pass_has_a_quick_test():
    tests = ROOT / "tests" / "core" / "passes"
    passes = [folder.parent.name for folder in (ROOT / "addon" / "core" / "passes").glob("*/__init__.py")]
    assert len(passes) > 5
    assert not [name for name in passes if not any(map(has_a_quick_test, (tests / name).glob("test_*.py")))]


def test_every_pass_is_described():
    from addon.core.passes.registry import PASSES

    told = (ROOT / "docs" / "method.md").read_text(encoding="utf-8")
    assert not [one.name for one in PASSES if f"`{one.name}`" not in told]


def test_the_methods_numbers_are_fields_of_params():
    """No number that was chosen by results stands by itself in a module of the method, or has no word on it."""
    sys.path.insert(0, str(ROOT / "scripts"))
    from count_constants import constants

    method = ("agreement", "evidence", "fit", "light", "lit_diffuse", "passes", "pipeline")
    for path in sorted(one for folder in method for one in (ROOT / "addon" / "core" / folder).rglob("*.py")):
        tree = ast.parse(path.read_text(encoding="utf-8"))
        assert not [name for name, kind in constants(tree) if not kind], path
        for one in tree.body:
            if isinstance(one, ast.ClassDef) and one.name.endswith("Params"):
                fields = {ast.unparse(field.target) for field in one.body if isinstance(field, ast.AnnAssign)}
                told = re.findall(r"^ {4}(\w[\w, ]*) : ", ast.get_docstring(one, clean=False) or "", re.MULTILINE)
                assert fields == {name for names in told for name in names.split(", ")}, f"{path}: {one.name}"


def bound_names(path: Path) -> list[tuple[str, int]]:
    """Names of variables, parameters and functions that a module binds, and their lines; not a class's fields."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    of_fields = {
        id(field.target)
        for node in ast.walk(tree)
        if isinstance(node, ast.ClassDef)
        for field in node.body
        if isinstance(field, ast.AnnAssign)
    }
    names = []
    for node in ast.walk(tree):
        if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store) and id(node) not in of_fields:
            names.append((node.id, node.lineno))
        elif isinstance(node, ast.arg):
            names.append((node.arg, node.lineno))
        elif isinstance(node, ast.FunctionDef):
            names.append((node.name, node.lineno))
    return names


def test_names_say_what_they_hold():
    vague = {"told", "thing", "things", "one", "asked", "shown", "usual", "stuff"}
    for path in CODE:
        for name, line in bound_names(path):
            assert name.strip("_") not in vague, f"{relative(path)}:{line}: '{name}' could hold anything"


def test_docstrings_have_numpys_sections():
    """What a function takes and gives stands in sections of its own, not run in with the sentences."""
    run_in = re.compile(r"\bReturns: |^\s*`\**[a-z_]+`: ", re.MULTILINE)
    for path in CODE:
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.FunctionDef | ast.ClassDef):
                assert not run_in.search(ast.get_docstring(node) or ""), f"{relative(path)}:{node.lineno}"


def test_blenders_half_has_annotations_that_blender_can_read():
    """Blender reads an operator's properties off its annotations; so they are none of them put off."""
    for path in (*(ROOT / "addon" / "bridge").rglob("*.py"), *(ROOT / "operators").rglob("*.py")):
        assert "from __future__ import annotations" not in path.read_text(encoding="utf-8"), relative(path)
