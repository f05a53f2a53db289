"""The person at the terminal, who places a robot and counts its cells."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING

import realitygap

if TYPE_CHECKING:
    from realitygap.trials import PortObserver


def attending_observer(spec: str, witness: str | None) -> PortObserver | None:
    """Return the person at the terminal, if there is one and the robot has no witness.

    Raises:
        StudyError: There is no such platform.
    """
    if (
        witness is not None
        or not sys.stdin.isatty()
        or not realitygap.platforms.platform_of(spec).needs_person
    ):
        return None
    from ._sheet import sheet_observer

    return sheet_observer(asks_for_start=True)
