"""`realitygap run` and `realitygap new-study`."""

from __future__ import annotations

import json
import shlex
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from realitygap.errors import StudyError

from ._browser import show_page
from ._results import written_report

if TYPE_CHECKING:
    from realitygap.study import Progress, StudyResult


# Below it a summary's numbers would be cut; a narrower terminal wraps the lines instead.
NARROWEST = 78


def run(
    study: Annotated[
        str, typer.Argument(metavar="STUDY", help="paper, paper-choices, or a study file (.toml).")
    ],
    replicates: Annotated[
        int | None, typer.Option(min=1, help="Runs of each condition, in place of the study's.")
    ] = None,
    out: Annotated[
        Path | None, typer.Option(metavar="DIR", help="Folder for the results. [default: results/NAME]")
    ] = None,
    seed: Annotated[int | None, typer.Option(min=0, help="In place of the study's.")] = None,
    threads: Annotated[
        int | None, typer.Option(min=1, help="Kernels at once. [default: all processors]")
    ] = None,
    chunk: Annotated[
        int | None, typer.Option(min=1, help="Runs written together. [default: by their length]")
    ] = None,
    fresh: Annotated[
        bool, typer.Option("--fresh", help="Delete the study that is in the folder and start anew.")
    ] = False,
    cluster: Annotated[
        str | None,
        typer.Option(
            metavar="WHERE",
            help="Compute on a Dask cluster: tcp://HOST:8786, or slurm (pbs, sge, lsf, oar, htcondor, moab); "
            "slurm:20 asks for 20 jobs.",
        ),
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print the summary as JSON.")] = False,
    open_page: Annotated[
        bool, typer.Option("--open", help="When done, write the report and show it in the browser.")
    ] = False,
) -> None:
    """Carry out a simulated study, or what is missing of it, and print a summary.

    Interrupt it at any moment: the same command goes on where it stopped. More replicates or new conditions
    extend what is there. The results do not depend on threads, clusters, chunks or interruptions.

    Example: realitygap run paper --replicates 1000

    In Python: realitygap.run_study("paper", replicates=1000)
    """
    from realitygap.study import run_study

    if threads is not None and cluster is not None:
        raise StudyError(
            "--threads and --cluster exclude each other. How many threads a worker of a cluster has is said where it "
            "is started: `dask worker --nthreads`, or `cores` in the settings of its jobs."
        )
    try:
        with RunsBar(quiet=as_json) as bar:
            result = run_study(
                study,
                out,
                seed=seed,
                replicates=replicates,
                threads=threads,
                chunk=chunk,
                fresh=fresh,
                cluster=cluster,
                tell=bar.show,
            )
    except KeyboardInterrupt:
        typer.echo(
            "Interrupted. What was published is safe; the same command goes on where it stopped.", err=True
        )
        raise typer.Exit(130) from None
    _print_result(result, as_json=as_json)
    if open_page:
        show_page(written_report(result.folder.path, to_stderr=as_json))


def new_study(
    path: Annotated[Path, typer.Argument(metavar="FILE", help="The file to write.")] = Path("my-study.toml"),
) -> None:
    """Write a commented study file, in which every setting stands with its meaning and its default.

    Example: realitygap new-study my-study.toml && realitygap run my-study.toml

    In Python: realitygap.study.study_template("my-study")
    """
    from realitygap.study import study_template

    if path.suffix != ".toml":
        raise StudyError(
            f"{path} does not end in .toml. Expected the name of a study file, such as my-study.toml."
        )
    try:
        with path.open("x", encoding="utf-8") as file:
            file.write(study_template(_as_name(path.stem)))
    except FileExistsError:
        raise StudyError(f"{path} exists already and was left as it is. Choose another name.") from None
    except OSError as error:
        raise StudyError(f"{path} cannot be written: {error.strerror}.") from error
    typer.echo(f"Written: {path}. Carry it out with: realitygap run {shlex.quote(str(path))}")


def _as_name(stem: str) -> str:
    name = "".join(
        letter if letter.isascii() and (letter.isalnum() or letter in ".-_") else "-" for letter in stem
    )
    return name.lstrip(".-_") or "my-study"


class RunsBar:
    """Runs done, rate and time left, on standard error where that is a terminal."""

    def __init__(self, *, quiet: bool) -> None:
        from rich.console import Console
        from rich.progress import (
            BarColumn,
            MofNCompleteColumn,
            Progress,
            SpinnerColumn,
            TextColumn,
            TimeRemainingColumn,
        )

        self._console = Console(stderr=True, quiet=quiet)
        self._progress = Progress(
            SpinnerColumn(),
            TextColumn("{task.description}"),
            BarColumn(),
            MofNCompleteColumn(),
            TextColumn("runs"),
            TextColumn("{task.fields[rate]}"),
            TimeRemainingColumn(),
            console=self._console,
            transient=True,
        )
        self._task = self._progress.add_task("compiling or loading the kernels", total=None, rate="")

    def __enter__(self) -> RunsBar:
        return self

    def __exit__(self, *_: object) -> None:
        if self._progress.live.is_started:  # else it would print an empty line
            self._progress.stop()

    def show(self, progress: Progress) -> None:
        """Show how far the study is; nothing where nothing is missing."""
        if progress.n_done == progress.n_runs and not self._progress.live.is_started:
            return
        if not self._progress.live.is_started:
            if not self._console.is_terminal:
                self._console.print("Compiling or loading the kernels (the first time takes some 15 s) ...")
            self._progress.start()
        if progress.waiting_for and not self._console.is_terminal:
            self._console.print(f"Waiting for {progress.waiting_for} ...", highlight=False)
        started = progress.n_computed > 0
        rate = (
            f"{progress.n_computed / progress.seconds:,.0f} runs/s"
            if started and progress.seconds > 0
            else ""
        )
        description = "running" if started else "compiling or loading the kernels"
        if progress.waiting_for:
            description = f"waiting for {progress.waiting_for}"
        self._progress.update(
            self._task,
            description=description,
            completed=progress.n_done,
            total=progress.n_runs,
            rate=rate,
        )


def _print_result(result: StudyResult, *, as_json: bool) -> None:
    from realitygap.report import summarize

    summary = summarize(result.folder)
    if as_json:
        found = {
            "folder": str(result.folder.path),
            "runs": result.n_runs,
            "computed": result.n_computed,
            "seconds": result.seconds,
            "conditions": summary.to_dicts(),
        }
        typer.echo(json.dumps(found, indent=2))
        return
    from rich.console import Console

    from ._tables import summary_table

    console = Console()
    if console.width < NARROWEST:
        console = Console(width=NARROWEST)
    console.print(summary_table(summary, result.folder.description["title"]))
    if note := result.folder.description.get("note"):
        console.print(note, style="italic", highlight=False, markup=False)
    path = result.folder.path
    if result.n_computed:
        typer.echo(
            f"{result.n_computed} of {result.n_runs} runs computed in {result.seconds:.1f} s "
            f"({result.n_computed / result.seconds:,.0f} runs/s)."
        )
    else:
        typer.echo(f"All {result.n_runs} runs were there already.")
    typer.echo(f"Results: {path}   in Python: polars.scan_parquet({f'{path}/trials/*.parquet'!r})")
    typer.echo(f"Report:  realitygap report {shlex.quote(str(path))}")
