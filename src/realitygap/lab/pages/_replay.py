"""Trials of a study that are played, compared, or driven live."""

from __future__ import annotations

import secrets
from typing import Any

from nicegui import run, ui

from realitygap.errors import StudyError
from realitygap.lab._choices import Choices
from realitygap.lab._lab import Lab
from realitygap.lab._live import LiveJob, live_mistakes
from realitygap.lab._messages import Archive, ReplayRefused, TrialChoice
from realitygap.lab._mistakes import Mistakes
from realitygap.lab._watcher import Watcher
from realitygap.orders import Limits

from ._elements import Elites, Player
from ._fields import Form
from ._frame import hint, section
from ._part import Part
from ._touch import Touch

_NUMBERS = {"replicate": "Run", "generation": "Generation", "individual": "Individual"}
MOST_TRIALS = 4
"""Number of trials that are played together: more robots cover each other."""
LIVE_S = 0.05
"""Time between two looks at a robot that is driven [s]."""


class LivePlayer:
    """A robot that is driven for those who look, until it can be played again.

    Args:
        job: What drives it.
    """

    def __init__(self, job: LiveJob) -> None:
        self._job = job
        self._n_told = 0
        self._is_ready = False
        self._is_live = job.is_live

    def show(self) -> None:
        """Show it."""
        job = self._job
        if job.outcome is not None and job.scene is None:
            ui.label(job.outcome).classes("lab-problem").props('role="status"')
            return
        if job.scene is None:
            ui.label("Getting the robot ready…").props('role="status"')
            return
        self._player = Player(job.scene, job.trials, live=job.is_live)
        self._player.on("all", self._ready)
        if job.is_live:
            self._timer = ui.timer(LIVE_S, self._look)

    def _ready(self) -> None:
        """Begin to send the trial, because the page is ready."""
        self._is_ready, self._n_told = True, 0

    def _look(self) -> None:
        job = self._job
        if self._is_ready and (messages := job.since(self._n_told)):
            self._n_told = job.n_told
            self._player.run_method("told", messages)
        if not job.is_live:
            self._timer.deactivate()
            self._player.run_method("ended", job.trials)


