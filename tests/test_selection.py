"""The tests that run without options cover every package."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

TESTS = Path(__file__).parent
PACKAGES = sorted(path.parent.name for path in (TESTS.parent / "src" / "realitygap").glob("*/__init__.py"))
LEAST = 5
"""Tests of each package, without those of `pytest.mark.slow` and `pytest.mark.long`."""


def _is_marked(nodes: list[ast.expr]) -> bool:
    return any(word in ast.unparse(node) for node in nodes for word in ("mark.slow", "mark.long"))


def quick_tests(path: Path) -> Iterator[str]:
    """Yield the names of the test functions in a file that are not marked."""
    body = ast.parse(path.read_text("utf-8")).body
    for node in body:
        if (
            isinstance(node, ast.Assign)
            and ast.unparse(node.targets[0]) == "pytestmark"
            and _is_marked([node.value])
        ):
            return
    for node in body:
        if (
            isinstance(node, ast.FunctionDef)
            and node.name.startswith("test_")
            and not _is_marked(node.decorator_list)
        ):
            yield node.name


@pytest.mark.parametrize("package", PACKAGES)
def test_package_has_tests_that_run_without_options(package: str) -> None:
    found: list[str] = []
    for path in sorted((TESTS / package).glob("test_*.py")):
        found += quick_tests(path)
        if len(found) >= LEAST:
            return
    raise AssertionError(f"{package} has {len(found)} tests that run without options, expected {LEAST}")


def test_marked_tests_are_not_counted(tmp_path: Path) -> None:
    file = tmp_path / "test_it.py"
    file.write_text(
        "def test_a(): pass\n@pytest.mark.slow\ndef test_b(): pass\n@pytest.mark.long\ndef test_c(): pass\n"
    )
    assert list(quick_tests(file)) == ["test_a"]
    file.write_text("pytestmark = pytest.mark.slow\n" + file.read_text())
    assert list(quick_tests(file)) == []
