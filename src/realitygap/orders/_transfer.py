"""The order of a transfer."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, ClassVar, Literal

from pydantic import Field

from realitygap.robot_families import port_platforms

from ._field import argument, option
from ._order import Order
from ._shared import Processes, Seed, Witness, folder_option, seed_option


class TransferOrder(Order):
    """Compare strategies that transfer controllers.

    Controllers evolve in simulation. Each strategy then spends a few trials on the target.

    All strategies start from the same simulated evolution and may spend the same trials on the target. Separate trials
    judge the controllers that they choose. Each trial on the target is saved immediately. Run the same command again to
    resume.

    Strategy plain takes the best champion in simulation. Strategy select tries the N best champions once each, and
    halving tries them in rounds. Strategy noise evolves under the paper's three noise levels, and randomized with
    numbers sampled from ranges set by hand. Strategy calibrated evolves in the fitted simulator, and posterior with a
    robot sampled from the calibration in each trial. Strategy recommended takes the one of these that predicted
    held-out trials best, or the robot file's numbers if they did. Strategy transferability is that of Koos, Mouret &
    Doncieux (2013). Strategy direct evolves on the target.

    Example: realitygap transfer sim-paper --to twin:worn-1.toml --budget 20

    Example: realitygap transfer light --to sim:khepera --budget 10 --strategy select

    Example: realitygap transfer sim-paper --to jyro --budget 10 --strategy plain --strategy select --json

    In Python: realitygap.study.transfer("sim-paper", target, "all", 20, out="results/transfer")
    """

    command: ClassVar[str] = "transfer"

    study: str = argument("STUDY", help="Study by name or file. See --condition.", refers="file")
    to: str = option(
        help=f"Target: sim:FILE, twin:FILE, {port_platforms()}, ...",
        metavar="PLATFORM",
        refers="platform",
    )
    budget: tuple[Annotated[int, Field(ge=0, le=4999)], ...] = option(
        (), help="Trials that each strategy may spend on the target. Repeatable.", default_is="20"
    )
    strategy: tuple[str, ...] = option(
        (),
        help="plain, select, halving, noise, randomized, calibrated, posterior, recommended, transferability, "
        "direct or all. Repeatable.",
        default_is="all",
    )
    condition: str | None = option(
        None,
        help="Condition of the study.",
        default_is="the first that selects for the score, preferably on sim",
    )
    calibration: Path | None = option(
        None,
        help="Existing calibration. Its trials count toward the budget.",
        default_is="calibrate first",
        metavar="FILE",
        refers="file",
    )
    observe: Literal["cells", "encoders", "track"] = option(
        "cells", help="Observation level for calibrating: cells, encoders or track.", metavar="HOW"
    )
    replicates: int = option(
        1, help="Number of replicates, each with its own evolution.", at_least=1, at_most=1000
    )
    fresh_trials: int = option(
        20,
        help="Trials used to judge each champion. They don't count toward the budget.",
        at_least=1,
        at_most=5000,
    )
    runs: int = option(100, help="Evolutions in simulation per replicate.", at_least=1)
    repeats: int = option(8, help="Trials per individual in simulation.", at_least=1)
    seed: Seed = seed_option()
    out: Path | None = folder_option("results/transfer")
    processes: Processes = None
    witness: Witness = None

    @property
    def budgets(self) -> tuple[int, ...]:
        """Trials that each strategy may spend on the target: one transfer for each number."""
        return self.budget or (20,)

    @property
    def folder(self) -> Path:
        """Folder for trials and result."""
        return self.out or Path("results/transfer")
