"""Platforms as users name them: NAME, or NAME:REST."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any, Literal

from realitygap.errors import RealityGapError, StudyError, did_you_mean
from realitygap.trials import OnLost, PortObserver, Pulse, Target
from realitygap.world import Arena

from ._platform import Opening, Platform
from ._python import EXPECTED, PYTHON, loaded_platform
from ._registry import built_in_platforms, platform_class, platform_names


def split_spec(spec: str) -> tuple[str, str]:
    """Return the name of a platform and what follows its colon; no other code splits at the colon."""
    name, _, rest = spec.partition(":")
    return name, rest


def class_of(spec: str) -> type[Platform]:
    """Return the class of the platform that a user named.

    Raises:
        StudyError: There is no such platform, or something is missing after the name, or too much.
    """
    name, colon, rest = spec.partition(":")
    if name == PYTHON and rest:
        return loaded_platform(spec)
    if name not in platform_names():
        if spec.endswith(".toml"):
            raise StudyError(
                f"{spec!r} is no platform. For a robot file or a calibration, write sim:{spec}. For a twin, "
                f"write twin:{spec}."
            )
        raise StudyError(f"{spec!r} is no platform. {did_you_mean(spec, known_specs())}")
    found = platform_class(name)
    if (colon and not (found.rest and rest)) or (found.needs_rest and not rest):
        raise StudyError(f"{spec!r} is no platform, expected {' or '.join(found.specs())}.")
    return found


def base_robot_of(spec: str) -> str:
    """Return the robot file that calibrations of the platform that a user named build on.

    Raises:
        StudyError: There is no such platform.
    """
    return class_of(spec).base_robot_at(spec.partition(":")[2])


def known_specs() -> tuple[str, ...]:
    """Return the ways to name platforms, those of other packages by their names alone."""
    own = [spec for each in built_in_platforms() for spec in each.specs()]
    return (
        *own,
        EXPECTED,
        *(name for name in platform_names() if name not in {spec.partition(":")[0] for spec in own}),
    )


def platform_of(spec: str) -> Platform:
    """Return the platform that a user named, with default settings.

    Raises:
        StudyError: There is no such platform, or it cannot be made of this.
    """
    found = class_of(spec)
    try:
        return found.from_rest("" if split_spec(spec)[0] == PYTHON else split_spec(spec)[1])
    except ValueError as error:
        text = (
            str(error)
            .removeprefix(f"{found.__name__}.{found.rest_setting}: ")
            .removeprefix(f"{found.__name__}: ")
        )
        raise StudyError(f"{spec}: {text}") from None


def is_physical(settings: Mapping[str, Any]) -> bool:
    """Return whether the trials of a condition with these settings go into a ledger; False without its platform."""
    name = str(settings.get("platform"))
    return name in platform_names() and platform_class(name).is_physical


def described_platform(name: str) -> str:
    """Return the name of a platform with its summary; the name alone if it is not installed."""
    summary = platform_class(name).summary if name in platform_names() else ""
    return f"{name}: {summary}" if summary else name


def names_a_port(spec: str) -> bool:
    """Return whether a user named a robot on a port."""
    name, _ = split_spec(spec)
    return name in platform_names() and platform_class(name).is_physical


def open_target(
    spec: str,
    arena: Arena,
    *,
    processes: int | None = None,
    witness: str | None = None,
    observer: PortObserver | None = None,
    step_s: float | None = None,
    on_lost: OnLost = "retry",
    pulse: Pulse | None = None,
    noise: float = 0.0,
    key: int = 0,
    randomize: Literal["no", "posterior"] = "no",
) -> Target:
    """Open a platform by its name for trials one by one.

    Args:
        spec: Name of the target: `jyro`, `sim`, `sim:FILE` with the file of a robot or a calibration, `twin:FILE`,
            a robot on a port, `NAME:PORT`, `recorded:FILE` with earlier trials, or a platform of another package.
        arena: Arena of the trials.
        processes: Number of processes of a twin; one for each processor when not given.
        witness: Address of the witness of an emulated robot in another program, HOST:PORT.
        observer: Observer, who places a robot and reports what it drew, if there is no witness.
        step_s: Duration of a robot's command [s]; that of its platform when not given.
        on_lost: Reaction to a trial in which the link to a robot was lost.
        pulse: Called when a trial on a robot begins or ends, and when the robot has answered in it.
        noise: Level a of the paper, on top of a simulated robot's own noise.
        key: Key of a simulator's random numbers.
        randomize: posterior draws the robot of each trial from the calibration in FILE.

    Raises:
        StudyError: There is no such platform, or it cannot be made of this.
        DescriptionError: The twin's file cannot be used.
        MissingExtraError: MuJoCo is not installed.
        RobotError: The robot, its witness or the twin's process cannot be reached.
    """
    platform = platform_of(spec)
    how = Opening(spec, noise, key, processes, witness, observer, step_s, on_lost, pulse)
    if randomize != "no":
        drawn = platform.randomized(randomize)
        if not drawn.is_randomized:
            raise StudyError(
                f"--randomize {randomize} draws robots from a calibration, and {spec!r} has no draws: expected "
                "sim:FILE with a file that `realitygap calibrate` wrote from trials."
            )
        platform, how = drawn, replace(how, name=f"{spec}, {randomize}")
    try:
        return platform.open(arena.alone, how)
    except RealityGapError:
        raise
    except ValueError as error:  # of an arena or settings that it cannot have
        raise StudyError(f"{how.name}: {str(error).rstrip('.')}.") from error
