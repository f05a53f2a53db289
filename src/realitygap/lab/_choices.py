"""Platforms, robots, and controllers that forms offer: built in, in the lab's folder, and at this computer."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Literal

from realitygap._wording import platform_in_words
from realitygap.platforms import (
    Platform,
    built_in_platforms,
    emulated_robots,
    platform_class,
    platform_names,
    split_spec,
)
from realitygap.robots import PortGuess
from realitygap.study import named_studies
from realitygap.world import robot_names

from ._files import plain_files

Choices = Mapping[str, Mapping[str, str]]
"""Title of each group, and in it the words for each text that can be chosen."""
Use = Literal["simulator", "target", "robot", "study"]
MOST_FILES = 200
"""Number of files of the lab's folder that are offered."""
_PORTS = "Ports of this computer"


def platform_choices(root: Path, use: Use, ports: Sequence[PortGuess] = ()) -> Choices:
    """Return the platforms that can be chosen.

    Args:
        root: Folder whose files are offered.
        use: Use of the platform: simulator or target of a gap, robot of a calibration, or platform of a condition. A
            target needs no person.
        ports: Ports of this computer, for robots.
    """
    models = built_in_platforms()
    groups: dict[str, dict[str, str]] = {"Simulators": {}}
    for model in models:
        has_rest = bool(model.rest)  # only such a platform has numbers that a calibration fits
        if not (model.is_physical or model.needs_rest) and (has_rest or use != "robot"):
            groups["Simulators"][model.name] = _words(model)
    groups |= _files(root, [model for model in models if model.is_simulator or use != "simulator"])
    if use in ("target", "robot"):
        groups["Emulated robots"] = {spec: _named(spec, "EMULATED") for spec in emulated_robots()}
    if use == "robot":
        groups[_PORTS] = {guess.port: f"{guess.port}: {guess.seems}" for guess in ports}
    if use == "study":
        groups["Robots"] = {model.name: _words(model) for model in models if model.is_physical}
    groups["Other robots"] = {f"sim:{name}": _named(f"sim:{name}") for name in _shipped_robots()}
    known = {model.name for model in models}
    groups["Other packages"] = {name: name for name in platform_names() if name not in known}
    return groups


def port_choices(ports: Sequence[PortGuess]) -> Choices:
    """Return the ports of this computer."""
    return {_PORTS: {guess.port: f"{guess.port}: {guess.seems}" for guess in ports}}


def controller_choices(studies: Sequence[str]) -> Choices:
    """Return the origins of controllers: random networks, and studies whose champions drive.

    Args:
        studies: Names of the studies in the lab's folder.
    """
    return {
        "Random": {"random": "Random networks"},
        "Champions of studies in this folder": {name: name for name in studies},
        "Champions of other studies, evolved first": {
            name: name for name in named_studies() if name not in studies
        },
    }


def model_choices(root: Path) -> Choices:
    """Return the robots that a calibration can start from."""
    files = _files(root, [model for model in built_in_platforms() if model.is_simulator])
    named = {
        title: {split_spec(spec)[1]: Path(split_spec(spec)[1]).stem for spec in listed}
        for title, listed in files.items()
    }
    return named | {"Robots": {name: name for name in robot_names()}}


def _words(model: type[Platform]) -> str:
    return f"{model.name}: {model.summary.partition(':')[0]}"


def _named(spec: str, label: str = "") -> str:
    return platform_in_words(spec, label).removeprefix("the ")


def _shipped_robots() -> list[str]:
    """Return the names of robots, without those of other equipment."""
    names = set(robot_names())
    base = platform_class("sim").base_robot
    return sorted(name for name in names - {base} if name.rpartition("-")[0] not in names)


def _files(root: Path, models: Sequence[type[Platform]]) -> dict[str, dict[str, str]]:
    """Return the files of a folder that platforms take, by kind, the last one changed first."""
    groups: dict[str, dict[str, str]] = {}
    for path in plain_files(root, (".toml",))[:MOST_FILES]:
        for model in models:
            if model.rest and (kind := model.kind_of_file(path)):
                title = f"{kind.capitalize()}s in this folder"
                spec = f"{model.name}:{path.name}"
                groups.setdefault(title, {})[spec] = _named(spec)
    return groups
