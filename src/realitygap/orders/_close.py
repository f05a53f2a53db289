"""The order of `close`: a gap, a calibration, and the gap again."""

from __future__ import annotations

from pathlib import Path
from typing import ClassVar, Literal

from realitygap.robot_families import port_platforms

from ._field import argument, option
from ._shared import (
    Lock,
    PairOrder,
    Processes,
    Seed,
    Witness,
    arena_option,
    folder_option,
    margin_option,
    seed_option,
)


class CloseOrder(PairOrder):
    """Measure the gap, calibrate, measure it again.

    The same controllers run on the target, in the simulator, and in the calibrated simulator. The calibration has other
    trials and other controllers, so both gaps are of trials that no fit has seen. The folder has all trials of the
    target, the calibration (fit.toml), and the page (report.html). Run the same command again to resume.

    With --lock, the design of all three parts is locked in design.sqlite. The order of the controllers in
    a round stays fixed. It is random with `gap --lock`.

    Example: realitygap close sim twin:worn-1.toml

    Example: realitygap close sim twin:worn-1.toml --budget 40 --margin 0.05 -o results/worn-1

    In Python: realitygap.close_gap("sim", "twin:worn-1.toml", budget=20)
    """

    command: ClassVar[str] = "close"

    sim: str = argument(
        "SIM", help="Simulator to calibrate: sim or sim:FILE.", label="Simulator", refers="platform"
    )
    target: str = argument(
        "TARGET",
        help=f"Target: twin:FILE, sim:FILE or an emulated robot, {port_platforms()}.",
        label="Target",
        refers="platform",
    )
    budget: int = option(
        20,
        help="Number of trials of the calibration.",
        at_least=1,
        metavar="TRIALS",
        label="Number of trials",
    )
    what: Literal["all", "path", "sensors", "motion", "contact"] = option(
        "all", help="Part of the robot to calibrate.", metavar="WHAT", label="Part of the robot"
    )
    margin: float | None = margin_option()
    observe: Literal["cells", "encoders", "track"] | None = option(
        None,
        help="Data recorded on the target.",
        default_is="track if the target supports it, otherwise cells",
        metavar="HOW",
        label="Observation level",
    )
    arena: str = arena_option()
    out: Path | None = folder_option("results/close")
    processes: Processes = None
    witness: Witness = None
    lock: Lock = False
    seed: Seed = seed_option()

    @property
    def folder(self) -> Path:
        """Folder for trials, calibration, and page."""
        return self.out or Path("results/close")
