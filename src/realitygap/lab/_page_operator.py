"""The operator of a physical study at a page: asked there, through the channel, and scored in the ledger directly."""

from __future__ import annotations

import threading
import time
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

from realitygap.emulator import Witness
from realitygap.records import LEDGER_NAME, Ledger, Score
from realitygap.robots import Command, Observation, Robot
from realitygap.trials import Card, DrivenTrial, Preflight, Verdict, WitnessOperator

from ._channel import Channel, Message
from ._drawn import keep_drawn

LIVE_S = 0.05
"""Between two messages on where an emulated robot is [s]."""


class _Stops:
    """A stop that need not wait for the step to end: the motors first, then the trial."""

    def __init__(self, channel: Channel) -> None:
        self.is_asked = False
        self._robot: Robot | None = None
        channel.at_once("stop", self._stop)

    def met(self, robot: Robot) -> None:
        """This robot is to be stopped."""
        self._robot = robot

    def _stop(self, message: Message) -> None:
        self.is_asked = True
        if self._robot is not None:
            self._robot.stop()


class _Live:
    """Tells where an emulated robot is, 20 times a second, while a trial goes on."""

    def __init__(self, channel: Channel) -> None:
        self._channel = channel
        self._ended = threading.Event()

    def begin(self, witness: Witness) -> None:
        """A trial begins."""
        self._ended = threading.Event()
        threading.Thread(target=self._look, args=(witness, self._ended), daemon=True).start()

    def end(self) -> None:
        """It has ended."""
        self._ended.set()

    def _look(self, witness: Witness, ended: threading.Event) -> None:
        while not ended.wait(LIVE_S):
            self._channel.say("pose", pose=list(witness.pose()))


class _Watched:
    """What all operators tell the page."""

    def __init__(self, channel: Channel, folder: Path) -> None:
        self._channel = channel
        self._folder = folder
        self._stops = _Stops(channel)
        self._live = _Live(channel)
        self._began = 0.0

    def _tell_step(self, card: Card, step: int, seen: Observation, command: Command) -> bool:
        """Tell of a step; whether somebody pressed stop."""
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
        return self._stops.is_asked

    def _tell_begun(self, card: Card) -> None:
        self._stops.is_asked = False
        self._channel.say("driving", card=card_values(card))

    def _tell_driven(self, card: Card) -> None:
        self._live.end()
        self._channel.say("driven", trial=card.trial.trial)


class WatchedWitness(WitnessOperator):
    """The witness of an emulated robot, which the page may watch and stop."""

    def __init__(self, channel: Channel, folder: Path, witness: Witness | None = None) -> None:
        super().__init__(witness)
        self._said = _Watched(channel, folder)
        self._channel = channel
        self._is_stopped = False

    def meet(self, robot: Robot) -> None:
        """It is the one to stop."""
        super().meet(robot)
        self._said._stops.met(robot)
        self._channel.say("met", label=robot.label)

    def accept(self, preflight: Preflight) -> bool:
        """Whether nothing was found; the page shows what."""
        self._channel.say("preflight", facts=preflight.facts, problems=list(preflight.problems))
        return super().accept(preflight)

    def settle(self, card: Card, problem: str) -> Verdict:
        """Void, once somebody has said that it may go on after a stop."""
        if self._is_stopped:
            self._is_stopped = False
            self._channel.ask("go on", card=card_values(card), problem=problem)
        return super().settle(card, problem)

    def place(self, card: Card) -> None:
        """Put the robot at the start."""
        super().place(card)
        self._said._tell_begun(card)
        self._said._live.begin(self.witness)

    def watch(self, card: Card, step: int, seen: Observation, command: Command) -> bool:
        """Tell of the step, and whether it was stopped."""
        super().watch(card, step, seen, command)
        self._is_stopped = self._said._tell_step(card, step, seen, command)
        if self._is_stopped:
            self._said._live.end()
        return self._is_stopped

    def drawn(self, card: Card, driven: DrivenTrial) -> Score:
        """The cells along the driven line."""
        self._said._tell_driven(card)
        return super().drawn(card, driven)


class PageOperator(_Watched):
    """Somebody at a page, who places the robot and watches it; the cells are entered at any page, into the ledger.

    An emulated robot is placed by its witness, and the line that it drew is kept beside the ledger for whoever counts,
    as a sheet of paper is.

    Args:
        channel: To the server.
        folder: Of the study's results.
        when: Whether to wait for cells after each trial, or when the sheet is full: trial or sheet.
        witness: Of an emulator in another program.
    """

    def __init__(
        self, channel: Channel, folder: Path, *, when: str = "sheet", witness: Witness | None = None
    ) -> None:
        super().__init__(channel, folder)
        self._when = when
        self._remote = witness
        self._witness: WitnessOperator | None = None

    # the robot

    def meet(self, robot: Robot) -> None:
        """Have the robot stood free for its pre-flight."""
        self._stops.met(robot)
        self._channel.say("met", label=robot.label)
        own = getattr(getattr(robot, "port", None), "witness", None) or getattr(robot, "witness", None)
        if robot.label == "EMULATED" and (own or self._remote) is not None:
            self._witness = WitnessOperator(self._remote)
            self._witness.meet(robot)
        else:
            self._channel.ask("meet", label=robot.label)

    def accept(self, preflight: Preflight) -> bool:
        """Show what was found; go on where somebody says so."""
        found: dict[str, Any] = {"facts": preflight.facts, "problems": list(preflight.problems)}
        self._channel.say("preflight", **found)
        if not preflight.problems:
            return True
        return bool(self._channel.ask("accept", **found).get("yes"))

    # a trial

    def settle(self, card: Card, problem: str) -> Verdict:
        """Ask whether a trial that was cut off counts."""
        self._live.end()
        answer = self._channel.ask("settle", card=card_values(card), problem=problem)
        return "driven" if answer.get("verdict") == "driven" else "void"

    def place(self, card: Card) -> None:
        """Ask for the robot at its start, with the pen."""
        self._channel.ask("place", card=card_values(card), is_placed=self._witness is not None)
        if self._witness is not None:
            self._witness.place(card)
            self._live.begin(self._witness.witness)
        self._tell_begun(card)

    def watch(self, card: Card, step: int, seen: Observation, command: Command) -> bool:
        """Tell of the step; whether somebody pressed stop."""
        if self._witness is not None:
            self._witness.watch(card, step, seen, command)
        return self._tell_step(card, step, seen, command)

    def drawn(self, card: Card, driven: DrivenTrial) -> Score | None:
        """Nothing yet: somebody has to look; of an emulated robot the line is kept for them."""
        self._tell_driven(card)
        if self._witness is not None:
            path = self._witness.drawn(card, driven).path or ()
            keep_drawn(self._folder, card.trial.trial, path)
        return None

    # a sheet

    def enter(self, cards: Sequence[Card], *, is_full: bool) -> Iterable[tuple[int, Score]]:
        """Wait until these trials are scored at some page, or somebody says later."""
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
        """Ask whether the scores may breed the next generation; a trial that is taken back is scored anew."""
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
    """What a page shows of a trial; of one under a code nothing that tells its condition."""
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
