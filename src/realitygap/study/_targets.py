"""What a user names as a target, opened: `jyro`, `sim`, `sim:FILE`, `twin:FILE`, `scribbler:PORT`, `recorded:FILE`."""

from __future__ import annotations

import functools

from realitygap.errors import StudyError, did_you_mean
from realitygap.records import ObservationsHead, Observe
from realitygap.robots import DEFAULT_ROBOT, JyroPlatform, ScribblerPlatform, SimPlatform
from realitygap.robots.scribbler import is_in_this_program
from realitygap.trials import (
    Attendant,
    OnLost,
    RecordedTarget,
    RobotTarget,
    SimTarget,
    Target,
    TwinTarget,
    WitnessAttendant,
)
from realitygap.world import Arena

from ._robot import connect_robot

FULL_SCALE = 6400.0
"""The largest reading of a Fluke's obstacle sensors: readings of robots and simulators are shares of it."""
TARGETS = ("jyro", "sim", "sim:FILE", "twin:FILE", "scribbler:PORT", "recorded:FILE")


def open_target(
    spec: str,
    arena: Arena,
    *,
    processes: int | None = None,
    witness: str | None = None,
    attendant: Attendant | None = None,
    step_s: float = 0.5,
    on_lost: OnLost = "retry",
    noise: float = 0.0,
    key: int = 0,
) -> Target:
    """Open what can carry out trials.

    Args:
        spec: Its name: `jyro`, `sim`, `sim:FILE`, where the file is of a robot or a calibration, `twin:FILE`,
            `scribbler:PORT`, or `recorded:FILE`, trials that were observed before.
        arena: Where.
        processes: Of a twin: how many; one a processor that may be used when not given.
        witness: Of an emulated robot in another program: the address of its witness, HOST:PORT.
        attendant: Of a robot: who places it and says what it drew, where no witness does.
        step_s: Of a robot: how long one command lasts [s].
        on_lost: Of a robot: what follows a trial in which the link was lost.
        noise: Of a simulator: the paper's a, on top of the robot's own noise.
        key: Of a simulator: of its random numbers.

    Raises:
        StudyError: There is no such platform, or it cannot be made of this.
        DescriptionError: The twin's file cannot be used.
        MissingExtraError: MuJoCo is not installed.
        RobotError: The robot, its witness or the twin's process cannot be reached.
    """
    name, colon, rest = spec.partition(":")
    if name == "jyro" and not colon:
        return SimTarget(JyroPlatform(), arena, noise, key=key, name=spec)
    if name == "sim" and bool(colon) == bool(rest):
        return SimTarget(_sim(rest), arena, noise, key=key, name=spec)
    if name == "twin" and rest:
        return TwinTarget(rest, arena, processes, name=spec)
    if name == "recorded" and rest:
        return RecordedTarget(rest, name=spec)
    if name == "scribbler" and rest:
        platform = ScribblerPlatform(reading_max=FULL_SCALE)
        chosen = attendant or _witness(rest, witness)
        opened = functools.partial(connect_robot(rest), platform)
        return RobotTarget(opened, arena, chosen, name=spec, step_s=step_s, on_lost=on_lost)
    raise StudyError(f"{spec!r} is no platform for trials. {did_you_mean(spec, TARGETS)}")


def observations_head(target: Target, observe: Observe, robot: str = DEFAULT_ROBOT) -> ObservationsHead:
    """What a file of trials of a target begins with."""
    arena = target.arena.to_dict()
    return ObservationsHead(target.name, target.label, robot, arena, target.step_s, observe, target.identity)


def steps_as_a_robot(target: Target) -> bool:
    """Whether a step of a target lasts as long as a robot's command; Jyro's is its own, of 0.1 s at 1 m/s."""
    return not (isinstance(target, SimTarget) and isinstance(target.platform, JyroPlatform))


def _witness(port: str, address: str | None) -> Attendant:
    if is_in_this_program(port):
        return WitnessAttendant()
    if address is not None:
        from realitygap.emulator import connect_witness

        remote = connect_witness(address)
        remote.hold()  # before its robot is spoken to: somebody may have left it driving, faster than it answers
        return WitnessAttendant(remote)
    raise StudyError(
        f"Who places the robot at {port} and says what it drew? Name the witness of an emulator (HOST:PORT, from "
        "realitygap emulate --witness PORT), or give an attendant."
    )


def _sim(file: str) -> SimPlatform:
    try:
        return SimPlatform(**({"robot": file} if file else {}))
    except ValueError as error:
        raise StudyError(f"sim:{file}: {str(error).removeprefix('SimPlatform.robot: ')}") from None
