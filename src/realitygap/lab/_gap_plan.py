"""The plan of a gap in words: the trials that it needs, and the differences that it can detect."""

from __future__ import annotations

from urllib.parse import parse_qsl

from realitygap.errors import RealityGapError
from realitygap.platforms import names_a_port, platform_of
from realitygap.robots import is_in_this_program
from realitygap.stats import controllers_for_margin, detectable_difference, spread_of_differences

from ._pace import duration

NOISE, SPREAD = 0.01535, 0.07753
"""Standard deviations of coverage in the pilot on sim, as `pilot_spreads` finds them: trials of one controller about
their mean, and true differences, for which a plan takes half the spread of controllers."""
STEPS = 100
"""Commands of a trial."""
PLACING_S = 20.0
"""Time to place a robot before a trial [s]."""


def plan_words(n: int, trials: int, target: str, margin: float | None = None) -> str:
    """Return how many trials on the target a measurement needs, and which differences it can detect.

    Args:
        n: Number of controllers, 2 or more.
        trials: Number of trials of each controller, 1 or more.
        target: Name of the target.
        margin: Margin of equivalence in coverage, if any.
    """
    total = n * trials
    seconds = trial_seconds(target)
    time = "" if seconds is None else f" (about {duration(total * seconds)})"
    least = detectable_difference(n, spread=SPREAD, noise=NOISE, trials=trials)
    words = (
        f"Needs {total:,} trials on the target{time}. With these, mean differences in coverage above {least:.2g} are "
        "detectable."
    )
    if margin is not None:
        needed = controllers_for_margin(margin, spread_of_differences(SPREAD, NOISE, trials))
        words += f" Equivalence within {margin:g} needs {'too many' if needed is None else f'{needed:,}'} controllers."
    return words


def trial_seconds(target: str) -> float | None:
    """Return the time of a trial on a robot [s]; None for a simulator, and for a target that cannot be timed."""
    if not names_a_port(target):
        return None
    try:
        command_s = float(platform_of(target).command_s)
    except RealityGapError:
        return None
    _, _, port = target.partition(":")
    if not is_in_this_program(port):
        return STEPS * command_s + PLACING_S
    speed = dict(parse_qsl(port.partition("?")[2])).get("speed", "1")
    try:
        return STEPS * command_s / float(speed)
    except (ValueError, ZeroDivisionError):
        return None
