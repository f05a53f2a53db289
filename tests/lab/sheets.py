"""A study of which a sheet is driven and waits to be counted, and a photograph of that sheet."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np

from realitygap.lab._scoring_files import keep_drawn
from realitygap.records import LEDGER_NAME, PATH_PARTS, Ledger, Score, TrialRecord
from realitygap.study import drive_study, parse_study
from realitygap.testing import (
    Film,
    FilmedCamera,
    path_through,
    photograph_sheet,
    save_film,
)
from realitygap.trials import Card
from realitygap.vision import SheetLayout
from realitygap.world import cells_along, paper_arena
from tests.study.physical import Unattended

from .robot_study import FAST, TEXT

PENS = ("red", "blue")
STEPS = 40
LEAD_S, STEP_S = 0.8, 0.5


class _Uncounted(Unattended):
    """Has trials driven, keeps their lines, and counts none."""

    def __init__(self, folder: Path) -> None:
        super().__init__()
        self._folder = folder
        self.paths: dict[int, np.ndarray] = {}

    def drawn(self, card: Card, record: TrialRecord) -> Score | None:
        path = super().drawn(card, record).path or ()
        self.paths[card.trial.trial] = np.array(path)
        keep_drawn(self._folder, card.trial.trial, path)
        return None


def drive_paths(root: Path, steps: int = STEPS) -> dict[int, np.ndarray]:
    """A study whose first sheet is full; (n, 3) where the robot was in each of its trials, by number."""
    folder = root / "by-robot"
    operator = _Uncounted(folder)
    study = parse_study(TEXT.format(steps=steps, blind="true"), "study.toml")
    drive_study(study, FAST, folder, operator=operator)
    return operator.paths


def drive_sheet(root: Path) -> list[np.ndarray]:
    """The same; (n, 2) the line of each trial [m]."""
    return [path[:, :2] for path in drive_paths(root).values()]


def film_of(root: Path, number: int, path: np.ndarray, file: Path) -> None:
    """Film a trial from above, as a video."""
    with Ledger.open(root / "by-robot" / LEDGER_NAME, writable=False) as ledger:
        began = ledger.record(number).times
    times = np.append(began - began[0], began[-1] - began[0] + STEP_S)
    at = LEAD_S + np.interp(np.arange(len(path)) / PATH_PARTS, np.arange(len(times)), times)
    camera = FilmedCamera(width=960, height=540, noise=3.0)
    save_film(Film(path_through(at, path), at[-1] + 0.4, rate=12.0, filmed=camera, n_exposures=3), str(file))


def photo_of(lines: list[np.ndarray]) -> bytes:
    """A JPEG of the sheet on which pens drew these lines."""
    return _photograph(*(np.ascontiguousarray(line).tobytes() for line in lines))


@cache
def _photograph(*lines: bytes) -> bytes:
    paths = [np.frombuffer(line).reshape(-1, 2) for line in lines]
    return photograph_sheet(SheetLayout.of(paper_arena(), PENS), paths, 1, size=(1600, 1200)).jpeg


def true_cells(line: np.ndarray) -> set[int]:
    return set(cells_along(line, paper_arena().grid))
