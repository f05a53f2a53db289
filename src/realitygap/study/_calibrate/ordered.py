"""A calibration as it is ordered: measured, or fitted to recorded data, and written."""

from __future__ import annotations

import re
from pathlib import Path

from realitygap.errors import DescriptionError, StudyError
from realitygap.orders import CalibrateOrder, takes_order
from realitygap.platforms import base_robot_of, open_target
from realitygap.records import existing_trials, is_observations, refuse_links
from realitygap.trials import Operator, PortObserver, Pulse
from realitygap.world import Calibration, load_arena, read_calibration

from .._design import design_of, hold_to_design
from .._deviations import check_unblinded
from .from_log import calibrate_from_log
from .from_table import calibrate_from_table
from .hold_out import hold_out_of
from .one import Tell, calibrate, calibrate_from, save_calibration


@takes_order(CalibrateOrder)
def make_calibration(
    order: CalibrateOrder,
    *,
    observer: PortObserver | None = None,
    operator: Operator | None = None,
    pulse: Pulse | None = None,
    tell: Tell | None = None,
) -> Calibration:
    """Fit the simulator to a robot and write the calibration, as `realitygap calibrate`.

    Without `out`, the file is in `results` and is named after the robot. The same call resumes its trials.

    Args:
        observer: Observer of a robot without a witness, who reports what it drew.
        operator: Operator, who places the robot; None if the target places itself.
        pulse: Called when a trial on a robot begins or ends, and when the robot has answered in it.
        tell: Called after each trial.

    Returns:
        The calibration, which states its order.

    Raises:
        StudyError: The settings, the data, and the kind do not go together, or a file cannot be written.
        StoppedByPerson: The operator stopped; recorded trials are kept.
        RealityGapError: The robot failed, or files cannot be read or written.
    """
    out = _checked(order)
    is_foreign = any(not path.exists() or not is_observations(path) for path in order.data)
    if not is_foreign and any(
        (order.map_file, order.hold_out, order.radius_mm, order.step, order.drop_bad_rows)
    ):
        raise StudyError(
            "--map, --hold-out, --radius-mm, --step and --drop-bad-rows are only for --from with a log or a table of "
            "another program. Leave them out."
        )
    if is_foreign:
        made = _fitted_to_foreign(order, out)
    elif order.data:
        made = calibrate_from(
            order.what, _only_one(order.data), robot=order.base, observe=order.observe, seed=order.seed
        )
    else:
        made = _measured(order, out, observer, operator, pulse, tell)
        deviations = check_unblinded(existing_trials(out.with_suffix(".trials.sqlite")))
        made = made.model_copy(update={"notes": (*made.notes, *deviations)})
    made = made.model_copy(update={"order": order.record()})
    save_calibration(out, made)
    return made.in_file(out)


def _checked(order: CalibrateOrder) -> Path:
    """Return the file to write, after all checks of files, before a trial is lost.

    Raises:
        StudyError: The file cannot be written, or it is no calibration.
    """
    out = order.out
    if out is None:
        robot = (order.robot or str(order.data[0])).removesuffix(".toml")
        words = " ".join(filter(None, (robot, order.what, order.observe)))
        out = Path("results") / (re.sub(r"\W+", "-", words).strip("-") + ".toml")
        out.parent.mkdir(exist_ok=True)
    if out.exists():
        _refuse_other_files(out)
    if not out.resolve().parent.is_dir():
        raise StudyError(f"There is no folder {out.parent} for {out.name}. Make it, or name another file.")
    refuse_links(out.parent, out.with_suffix(".trials.sqlite"))
    return out


def _refuse_other_files(out: Path) -> None:
    """Raise an error if a file is not a calibration, which may be overwritten.

    Raises:
        StudyError: It is another file, or a calibration that was changed and cannot be read.
    """
    stays = "it was not changed. Name another file."
    try:
        made = read_calibration(out)
    except DescriptionError as error:
        raise StudyError(f"{out} exists and cannot be read as a calibration: {stays} {error}") from None
    if made is None:
        raise StudyError(f"{out} exists and is not a calibration: {stays}")


def _only_one(data: tuple[Path, ...]) -> Path:
    """Return the data, of which there has to be one."""
    if len(data) > 1:
        raise StudyError(
            f"--from names {len(data)} files, {data[0]} and others. Expected one, unless motion is fitted to logs of "
            "another program."
        )
    return data[0]


def _fitted_to_foreign(order: CalibrateOrder, out: Path) -> Calibration:
    """Fit a log or a table of another program."""
    if order.what == "motion":
        return calibrate_from_log(
            list(order.data),
            map_file=order.map_file,
            base=order.base,
            hold_out=hold_out_of(order.hold_out or "0.5"),
            seed=order.seed,
            step_s=order.step,
            drop_bad_rows=order.drop_bad_rows,
        )
    if order.what == "sensors":
        return calibrate_from_table(
            _only_one(order.data),
            map_file=order.map_file,
            base=order.base,
            hold_out=hold_out_of(order.hold_out or "blocks"),
            seed=order.seed,
            radius=None if order.radius_mm is None else order.radius_mm / 1000,
            robot_file=out.with_suffix(".robot.toml"),
        )
    raise StudyError(
        f"{order.data[0]} is not a file of observed trials. You can fit motion to a log, and sensors to a table of "
        f"readings. To fit {order.what}, import the log first: realitygap import."
    )


def _measured(
    order: CalibrateOrder,
    out: Path,
    observer: PortObserver | None,
    operator: Operator | None,
    pulse: Pulse | None,
    tell: Tell | None,
) -> Calibration:
    """Drive the trials, and fit."""
    robot = order.robot or ""
    base = order.base or base_robot_of(robot)
    with open_target(
        robot,
        load_arena(order.arena),
        key=order.seed,
        witness=order.witness,
        observer=observer,
        on_lost="retry" if operator is None else "stop",  # a retry needs a person who puts it back
        pulse=pulse,
    ) as target:
        return calibrate(
            order.what,
            target,
            robot=base,
            observe=order.observe or "cells",
            budget=order.budget,
            seed=order.seed,
            trials_file=existing_trials(out.with_suffix(".trials.sqlite")),
            choose=order.choose,
            operator=operator,
            tell=tell,
            hold=lambda file: hold_to_design(file, design_of(order, target, score=""), lock=order.lock),
        )
