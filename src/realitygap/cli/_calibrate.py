"""`realitygap calibrate`."""

from __future__ import annotations

import shlex
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

import realitygap
from realitygap._terminal import echo
from realitygap.errors import StudyError
from realitygap.orders import CalibrateOrder

from ._code import AllowPlatforms
from ._observer import CameraOfRobots, needs_operator, sheet_observer, under_camera
from ._options import Json, print_json
from ._order import command_of
from ._progress import TrialsBar, resumable
from ._tables import calibration_table, held_out_table, wide_console

if TYPE_CHECKING:
    from realitygap.world import Calibration


@command_of(CalibrateOrder)
def calibrate(
    order: CalibrateOrder,
    camera: CameraOfRobots = None,
    figure: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            help="Draw the readings as the paper's Figure 3 (.svg, .pdf, .png). Only for sensors.",
        ),
    ] = None,
    allow_code: AllowPlatforms = False,
    as_json: Json = False,
) -> None:
    """Calibrate, print the result, and draw the figure."""
    _check(order, camera, figure)
    made = realitygap.study.make_calibration(order) if order.data else _measured(order, camera, quiet=as_json)
    if figure is not None:
        realitygap.report.save_sensor_figure(made, figure)
    _print(made, order.out or Path(), figure, as_json=as_json)


def _check(order: CalibrateOrder, camera: str | None, figure: Path | None) -> None:
    """Refuse wrong options of the command before a trial is lost."""
    if order.out is None:
        raise StudyError("No file for the calibration. Name one: -o FILE.toml")
    if order.data and camera is not None:
        raise StudyError("--camera is only for --robot. Leave it out with --from.")
    if figure is None:
        return
    if order.what != "sensors" or figure.suffix not in (".svg", ".pdf", ".png"):
        raise StudyError("--figure draws the readings of `calibrate sensors` into a .svg, .pdf or .png.")
    if not figure.resolve().parent.is_dir():
        raise StudyError(
            f"There is no folder {figure.parent} for {figure.name}. Make it, or name another file."
        )
    if order.data and not all(
        path.exists() and realitygap.records.is_observations(path) for path in order.data
    ):
        raise StudyError("--figure draws the readings of trials, but the data are a table. Leave it out.")


def _measured(order: CalibrateOrder, camera: str | None, *, quiet: bool) -> Calibration:
    """Drive the trials, and fit."""
    from ._calibration_operator import CalibrationOperator

    robot = order.robot or ""
    base = order.base or realitygap.platforms.base_robot_of(robot)
    if order.observe is None and camera is not None:
        order = order.model_copy(update={"observe": "track"})
    where, model = realitygap.world.load_arena(order.arena), realitygap.world.load_robot(base)
    is_led = needs_operator(robot, order.witness)
    operator = CalibrationOperator(where, model) if is_led else None
    kept = (order.out or Path("fit")).with_suffix(".trials.sqlite")
    try:
        with resumable(kept), TrialsBar(quiet=quiet or is_led) as bar:
            sheet = sheet_observer(asks_for_start=False) if is_led else None
            with under_camera(camera, robot, where, sheet, order.witness) as observer:
                return realitygap.study.make_calibration(
                    order, observer=observer, operator=operator, tell=partial(bar.show, robot)
                )
    except realitygap.study.StoppedByPerson:
        echo(f"Recorded trials are in {kept}. Run the same command to resume.", err=True)
        raise typer.Exit(0) from None


def _print(made: Calibration, out: Path, figure: Path | None, *, as_json: bool) -> None:
    if as_json:
        values = {"file": str(out), "figure": None if figure is None else str(figure)}
        values |= made.model_dump(exclude={"draws", "evidence"}) | {"held_out": made.held_out or None}
        print_json(values)
        return
    console = wide_console()
    console.print(calibration_table(made))
    if made.held_out:
        console.print(held_out_table(made.held_out, made.label))
    for note in made.remarks:
        console.print(note)
    if made.misspecified:
        p = f" (p {made.misspecification_p:.3f})" if made.misspecification_p < 1 else ""
        echo(
            f"The simulator cannot make what was observed{p}: what was fitted is the nearest that it can do."
        )
    for line in sorted(
        {f"{each.name.rpartition('.')[2]}: {each.advice}" for each in made.fitted if each.advice}
    ):
        echo(f"Not identified: {line}")
    if figure is not None:
        echo(f"Figure: {figure}")
    echo(f"Written: {out}. Simulate it with platform sim:{shlex.quote(str(out))}")
