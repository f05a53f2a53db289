"""A robot that somebody wants to see driven by a network: simulated, a twin, or emulated."""

from __future__ import annotations

from realitygap.errors import StudyError, did_you_mean
from realitygap.robots import JyroPlatform, Robot, SimPlatform
from realitygap.robots.twin import load_twin
from realitygap.runs import Condition
from realitygap.study import connect_robot
from realitygap.trials import JyroRobot, SimRobot, open_twin
from realitygap.world import Arena

EMULATED = "emulator://s2?fluke=2"
PLATFORMS = ("jyro", "sim", "sim:FILE", "twin:FILE", EMULATED)


def own_platform(condition: Condition) -> str:
    """Where the trials of a condition are driven, as `open_robot` takes it; a robot's on an emulated one."""
    if condition.platform == "scribbler":
        return EMULATED
    return f"twin:{condition.twin.file}" if condition.platform == "twin" else condition.platform


def open_robot(condition: Condition, platform: str) -> tuple[Robot, int]:
    """A robot, and how many commands a trial has on it.

    Args:
        condition: Whose networks drive it; where they were evolved on this platform it is as they knew it.
        platform: jyro, sim, sim:FILE, twin:FILE or the port of an emulated robot in this program.

    Raises:
        StudyError: There is no such platform, or it cannot be made of this.
        DescriptionError: The twin's file cannot be used.
        MissingExtraError: MuJoCo is not installed.
        RobotError: The emulated robot cannot be reached.
    """
    arena = condition.placed_arena
    name, _, rest = platform.partition(":")
    if platform == "jyro":
        jyro = (condition.jyro if condition.platform == "jyro" else JyroPlatform()).model_copy(
            update={"precision": "double"}
        )
        return JyroRobot(jyro, arena, noise=condition.noise), jyro.steps
    if name == "sim":
        sim = condition.sim if condition.platform == "sim" and not rest else _sim(rest)
        return SimRobot(sim, arena), sim.steps
    if name == "twin" and rest:
        return _twin(rest, arena), condition.twin.steps
    if name == "emulator":
        return _emulated(condition, platform), condition.scribbler.steps
    raise StudyError(f"{platform!r} cannot be shown live. {did_you_mean(platform, PLATFORMS)}")


def _sim(file: str) -> SimPlatform:
    try:
        return SimPlatform(**({"robot": file} if file else {}))
    except ValueError as error:
        raise StudyError(f"sim:{file}: {str(error).removeprefix('SimPlatform.robot: ')}") from None


def _twin(file: str, arena: Arena) -> Robot:
    return open_twin(load_twin(file), arena)


def _emulated(condition: Condition, port: str) -> Robot:
    """Put at the start by its witness."""
    robot = connect_robot(port)(condition.scribbler)
    witness = getattr(getattr(robot, "port", None), "witness", None) or getattr(robot, "witness", None)
    if witness is not None:
        witness.place(condition.placed_arena.start, 0)
    return robot
