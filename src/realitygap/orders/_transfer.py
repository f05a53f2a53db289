"""The orders of `try` and `transfer`: controllers of simulation on a target."""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path
from typing import Annotated, ClassVar, Literal

from pydantic import Field

from realitygap.robot_families import port_platforms

from ._field import argument, option
from ._order import Order
from ._shared import (
    ALPHA,
    Blind,
    Lock,
    Processes,
    Seed,
    Witness,
    alpha_option,
    arena_option,
    folder_option,
    seed_option,
)

ONLY_PAIRS = "Only to compare two controllers"


def fewest_pairs(alpha: float) -> int:
    """Return the pairs below which a test can show nothing: each of them at most doubles E/2, which begins at 1/2."""
    return math.floor(math.log2(2 / alpha)) + 1


class TryOrder(Order):
    """Drive one exported controller on any platform.

    The command prints how much of the arena the controller covers. A controller can drive in simulation, on a twin, and
    on a real or emulated robot, if the platform has its inputs.

    With --against, the command compares two controllers in pairs of trials, and a coin decides which of them goes
    first. It prints what is shown after each pair, and ends as soon as a difference or equivalence is shown, or after
    --trials pairs. The plan is stored before trial 1, so looking costs nothing. `realitygap trials advise` prints the
    result again. With --lock, the design is locked: its hash decides the order of each pair, and later changes are
    listed as deviations.

    Example: realitygap try champion.json --on twin:worn-1.toml --trials 20

    Example: realitygap try one.json --against two.json --on scribbler:emulator://s2 --trials 40 -o pairs.sqlite

    In Python: realitygap.study.try_genome("champion.json", on="twin:worn-1.toml", trials=20)
    """

    command: ClassVar[str] = "try"

    genome: Path = argument(
        "GENOME", help="Genome from `realitygap export` or `realitygap transfer`.", refers="file"
    )
    on: str = option(
        help=f"Platform: jyro, sim, sim:FILE, twin:FILE, {port_platforms()}.",
        metavar="PLATFORM",
        refers="platform",
    )
    trials: int = option(
        1, help="Number of trials. With --against, maximum number of pairs.", at_least=1, at_most=9999
    )
    steps: int = option(100, help="Number of commands per trial.", at_least=1)
    against: Path | None = option(
        None,
        help="Genome of a second controller, to compare both.",
        metavar="GENOME",
        refers="file",
        panel=ONLY_PAIRS,
    )
    margin: float | None = option(
        None,
        help="Largest difference in coverage that counts as equivalent, such as 0.05.",
        above=0,
        metavar="M",
        panel=ONLY_PAIRS,
    )
    alpha: float = alpha_option(panel=ONLY_PAIRS)
    null: Literal["distribution", "mean"] = option(
        "distribution",
        help="Hypothesis to refute: that both have the same distribution of coverage, or the same mean, which needs "
        "more pairs.",
        metavar="WHICH",
        panel=ONLY_PAIRS,
    )
    observe: Literal["readings", "cells", "encoders", "track"] = option(
        "cells", help="Observation level: cells, encoders or track.", metavar="HOW"
    )
    inputs: str | None = option(
        None,
        help="Names of the controller's inputs, such as range.0,range.1,bias, if its file has none.",
        metavar="NAMES",
    )
    outputs: str | None = option(
        None, help="Names of the controller's outputs: move,turn or left,right.", metavar="NAMES"
    )
    arena: str = arena_option()
    witness: Witness = None
    seed: Seed = seed_option(0)
    out: Path | None = option(
        None,
        help="File to save the trials in, one per line. Run the command again to resume.",
        metavar="FILE",
        names=("-o", "--out"),
        is_output=True,
    )
    lock: Lock = False
    blind: Blind = False

    def conflicts(self) -> Iterator[tuple[str, str]]:
        """Yield the field and the message for each setting that others exclude."""
        if self.against is None:
            if self.margin is not None or self.null != "distribution" or self.alpha != ALPHA:
                yield "against", "--margin, --null and --alpha need a second controller (--against GENOME)."
            elif self.blind:
                yield (
                    "blind",
                    "--blind needs a second controller (--against GENOME): one alone has no arms to hide.",
                )
            return
        if self.trials < (fewest := fewest_pairs(self.alpha)):
            yield (
                "trials",
                f"--trials is {self.trials}, expected at least {fewest} pairs with --against: fewer can show "
                "nothing. For example: --trials 40",
            )


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

    Strategy trial-and-error evolves a repertoire of different controllers by MAP-Elites, and tries what a prediction
    expects most of, trial by trial (Cully and others 2015). Strategy trial-and-error-recalibrated tries the repertoire
    in the fitted simulator first. The repertoire of trial-and-error-posterior is from the fitted simulator, and that of
    trial-and-error-damage from robots with suspected damages. Strategy trial-and-error-combined has both. See
    --stop-at.

    Example: realitygap transfer sim-paper --to twin:worn-1.toml --budget 20

    Example: realitygap transfer light --to sim:khepera --budget 10 --strategy select

    Example: realitygap transfer sim-paper --to jyro --budget 10 --strategy plain --strategy select --json

    In Python: realitygap.study.transfer("sim-paper", target, "all", 20, out="results/transfer")
    """

    command: ClassVar[str] = "transfer"

    study: str = argument("STUDY", help="Study by name or file. See --condition.", refers="file")
    to: str = option(
        help=f"Target: sim:FILE, twin:FILE, {port_platforms()}, ...", metavar="PLATFORM", refers="platform"
    )
    budget: tuple[Annotated[int, Field(ge=0, le=4999)], ...] = option(
        (), help="Trials that each strategy may spend on the target. Repeatable.", default_is="20"
    )
    strategy: tuple[str, ...] = option(
        (),
        help="plain, select, halving, noise, randomized, calibrated, posterior, recommended, transferability, "
        "trial-and-error, trial-and-error-recalibrated, trial-and-error-posterior, trial-and-error-damage, "
        "trial-and-error-combined, direct or all. Repeatable.",
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
    stop_at: float | None = option(
        None,
        above=0,
        at_most=1,
        help="Strategies trial-and-error end when their best trial has this share of the highest predicted score, 0 to "
        "1.",
        default_is="use the whole budget",
        metavar="SHARE",
    )
    seed: Seed = seed_option()
    out: Path | None = folder_option("results/transfer")
    lock: Lock = False
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
