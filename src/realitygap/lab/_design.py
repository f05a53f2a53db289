"""Changes of a locked design that visitors enter."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from realitygap.errors import StudyError
from realitygap.orders import OrderError
from realitygap.study import amend_design, unblind_design

from ._mistakes import FormError, refuse_unnamed

LONGEST_TEXT = 1000
"""Largest length of a reason, note, or value [letters]."""

TOO_LATE = "The study has trials. A design is locked before the first trial."


def amend(source: Path, who: str, setting: str, value: str, reason: str) -> None:
    """Amend the design of a file of trials, or of the folder of a study. Without a setting, only the reason is logged.

    Raises:
        FormError: The person has no name, or the value is out of range.
        RealityGapError: The file cannot be changed.
    """
    who = refuse_unnamed(who)
    settings = {setting: value[:LONGEST_TEXT]} if setting else None
    try:
        amend_design(source, reason[:LONGEST_TEXT], settings, who=who)
    except OrderError as error:
        raise FormError({"value": "\n".join(error.problems.values())}) from None
    except StudyError as error:
        raise FormError({"value" if setting and reason.strip() else "reason": str(error)}) from None


def unblind(source: Path, who: str, reason: str) -> None:
    """Unblind the design of a file of trials.

    Raises:
        FormError: The person has no name.
        RealityGapError: The file cannot be changed, or its design is not blind.
    """
    unblind_design(source, reason[:LONGEST_TEXT], who=refuse_unnamed(who))


def shown_value(value: Any) -> str:
    """Return the value of a setting as a text that `amend` reads."""
    if value is None or isinstance(value, str):
        return value or ""
    return json.dumps(value, ensure_ascii=False)
