"""Imports between packages, beyond the layers that import-linter checks."""

from __future__ import annotations

import ast
import re
import tomllib
from collections.abc import Iterator
from itertools import chain
from pathlib import Path

import realitygap

SOURCES = Path(realitygap.__file__).parent
PACKAGES = {path.name for path in SOURCES.iterdir() if (path / "__init__.py").exists()}


def imported_names(text: str, package: list[str]) -> Iterator[list[str]]:
    """Yield the full name of each module or member that a module imports, in parts."""
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.Import):
            yield from (alias.name.split(".") for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            parents = package[: len(package) + 1 - node.level] if node.level else []
            parents = [*parents, *(node.module or "").split(".")] if node.module else parents
            yield from ([*parents, alias.name] for alias in node.names)


def private_imports(text: str, package: list[str]) -> list[str]:
    """Return the private modules and members of other top-level packages that a module imports."""
    return [
        ".".join(name)
        for name in imported_names(text, package)
        if len(name) > 1
        and name[0] == "realitygap"
        and name[1] in PACKAGES - set(package[1:2])
        and any(part.startswith("_") for part in name[2:])
    ]


def test_no_package_imports_a_private_module_of_another():
    refused = {}
    for path in SOURCES.rglob("*.py"):
        package = ["realitygap", *path.relative_to(SOURCES).parent.parts]
        if private := private_imports(path.read_text("utf-8"), package):
            refused[str(path.relative_to(SOURCES))] = private
    assert not refused


def test_private_imports_are_detected_in_each_form():
    package = ["realitygap", "lab", "pages"]
    text = """
def late():
    from realitygap.world._case import Case
from realitygap.world import _case
from ...world._case import Case
import realitygap.robots.twin._cells
from realitygap.world import Case, _hidden
"""
    assert private_imports(text, package) == [
        "realitygap.world._case",
        "realitygap.world._case.Case",
        "realitygap.robots.twin._cells",
        "realitygap.world._hidden",
        "realitygap.world._case.Case",
    ]
    own = "from realitygap.lab._lab import Lab\nfrom .._lab import Lab\nfrom realitygap._limits import read_file"
    assert not private_imports(own, package)


def import_graph() -> dict[str, set[str]]:
    """Return, for each module, those of its package that it imports, in functions and for types, too."""
    modules = {}
    for path in SOURCES.rglob("*.py"):
        if path.name != "__init__.py":
            modules[".".join(path.relative_to(SOURCES).with_suffix("").parts)] = path
    graph = {}
    for module, path in modules.items():
        package = ["realitygap", *module.split(".")[:-1]]
        names = {tuple(name[1:]) for name in imported_names(path.read_text("utf-8"), package)}
        found = {".".join(name[:end]) for name in names for end in (len(name), len(name) - 1)} & set(modules)
        graph[module] = {name for name in found if name.partition(".")[0] == module.partition(".")[0]}
    return graph


def cycles_of(graph: dict[str, set[str]]) -> set[str]:
    """Return each largest group of modules that all reach each other, as their names."""

    def reached(module: str) -> set[str]:
        seen: set[str] = set()
        missing = set(graph[module])
        while missing:
            seen |= missing
            missing = set().union(*(graph[name] for name in missing)) - seen
        return seen

    reach = {module: reached(module) for module in graph}
    return {
        " ".join(sorted(name for name in reach[module] if module in reach[name]))
        for module in graph
        if module in reach[module]
    }


def test_modules_of_a_package_do_not_import_each_other():
    assert cycles_of(import_graph()) == set()


def test_cycles_are_detected():
    graph = {"a": {"b"}, "b": {"c"}, "c": {"a", "d"}, "d": set(), "e": {"a"}}
    assert cycles_of(graph) == {"a b c"}


def test_the_architecture_page_draws_the_layers_that_are_checked():
    """Each package is in a layer, and the picture has the same order."""
    root = SOURCES.parent.parent
    contracts = tomllib.loads((root / "pyproject.toml").read_text("utf-8"))["tool"]["importlinter"][
        "contracts"
    ]
    layers = [
        [name.removeprefix("realitygap.") for name in line.split(" | ")] for line in contracts[0]["layers"]
    ]
    page = (root / "docs" / "explanations" / "architecture.md").read_text("utf-8")
    picture = page.partition("```text\n")[2].partition("```")[0].splitlines()
    assert [line[:32].strip().split(" | ") for line in picture] == layers
    assert set(chain.from_iterable(layers)) >= PACKAGES


def test_the_architecture_page_names_files_and_names_that_exist():
    page = (SOURCES.parent.parent / "docs" / "explanations" / "architecture.md").read_text("utf-8")
    quoted = set(re.findall(r"`([^`\n]+)`", page.partition("## Where to put a change")[2]))
    files = {f"/{path.relative_to(SOURCES)}" for path in SOURCES.rglob("*") if path.is_file()}
    paths = {name for name in quoted if re.fullmatch(r"[a-z_/]+(\.py|\.\w+\.jinja)", name)}
    assert {name for name in paths if not any(file.endswith(f"/{name}") for file in files)} == set()
    names = {name for name in quoted if re.fullmatch(r"_?[A-Z][A-Z_]+|_[a-z_]+", name)}
    text = "\n".join(path.read_text("utf-8") for path in SOURCES.rglob("*.py"))
    assert {name for name in names if not re.search(rf"\b{name}\b", text)} == set()
    assert len(paths) > 20
    assert len(names) > 10
