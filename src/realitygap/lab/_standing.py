"""The state of a study as every page shows it: one word, from one look at its folder and its job."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Literal

from realitygap._wording import counted

from ._pace import duration
from ._studies import StudyState
from ._study_job import StudyJob

Word = Literal["Not started", "Running", "Paused", "Complete", "Failed", "In use", "Waiting for robot"]


@dataclass(frozen=True)
class Standing:
    """A study at one moment.

    Attributes:
        name: Name of its folder.
        title: Title from its study file.
        note: Note from its study file.
        word: Its state.
        message: Why it failed, or which program uses it; empty otherwise.
        n_runs, n_done: Simulated runs: total, and published.
        n_driven_runs, n_driven_done: Runs of conditions that a robot drives: total, and complete.
        trials: Number of trials of the ledger in each state.
        labels: Labels of its platforms, such as SIM.
        medians: Median best coverage of each condition; empty before its figures were drawn.
        has_thumbnail: Whether there is a small picture of its best path.
        has_report: Whether there is a report.
        rate: Runs per second; 0 if unknown.
        is_asking: Whether it waits for an answer from a visitor.
    """

    name: str
    title: str
    note: str
    word: Word
    message: str = ""
    n_runs: int = 0
    n_done: int = 0
    n_driven_runs: int = 0
    n_driven_done: int = 0
    trials: dict[str, int] = field(default_factory=dict)
    labels: tuple[str, ...] = ()
    medians: tuple[float, ...] = ()
    has_thumbnail: bool = False
    has_report: bool = False
    rate: float = 0.0
    is_asking: bool = False

    @property
    def has_robot(self) -> bool:
        """True if a robot drives some of its conditions."""
        return self.n_driven_runs > 0

    @property
    def share(self) -> float:
        """Share of its runs that are published, 0 to 1."""
        return (self.n_done + self.n_driven_done) / max(self.n_runs + self.n_driven_runs, 1)

    @property
    def steady(self) -> Standing:
        """The same without what changes all the time while it runs: numbers of runs and trials, and the rate."""
        n_done, n_driven_done = min(self.n_done, 1), min(self.n_driven_done, 1)
        return replace(self, n_done=n_done, n_driven_done=n_driven_done, trials={}, rate=0.0)

    @property
    def can_resume(self) -> bool:
        """True if its simulated runs can be started or resumed."""
        return self.word in ("Not started", "Paused", "Failed") and self.n_done < self.n_runs

    @property
    def progress(self) -> str:
        """Progress in words, with the time left while it runs."""
        parts = []
        if self.n_runs:
            all_runs = counted(self.n_runs, "run")
            parts.append(all_runs if self.n_done == self.n_runs else f"{self.n_done:,}/{all_runs}")
        if self.n_driven_runs:
            parts.append(f"{self.n_driven_done}/{counted(self.n_driven_runs, 'robot run')}")
        if self.trials:
            parts.append("trials: " + ", ".join(f"{n} {name}" for name, n in sorted(self.trials.items())))
        if self.word == "Running" and self.rate > 0 and self.n_done < self.n_runs:
            parts += [
                f"{self.rate:,.0f} runs/s",
                f"{duration((self.n_runs - self.n_done) / self.rate)} left",
            ]
        return " · ".join(parts)


def standing_of(state: StudyState, job: StudyJob | None) -> Standing:
    """Return the state of a study.

    Args:
        state: What is in its folder. If the job is over, it must have been read after the job's end.
        job: Its job in this lab; None if there has been none.
    """
    word, message = _word(state, job)
    n_done, rate = state.n_done, 0.0
    if word == "Running" and job is not None and job.progress:
        n_done = max(n_done, int(job.progress["n_done"]))
        seconds = float(job.progress["seconds"])
        rate = job.progress["n_computed"] / seconds if seconds > 0 else 0.0
    return Standing(
        name=state.name,
        title=state.title or state.name,
        note=state.note,
        word=word,
        message=message,
        n_runs=state.n_runs,
        n_done=n_done,
        n_driven_runs=state.n_driven_runs,
        n_driven_done=state.n_driven_done,
        trials=state.trials,
        labels=state.labels,
        medians=state.medians,
        has_thumbnail=state.has_thumbnail,
        has_report=state.has_report,
        rate=rate,
        is_asking=job is not None and job.ask is not None,
    )


def _word(state: StudyState, job: StudyJob | None) -> tuple[Word, str]:
    if state.problem:
        return "Failed", state.problem
    if job is not None and not job.is_over:
        return "Running", ""
    if state.used_by:
        return "In use", f"In use by another program: {state.used_by}."
    if state.is_complete:
        return "Complete", ""
    if job is not None and job.is_failed:
        return "Failed", job.outcome or ""
    if state.has_robot and state.n_done == state.n_runs:
        return "Waiting for robot", ""
    return ("Paused" if state.n_done else "Not started"), ""
