"""Progress on standard error, and how interrupted work resumes."""

from __future__ import annotations

import contextlib
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Self

import typer

from realitygap._terminal import echo

if TYPE_CHECKING:
    from rich.progress import TaskID

    from realitygap.study import Progress as StudyProgress

_LINE_EVERY_S = 10.0
"""Minimum time between two lines of progress in a file [s]."""


@contextlib.contextmanager
def resumable(kept: str | Path | None, how: str = "") -> Iterator[None]:
    """End a command with status 130 at Ctrl-C, after a message that states what is saved, and how to resume.

    Args:
        kept: File or folder of the finished trials, as soon as it exists; None if no trial is saved. Or what is saved.
        how: What saves trials, if nothing is saved.
    """
    try:
        yield
    except KeyboardInterrupt:
        if isinstance(kept, Path):
            kept = f"Finished trials are in {kept}." if kept.exists() else None
        words = f"{kept} Run the same command to resume." if kept else f"Nothing was saved. {how}"
        echo(f"Interrupted. {words}".strip(), err=True)
        raise typer.Exit(130) from None


class ProgressBar:
    """A bar of finished units of work and the remaining time.

    Args:
        unit: Units, in the plural.
        has_rate: True to show a spinner and the rate, a field of tasks.
        quiet: True to show nothing.
    """

    def __init__(self, unit: str, *, has_rate: bool = False, quiet: bool) -> None:
        # Rich takes a while to import, and the help of a command needs none
        from rich.progress import BarColumn, MofNCompleteColumn, Progress, SpinnerColumn, TimeRemainingColumn

        from realitygap._console import PlainColumn, PlainConsole

        self._console = PlainConsole(stderr=True, quiet=quiet)
        counted = (PlainColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), PlainColumn(unit))
        columns = (SpinnerColumn(), *counted, PlainColumn("{task.fields[rate]}")) if has_rate else counted
        self._progress = Progress(*columns, TimeRemainingColumn(), console=self._console, transient=True)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        if self._progress.live.is_started:  # else it would print an empty line
            self._progress.stop()


class RunsBar(ProgressBar):
    """Finished runs, rate, and remaining time, on standard error if that is a terminal."""

    def __init__(self, *, quiet: bool) -> None:
        super().__init__("runs", has_rate=True, quiet=quiet)
        self._task = self._progress.add_task("compiling or loading the kernels", total=None, rate="")

    def show(self, progress: StudyProgress) -> None:
        """Show the progress of the study; nothing if all runs are finished."""
        if progress.n_done == progress.n_runs and not self._progress.live.is_started:
            return
        if not self._progress.live.is_started:
            if not self._console.is_terminal:
                self._console.print(
                    "Compiling or loading the kernels (compiling takes up to a minute, once per version) ..."
                )
            self._progress.start()
        if progress.waiting_for and not self._console.is_terminal:
            self._console.print(f"Waiting for {progress.waiting_for} ...")
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


class TrialsBar(ProgressBar):
    """A display of the finished trials on each platform, on standard error. A file gets a line now and then.

    Args:
        unit: Units, in the plural.
        quiet: True to show nothing.
        clock: Clock [s].
    """

    def __init__(
        self, unit: str = "trials", *, quiet: bool, clock: Callable[[], float] = time.monotonic
    ) -> None:
        super().__init__(unit, quiet=quiet)
        self._unit = unit
        self._tasks: dict[tuple[str, int], TaskID] = {}
        self._clock, self._printed = clock, clock()

    def show(self, name: str, done: int, total: int) -> None:
        """Show the number of finished trials."""
        if not self._console.is_terminal:
            self.say(f"{name}: {done:,} of {total:,} {self._unit}")
            return
        if not self._progress.live.is_started:
            self._progress.start()
        key = (name, total)
        if key not in self._tasks or self._progress.tasks[self._tasks[key]].completed > done:
            self._tasks[key] = self._progress.add_task(name, total=total)
        self._progress.update(self._tasks[key], completed=done)

    def say(self, text: str) -> None:
        """Print other progress."""
        if self._console.is_terminal or self._clock() - self._printed >= _LINE_EVERY_S:
            self._printed = self._clock()
            self._console.print(text)
