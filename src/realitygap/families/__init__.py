"""Families of robots, a folder each: protocol, driver, emulator, platforms, and robot files.

No other package names a family. They ask `realitygap.robot_families`, which reads the `FAMILY` of each folder.
"""

from importlib import import_module
from pkgutil import iter_modules
from types import ModuleType


def __getattr__(name: str) -> ModuleType:
    if name not in {module.name for module in iter_modules(__path__)}:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return import_module(f"{__name__}.{name}")