class Replays:
    """The form that chooses trials, and the players that show them.

    Args:
        lab: Lab of the page.
        name: Name of the study.
        watcher: Computes replays.
        conditions: Names of its conditions.
        platforms: Platforms on which a network can be driven live.
    """

    def __init__(
        self, lab: Lab, name: str, watcher: Watcher, conditions: list[str], platforms: Choices
    ) -> None:
        self._lab, self._name, self._watcher = lab, name, watcher
        self._conditions, self._platforms = conditions, platforms
        self._key = secrets.token_hex(8)
        self._is_computing = self._has_played = False
        self._choices: list[TrialChoice] = []

    def show(self) -> None:
        """Show them."""
        self._form = form = Form()
        form.summary()
        with ui.element("div").classes("lab-fields"):
            self._condition = form.choice("condition", "Condition", self._conditions, self._conditions[0])
            self._numbers = {
                key: form.number(key, label, None, Limits(high=2**31)) for key, label in _NUMBERS.items()
            }
        hint("If you don't choose a run, the run with the median best coverage is shown.")
        with ui.row().classes("lab-row"):
            ui.button("Show trial", on_click=lambda: self._play()).props("unelevated no-caps")
            ui.button("Compare", on_click=lambda: self._play(compares=True)).props("outline no-caps")
        hint(f"Compare adds the chosen trial to those shown, up to {MOST_TRIALS}.")
        self._archive = Part(self._archive_state, self._show_archive)
        self._archive.show()
        self._condition.on_value_change(self._archive.look)
        self._stage = ui.refreshable(self._show_stage)
        self._stage()
        self._touch = Touch(self._watcher, lambda: self._choices[-1] if self._choices else None)
        self._touch.show()
        section("Drive live")
        with ui.element("div").classes("lab-form"):
            form.text(
                "platform",
                "Platform",
                choices={"Default": {"": "The platform of the condition"}} | dict(self._platforms),
            )
        ui.button("Drive live", on_click=lambda: form.submit(self._drive, self._mistakes_of_drive)).props(
            "outline no-caps"
        )
        self._live = Part(self._live_state, self._show_live)
        self._live.show()

    def look(self) -> None:
        """Show what has changed."""
        if self._is_computing and self._key in self._watcher.replays:
            self._is_computing = False
            if isinstance(self._watcher.replays[self._key], ReplayRefused):
                self._choices = self._choices[:-1]
            self._stage.refresh()
        self._archive.look()
        self._live.look()
        self._touch.look()

    async def play_first(self) -> None:
        """Play the typical run, unless a trial was played already, whatever a visitor is entering."""
        if not self._has_played:
            await run.io_bound(self._begin, [], {"condition": self._conditions[0]})
            self._stage.refresh()

    async def _play(self, *, compares: bool = False) -> None:
        before = self._choices if compares else []

        def ask(values: dict[str, Any]) -> None:
            if len(before) >= MOST_TRIALS:
                raise StudyError(
                    f"{MOST_TRIALS} trials are shown. Show one trial, then compare others with it."
                )
            if (choice := _choice_of(values)) in before:
                raise StudyError("This trial is shown already. Choose another condition, run, or generation.")
            self._begin(before, choice)

        if await self._form.submit(ask, self._mistakes):
            self._stage.refresh()

    def _begin(self, before: list[TrialChoice], choice: TrialChoice) -> None:
        """Begin to compute a replay; results of earlier requests come too late."""
        key, choices = secrets.token_hex(8), [*before, choice]
        self._watcher.replay(key, choices)
        self._key, self._choices = key, choices
        self._has_played = self._is_computing = True

    def _mistakes(self, values: dict[str, Any]) -> Mistakes:
        """Return a mistake for each number that no trial of the chosen condition has."""
        mistakes = Mistakes()
        described = self._lab.studies.results(self._name).description
        conditions = [each for each in described["conditions"] if isinstance(each, dict)]
        settings = {each["name"]: each.get("settings") or {} for each in conditions}
        neat = settings.get(values["condition"], {}).get("neat", {})
        sizes = (described.get("replicates"), neat.get("generations"), neat.get("population"))
        for key, size in zip(_NUMBERS, sizes, strict=True):
            number = values.get(key)
            if number is not None and (number < 0 or number >= (size or 2**31)):
                words = Limits(0, (size or 2**31) - 1).words
                mistakes.problems[key] = f"Enter {words}. You entered {number}."
        if values.get("individual") is not None and values.get("generation", 0) is None:
            mistakes.problems["generation"] = "Enter the generation of the individual."
        return mistakes

    def _mistakes_of_drive(self, values: dict[str, Any]) -> Mistakes:
        mistakes = self._mistakes(values)
        mistakes.problems |= live_mistakes(self._lab.root, values).problems
        return mistakes

    def _drive(self, values: dict[str, Any]) -> None:
        self._lab.drive_live(self._name, values["platform"], _choice_of(values))

    def _archive_state(self) -> Archive | ReplayRefused | None:
        return self._watcher.archive(str(self._condition.value)) if self._has_played else None

    def _show_archive(self, archive: Archive | ReplayRefused | None) -> None:
        if isinstance(archive, ReplayRefused):
            ui.label(archive.text).classes("lab-problem").props('role="alert"')
        elif archive is not None and archive.maps:
            section("Archive")
            replicate = archive.maps["replicate"]
            Elites(archive.maps).on("choose", lambda event: self._play_elite(replicate, event.args))

    async def _play_elite(self, replicate: int, elite: Any) -> None:
        """Show the trial of an elite, and enter its numbers, with which it can be driven."""
        if not isinstance(elite, dict):
            return
        for key, number in {"replicate": replicate, **elite}.items():
            if key in self._numbers and isinstance(number, int):
                self._numbers[key].set_value(number)
        await self._play()

    def _live_state(self) -> tuple[int, bool, bool] | None:
        job = self._lab.lives.get(self._name)
        return None if job is None else (id(job), job.scene is None, job.is_over)

    def _show_live(self, state: tuple[int, bool, bool] | None) -> None:
        job = self._lab.lives.get(self._name)
        if job is None:
            return
        LivePlayer(job).show()
        if not job.is_over:
            ui.button("End drive", on_click=job.ask_to_end).props("flat no-caps")
        elif job.scene is not None:
            ui.label(job.outcome or "").classes("lab-problem" if job.is_failed else "lab-hint").props(
                'role="status"'
            )

    def _show_stage(self) -> None:
        if self._is_computing:
            ui.label("Computing the trial…").props('role="status"')
            return
        replay = self._watcher.replays.get(self._key)
        if replay is None:
            return
        if isinstance(replay, ReplayRefused):
            ui.label(replay.text).classes("lab-problem").props('role="alert"')
        else:
            Player(replay.scene, replay.trials)


def _choice_of(values: dict[str, Any]) -> TrialChoice:
    """Return the trial that the fields of the form name."""
    choice: TrialChoice = {"condition": values["condition"]}
    for key in ("replicate", "generation", "individual"):
        if values[key] is not None:
            choice[key] = values[key]
    return choice
