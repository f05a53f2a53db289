"""The order of `closing-the-gap`."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import ClassVar, Literal

from ._field import option
from ._order import Order
from ._shared import Seed, folder_option, seed_option


class ClosingOrder(Order):
    """Measure and shrink the gap to many robots.

    The study calibrates to each twin of several families with a few trials, and transfers controllers to it. Twins need
    the extra 'twin'. With --plan thymio, the robot is a Thymio in simulators of other authors. You can interrupt the
    command at any time. Run the same command again to resume.

    Example: realitygap closing-the-gap --small

    Example: realitygap closing-the-gap --plan thymio --families enki

    In Python: realitygap.study.closing_the_gap("results/closing-the-gap")
    """

    command: ClassVar[str] = "closing-the-gap"

    plan: Literal["twins", "fresh", "thymio", "playground"] = option(
        "twins",
        help="Plan of the study. twins: MuJoCo twins of a Scribbler. fresh: other twins and controllers, without "
        "transfer. thymio: a Thymio in Enki and in Aseba's playground. playground: the same, with its infrared "
        "sensors.",
        metavar="PLAN",
    )
    twins: int | None = option(
        None,
        help="Number of twins per family, or of sittings per robot.",
        default_is="from the plan",
        at_least=1,
        at_most=900,
    )
    families: str | None = option(
        None, help="Families of twins, or robots.", default_is="all in the plan", metavar="LIST"
    )
    budgets: str | None = option(
        None, help="Calibration budgets, in trials.", default_is="0,10,20,40", metavar="LIST"
    )
    observe: str | None = option(None, help="Observation levels.", default_is="from the plan", metavar="LIST")
    small: bool = option(False, help="Run a small version, which takes minutes and shows no result.")
    seed: Seed | None = seed_option(None, default_is="from the plan", help="Seed of the twins.")
    out: Path | None = folder_option("results/closing-the-gap, or results/closing-the-gap-PLAN")
    processes: int | None = option(
        None, help="Number of twins to run in parallel.", default_is="all processors", at_least=1
    )

    @classmethod
    def by_place(cls, *values: object) -> dict[str, object]:
        """Return the fields for a folder and a plan."""
        return dict(zip(("out", "plan"), values, strict=False))

    def conflicts(self) -> Iterator[tuple[str, str]]:
        """Yield the field and the message for budgets that are no numbers."""
        if self.budgets is not None and not all(word.strip().isdecimal() for word in self.budgets.split(",")):
            yield (
                "budgets",
                f"--budgets is {self.budgets!r}, expected numbers of trials, such as 0,10,20,40.",
            )

    @property
    def folder(self) -> Path:
        """Folder for the results."""
        name = self.command if self.plan == "twins" else f"{self.command}-{self.plan}"
        return self.out or Path("results") / name
