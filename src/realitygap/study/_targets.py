"""What a user names as a target, opened: `jyro`, `sim`, `sim:FILE`, `twin:FILE`, `scribbler:PORT`."""

from __future__ import annotations

from realitygap.errors import StudyError, did_you_mean
from realitygap.records import ObservationsHead, Observe
from realitygap.robots import DEFAULT_ROBOT, JyroPlatform, SimPlatform
from realitygap.trials import SimTarget, Target, TwinTarget
from realitygap.world import Arena

TARGETS = ("jyro", "sim", "sim:FILE", "twin:FILE", "scribbler:PORT")


def open_target(
    spec: str,
    arena: Arena,
    *,
    processes: int | None = None,
    noise: float = 0.0,
    key: int = 0,
) -> Target:
    """Open what can carry out trials.

    Args:
        spec: Its name: `jyro`, `sim`, `sim:FILE`, where the file is of a robot or a calibration, or `twin:FILE`.
        arena: Where.
        processes: Of a twin: how many; one a processor that may be used when not given.
        noise: Of a simulator: the paper's a, on top of the robot's own noise.
        key: Of a simulator: of its random numbers.

    Raises:
        StudyError: There is no such platform, or it cannot be made of this.
        DescriptionError: The twin's file cannot be used.
        MissingExtraError: MuJoCo is not installed.
        RobotError: The twin's process does not come up.
    """
    name, colon, rest = spec.partition(":")
    if name == "jyro" and not colon:
        return SimTarget(JyroPlatform(), arena, noise, key=key, name=spec)
    if name == "sim" and bool(colon) == bool(rest):
        return SimTarget(_sim(rest), arena, noise, key=key, name=spec)
    if name == "twin" and rest:
        return TwinTarget(rest, arena, processes, name=spec)
    raise StudyError(f"{spec!r} is no platform for trials. {did_you_mean(spec, TARGETS)}")


def observations_head(target: Target, observe: Observe, robot: str = DEFAULT_ROBOT) -> ObservationsHead:
    """What a file of trials of a target begins with."""
    return ObservationsHead(target.name, target.label, robot, target.arena.to_dict(), target.step_s, observe)


def _sim(file: str) -> SimPlatform:
    try:
        return SimPlatform(**({"robot": file} if file else {}))
    except ValueError as error:
        raise StudyError(f"sim:{file}: {str(error).removeprefix('SimPlatform.robot: ')}") from None
