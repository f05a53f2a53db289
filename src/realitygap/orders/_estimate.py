"""The order of an assisted estimate."""

from __future__ import annotations

from collections.abc import Iterator
from typing import ClassVar

from realitygap.robot_families import port_platforms

from ._compare import UNIT_RANGE, range_ends
from ._field import argument, option
from ._shared import ONLY_TABLES, MeasureOrder, controller_option, score_option


class EstimateOrder(MeasureOrder):
    """Estimate a robot's mean score, assisted by simulation.

    A few controllers run on the target. These and many others like them run in the simulator. The estimate is the
    target's mean, corrected by the regression of its scores on the simulator's. Its 95 % interval is valid whatever the
    simulator's error. The interval from the target alone is printed, too.

    In place of SIM, you can name a table of scores (.csv or .jsonl) of any robots and simulators, with the columns of
    `realitygap compare`. Controllers or blocks of the simulator alone then assist the estimate.

    Example: realitygap estimate sim twin:worn-1.toml --n-controllers 10 --trials 5

    Example: realitygap estimate sim:fit.toml recorded:tracked.sqlite --fleet --others 20

    Example: realitygap estimate scores.csv --of new --minus old

    In Python: realitygap.estimate_score("sim", "twin:worn-1.toml", n_controllers=10)
    """

    command: ClassVar[str] = "estimate"

    sim: str = argument(
        "SIM",
        help="Simulator: sim, sim:FILE or jyro. Or a table of scores (.csv or .jsonl).",
        label="Simulator",
    )
    target: str = argument(
        "TARGET",
        help=f"Target: twin:FILE, {port_platforms()}, recorded:FILE, sim, sim:FILE or jyro. None for a table.",
        label="Target",
        refers="platform",
        default="",
    )
    n_controllers: int = option(
        10,
        help="Number of controllers on the target.",
        at_least=2,
        at_most=1023,
        label="Controllers on the target",
    )
    others: int = option(
        200,
        help="Number of further controllers, in simulation only.",
        at_least=1,
        at_most=1022,
        label="Controllers in simulation only",
    )
    trials: int = option(
        5, help="Trials per controller on the target.", at_least=1, at_most=4096, label="Trials on the target"
    )
    sim_trials: int = option(
        20,
        help="Trials per controller in simulation.",
        at_least=1,
        at_most=4096,
        label="Trials in simulation",
    )
    fleet: bool = option(
        False,
        help="Estimate the mean of these controllers. Otherwise, that of all controllers like them.",
        label="These controllers only",
    )
    of: str | None = option(
        None,
        help="Name of the controller to estimate, over blocks. Default: the mean of all controllers.",
        metavar="NAME",
        panel=ONLY_TABLES,
    )
    minus: str | None = option(
        None,
        help="Name of another controller: estimate the difference of both, over blocks.",
        metavar="NAME",
        panel=ONLY_TABLES,
    )
    sim_name: str | None = option(
        None, help="Platform that predicts.", default_is="sim", metavar="PLATFORM", panel=ONLY_TABLES
    )
    real_name: str | None = option(
        None, help="Platform that is estimated.", default_is="real", metavar="PLATFORM", panel=ONLY_TABLES
    )
    score: str | None = score_option(panel=ONLY_TABLES)
    controller: str | None = controller_option(panel=ONLY_TABLES)
    range: str = option(
        UNIT_RANGE,
        help="Range of the scores, such as 0:100 for percent.",
        metavar="LOW:HIGH",
        panel=ONLY_TABLES,
    )

    @property
    def is_of_table(self) -> bool:
        """True if the scores are in a table."""
        return self.sim.lower().endswith((".csv", ".jsonl")) and ":" not in self.sim

    def conflicts(self) -> Iterator[tuple[str, str]]:
        """Yield the field and the message for each setting that others exclude."""
        if not self.is_of_table and not self.target:
            yield "target", "expected a target, such as twin:FILE, got none."
        if self.is_of_table and self.target:
            yield (
                "target",
                f"expected none, because {self.sim} is a table with both platforms, got {self.target}.",
            )
        low, high = range_ends(self.range)
        if not low < high:
            yield (
                "range",
                f"expected LOW:HIGH, such as 0:100, with the lower number first, got {self.range!r}.",
            )
        if self.minus is not None and self.of is None:
            yield "minus", "expected a controller in --of, from which to subtract it, got none."
