"""A network of a study drives a robot while visitors watch: simulated, a twin, or emulated.

`LiveJob` is what pages see; `drive_live` runs in a process of its own.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from realitygap.errors import StudyError
from realitygap.platforms import emulated_robot, platform_of
from realitygap.playback import PackedScene, PackedTrial, WatchedRobot, pack_scene, pack_trials
from realitygap.report import choose_trial, read_tally
from realitygap.robots import Robot
from realitygap.runs import Condition, genome_of
from realitygap.trials import drive_trial

from ._channel import Channel
from ._files import refuse_outside, refuse_port
from ._job import MOST_POINTS, Job
from ._messages import LiveBegun, LiveNews, LivePlayed, LiveWork, Message
from ._mistakes import Mistakes

_NAMES = {"replicate": "run", "generation": "generation", "individual": "individual"}


def live_mistakes(root: Path, values: Mapping[str, Any]) -> Mistakes:
    """Return what is wrong in the fields of a live drive."""
    mistakes, platform = Mistakes(), str(values.get("platform") or "")
    with mistakes.in_field("platform"):
        refuse_port(root, platform) if "://" in platform else refuse_outside(root, platform)
    return mistakes


class LiveJob(Job):
    """A robot that is driven while pages look.

    Attributes:
        scene: What stands still; None before the robot is there.
        trials: What can be played: a trial in which nothing has happened yet, and in the end all of it.
        messages: What pages are told of it, in order; `n_told` of them so far, the older ones forgotten.

    Args:
        work: What the process is told.
        root: Where it works.
        changed: Called when it begins and ends, from another thread.
    """

    QUIET = (LiveNews,)

    def __init__(self, work: LiveWork, root: Path, changed: Callable[[], None]) -> None:
        self.scene: PackedScene | None = None
        self.trials: list[PackedTrial] = []
        self.messages: list[dict[str, Any]] = []
        self.n_told = 0
        self._trail: list[list[float]] = []
        self._cells: list[int] = []
        super().__init__(work, root, changed)

    @property
    def is_live(self) -> bool:
        """True if it drives."""
        return self.scene is not None and not self.is_over

    def since(self, n: int) -> list[dict[str, Any]]:
        """Return the messages after the first n; one message with everything if they were forgotten."""
        n_new = self.n_told - n
        if not self.messages or n_new <= 0:
            return []
        if n and n_new <= len(self.messages):
            return self.messages[-n_new:]
        last = {**self.messages[-1], "trail": self._trail[:-1], "cells": self._cells, "lasts": 0.0}
        return [{"kind": "begin"}, last]

    def _take(self, message: Message) -> None:
        match message:
            case LiveBegun():
                self.trials, self.scene = message.trials, message.scene
            case LivePlayed():
                self.trials = message.trials
                self._conclude(message.problem or "Driven.")
            case LiveNews():
                self._remember(message.content)
            case _:
                super()._take(message)

    def _remember(self, content: dict[str, Any]) -> None:
        """Remember where the robot was, for pages that come later."""
        if content.get("kind") != "now":
            self._trail, self._cells, self.messages = [], [], []
            return
        self._trail = [*self._trail, *content["trail"], content["pose"][:2]][-MOST_POINTS:]
        self._cells += content["cells"]
        self.messages = [*self.messages[-40:], content]
        self.n_told += 1


# in a process


class _FarPage:
    """A page at the other end of the channel."""

    def __init__(self, channel: Channel) -> None:
        self._channel = channel
        self.scene, self.trials = pack_scene(None, ""), pack_trials([])
        self.live = True

    def send(self, content: dict[str, Any]) -> None:
        """Tell it where the robot is."""
        self._channel.say(LiveNews(content))

    def on_msg(self, handler: Callable[[Any, dict[str, Any], Any], None]) -> None:
        """Do nothing: the server keeps the messages for pages that are opened later."""


def drive_live(channel: Channel, work: LiveWork) -> None:
    """Drive one trial, as fast as it goes in truth."""
    chosen = choose_trial(read_tally(Path(work.folder)), **work.trial)
    row, condition = chosen.row, chosen.condition
    robot, n_steps = open_robot(condition, work.platform)
    page, problem = _FarPage(channel), "Stopped."
    which = ", ".join(f"{name} {row[key]}" for key, name in _NAMES.items())
    try:
        with WatchedRobot(robot, arena=condition.placed_arena, page=page) as watched:
            page.scene["title"] = f"{condition.name}, {which}"
            channel.say(LiveBegun(page.scene, page.trials))
            genome = genome_of(condition, row)
            driven = drive_trial(watched, genome.network(), n_steps, interface=genome.interface)
            problem = driven.problem
    finally:
        channel.say(LivePlayed(page.trials, problem))


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
