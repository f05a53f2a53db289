"""A study: conditions x replicates, every choice by name."""

from __future__ import annotations

import unicodedata
from collections.abc import Iterable
from pathlib import Path
from typing import Annotated, Any, Literal, Self

from pydantic import AfterValidator, Field, model_validator

import realitygap
from realitygap._version import __version__
from realitygap.drawing import ShownAsCard
from realitygap.errors import StudyError, whole_number
from realitygap.runs import NAME_PATTERN, Condition
from realitygap.settings import Settings


def _printable(text: str) -> str:
    if any(unicodedata.category(letter) == "Cc" for letter in text):
        raise ValueError("expected a text on one line, without control characters")
    return text


Line = Annotated[str, AfterValidator(_printable)]


class StudySection(Settings):
    """The settings of the whole study."""

    name: str = Field(
        pattern=NAME_PATTERN,
        max_length=80,
        description="Name of the study and of its folder: letters, digits, dot, dash, and underscore.",
    )
    title: Line = Field("", max_length=200, description="Title of the report. Default: the name.")
    note: Line = Field("", max_length=500, description="Remark, shown in the summary.")
    seed: int = Field(1, ge=0, le=2**63 - 1, description="Seed of all random numbers.")
    replicates: int = Field(
        100,
        ge=1,
        le=1_000_000_000,
        description="Number of runs per condition. Increase it to extend an existing study.",
    )
    pair: bool = Field(
        True,
        description="Use the same random numbers for all conditions, if possible. This narrows the intervals of their "
        "differences. false: each condition has its own.",
    )


def replaced(**given: int | None) -> dict[str, int]:
    """Return the seed and the replicates that replace those of the study, without those that are None.

    Raises:
        StudyError: One is not a whole number, or out of range.
    """
    ranges = {"seed": (0, 2**63 - 1), "replicates": (1, 1_000_000_000)}
    try:
        return {
            name: whole_number(f"--{name}", value, *ranges[name])
            for name, value in given.items()
            if value is not None
        }
    except (TypeError, ValueError) as error:
        raise StudyError(str(error)) from None


class ReportSection(Settings):
    """The settings of the report; they change no result."""

    points: Literal["best-of-generation", "best-so-far"] = Field(
        "best-of-generation",
        description="Quantity that Figure 4 shows for each generation. The paper does not state it.",
    )


def _told_apart(pens: list[str]) -> list[str]:
    twice = [pen for k, pen in enumerate(pens) if pen in pens[:k]]
    if twice:
        raise ValueError(f"{twice[0]!r} is listed twice; each line on a sheet needs its own pen")
    return pens


class TrialsSection(Settings):
    """The settings for guiding trials on a robot; they change no simulated result."""

    order: Literal["in-order", "shuffled"] = Field(
        "in-order",
        description="in-order: generation by generation, run by run, condition by condition. shuffled: the same "
        "generation of all conditions together, with mixed individuals. A falling battery or a worn floor "
        "then affects all conditions equally.",
    )
    blind: bool = Field(
        False,
        description="Show trials under codes, so that people who count cells don't know the condition.",
    )
    pens: Annotated[
        list[Annotated[Line, Field(min_length=1, max_length=20)]], AfterValidator(_told_apart)
    ] = Field(
        ["black", "red", "blue", "green", "orange", "purple", "brown", "pink"],
        min_length=1,
        max_length=64,
        description="Pens by color, one for each trial on a sheet of paper. Their number is that of the trials on a "
        "sheet (section 2.1: eight).",
    )

    null: Literal["distribution", "mean"] = Field(
        "distribution",
        description="Hypothesis of `realitygap trials advise` if several conditions are on a robot: that both of two "
        "have the same distribution of scores, or the same mean. The ledger stores it before trial 1.",
    )
    margin: float = Field(
        0.0,
        ge=0,
        description="Largest difference in score that counts as equivalent there. 0: equivalence is not tested.",
    )


class ConditionNotes(Settings):
    """Notes on a condition, in addition to its settings; they change no result."""

    published: list[Annotated[float, Field(ge=0, le=1)]] | None = Field(
        None, description="Published values of the best coverage of a run, shown next to ours."
    )
    published_source: Line | None = Field(None, max_length=200, description="Source of these values.")
    baseline: str | None = Field(None, description="Condition with which this one is compared.")
    change: Line | None = Field(
        None, max_length=200, description="Difference from the baseline, in a few words."
    )


