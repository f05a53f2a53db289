"""The check of a robot before it drives trials."""

from __future__ import annotations

import math
import re

import pytest

from realitygap.errors import RobotTimeout
from realitygap.trials import preflight

from .fake_robot import FakeRobot


class Silent(FakeRobot):
    """A robot whose battery cannot be asked."""

    def volts(self) -> float:
        raise RobotTimeout("No reply to 'battery' within 2.0 s.")


class Plain(FakeRobot):
    """A robot without a way to measure its battery."""

    volts = None  # type: ignore[assignment]


class WithoutFluke(FakeRobot):
    def volts(self) -> float:
        return math.nan


@pytest.mark.parametrize(
    ("kind", "words"),
    [
        (FakeRobot, r"\d\.\d\d V"),
        (Silent, "unknown: No reply to 'battery' within 2.0 s."),
        (Plain, "unknown: this robot does not report its voltage"),
        (WithoutFluke, "unknown: nothing measures it"),
    ],
)
def test_preflight_states_the_battery_or_why_it_is_unknown(kind, words):
    assert re.match(words, preflight(kind()).facts["battery under load"])
