"""Operators of a physical study whose trials are shown on a page, and the camera above its robot."""

from __future__ import annotations

import contextlib
import threading
from collections.abc import Callable, Iterable, Iterator, Sequence
from pathlib import Path

from realitygap.emulator import Witness
from realitygap.errors import RobotError, StudyError
from realitygap.records import LEDGER_NAME, Ledger, Score, TrialRecord
from realitygap.robots import Command, Observation, Robot
from realitygap.study import (
    OWN_POSES,
    CameraObserver,
    OwnPosesObserver,
    Study,
    physical_conditions,
    read_camera,
)
from realitygap.trials import Card, Operator, Preflight, Verdict, WitnessObserver, own_witness
from realitygap.vision import CameraDevice, LiveTrack

from . import _messages as messages
from ._channel import Channel
from ._scoring_files import keep_drawn, keep_proposal, track_proposal

LIVE_S = 0.05
"""Time between two messages on the position of an emulated robot [s]."""


class _Stops:
    """A stop that need not wait for the step to end: the motors first, then the trial."""

    def __init__(self, channel: Channel) -> None:
        self.is_asked = False
        self._robot: Robot | None = None
        channel.at_once(messages.Stop, self._stop)

    def met(self, robot: Robot) -> None:
        """Remember the robot that a stop has to reach."""
        self._robot = robot

    def _stop(self, _wish: messages.Stop) -> None:
        self.is_asked = True
        if self._robot is not None:
            self._robot.stop()


class _Live:
    """Reports the pose of an emulated robot 20 times a second during a trial."""

    def __init__(self, channel: Channel) -> None:
        self._channel = channel
        self._ended = threading.Event()

    def begin(self, witness: Witness) -> None:
        """A trial begins."""
        self._ended = threading.Event()
        threading.Thread(target=self._look, args=(witness, self._ended), daemon=True).start()

    def end(self) -> None:
        """End the updates of the position."""
        self._ended.set()

    def _look(self, witness: Witness, ended: threading.Event) -> None:
        # the trial ends with the emulator, and the loop that drives reports it
        with contextlib.suppress(RobotError):
            while not ended.wait(LIVE_S):
                self._channel.say(messages.RobotPose(list(witness.pose()), list(witness.cells())))


class _Shown:
    """Reports trials to the page, and receives stops from it."""

    def __init__(self, channel: Channel) -> None:
        self._channel = channel
        self.stops = _Stops(channel)
        self._live = _Live(channel)

    def met(self, robot: Robot) -> None:
        """Report the robot that is in use."""
        self.stops.met(robot)
        self._channel.say(messages.RobotMet(robot.label))

    def begun(self, card: Card, observer: WitnessObserver | None) -> None:
        """The robot stands at the start of a trial."""
        if observer is not None:
            self._live.begin(observer.witness)
        self.stops.is_asked = False
        self._channel.say(messages.TrialBegun(card_values(card)))

    def step(self, card: Card, step: int, seen: Observation, command: Command) -> bool:
        """Report a step that begins; return True if a person pressed stop."""
        raw, (move, turn) = list(seen.raw), command
        self._channel.say(messages.Step(step, card.n_steps, raw, stalled=seen.stalled, move=move, turn=turn))
        return self.stops.is_asked

    def cut_off(self) -> None:
        """The trial was interrupted."""
        self._live.end()

    def driven(self) -> None:
        """The trial has ended."""
        self._live.end()
        self._channel.say(messages.TrialDriven())


class WatchedOperator(Operator):
    """An emulated robot without an operator; visitors can watch and stop it.

    Args:
        channel: To the server.
        witness: Of an emulator in another program.
    """

    def __init__(self, channel: Channel, witness: Witness | None = None) -> None:
        self._witness = WitnessObserver(witness)
        super().__init__(self._witness)
        self._channel = channel
        self._page = _Shown(channel)
        self._is_stopped = False

    def meet(self, robot: Robot) -> None:
        """Remember the robot, so that a visitor can stop it."""
        super().meet(robot)
        self._page.met(robot)

    def accept(self, preflight: Preflight) -> bool:
        """Return True if the check found no problem; the page shows the problems."""
        self._channel.say(_result_of(preflight))
        return super().accept(preflight)

    def settle(self, card: Card, problem: str) -> Verdict:
        """Void the trial; after a stop, wait until a visitor continues."""
        if self._is_stopped:
            self._is_stopped = False
            self._channel.ask(messages.ContinueQuestion(card_values(card), problem))
        return super().settle(card, problem)

    def place(self, card: Card) -> None:
        """Put the robot at the start."""
        super().place(card)
        self._page.begun(card, self._witness)

    def watch(self, card: Card, step: int, seen: Observation, command: Command) -> bool:
        """Report the step; return True if the trial was stopped."""
        super().watch(card, step, seen, command)
        self._is_stopped = self._page.step(card, step, seen, command)
        if self._is_stopped:
            self._page.cut_off()
        return self._is_stopped

    def drawn(self, card: Card, record: TrialRecord) -> Score | None:
        """The cells along the driven line."""
        self._page.driven()
        return super().drawn(card, record)


