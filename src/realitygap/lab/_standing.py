"""The state of a study as every page shows it: one word, from one look at its folder and its job."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

from realitygap._wording import counted, duration

from ._studies import StudyState
from ._study import StudyJob

Word = Literal["Not started", "Running", "Paused", "Complete", "Failed", "In use", "Waiting for robot"]


@dataclass(frozen=True)
class Standing:
    """A study at one moment.

    Attributes:
        state: What is in its folder.
        word: Its state.
        message: Why it failed, or which program uses it; empty otherwise.
        rate: Runs per second; 0 if unknown.
        is_asking: Whether it waits for an answer from a visitor.
    """

    state: StudyState
    word: Word
    message: str = ""
    rate: float = 0.0
    is_asking: bool = False

    @property
    def steady(self) -> Standing:
        """The same without what changes all the time while it runs: numbers of runs and trials, and the rate."""
        n_done, n_driven_done = min(self.state.n_done, 1), min(self.state.n_driven_done, 1)
        state = replace(self.state, n_done=n_done, n_driven_done=n_driven_done, trials={}, conditions=())
        return replace(self, state=state, rate=0.0)

    @property
    def can_resume(self) -> bool:
        """True if its simulated runs can be started or resumed."""
        return self.word in ("Not started", "Paused", "Failed") and self.state.n_done < self.state.n_runs

    @property
    def progress(self) -> str:
        """Progress in words, with the time left while it runs."""
        state, parts = self.state, []
        n_left = state.n_runs - state.n_done
        if state.n_runs:
            all_runs = counted(state.n_runs, "run")
            parts.append(f"{state.n_done:,}/{all_runs}" if n_left else all_runs)
        if state.n_driven_runs:
            parts.append(f"{state.n_driven_done}/{counted(state.n_driven_runs, 'robot run')}")
        if state.trials:
            parts.append("trials: " + ", ".join(f"{n} {name}" for name, n in sorted(state.trials.items())))
        if self.word == "Running" and self.rate > 0 and n_left > 0:
            parts += [f"{self.rate:,.0f} runs/s", f"{duration(n_left / self.rate)} left"]
        return " · ".join(parts)


def standing_of(state: StudyState, job: StudyJob | None) -> Standing:
    """Return the state of a study.

    Args:
        state: What is in its folder. If the job is over, it must have been read after the job's end.
        job: Its job in this lab; None if there has been none.
    """
    word, message = _word(state, job)
    progress, rate = None if job is None else job.progress, 0.0
    if word == "Running" and progress is not None:
        rate = progress.n_computed / progress.seconds if progress.seconds > 0 else 0.0
    return Standing(state, word, message, rate, is_asking=job is not None and job.ask is not None)


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
