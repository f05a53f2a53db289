"""`realitygap import`."""

from __future__ import annotations

import dataclasses
import shlex
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

import realitygap
from realitygap._terminal import echo
from realitygap.errors import LogError

from ._options import Json, print_json

if TYPE_CHECKING:
    from collections.abc import Sequence

    from realitygap.logs import ImportReport, MappedLog


def import_log(
    log: Annotated[
        list[Path],
        typer.Argument(
            metavar="LOG...",
            help="Text table, Parquet, MCAP, bag of ROS, LeRobot dataset, or recording; or the folder of its files. "
            "Several logs of one robot, folders, and patterns such as 'runs/*.csv' are possible.",
        ),
    ],
    out: Annotated[
        Path | None, typer.Option("--out", "-o", metavar="FILE", help="File of trials to write (.jsonl).")
    ] = None,
    map_file: Annotated[
        Path | None,
        typer.Option(
            "--map",
            metavar="FILE",
            help="Mapping of the columns (.toml). [default: LOG.map.toml next to LOG; otherwise a guess]",
        ),
    ] = None,
    base: Annotated[
        str | None,
        typer.Option(
            metavar="ROBOT", help="Robot that drove: a name or a file. [default: as the mapping says]"
        ),
    ] = None,
    step: Annotated[
        float | None,
        typer.Option(
            min=0.001, metavar="SECONDS", help="Length of a step. [default: interval of the commands]"
        ),
    ] = None,
    drop_bad_rows: Annotated[
        bool,
        typer.Option(
            "--drop-bad-rows", help="Leave out rows that lack a number or repeat or turn back the time."
        ),
    ] = False,
    show_map: Annotated[
        bool, typer.Option("--show-map", help="Print the mapping as TOML, and write nothing.")
    ] = False,
    as_json: Json = False,
) -> None:
    """Turn a log of a real robot into trials.

    A mapping says which column is what, in which unit, with which sign, and by which clock. Without a mapping, the
    names of the columns are used. --show-map prints the mapping as TOML, to be saved and changed.

    All parts are resampled to steps of one length. The report gives the method of each part, and the time by which
    poses follow commands. It also names the usual mistakes: wheels that are swapped or reversed, half of the track,
    degrees, millimeters, ticks, and clocks that differ.

    Example: realitygap import drive.csv --show-map > drive.map.toml

    Example: realitygap import drive.csv -o trials.jsonl

    Example: realitygap import "runs/*.csv" --map runs.toml -o trials.jsonl

    In Python: realitygap.logs.import_log("drive.csv", "trials.jsonl", log_map)
    """
    logs = realitygap.logs
    mapped = logs.mapped_logs(log, map_file, step_s=step, draft=show_map)
    if show_map:
        echo(mapped[0].log_map.to_toml(), nl=False)
        return
    if out is None:
        raise LogError("No file for the trials. Name one: -o trials.jsonl. Or print the mapping: --show-map.")
    if out.suffix != ".jsonl":
        raise LogError(
            f"{out} does not end in .jsonl. Expected the name of a file of trials, such as trials.jsonl."
        )
    if any(out.resolve() == each.path.resolve() for each in mapped):
        raise LogError(f"{out} is the log itself. Name another file.")
    report = logs.import_logs(mapped, out, base=base, drop_bad_rows=drop_bad_rows)
    if as_json:
        about: dict[str, Any] = {"file": out, "label": mapped[0].log_map.label}
        about["seconds"] = report.n_steps * report.step_s
        about["logs"] = [
            {
                "log": each.path,
                "mapping_from": each.origin,
                "mapping": each.log_map.model_dump(exclude_defaults=True),
            }
            for each in mapped
        ]
        print_json(about | dataclasses.asdict(report))
        return
    _print(mapped, out, report)


def _print(mapped: Sequence[MappedLog], out: Path, report: ImportReport) -> None:
    log_map = mapped[0].log_map
    origins = dict.fromkeys(log.origin for log in mapped)
    trials = "1 trial" if report.n_trials == 1 else f"{report.n_trials:,} trials"
    seconds = report.n_steps * report.step_s
    name = realitygap.logs.target_of([log.path for log in mapped])
    echo(f"{name} ({log_map.label}): {trials}, {report.n_steps:,} steps, {seconds:.4g} s; {report.observe}")
    echo(f"Mapping: {', '.join(origins)}.")
    if any("guessed" in origin for origin in origins):
        echo("".join(f"  {line}\n" for line in log_map.to_toml().splitlines()), nl=False)
    for note in report.notes:
        echo(note)
    offset = report.offset
    if offset is not None:
        wheels = "commands" if "commands" in report.observe else "encoders"
        echo(f"Poses follow {wheels} by {offset}, a robot's lag and delay included.")
    for mistake in report.mistakes:
        echo(f"Check ({mistake.kind}): {mistake.message}")
    data = " ".join(f"--from {shlex.quote(str(log.path))}" for log in mapped)
    echo(f"Written: {out}. Fit a robot to it: realitygap calibrate motion {data}")
