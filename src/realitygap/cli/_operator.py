"""Operators of a physical study: a person at a terminal, or none if the robot is emulated."""

from __future__ import annotations

import getpass
import math
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import groupby
from pathlib import Path
from typing import TYPE_CHECKING

import realitygap
from realitygap._terminal import draw, echo
from realitygap.errors import StudyError
from realitygap.trials import Card, Operator, Preflight, WitnessObserver

from ._grid_editor import pick_cells
from ._keys import ask_verdict, read_line, single_keys

if TYPE_CHECKING:
    from realitygap.records import Score, Trial, TrialRecord
    from realitygap.robots import Command, Observation, Robot
    from realitygap.trials import Verdict
    from realitygap.world import Arena

_ABORTING = ("space", "escape", "q")

_ARROWS = ">/^\\</v\\"


_SILENCE_S = 10.0
"""Time without a message after which the next trial is reported, too."""


@dataclass(frozen=True)
class Answers:
    """Answers that options give in advance.

    Attributes:
        who: Enters the scores; the account's name when None.
        in_flight: Decision about a trial that was cut off, `void` or `driven`; None asks.
        score: Time to ask for the drawn cells: `trial`, `sheet` or `later`.
        wait: Whether to wait for Enter before each trial.
        despite_preflight: Whether to drive whatever the pre-flight finds.

    Raises:
        StudyError: An answer is none of these.
    """

    who: str | None = None
    in_flight: str | None = None
    score: str = "sheet"
    wait: bool = True
    despite_preflight: bool = False

    def __post_init__(self) -> None:
        if self.in_flight not in (None, "void", "driven"):
            raise StudyError(f"--in-flight is {self.in_flight!r}, expected void or driven.")
        if self.score not in ("trial", "sheet", "later"):
            raise StudyError(f"--score is {self.score!r}, expected trial, sheet or later.")

    @property
    def name(self) -> str:
        """Return the name of the operator who enters the scores."""
        return self.who or getpass.getuser()

    @property
    def verdict(self) -> Verdict | None:
        """Return the verdict on a trial that was cut off."""
        return "void" if self.in_flight == "void" else "driven" if self.in_flight == "driven" else None


def choose_operator(
    port: str, witness: str | None, answers: Answers, folder: Path, *, quiet: bool = False
) -> Operator:
    """Return no operator for an emulator with a witness; otherwise the person at the terminal.

    Args:
        port: Port of the robot.
        witness: HOST:PORT of an emulator's witness.
        answers: Answers that were given in advance.
        folder: Folder of the results, whose ledger stores notes.
        quiet: True if standard output has another purpose. Then questions go to standard error, and a witness's trials
            are not reported.
    """
    if realitygap.robots.is_in_this_program(port) or witness is not None:
        remote = (
            None
            if witness is None or realitygap.robots.is_in_this_program(port)
            else realitygap.emulator.connect_witness(witness)
        )
        kind = Operator if quiet else TellingOperator
        return kind(
            WitnessObserver(remote),
            in_flight=answers.verdict or "void",
            despite_preflight=answers.despite_preflight,
        )

    def note(text: str, who: str, trial: int | None) -> None:
        with realitygap.records.Ledger.open(folder / realitygap.records.LEDGER_NAME) as ledger:
            ledger.note(text, who, trial)

    return PersonOperator(answers, note, to_stderr=quiet)


Note = Callable[[str, str, int | None], None]
"""Keeps a note: text, who, and the trial it is about."""


