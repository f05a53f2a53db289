"""The table of Jyro's features names what exists, and tests that exist."""

from __future__ import annotations

import ast
import importlib
import tomllib
from pathlib import Path
from typing import Any

import pytest

from realitygap.classroom import jyro

ROOT = Path(__file__).parent.parent
TABLE = tomllib.loads((ROOT / "docs" / "data" / "jyro-features.toml").read_text("utf-8"))
FEATURES = [(name, entry) for group in TABLE.values() for name, entry in group.items()]
HERE = [entry for _, entry in FEATURES if "here" in entry]


def look_up(name: str) -> Any:
    """The module, class or function of a name below `realitygap`."""
    found: Any = importlib.import_module("realitygap")
    path = "realitygap"
    for part in name.split("."):
        path = f"{path}.{part}"
        if not hasattr(found, part):
            importlib.import_module(path)
        found = getattr(found, part)
    return found


@pytest.mark.parametrize(("name", "entry"), FEATURES, ids=[name for name, _ in FEATURES])
def test_a_feature_is_here_with_a_test_or_says_why_not(name: str, entry: dict[str, Any]) -> None:
    if "left_out" in entry:
        assert set(entry) == {"left_out"}
        return
    assert set(entry) <= {"here", "attribute", "test", "note"}
    found = [look_up(place) for place in entry["here"]]
    if "attribute" in entry:
        assert hasattr(found[0], entry["attribute"]) or f"self.{entry['attribute']}" in source_of(found[0])
    file, function = entry["test"].split("::")
    tree = ast.parse((ROOT / "tests" / file).read_text("utf-8"))
    tests = {node.name for node in ast.walk(tree) if isinstance(node, ast.FunctionDef)}
    assert function in tests or (function == "*" and tests)


def source_of(kind: type) -> str:
    import inspect

    return "".join(inspect.getsource(one) for one in kind.__mro__ if one.__module__.startswith("realitygap"))


def test_everything_that_a_world_offers_is_in_the_table() -> None:
    named = {
        place.split(".")[2]
        for entry in HERE
        for place in entry["here"]
        if place.startswith("classroom.jyro.")
    }
    parts_of_others = {
        "Area",
        "Column",
        "DrivenRobot",
        "Edge",
        "Lamp",
        "LampSeen",
        "LightMode",
        "Mount",
        "Part",
    }
    assert named == set(jyro.__all__) - parts_of_others
