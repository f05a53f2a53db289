"""What a user names as a target, opened: `jyro`, `sim`, `sim:FILE`, `twin:FILE`, `scribbler:PORT`, `recorded:FILE`."""

from __future__ import annotations

import functools
from typing import Literal

from realitygap.errors import RobotError, StudyError, did_you_mean
from realitygap.records import OBSERVATIONS, ObservationsHead, Observe
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
    randomize: Literal["no", "posterior"] = "no",
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
        randomize: Of `sim:FILE`, where the file is a calibration: posterior draws the robot of each trial of a
            controller from it.

    Raises:
        StudyError: There is no such platform, or it cannot be made of this.
        DescriptionError: The twin's file cannot be used.
        MissingExtraError: MuJoCo is not installed.
        RobotError: The robot, its witness or the twin's process cannot be reached.
    """
    name, colon, rest = spec.partition(":")
    if randomize != "no" and not (name == "sim" and rest):
        raise StudyError(
            f"--randomize {randomize} draws robots from a calibration, sim:FILE, and {spec!r} is none."
        )
    if name == "jyro" and not colon:
        return SimTarget(JyroPlatform(), arena, noise, key=key, name=spec)
    if name == "sim" and bool(colon) == bool(rest):
        drawn = "" if randomize == "no" else f", {randomize}"
        return SimTarget(_sim(rest, randomize), arena, noise, key=key, name=spec + drawn)
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


def refuse_more_than_is_seen(target: Target, observe: Observe) -> None:
    """Return where so much can be seen of a target.

    Raises:
        StudyError: It cannot.
    """
    if OBSERVATIONS.index(observe) > OBSERVATIONS.index(target.observes):
        raise StudyError(
            f"observe is {observe!r}, and of {target.name} no more can be seen than {target.observes!r}. Choose that, "
            "or name a witness that sees more."
        )


def refuse_lost(n: int, name: str, kept: str = "") -> None:
    """Return where no trial was lost for good, as where lost ones are skipped.

    Raises:
        RobotError: So many were.
    """
    if n:
        lost = f"{n} trials on {name} were" if n > 1 else f"A trial on {name} was"
        raise RobotError(f"{lost} lost, and cannot be done without.{kept} Carry out what is missing.")


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


def _sim(file: str, randomize: Literal["no", "posterior"]) -> SimPlatform:
    try:
        platform = SimPlatform(**({"robot": file} if file else {}), randomize=randomize)
    except ValueError as error:
        raise StudyError(f"sim:{file}: {str(error).removeprefix('SimPlatform.robot: ')}") from None
    if randomize != "no" and not platform.draws:
        raise StudyError(
            f"--randomize {randomize} draws robots from a calibration, and {file} has no draws: it is a robot, or a "
            "calibration of no trials."
        )
    return platform
