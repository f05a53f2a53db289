"""The order of an assisted estimate."""

from __future__ import annotations

from typing import ClassVar

from ._field import option
from ._shared import MeasureOrder


class EstimateOrder(MeasureOrder):
    """Estimate a robot's mean score, assisted by simulation.

    A few controllers run on the target. These and many others like them run in the simulator. The estimate is the
    target's mean, corrected by the regression of its scores on the simulator's. Its 95 % interval is valid whatever the
    simulator's error. The interval from the target alone is printed, too.

    Example: realitygap estimate sim twin:worn-1.toml --n-controllers 10 --trials 5

    Example: realitygap estimate sim:fit.toml recorded:tracked.sqlite --fleet --others 20

    In Python: realitygap.estimate_score("sim", "twin:worn-1.toml", n_controllers=10)
    """

    command: ClassVar[str] = "estimate"

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
