"""The order of a calibration."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import ClassVar, Literal

from pydantic import model_validator

from realitygap.errors import meant
from realitygap.robot_families import default_family, port_platforms

from ._field import argument, option
from ._order import Order
from ._shared import Lock, Seed, Witness, arena_option, seed_option

PARTS = ("path", "sensors", "motion", "contact", "all")
LEVELS = ("track", "cells", "encoders")
"""Observation levels, each short for all parts from such data."""


class CalibrateOrder(Order):
    """Fit the simulator to a robot.

    The file that it writes describes the robot as it was measured. Use it as platform `sim:FILE`.

    The paper's calibrations are path and sensors. For path, the robot drives five full steps ahead and five turning.
    For sensors, it takes fifty readings at each distance from a wall, 3 in apart. The others are motion for motors and
    drift, contact for the behavior at walls, and all for everything together.

    Twins, emulators and sim need no operator. With a robot, the terminal leads you through the trials. Each trial is
    saved next to FILE when it ends. Run the same command again to resume.

    Example: realitygap calibrate sensors --robot sim -o sensors.toml --figure sensors.svg

    Example: realitygap calibrate path --robot scribbler:/dev/rfcomm0 -o path.toml

    Example: realitygap calibrate motion --robot scribbler:/dev/rfcomm0 --camera 0 -o motion.toml

    Example: realitygap calibrate all --robot "thymio:emulator://playground?speed=8" --observe track -o fit.toml

    Example: realitygap calibrate all --robot twin:worn.toml --observe track --budget 20 -o worn-fit.toml

    Example: realitygap calibrate sensors --from sensors.trials.sqlite -o sensors.toml

    With --from, a log or a table of another program is fitted, too. A log has commands, and poses or encoders
    (motion). A table has readings by distance and bearing of a wall (sensors). The error of the fit on the part that
    it did not see is printed. So are those of the robot file's numbers, of the paper's uniform noise, and of a lookup
    table. Numbers of the robot file stay if they predict better.

    Example: realitygap calibrate motion --from drive.csv --base pioneer -o drive.toml

    Example: realitygap calibrate motion --from run-1.csv --from run-2.csv --map runs.toml -o drive.toml

    Example: realitygap calibrate sensors --from wall.sample --base khepera -o wall.toml

    Example: realitygap calibrate sensors --from wall.sample --radius-mm 27.5 -o wall.toml

    In Python: realitygap.study.calibrate_from_log("drive.csv", base="pioneer")

    In Python: realitygap.study.calibrate_from_table("wall.sample", base="khepera")

    In Python: realitygap.calibrate("track", robot="twin:worn.toml").simulator()
    """

    command: ClassVar[str] = "calibrate"

    what: str = argument(
        "WHAT",
        help="Part of the robot: path, sensors, motion, contact or all. track, cells or encoders: all, from such data.",
    )
    robot: str | None = option(
        None,
        help=f"Robot to measure: {port_platforms()}, twin:FILE, sim or sim:FILE.",
        metavar="PLATFORM",
        label="Robot",
        refers="platform",
    )
    out: Path | None = option(
        None, help="Calibration to write (.toml).", metavar="FILE", names=("--out", "-o"), is_output=True
    )
    observe: Literal["cells", "encoders", "track"] | None = option(
        None,
        help="Data to record: cells (and a ruler), encoders, or track (a camera).",
        default_is="cells",
        metavar="HOW",
        label="Observation level",
    )
    budget: int | None = option(
        None,
        help="Total number of trials.",
        default_is="depends on WHAT",
        at_least=1,
        metavar="TRIALS",
        label="Number of trials",
    )
    choose: bool = option(
        False,
        help="Choose the last trials after a first fit, as the most informative ones. Only for all.",
        label="Choose the last trials",
    )
    data: tuple[Path, ...] = option(
        (),
        help="Trials, a log of a real robot (motion), or a table of readings (sensors), to fit without driving. "
        "Several logs of one robot, folders, and patterns such as 'runs/*.csv' are possible.",
        metavar="DATA",
        names=("--from",),
    )
    map_file: Path | None = option(
        None,
        help="Mapping of the columns of DATA (.toml).",
        default_is="DATA.map.toml next to DATA; otherwise a guess",
        metavar="FILE",
        names=("--map",),
    )
    hold_out: str | None = option(
        None,
        help="Part of a log or table that the fit does not see, and predicts.",
        default_is="0.5 of a log, blocks of a table",
        metavar="SHARE|blocks",
    )
    radius_mm: float | None = option(
        None,
        help="Radius of a round robot without a file: a table of readings places its sensors.",
        at_least=1,
        metavar="MM",
    )
    step: float | None = option(
        None,
        help="Length of a step of a log.",
        default_is="interval of the commands",
        at_least=0.001,
        metavar="SECONDS",
    )
    drop_bad_rows: bool = option(
        False, help="Leave out rows of a log that lack a number or repeat or turn back the time."
    )
    base: str | None = option(
        None,
        help="Robot, robot file, or earlier calibration whose numbers the fit starts from.",
        default_is=f"that of the platform, such as {default_family().robot}",
        metavar="ROBOT",
        label="Robot model",
        refers="file",
    )
    seed: Seed = seed_option(0)
    arena: str = arena_option()
    lock: Lock = False
    witness: Witness = None

    @model_validator(mode="before")
    @classmethod
    def _takes_what_is_seen(cls, values: dict[str, object]) -> dict[str, object]:
        """Read an observation level in place of a part as all parts, observed at that level."""
        what = values.get("what")
        is_level = what in LEVELS and values.get("observe") in (None, what)
        return values | {"what": "all", "observe": what} if is_level else values

    def conflicts(self) -> Iterator[tuple[str, str]]:
        """Yield the field and the message for each setting that others exclude."""
        if self.what not in (*PARTS, *LEVELS):
            yield (
                "what",
                f"expected {', '.join(PARTS)}, or, for all from such data, {', '.join(LEVELS)}, got {self.what!r}."
                f"{meant(self.what, (*PARTS, *LEVELS))}",
            )
        if (self.robot is None) == (not self.data):
            yield (
                "robot",
                "Expected either the robot to measure (--robot PLATFORM) or recorded trials (--from DATA).",
            )
        elif self.data and (self.witness is not None or self.choose or self.lock):
            yield "data", "--witness, --choose and --lock are only for --robot. Leave them out with --from."
        if self.radius_mm is not None and (self.what != "sensors" or self.base is not None):
            yield "radius_mm", "--radius-mm is only for sensors, instead of --base."
        if self.what != "motion" and (self.step is not None or self.drop_bad_rows):
            yield "step", "--step and --drop-bad-rows are only for motion. Leave them out."
        if self.out is not None and self.out.suffix != ".toml":
            yield (
                "out",
                f"{self.out} does not end in .toml. Expected the name of a calibration, such as fit.toml.",
            )
