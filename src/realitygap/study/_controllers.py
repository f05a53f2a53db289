"""Controllers to try on both sides of a gap: unrelated networks, or champions."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from realitygap.evolution import Genome


@dataclass(frozen=True)
class Controller:
    """A controller and where it comes from.

    Attributes:
        genome: Its network.
        name: Such as random-3, or coverage-10/7 for the champion of run 7.
        kind: random, or champion.
        selected_score: Coverage [0..1] for which it was selected; None where it was not.
        selected_on: The platform where it was selected; empty where it was not.
    """

    genome: Genome
    name: str
    kind: str
    selected_score: float | None = None
    selected_on: str = ""


def sample_controllers(kind: str | Path, n: int, seed: int = 1) -> list[Controller]:
    """Draw n controllers.

    Args:
        kind: `random` (unrelated networks), a folder of results, or the name or file of a study, whose first
            condition is then run.
        n: How many, at least 1.
        seed: Of the draw.

    Raises:
        ValueError: n is out of range, or there are not so many champions.
        StudyError: There is no such study.
        RecordError: There are no such results.
    """
    raise NotImplementedError
