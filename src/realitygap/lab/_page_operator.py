"""Operators of a physical study whose trials are shown on a page."""

from __future__ import annotations

import contextlib
import threading
import time
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

from realitygap.emulator import Witness
from realitygap.errors import RobotError
from realitygap.records import LEDGER_NAME, Ledger, Score, TrialRecord
from realitygap.robots import Command, Observation, Robot
from realitygap.study import CameraObserver
from realitygap.trials import Card, Operator, Preflight, Verdict, WitnessObserver, own_witness

from ._channel import Channel, Message
from ._drawn import keep_drawn
from ._proposals import keep_proposal, track_proposal

LIVE_S = 0.05
"""Time between two messages on the position of an emulated robot [s]."""


class _Stops:
    """A stop that need not wait for the step to end: the motors first, then the trial."""

    def __init__(self, channel: Channel) -> None:
        self.is_asked = False
        self._robot: Robot | None = None
        channel.at_once("stop", self._stop)

    def met(self, robot: Robot) -> None:
        """Remember the robot that a stop has to reach."""
        self._robot = robot

    def _stop(self, message: Message) -> None:
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
                self._channel.say("pose", pose=list(witness.pose()))


class _Shown:
    """Reports trials to the page, and receives stops from it."""

    def __init__(self, channel: Channel) -> None:
        self._channel = channel
        self.stops = _Stops(channel)
        self._live = _Live(channel)

    def met(self, robot: Robot) -> None:
        """Report the robot that is in use."""
        self.stops.met(robot)
        self._channel.say("met", label=robot.label)

    def begun(self, card: Card, observer: WitnessObserver | None) -> None:
        """The robot stands at the start of a trial."""
        if observer is not None:
            self._live.begin(observer.witness)
        self.stops.is_asked = False
        self._channel.say("driving", card=card_values(card))

    def step(self, card: Card, step: int, seen: Observation, command: Command) -> bool:
        """Report a step that begins; return True if a person pressed stop."""
        self._channel.say(
            "step",
            step=step,
            n_steps=card.n_steps,
            raw=list(seen.raw),
            readings=list(seen.readings),
            stalled=seen.stalled,
            move=command.move,
            turn=command.turn,
        )
        return self.stops.is_asked

    def cut_off(self) -> None:
        """The trial was interrupted."""
        self._live.end()

    def driven(self, card: Card) -> None:
        """The trial has ended."""
        self._live.end()
        self._channel.say("driven", trial=card.trial.trial)


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
        self._channel.say("preflight", facts=preflight.facts, problems=list(preflight.problems))
        return super().accept(preflight)

    def settle(self, card: Card, problem: str) -> Verdict:
        """Void the trial; after a stop, wait until a visitor continues."""
        if self._is_stopped:
            self._is_stopped = False
            self._channel.ask("go on", card=card_values(card), problem=problem)
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
        self._page.driven(card)
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
            self._channel.ask("meet", label=robot.label)
        super().meet(robot)

    def accept(self, preflight: Preflight) -> bool:
        """Show the result of the pre-flight check; return whether to drive."""
        found: dict[str, Any] = {"facts": preflight.facts, "problems": list(preflight.problems)}
        self._channel.say("preflight", **found)
        if not preflight.problems:
            return True
        return bool(self._channel.ask("accept", **found).get("yes"))

    # a trial

    def settle(self, card: Card, problem: str) -> Verdict:
        """Ask whether a trial that was cut off counts."""
        self._page.cut_off()
        answer = self._channel.ask("settle", card=card_values(card), problem=problem)
        return "driven" if answer.get("verdict") == "driven" else "void"

    def place(self, card: Card) -> None:
        """Request control at its start, with the pen."""
        self._channel.ask("place", card=card_values(card), is_placed=self._witness is not None)
        super().place(card)
        self._page.begun(card, self._witness)

    def watch(self, card: Card, step: int, seen: Observation, command: Command) -> bool:
        """Report the step; return True if a person pressed stop."""
        super().watch(card, step, seen, command)
        return self._page.step(card, step, seen, command)

    def drawn(self, card: Card, record: TrialRecord) -> Score | None:
        """Return the score, or None if a person must check the cells first; they are saved as a proposal."""
        self._page.driven(card)
        seen, number = super().drawn(card, record), card.trial.trial
        if card.observe != "cells" or (
            seen is not None and seen.who == CameraObserver.who and not self.proposer
        ):
            return seen
        if seen is not None and seen.who == CameraObserver.who:
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
                    "score",
                    until=lambda: all(ledger.trial(number).state != "driven" for number in numbers),
                    trials=numbers,
                    sheet=cards[0].trial.sheet,
                    is_full=is_full,
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
            answer = self._channel.ask("close", until=has_changed, trials=numbers)
        number = answer.get("undo")
        return [number] if number in numbers else ()


def card_values(card: Card) -> dict[str, Any]:
    """Return the facts that a page shows about a trial; a blind trial hides its condition."""
    trial = card.trial
    return {
        "trial": trial.trial,
        "title": card.title,
        "code": trial.code,
        "pen": card.pen,
        "sheet": trial.sheet,
        "n_steps": card.n_steps,
        "n_left": card.n_left,
        "time": time.time(),
    }
