"""`realitygap calibrate`."""

from __future__ import annotations

import shlex
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from realitygap._terminal import draw, echo
from realitygap.errors import DescriptionError, StudyError

from ._camera import CAMERA_HELP, under_camera
from ._code import AllowPlatforms
from ._json import print_json

if TYPE_CHECKING:
    from realitygap.trials import OnLost
    from realitygap.world import Calibration

_OBSERVE = ("cells", "encoders", "track")


def calibrate(
    what: Annotated[
        str, typer.Argument(metavar="WHAT", help="Part of the robot: path, sensors, motion, contact or all.")
    ],
    robot: Annotated[
        str | None,
        typer.Option(
            metavar="PLATFORM",
            help="Robot to measure: scribbler:PORT, thymio:PORT, enki, twin:FILE, sim or sim:FILE.",
        ),
    ] = None,
    out: Annotated[
        Path | None, typer.Option("--out", "-o", metavar="FILE", help="Calibration to write (.toml).")
    ] = None,
    observe: Annotated[
        str | None,
        typer.Option(
            metavar="HOW",
            help="Data to record: cells (and a ruler), encoders, or track (a camera). [default: cells]",
        ),
    ] = None,
    budget: Annotated[
        int | None,
        typer.Option(min=1, metavar="TRIALS", help="Total number of trials. [default: depends on WHAT]"),
    ] = None,
    choose: Annotated[
        bool,
        typer.Option(
            "--choose",
            help="Choose the last trials after a first fit, as the most informative ones. Only for all.",
        ),
    ] = False,
    data: Annotated[
        list[Path] | None,
        typer.Option(
            "--from",
            metavar="DATA",
            help="Trials, a log of a real robot (motion), or a table of readings (sensors), to fit without driving. "
            "Several logs of one robot, folders, and patterns such as 'runs/*.csv' are possible.",
        ),
    ] = None,
    map_file: Annotated[
        Path | None,
        typer.Option(
            "--map",
            metavar="FILE",
            help="Mapping of the columns of DATA (.toml). [default: DATA.map.toml next to DATA; otherwise a guess]",
        ),
    ] = None,
    hold_out: Annotated[
        str | None,
        typer.Option(
            "--hold-out",
            metavar="SHARE|blocks",
            help="Part of a log or table that the fit does not see, and predicts. [default: 0.5 of a log, blocks of a "
            "table]",
        ),
    ] = None,
    radius_mm: Annotated[
        float | None,
        typer.Option(
            "--radius-mm",
            min=1.0,
            metavar="MM",
            help="Radius of a round robot without a file: a table of readings places its sensors.",
        ),
    ] = None,
    step: Annotated[
        float | None,
        typer.Option(
            min=0.001,
            metavar="SECONDS",
            help="Length of a step of a log. [default: interval of the commands]",
        ),
    ] = None,
    drop_bad_rows: Annotated[
        bool,
        typer.Option(
            "--drop-bad-rows",
            help="Leave out rows of a log that lack a number or repeat or turn back the time.",
        ),
    ] = False,
    base: Annotated[
        str | None,
        typer.Option(
            metavar="ROBOT",
            help="Robot, robot file, or earlier calibration whose numbers the fit starts from. "
            "[default: that of the platform, such as scribbler-s2-fluke2 or thymio]",
        ),
    ] = None,
    seed: Annotated[int, typer.Option(min=0, help="Seed of the trials and samples.")] = 0,
    arena: Annotated[str, typer.Option(metavar="ARENA", help="Arena by name or file.")] = "paper",
    witness: Annotated[
        str | None,
        typer.Option(
            metavar="HOST:PORT",
            help="Witness of an emulator in another program. It places the robot and observes its path.",
        ),
    ] = None,
    camera: Annotated[str | None, typer.Option(metavar="CAMERA", help=CAMERA_HELP)] = None,
    figure: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            help="Draw the readings as the paper's Figure 3 (.svg, .pdf, .png). Only for sensors.",
        ),
    ] = None,
    allow_code: AllowPlatforms = False,
    as_json: Annotated[bool, typer.Option("--json", help="Print the result as JSON.")] = False,
) -> None:
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

    Example: realitygap calibrate sensors --from sensors.trials.jsonl -o sensors.toml

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

    In Python: realitygap.study.calibrate("sensors", target)
    """
    from realitygap.study import calibrate_from, save_calibration

    out = _checked(what, robot, out, observe, data, witness, camera, figure, choose=choose)
    foreign = _is_foreign(data)
    if not foreign and any((map_file, hold_out, radius_mm, step, drop_bad_rows)):
        raise StudyError(
            "--map, --hold-out, --radius-mm, --step and --drop-bad-rows are only for --from with a log or a table of "
            "another program. Leave them out."
        )
    if foreign and data:
        if figure is not None:
            raise StudyError("--figure draws the readings of trials, but the data are a table. Leave it out.")
        made = _from_foreign(
            what, data, out, map_file, base, hold_out, seed, radius_mm, step, drop_bad_rows=drop_bad_rows
        )
    elif data:
        made = calibrate_from(what, _only_one(data), robot=base, observe=_seen(observe), seed=seed)
    else:
        made = _measured(
            *(what, robot or "", out, observe, budget, base, seed, arena, witness, camera),
            choose=choose,
            quiet=as_json,
        )
    save_calibration(out, made)
    if figure is not None:
        from realitygap.report import save_sensor_figure

        save_sensor_figure(made, figure)
    _print(made, out, figure, as_json=as_json)


def _checked(
    what: str,
    robot: str | None,
    out: Path | None,
    observe: str | None,
    data: list[Path] | None,
    witness: str | None,
    camera: str | None,
    figure: Path | None,
    *,
    choose: bool,
) -> Path:
    """Refuse wrong options before a trial is lost, and return the file for the calibration."""
    from realitygap.records import refuse_links

    if (robot is None) == (not data):
        raise StudyError(
            "Expected either the robot to measure (--robot PLATFORM) or recorded trials (--from DATA)."
        )
    if out is None:
        raise StudyError("No file for the calibration. Name one: -o FILE.toml")
    if out.suffix != ".toml":
        raise StudyError(
            f"{out} does not end in .toml. Expected the name of a calibration, such as fit.toml."
        )
    if out.exists():
        _refuse_other_files(out)
    for path in (out, figure):
        if path is not None and not path.resolve().parent.is_dir():
            raise StudyError(
                f"There is no folder {path.parent} for {path.name}. Make it, or name another file."
            )
    refuse_links(out.parent, out.with_suffix(".trials.jsonl"))
    if observe is not None and observe not in _OBSERVE:
        raise StudyError(f"--observe is {observe!r}, expected cells, encoders or track.")
    if figure is not None and (what != "sensors" or figure.suffix not in (".svg", ".pdf", ".png")):
        raise StudyError("--figure draws the readings of `calibrate sensors` into a .svg, .pdf or .png.")
    if data and (witness is not None or camera is not None or choose):
        raise StudyError("--witness, --camera and --choose are only for --robot. Leave them out with --from.")
    return out


def _refuse_other_files(out: Path) -> None:
    """Raise an error if a file is not a calibration, which may be overwritten.

    Raises:
        StudyError: It is another file, or a calibration that was changed and cannot be read.
    """
    from realitygap.world import read_calibration

    stays = "it was not changed. Name another file."
    try:
        made = read_calibration(out)
    except DescriptionError as error:
        raise StudyError(f"{out} exists and cannot be read as a calibration: {stays} {error}") from None
    if made is None:
        raise StudyError(f"{out} exists and is not a calibration: {stays}")


def _is_foreign(data: list[Path] | None) -> bool:
    """Return whether the data is of another program, or a recording, and not a file of observed trials."""
    from realitygap.records import is_observations

    return any(not path.exists() or not is_observations(path) for path in data or ())


def _only_one(data: list[Path]) -> Path:
    """Return the data, of which there has to be one."""
    if len(data) > 1:
        raise StudyError(
            f"--from names {len(data)} files, {data[0]} and others. Expected one, unless motion is fitted to logs of "
            "another program."
        )
    return data[0]


def _from_foreign(
    what: str,
    data: list[Path],
    out: Path,
    map_file: Path | None,
    base: str | None,
    hold_out: str | None,
    seed: int,
    radius_mm: float | None,
    step: float | None,
    *,
    drop_bad_rows: bool,
) -> Calibration:
    """Fit a log or a table of another program."""
    from realitygap.study import calibrate_from_log, calibrate_from_table, hold_out_of

    if radius_mm is not None and (what != "sensors" or base is not None):
        raise StudyError("--radius-mm is only for sensors, instead of --base.")
    if what == "motion":
        share = hold_out_of(hold_out or "0.5")
        return calibrate_from_log(
            data,
            map_file=map_file,
            base=base,
            hold_out=share,
            seed=seed,
            step_s=step,
            drop_bad_rows=drop_bad_rows,
        )
    if step is not None or drop_bad_rows:
        raise StudyError("--step and --drop-bad-rows are only for motion. Leave them out.")
    if what == "sensors":
        return calibrate_from_table(
            _only_one(data),
            map_file=map_file,
            base=base,
            hold_out=hold_out_of(hold_out or "blocks"),
            seed=seed,
            radius=None if radius_mm is None else radius_mm / 1000,
            robot_file=out.with_suffix(".robot.toml"),
        )
    raise StudyError(
        f"{data[0]} is not a file of observed trials. You can fit motion to a log, and sensors to a table of "
        f"readings. To fit {what}, import the log first: realitygap import."
    )


def _seen(observe: str | None) -> Any:
    return observe


def _measured(
    what: str,
    robot: str,
    out: Path,
    observe: str | None,
    budget: int | None,
    base: str | None,
    seed: int,
    arena: str,
    witness: str | None,
    camera: str | None,
    *,
    choose: bool,
    quiet: bool,
) -> Calibration:
    """Drive the trials, and fit."""
    from realitygap.platforms import class_of
    from realitygap.study import StoppedByPerson, calibrate, open_target
    from realitygap.world import load_arena, load_robot

    from ._calibration_operator import CalibrationOperator
    from ._sheet import sheet_observer

    kept = out.with_suffix(".trials.jsonl")
    base = base or class_of(robot).base_robot
    where, model = load_arena(arena), load_robot(base)
    is_led = _is_led(robot, witness)
    again = f"Recorded trials are in {kept}. Run the same command to resume."
    try:
        sheet = sheet_observer(asks_for_start=False) if is_led else None
        operator = CalibrationOperator(where, model) if is_led else None
        on_lost: OnLost = "stop" if is_led else "retry"  # a retry needs a person who puts it back
        with (
            under_camera(camera, where, sheet) as observer,
            open_target(
                robot, where, key=seed, witness=witness, observer=observer, on_lost=on_lost
            ) as target,
        ):
            return calibrate(
                what,
                target,
                robot=base,
                observe=_seen(observe or ("cells" if camera is None else "track")),
                budget=budget,
                seed=seed,
                trials_file=kept,
                choose=choose,
                operator=operator,
                tell=None if quiet or operator is not None else _tell,
            )
    except StoppedByPerson:
        echo(again, err=True)
        raise typer.Exit(0) from None
    except KeyboardInterrupt:
        echo(f"Interrupted. {again}", err=True)
        raise typer.Exit(130) from None


def _is_led(robot: str, witness: str | None) -> bool:
    """Return whether a person at the terminal has to place the robot."""
    from realitygap.platforms import platform_of

    return witness is None and platform_of(robot).needs_person


def _tell(done: int, n: int) -> None:
    if sys.stderr.isatty():
        draw("\r", err=True)
        echo(f"{done} of {n} trials", nl=done == n, err=True)


def _print(made: Calibration, out: Path, figure: Path | None, *, as_json: bool) -> None:
    if as_json:
        values = {"file": str(out), "figure": None if figure is None else str(figure)}
        values |= made.model_dump(exclude={"draws", "evidence"}) | {"held_out": made.held_out or None}
        print_json(values)
        return
    from ._tables import calibration_table, held_out_table, wide_console

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
