"""`realitygap run` and `realitygap new-study`."""

from __future__ import annotations

import dataclasses
import shlex
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

import realitygap
from realitygap._how_to_run import launcher
from realitygap._terminal import echo
from realitygap.errors import StudyError

from ._code import AllowTasks, code_permission
from ._options import Json, OpenPage, Replicates, StudyFolder, StudySeed, print_json
from ._progress import RunsBar, resumable
from ._results import show_page, written_report
from ._tables import summary_table, task_table, wide_console

if TYPE_CHECKING:
    from realitygap.records import ResultsFolder
    from realitygap.study import StudyResult


_COMPUTING = "Computing"


def run(
    study: Annotated[
        str,
        typer.Argument(
            metavar="STUDY",
            help="Name of a study, such as paper, paper-choices or distances; or a study file (.toml).",
        ),
    ],
    replicates: Replicates = None,
    out: StudyFolder = None,
    seed: StudySeed = None,
    randomize: Annotated[
        str | None,
        typer.Option(
            metavar="HOW",
            help="posterior: sample the robot of each trial from the calibration of sim:FILE. no: use its estimate. "
            "[default: from the study]",
        ),
    ] = None,
    threads: Annotated[
        int | None,
        typer.Option(min=1, help="Number of threads. [default: all processors]", rich_help_panel=_COMPUTING),
    ] = None,
    chunk: Annotated[
        int | None,
        typer.Option(
            min=1,
            help="Number of runs per file. [default: depends on their length]",
            rich_help_panel=_COMPUTING,
        ),
    ] = None,
    fresh: Annotated[
        bool, typer.Option("--fresh", help="Delete the existing study in the folder and start again.")
    ] = False,
    cluster: Annotated[
        str | None,
        typer.Option(
            metavar="WHERE",
            help="Dask cluster to compute on: tcp://HOST:8786, or slurm (pbs, sge, lsf, oar, htcondor, moab); "
            "slurm:20 requests 20 jobs.",
            rich_help_panel=_COMPUTING,
        ),
    ] = None,
    allow_code: AllowTasks = False,
    as_json: Json = False,
    open_page: OpenPage = False,
) -> None:
    """Run a study, or resume one that was interrupted.

    You can interrupt it at any time. Run the same command again to resume. More runs or new conditions extend
    existing results. The results do not depend on threads, clusters, chunks or interruptions.

    A study may have tasks and descriptors in Python files. Before such a file runs for the first time, the command
    shows it and asks for your permission. The answer is remembered until the file changes.

    `realitygap drive` drives the conditions that are on a robot.

    Example: realitygap run paper --open

    Example: realitygap run paper --replicates 1000

    In Python: realitygap.run_study("paper", replicates=1000)
    """
    if threads is not None and cluster is not None:
        raise StudyError(
            "--threads and --cluster exclude each other. Set the number of threads of a worker when you start "
            "it: `dask worker --nthreads`, or `cores` in the settings of its jobs."
        )
    resolved = realitygap.study.load_study(study, seed=seed, replicates=replicates, randomize=randomize)
    if resolved.n_physical == len(resolved.conditions):
        raise StudyError(
            f"Every condition of study {resolved.about.name!r} is on a robot. Drive it: "
            f"realitygap drive {shlex.quote(study)} --port PORT"
        )
    with resumable("Published runs are saved."), RunsBar(quiet=as_json) as bar:
        result = realitygap.study.run_study(
            resolved,
            out,
            threads=threads,
            chunk=chunk,
            fresh=fresh,
            cluster=cluster,
            tell=bar.show,
            allow_code=code_permission(allow_code),
        )
    print_result(result, as_json=as_json)
    if open_page:
        show_page(written_report(result.folder.path, to_stderr=as_json))


