"""A network of a study drives a robot in its own process while visitors watch: simulated, a twin, or emulated."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from realitygap.errors import StudyError
from realitygap.platforms import emulated_robot, platform_of
from realitygap.playback import WatchedRobot, pack_scene, pack_trials
from realitygap.report import choose_trial, read_tally
from realitygap.robots import Robot
from realitygap.runs import Condition, genome_of
from realitygap.trials import drive_trial

from ._channel import Channel, Message

NUMBERS = ("condition", "replicate", "generation", "individual")

_NAMES = {"replicate": "run", "generation": "generation", "individual": "individual"}


class _FarPage:
    """A page at the other end of the channel."""

    def __init__(self, channel: Channel) -> None:
        self._channel = channel
        self.scene, self.trials = pack_scene(None, ""), pack_trials([])
        self.live = True

    def send(self, content: dict[str, Any]) -> None:
        """Tell it where the robot is."""
        self._channel.say("told", content=content)

    def on_msg(self, handler: Callable[[Any, dict[str, Any], Any], None]) -> None:
        """Do nothing: the server keeps the messages for pages that are opened later."""


def work(channel: Channel, order: Message) -> None:
    """Drive one trial, as fast as it goes in truth.

    Args:
        channel: To the server.
        order: `folder` of the study, `platform` as `open_robot` takes it, or empty for the study's own, and of which
            trial: `condition`, `replicate`, `generation` and `individual`, where they are named.
    """
    numbers = {key: order[key] for key in NUMBERS if key in order}
    chosen = choose_trial(read_tally(Path(order["folder"])), **numbers)
    row, condition = chosen.row, chosen.condition
    robot, n_steps = open_robot(condition, order.get("platform") or "")
    page, problem = _FarPage(channel), "Stopped."
    which = ", ".join(f"{name} {row[key]}" for key, name in _NAMES.items())
    try:
        with WatchedRobot(robot, arena=condition.placed_arena, page=page) as watched:
            scene = {**page.scene, "title": f"{condition.name}, {which}"}
            channel.say("begun", scene=scene, trials=page.trials)
            genome = genome_of(condition, row)
            driven = drive_trial(watched, genome.network(), n_steps, interface=genome.interface)
            problem = driven.problem
    finally:
        channel.say("played", trials=page.trials, problem=problem)


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