class PersonOperator(Operator):
    """A person who places the robot, watches it and counts cells; asked in the terminal what no option has answered."""

    def __init__(self, answers: Answers, note: Note, *, to_stderr: bool = False) -> None:
        super().__init__()
        self._answers = answers
        self._note = note
        self._to_stderr = to_stderr
        out = sys.stderr if to_stderr else sys.stdout
        self._is_terminal = sys.stdin is not None and sys.stdin.isatty() and out.isatty()
        self._is_first = True

    # the robot

    def meet(self, robot: Robot) -> None:
        """Say that the robot will turn."""
        super().meet(robot)
        self._say(f"The robot answers ({robot.label}). For the pre-flight it turns on the spot for a moment.")
        if self._answers.wait:
            self._ask("Stand it free, then press Enter: ", "--no-wait drives without waiting")

    def accept(self, preflight: Preflight) -> bool:
        """Show the result of the pre-flight check, and ask if there is a problem."""
        for name, value in preflight.facts.items():
            self._say(f"  {name}: {value}")
        if not preflight.problems:
            self._say("Nothing speaks against driving.")
            return True
        for problem in preflight.problems:
            self._say(f"  against driving: {problem}")
        if self._answers.despite_preflight:
            return True
        if not self._is_terminal:
            return False
        return self._ask("Drive all the same? y or n: ", "").lower().startswith("y")

    # a trial

    def settle(self, card: Card, problem: str) -> Verdict:
        """Ask whether a trial that was cut off counts."""
        self._say(f"\nTrial {card.trial.trial}, {card.title}, was cut off: {problem}.")
        if self._answers.verdict is not None:
            return self._answers.verdict
        words = "v: void, drive it again; d: driven, count what it drew: "
        return ask_verdict(lambda: self._ask(words, "--in-flight void or --in-flight driven"))

    def place(self, card: Card) -> None:
        """Ask for the robot at its start, with the pen."""
        self._say(f"\nTrial {card.trial.trial}: {card.title}. {card.n_left} left in this generation.")
        draws = card.observe == "cells"
        if draws:
            self._say(f"Sheet {card.trial.sheet}, pen: {card.pen}.")
        if self._is_first:
            self._say(sketch(card.arena))
            self._is_first = False
        if not self._answers.wait:
            super().place(card)
            return
        while True:
            answer = self._ask(
                f"Robot at the start{', pen in' if draws else ''}: Enter drives; n TEXT adds a note: ",
                "--no-wait drives without waiting",
            )
            if answer.startswith("n "):
                self._note(answer[2:], self._answers.name, card.trial.trial)
            elif not answer:
                super().place(card)
                return

    def watch(self, card: Card, step: int, seen: Observation, command: Command) -> bool:
        """Show the step; whether a key that aborts was pressed."""
        super().watch(card, step, seen, command)
        if not self._is_terminal:
            return False
        raw = " ".join(f"{value:5.0f}" for value in seen.raw)
        stalled = "  stalled" if seen.stalled else "         "
        told = f"move {command.move:+.2f} turn {command.turn:+.2f}"
        text = f"step {step + 1:3}/{card.n_steps}  sees {raw}  {told}{stalled}"
        draw("\r", err=self._to_stderr)
        self._say(f"{text}  space aborts", nl=step + 1 == card.n_steps)
        with single_keys() as keys:
            return keys.read(0.0) in _ABORTING

    def drawn(self, card: Card, record: TrialRecord) -> Score | None:
        """Return the score that a camera saw; None without one, because the person has to look first."""
        self._say("Done; the motors are stopped.")
        return super().drawn(card, record)

    # a sheet

    def enter(self, cards: Sequence[Card], *, is_full: bool) -> Iterator[tuple[int, Score]]:
        """Ask what was drawn, by one trial or on a full sheet."""
        wanted = self._answers.score == "trial" or (self._answers.score == "sheet" and is_full)
        if not wanted or not self._is_terminal:
            return
        if is_full:
            self._say(f"\nSheet {cards[0].trial.sheet} is full. Which cells does each line cross?")
        for card in cards:
            score = self._pick(card)
            if score is not None:
                yield card.trial.trial, score

    def close(self, cards: Sequence[Card]) -> Sequence[int]:
        """Show the scores; ask which are taken back before they breed the next generation."""
        self._say("\nThe generation is scored:")
        for card in cards:
            n_cells = len(card.trial.cells or ())
            self._say(f"  {card.trial.trial:4}  {card.pen:8} {card.title}: {n_cells} cells")
        if not self._is_terminal:
            return ()
        numbers = {str(card.trial.trial): card.trial.trial for card in cards}
        while True:
            answer = self._ask(
                (
                    "Enter: close it and freeze the scores, TRIAL NUMBER: withdraw its score, n TEXT: add a note: "
                ),
                "",
            )
            if answer.startswith("n "):
                self._note(answer[2:], self._answers.name, None)
            elif not answer:
                return ()
            elif answer in numbers:
                return [numbers[answer]]
            else:
                self._say(f"There is no trial {answer} in this generation.")

    # inside

    def _pick(self, card: Card) -> Score | None:
        self._say(f"\nTrial {card.trial.trial}, {card.title}, pen: {card.pen}")
        cells = pick_cells(card.arena, write=lambda codes: draw(codes, err=self._to_stderr))
        return None if cells is None else realitygap.records.Score(cells, self._answers.name)

    def _ask(self, prompt: str, option: str) -> str:
        """Return a line from the terminal.

        Raises:
            StudyError: There is no terminal.
            KeyboardInterrupt: It is gone.
        """
        if not self._is_terminal:
            answered = f" {option}." if option else ""
            raise StudyError(f"There is no terminal in which to ask '{prompt.strip(': ')}'.{answered}")
        self._say(prompt, nl=False)
        return read_line()

    def _say(self, text: str, *, nl: bool = True) -> None:
        echo(text, nl=nl, err=self._to_stderr)