def new_study(
    path: Annotated[Path, typer.Argument(metavar="FILE", help="Study file to write (.toml).")] = Path(
        "my-study.toml"
    ),
    source: Annotated[
        str | None,
        typer.Option(
            "--from",
            metavar="STUDY",
            help="Study that comes with realitygap to start from, such as paper. [default: a template of all settings]",
        ),
    ] = None,
) -> None:
    """Write a study file to change: a template, or a copy.

    The template documents every setting. A copy of a study that comes with realitygap has its own name.

    Example: realitygap new-study my-study.toml && realitygap run my-study.toml

    Example: realitygap new-study quiet.toml --from paper

    In Python: realitygap.study.study_template("my-study")
    """
    if path.suffix != ".toml":
        copy = f" To copy the study {path}: realitygap new-study my-study.toml --from {path}"
        raise StudyError(
            f"{path} does not end in .toml. Expected the name of a study file, such as my-study.toml."
            + (copy if str(path) in realitygap.study.named_studies() else "")
        )
    text = realitygap.study.study_template(_as_name(path.stem), source)
    try:
        with path.open("x", encoding="utf-8") as file:
            file.write(text)
    except FileExistsError:
        raise StudyError(f"{path} exists and was not changed. Choose another name.") from None
    except OSError as error:
        raise StudyError(f"{path} cannot be written: {error.strerror}.") from error
    echo(f"Written: {path}. Run it with: {launcher()} run {shlex.quote(str(path))}")


def _as_name(stem: str) -> str:
    name = "".join(
        letter if letter.isascii() and (letter.isalnum() or letter in ".-_") else "-" for letter in stem
    )
    return name.lstrip(".-_") or "my-study"


def print_result(result: StudyResult, *, as_json: bool) -> None:
    """Print the summary of a study, and how many runs are complete."""
    there = result.n_runs or (result.physical is not None and result.physical.n_complete)
    if not there:  # nothing to summarize yet
        if as_json:
            print_json({"folder": str(result.folder.path), **_physical_json(result)})
        _print_physical(result, to_stderr=as_json)
        return
    summary, tasks = (
        realitygap.report.summarize(result.folder),
        realitygap.report.summarize_tasks(result.folder),
    )
    if as_json:
        found = {
            "folder": str(result.folder.path),
            "title": result.folder.description["title"],
            "note": result.folder.description.get("note"),
            "runs": result.n_runs,
            "computed": result.n_computed,
            "seconds": result.seconds,
            **_physical_json(result),
            "conditions": summary.to_dicts(),
            **({"tasks": tasks.to_dicts()} if len(tasks) else {}),
        }
        print_json(found)
        _print_physical(result, to_stderr=True)
        return
    console = wide_console()
    title = result.folder.description["title"]
    if len(tasks):
        console.print(task_table(tasks, title))
    if len(tasks) < len(summary):
        console.print(summary_table(summary, title))
    if note := result.folder.description.get("note"):
        console.print(note, style="italic")
    path = result.folder.path
    if result.n_computed:
        echo(
            f"{result.n_computed} of {result.n_runs} runs computed in {result.seconds:.1f} s "
            f"({result.n_computed / result.seconds:,.0f} runs/s)."
        )
    elif result.n_runs:
        echo(f"All {result.n_runs} runs existed already.")
    _print_physical(result)
    echo(f"Results: {path}   in Python: {_reading(result.folder)}")
    echo(f"Report:  {launcher()} report {shlex.quote(str(path))}")


def _reading(folder: ResultsFolder) -> str:
    """Return the line of Python that reads all rows."""
    import polars as pl

    chunks = [chunks[0].path for name in folder.conditions if (chunks := folder.chunks(name))]
    if len({frozenset(pl.read_parquet_schema(path)) for path in chunks}) > 1:
        return f"realitygap.ResultsFolder.open({str(folder.path)!r}).scan()"
    return f"polars.scan_parquet({f'{folder.path}/trials/*.parquet'!r})"


def _physical_json(result: StudyResult) -> dict[str, Any]:
    return {} if result.physical is None else {"physical": dataclasses.asdict(result.physical)}


def _print_physical(result: StudyResult, *, to_stderr: bool = False) -> None:
    """Print the progress of the runs on a robot, and the next step."""
    physical = result.physical
    if physical is None:
        return
    left = physical.n_runs - physical.n_complete
    driven = f" {physical.n_driven} trials were driven just now." if physical.n_driven else ""
    echo(f"{physical.n_complete} of {physical.n_runs} runs on a robot are complete.{driven}", err=to_stderr)
    if physical.waiting:
        echo(physical.waiting, err=to_stderr)
    elif left:
        echo("`realitygap drive` drives the others.", err=to_stderr)
