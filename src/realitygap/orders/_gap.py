"""The order of a gap."""

from __future__ import annotations

from collections.abc import Iterator
from typing import ClassVar, Literal

from ._field import option
from ._shared import MeasureOrder, margin_option


class GapOrder(MeasureOrder):
    """Measure the gap between a simulator and a target.

    Runs the same controllers on both platforms. Reports level, RMS gap without the noise of trials, ranking, behavior,
    and equivalence at a margin, with 95 % intervals. If there are too few trials for a measure, the report says how
    many you need. With --observe track, it also measures replays.

    Example: realitygap gap sim jyro --n-controllers 10 --trials 5

    Example: realitygap gap sim twin:worn-1.toml --controllers paper --margin 0.05 --report gap.html

    Example: realitygap gap sim twin:worn-1.toml --controllers avoid

    Example: realitygap gap sim:fit.toml recorded:tracked.sqlite --observe track

    Example: realitygap gap sim:fit.toml twin:worn-1.toml --randomize posterior

    In Python: realitygap.measure_gap("sim", "jyro", n_controllers=10, trials=5)
    """

    command: ClassVar[str] = "gap"

    margin: float | None = margin_option()
    randomize: Literal["no", "posterior"] = option(
        "no",
        help="posterior: sample the robot of each trial from the calibration SIM. no: use its estimate.",
        label="Randomize",
    )
    reevolved: str | None = option(
        None,
        help="Study or folder of champions evolved on the target. Adds the re-evolved gap, which is the paper's.",
        metavar="WHICH",
        label="Re-evolved controllers from",
        refers="file",
    )
    why: bool = option(
        False,
        help="Report how much of the gap each part of the model explains. SIM must be a calibration.",
        label="Explain the gap",
    )

    def conflicts(self) -> Iterator[tuple[str, str]]:
        """Yield the field and the message for each setting that others exclude."""
        if self.why and self.noise:
            yield (
                "why",
                f"--why switches parts of the model in without the paper's noise, and --noise is {self.noise:g}. Leave "
                "one out.",
            )
        elif self.why and self.trials < 2:
            yield (
                "why",
                "--why needs at least 2 trials of each controller, to separate the gap from noise.",
            )

    @property
    def can_close(self) -> bool:
        """True if a calibration of the simulator may close the gap."""
        is_sim = self.sim.partition(":")[0] == "sim" and self.observe != "readings"
        return (
            is_sim and self.target != self.sim and self.target.partition(":")[0] not in ("jyro", "recorded")
        )

    @property
    def n_trials(self) -> int:
        """Number of trials on each platform."""
        return self.n_controllers * self.trials
