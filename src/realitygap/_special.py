"""Special functions of SciPy, loaded when the first is used: what needs none begins half a second earlier."""

from __future__ import annotations

from importlib import import_module
from typing import Any


def __getattr__(name: str) -> Any:
    return getattr(import_module("scipy.special"), name)