def same_file(name: str, others: Iterable[str]) -> str | None:
    """Return the other name that is the same file on a disk that ignores case; None if there is none."""
    return next((other for other in others if other.casefold() == name.casefold()), None)


class Study(Settings, ShownAsCard):
    """A study as resolved: nothing is left to a default."""

    about: StudySection
    report: ReportSection
    trials: TrialsSection = TrialsSection()
    conditions: tuple[Condition, ...]
    notes: tuple[ConditionNotes, ...]

    @model_validator(mode="after")
    def _conditions_are_whole_and_apart(self) -> Self:
        if len(self.notes) != len(self.conditions):
            raise ValueError(
                f"there are {len(self.notes)} notes, expected {len(self.conditions)}: one a condition, such as "
                "ConditionNotes()"
            )
        names = [condition.name for condition in self.conditions]
        for k, name in enumerate(names):
            if (alike := same_file(name, names[:k])) is not None:
                raise ValueError(
                    f"conditions {alike!r} and {name!r} would share files; give one another name"
                )
        return self

    @model_validator(mode="after")
    def _conditions_share_the_seed(self) -> Self:
        for condition in self.conditions:
            if (condition.seed, condition.pair) != (self.about.seed, self.about.pair):
                raise ValueError(
                    f"condition {condition.name!r} has seed {condition.seed} and pair {condition.pair}, expected the "
                    f"study's: {self.about.seed} and {self.about.pair}"
                )
        return self

    def __repr__(self) -> str:
        n, labels = len(self.conditions), "+".join(self.labels)
        runs = f"{n} condition{'s' * (n != 1)} × {self.about.replicates:,} runs"
        return f"{type(self).__name__}({self.about.name!r}, {runs}, {labels})"

    @property
    def labels(self) -> tuple[str, ...]:
        """Labels of the conditions, such as SIM, each once."""
        return tuple(dict.fromkeys(str(condition.label) for condition in self.conditions))

    @property
    def n_runs(self) -> int:
        """Total number of runs."""
        return len(self.conditions) * self.about.replicates

    @property
    def n_physical(self) -> int:
        """Conditions that a robot drives."""
        return sum(condition.is_physical for condition in self.conditions)

    def run(
        self,
        out: str | Path | None = None,
        *,
        replicates: int | None = None,
        threads: int | None = None,
        fresh: bool = False,
        cluster: str | None = None,
    ) -> realitygap.ResultsFolder:
        """Run the simulated conditions, or what is missing of them, as `realitygap.run_study`; return the results.

        Args:
            out: Folder for the results. Default: `results/NAME`.
            replicates: Number of runs per condition that replaces the study's.
            threads: Number of threads. Default: the number of processors.
            fresh: True to delete existing results in the folder first.
            cluster: Cluster that replaces this machine's threads.
        """
        study = self
        if replicates is not None:
            about = self.about.model_copy(update=replaced(replicates=replicates))
            study = self.model_copy(update={"about": about})
        return realitygap.study.run_study(study, out, threads=threads, fresh=fresh, cluster=cluster).folder

    def description(self) -> dict[str, Any]:
        """Return the study as the folder of results keeps it (`study.json`)."""
        return {
            "name": self.about.name,
            "title": self.about.title or self.about.name,
            "note": self.about.note,
            "software": __version__,
            "seed": self.about.seed,
            "pair": self.about.pair,
            "replicates": self.about.replicates,
            "report": self.report.model_dump(mode="json"),
            **({"trials": self.trials.model_dump(mode="json")} if self.n_physical else {}),
            "conditions": [
                {
                    "name": condition.name,
                    "label": condition.label,
                    **({"drawn": list(condition.drawn_names)} if condition.on.records_draws else {}),
                    "hash": condition.hash(),
                    **notes.model_dump(mode="json"),
                    "settings": condition.settings(),
                }
                for condition, notes in zip(self.conditions, self.notes, strict=True)
            ],
        }
