"""The port of an emulated Scribbler, and the emulator that text options describe."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import ClassVar

from realitygap.emulator import EmulatedPort, number_in
from realitygap.errors import RobotError
from realitygap.robots.twin import TwinBody, load_twin
from realitygap.world import Arena

from ._emulator import Emulator
from ._link import Faults
from ._scene import open_scene


class ScribblerPort(EmulatedPort):
    """A serial port with an emulated Scribbler at its other end: emulator://s2?fluke=2&seed=1."""

    options: ClassVar[tuple[str, ...]] = ("fluke", "arena", "seed", "timing", "faults", "state", "twin")

    def make_robot(self, host: str, options: Mapping[str, str]) -> Emulator:
        """Return the emulator that an address describes; an S2 if it names no model."""
        return make_emulator(host or "s2", options)


def make_emulator(model: str, options: Mapping[str, str]) -> Emulator:
    """Return the emulator that text options describe: fluke, arena, seed, timing, faults, state, twin.

    Raises:
        RobotError: One of them is not known or out of range.
    """
    timing = options.get("timing", "on")
    if timing not in ("on", "off"):
        raise RobotError(f"timing={timing}: expected on or off.")
    scene = open_scene(options.get("arena", "paper"))
    return Emulator(
        model,  # type: ignore[arg-type]  # checked there
        options.get("fluke", "2" if model == "s2" else "1"),  # type: ignore[arg-type]  # checked there
        arena=scene,
        seed=int(number_in("seed", options.get("seed", "0"), 0, 2**63, whole=True)),
        faults=Faults.parse(options.get("faults", "")),
        timing=timing == "on",
        state=Path(options["state"]) if options.get("state") else None,
        robot=_twin(options["twin"], scene.arena) if options.get("twin") else None,
    )


def _twin(file: str, arena: Arena) -> TwinBody:
    """Return a twin's body from its file."""
    try:
        return TwinBody(load_twin(file), arena)
    except ValueError as error:
        raise RobotError(f"{error}") from error