def sketch(arena: Arena) -> str:
    """Return the arena from above as text: walls, reachable cells, and the start as an arrow."""
    grid, start = arena.grid, arena.start
    left, bottom = min(wall[0] for wall in arena.walls), min(wall[1] for wall in arena.walls)
    n_columns = round((max(wall[2] for wall in arena.walls) - left) / grid.cell)
    n_rows = round((max(wall[3] for wall in arena.walls) - bottom) / grid.cell)
    way = round(start.heading / (math.pi / 4)) % 8
    lines = ["+" + "---" * n_columns + "+"]
    for row in reversed(range(n_rows)):
        text = ""
        for column in range(n_columns):
            x, y = left + column * grid.cell, bottom + row * grid.cell
            holds_start = x <= start.x < x + grid.cell and y <= start.y < y + grid.cell
            is_reachable = (
                grid.x - 1e-9 <= x < grid.x + (grid.columns - 0.5) * grid.cell
                and grid.y - 1e-9 <= y < grid.y + (grid.rows - 0.5) * grid.cell
            )
            text += f" {_ARROWS[way]} " if holds_start else " . " if is_reachable else "   "
        lines.append(f"|{text}|")
    lines.append(lines[0])
    lines.append(f"Start ({_ARROWS[way]}): {realitygap.trials.start_words(arena)}")
    return "\n".join(lines)


class TellingOperator(Operator):
    """An operator that reports each closed generation, and each trial if that takes long."""

    _told = 0.0

    def accept(self, preflight: Preflight) -> bool:
        """Report what speaks against driving if it drives all the same."""
        accepts = super().accept(preflight)
        for problem in preflight.problems if accepts else ():
            self._say(f"Against driving: {problem}. The robot drives anyway (--despite-preflight).")
        return accepts

    def place(self, card: Card) -> None:
        """Put the robot at the start."""
        self._told = self._told or time.monotonic()
        super().place(card)

    def drawn(self, card: Card, record: TrialRecord) -> Score | None:
        """Return the cells along the driven line."""
        score = super().drawn(card, record)
        if score is not None and time.monotonic() - self._told > _SILENCE_S:
            self._say(f"Trial {card.trial.trial}, {card.title}: {len(set(score.cells))} cells.")
        return score

    def close(self, cards: Sequence[Card]) -> Sequence[int]:
        """Close it."""
        trials = sorted((card.trial for card in cards), key=_run)
        for (condition, replicate, generation), group in groupby(trials, key=_run):
            counts = [len(trial.cells or ()) for trial in group]
            self._say(
                f"{condition}, run {replicate}, generation {generation}: {len(counts)} trials, at most {max(counts)} "
                "cells."
            )
        return super().close(cards)

    def _say(self, text: str) -> None:
        echo(text, err=True)
        self._told = time.monotonic()


def _run(trial: Trial) -> tuple[str, int, int]:
    return trial.condition, trial.replicate, trial.generation
