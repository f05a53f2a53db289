"""A robot that a network drives while visitors watch: simulated, a twin, or emulated."""

from __future__ import annotations

from realitygap.errors import StudyError
from realitygap.platforms import emulated_robot, platform_of
from realitygap.robots import Robot
from realitygap.runs import Condition


def open_robot(condition: Condition, spec: str = "") -> tuple[Robot, int]:
    """Open a robot at the start of a condition's arena; return it with the number of commands in a trial.

    Args:
        condition: Whose networks drive it.
        spec: A platform as users name it; the condition's own when empty, with its settings.

    Raises:
        StudyError: There is no such platform, or a program cannot place its robot.
        DescriptionError: The twin's file cannot be used.
        MissingExtraError: MuJoCo is not installed.
        RobotError: The emulated robot cannot be reached.
    """
    own, arena = condition.on, condition.placed_arena
    if own.is_physical and not spec:
        spec = emulated_robot(own.name)  # in this program
    if spec in ("", own.spec):
        return own.in_double().open_robot(arena, noise=condition.noise), own.steps
    platform = platform_of(spec)
    if platform.needs_person:
        raise StudyError(
            f"{spec!r} cannot be driven live, because a person must place this robot. Expected an emulated one, such "
            f"as {emulated_robot(platform.name)!r}."
        )
    if platform.name == own.name:
        platform = platform.model_copy(update={"steps": own.steps})
    noise = condition.noise if own.takes_noise and platform.takes_noise else platform.default_noise
    return platform.in_double().open_robot(arena, noise=noise), platform.steps
