"""Tables of the pages on the Python API: the packages, and the classes and functions of each.

The pages name the packages: `docs/reference/api/NAME.md` documents one of them by `automodule`.
"""

from __future__ import annotations

import importlib
import inspect
import re
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType

PAGES = Path(__file__).parent / "reference" / "api"
_MODULE = re.compile(r"automodule:: (\S+)\n")
_EXCLUDED = re.compile(r":exclude-members: (.*)\n")


def page_parts() -> dict[str, str]:
    """Return the generated parts of the pages, by file."""
    tables = {path.stem: _of_page(path) for path in sorted(PAGES.glob("*.md"))}
    packages = [
        f"| [`{module.__name__}`](api/{name}.md) | {_first_line(module)} |"
        for name, (module, _) in tables.items()
    ]
    parts = {f"parts/api-{name}.md": _table("name", rows) for name, (_, rows) in tables.items()}
    return {"parts/api-packages.md": _table("package", packages), **parts}


def _of_page(path: Path) -> tuple[ModuleType, list[str]]:
    """Return the package that a page documents, and a row for each class and function of it."""
    text = path.read_text("utf-8")
    found, excluded = _MODULE.search(text), _EXCLUDED.search(text)
    if found is None:
        raise ValueError(f"{path} documents no package, expected a line `.. automodule:: PACKAGE`")
    module = importlib.import_module(found[1])
    without = set(excluded[1].split(", ")) if excluded else set()
    return module, [row for name in _names(module) if name not in without for row in _row(module, name)]


def _names(module: ModuleType) -> list[str]:
    """Return the public names of a package in the order of its source."""
    own = [
        name for name, value in vars(module).items() if getattr(value, "__module__", "") == module.__name__
    ]
    return list(getattr(module, "__all__", own))


def _row(module: ModuleType, name: str) -> Iterator[str]:
    """Yield a row for a class or function that has a description."""
    value = getattr(module, name)
    if (
        not name.startswith("_")
        and (inspect.isclass(value) or inspect.isroutine(value))
        and _first_line(value)
    ):
        yield f"| {{py:obj}}`{name} <{module.__name__}.{name}>` | {_first_line(value)} |"


def _first_line(value: object) -> str:
    """Return the first paragraph of a description on one line; empty if there is none of its own."""
    text = (getattr(value, "__doc__", None) or "").strip().partition("\n\n")[0]
    is_generated = inspect.isclass(value) and text.startswith(f"{value.__name__}(")
    return "" if is_generated else " ".join(text.split()).replace("|", "\\|")


def _table(head: str, rows: list[str]) -> str:
    return "\n".join([f"| {head} | description |", "|---|---|", *rows, ""])