class PageOperator(Operator):
    """A person at a page, who places the robot and watches it; the cells are entered at any page, into the ledger.

    An emulated robot is placed by its witness, and the line that it drew is kept beside the ledger for whoever counts,
    as a sheet of paper is.

    Args:
        channel: To the server.
        folder: Of the study's results.
        when: Whether to wait for cells after each trial, or when the sheet is full: trial or sheet.
        witness: Of an emulator in another program.

    Attributes:
        proposer: Name of the camera whose cells wait for a person to look at them; empty if they are entered.
    """

    def __init__(
        self, channel: Channel, folder: Path, *, when: str = "sheet", witness: Witness | None = None
    ) -> None:
        super().__init__()
        self._channel, self._folder, self._when, self._remote = channel, folder, when, witness
        self._page = _Shown(channel)
        self._witness: WitnessObserver | None = None
        self.proposer = ""

    # the robot

    def meet(self, robot: Robot) -> None:
        """Ask the operator to place the robot on free floor for its pre-flight."""
        self._page.met(robot)
        if robot.label == "EMULATED" and (own_witness(robot) or self._remote) is not None:
            self._witness = WitnessObserver(self._remote)
            if isinstance(self.observer, CameraObserver):
                self.observer.beside = self._witness
            else:
                self.observer = self._witness
        else:
            self._channel.ask(messages.MeetQuestion())
        super().meet(robot)

    def accept(self, preflight: Preflight) -> bool:
        """Show the result of the pre-flight check; return whether to drive."""
        self._channel.say(_result_of(preflight))
        if not preflight.problems:
            return True
        return self._channel.ask(messages.AcceptQuestion(list(preflight.problems))).choice == "yes"

    # a trial

    def settle(self, card: Card, problem: str) -> Verdict:
        """Ask whether a trial that was cut off counts."""
        self._page.cut_off()
        choice = self._channel.ask(messages.SettleQuestion(card_values(card), problem)).choice
        return "driven" if choice == "driven" else "void"

    def place(self, card: Card) -> None:
        """Request control at its start, with the pen."""
        self._channel.ask(messages.PlaceQuestion(card_values(card), is_placed=self._witness is not None))
        super().place(card)
        self._page.begun(card, self._witness)

    def watch(self, card: Card, step: int, seen: Observation, command: Command) -> bool:
        """Report the step; return True if a person pressed stop."""
        super().watch(card, step, seen, command)
        return self._page.step(card, step, seen, command)

    def drawn(self, card: Card, record: TrialRecord) -> Score | None:
        """Return the score, or None if a person must check the cells first; they are saved as a proposal."""
        self._page.driven()
        seen, number = super().drawn(card, record), card.trial.trial
        is_tracked = seen is not None and isinstance(self.observer, CameraObserver)
        if card.observe != "cells" or (is_tracked and not self.proposer):
            return seen
        if seen is not None and is_tracked:
            told = f"Cells and path by {self.proposer}, checked by the person who saved them."
            keep_proposal(self._folder, number, track_proposal(seen, self.proposer, self.proposer, told))
        if self._witness is not None:
            keep_drawn(self._folder, number, self._witness.score(card.arena).path or ())
        return None

    # a sheet

    def enter(self, cards: Sequence[Card], *, is_full: bool) -> Iterable[tuple[int, Score]]:
        """Wait until these trials are scored, or a visitor postpones them."""
        if is_full or self._when == "trial":
            numbers = [card.trial.trial for card in cards]
            with Ledger.open(self._folder / LEDGER_NAME, writable=False) as ledger:
                self._channel.ask(
                    messages.ScoreQuestion(numbers, cards[0].trial.sheet, is_full),
                    until=lambda: all(ledger.trial(number).state != "driven" for number in numbers),
                )
        return ()

    def close(self, cards: Sequence[Card]) -> Sequence[int]:
        """Ask whether to close the generation; return the trials to score again."""
        numbers = [card.trial.trial for card in cards]
        with Ledger.open(self._folder / LEDGER_NAME, writable=False) as ledger:

            def has_changed() -> bool:
                return any(ledger.trial(number).state != "scored" for number in numbers)

            if has_changed():
                return ()
            again = self._channel.ask(messages.CloseQuestion(numbers), until=has_changed).trial
        return [again] if again in numbers else ()


def _result_of(preflight: Preflight) -> messages.PreflightResult:
    return messages.PreflightResult(preflight.facts, list(preflight.problems))


def card_values(card: Card) -> messages.TrialCard:
    """Return the facts that a page shows about a trial; a blind trial hides its condition."""
    return {
        "trial": card.trial.trial,
        "title": card.title,
        "pen": card.pen,
        "sheet": card.trial.sheet,
        "n_steps": card.n_steps,
        "n_left": card.n_left,
    }


@contextlib.contextmanager
def under_camera(
    spec: str, study: Study, operator: PageOperator, say: Callable[[str], None], *, asks: bool
) -> Iterator[PageOperator]:
    """The operator of a sitting with a camera above the robot.

    Args:
        spec: Of the camera, as `read_camera` takes it.
        study: Whose first physical condition says in which arena.
        operator: Without a camera.
        say: Told what the camera did not see.
        asks: Whether its cells wait for somebody to look at them; else they are entered as they are.

    Raises:
        StudyError: The camera's options cannot be.
        VisionError: There is no such camera.
    """
    arena = physical_conditions(study)[0].arena.arena()
    if spec == OWN_POSES:
        operator.observer = OwnPosesObserver(arena, say=say)
        operator.proposer = OwnPosesObserver.who if asks else ""
        yield operator
        return
    name, marks = read_camera(spec, arena)
    if not name.isdecimal():
        raise StudyError(
            f"The camera is {spec!r}, expected its number such as 0, or 0?tag=10&tag-height=0.1. A video is tracked "
            "after the sitting, below."
        )
    with LiveTrack(CameraDevice(int(name)), marks) as live:
        operator.observer = CameraObserver(live, arena, say=say)
        operator.proposer = f"camera {name}" if asks else ""
        yield operator
