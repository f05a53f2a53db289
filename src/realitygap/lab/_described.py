"""The study that a folder of results describes."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from realitygap.runs import Condition
from realitygap.study import ConditionNotes, ReportSection, Study, StudySection, TrialsSection


def study_of(description: Mapping[str, Any]) -> Study:
    """The study as resolved, from what its folder says of it.

    Raises:
        RecordVersionError: A condition has settings of another version.
        ValueError: It is no description of a study.
    """
    about = {key: description[key] for key in ("name", "title", "note", "seed", "replicates", "pair")}
    conditions = description["conditions"]
    return Study(
        about=StudySection(**about),
        report=ReportSection(**description["report"]),
        trials=TrialsSection(**(description.get("trials") or {})),
        conditions=tuple(Condition.from_settings(each["name"], each["settings"]) for each in conditions),
        notes=tuple(
            ConditionNotes(**{key: each[key] for key in ConditionNotes.model_fields if key in each})
            for each in conditions
        ),
    )
