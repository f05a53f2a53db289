"""Strategies that blur the simulation: the paper's uniform noise, and numbers drawn by hand."""

from __future__ import annotations

from realitygap.errors import StudyError
from realitygap.platforms import SimPlatform, as_sim
from realitygap.runs import Condition
from realitygap.world import Distribution

from .attempt import Attempt
from .simulated import Champion
from .uncalibrated import best_on_target

LEVELS = (0.1, 0.5, 0.8)
"""The paper's levels of noise (section 2.3)."""

SPREAD: dict[str, tuple[float, float]] = {
    "drive.gain_left": (0.85, 1.1),
    "drive.gain_right": (0.85, 1.1),
    "drive.track": (0.95, 1.05),
    "drive.lag": (0.5, 2.0),
    "contact.friction": (0.5, 1.5),
}
"""Ranges of numbers that `randomized` draws for each trial, as multiples of those in the robot's file."""

ADDED: dict[str, tuple[float, float]] = {
    "drive.delay": (0.0, 0.15),
    "drive.slip": (0.0, 0.1),
    "drive.drift_per_m": (-0.1, 0.1),
}
"""Ranges of numbers that it draws between two values."""

IR = {"amplitude": (0.7, 1.3), "decay": (0.7, 1.4)}
"""Ranges of numbers of each infrared sensor, as multiples of those in the file."""


def noise(attempt: Attempt) -> Champion:
    """Evolve under each of the paper's levels of noise, which share the trials, and keep the best on average.

    Each level has a third of the runs and of the trials. Which one is kept the trials of the budget decide and nothing
    else; with fewer than three trials it is the middle one.
    """
    runs = -(-attempt.simulation.runs // len(LEVELS))
    champions = []
    for level in LEVELS:
        noisy = changed_condition(attempt.condition, f"noise-{level:g}", noise=level)
        champions.append(attempt.simulation.champions(noisy, attempt.replicate, runs=runs)[0])
    each = attempt.left // len(LEVELS)
    if not each:
        return champions[len(LEVELS) // 2]
    extra = attempt.left - each * len(LEVELS)
    means = []
    for k, champion in enumerate(champions):
        scores = attempt.score_on_target([champion] * (each + (k < extra)))
        means.append(sum(scores) / len(scores))
    return champions[max(range(len(champions)), key=lambda k: (means[k], -k))]


def randomized(attempt: Attempt) -> Champion:
    """Evolve with numbers of the robot drawn for each trial, and try the N best as `select` does."""
    return best_on_target(attempt, attempt.champions(randomized_condition(attempt.condition)))


def randomized_condition(condition: Condition) -> Condition:
    """Return the condition with numbers of its robot drawn for each trial.

    Raises:
        StudyError: It is not on platform `sim`, which alone has such numbers.
    """
    sim = needs_sim(condition, "randomized")
    numbers = sim.model.centers()
    drawn: dict[str, Distribution] = {}
    for name, (low, high) in SPREAD.items():
        if name in numbers:
            drawn[name] = _times(numbers[name], low, high)
    drawn |= {name: Distribution(uniform=ends) for name, ends in ADDED.items()}
    for name, value in numbers.items():
        group, _, last = name.rpartition(".")
        if group.startswith("range.") and last in IR:
            drawn[name] = _times(value, *IR[last])
    return changed_condition(condition, "randomized", set={**drawn, **sim.set})


def needs_sim(condition: Condition, strategy: str) -> SimPlatform:
    """Return the platform of a condition whose robot has numbers to change.

    Raises:
        StudyError: Its robot has no such numbers.
    """
    sim = as_sim(condition.on)
    if sim is None:
        raise StudyError(
            f"Strategy {strategy!r} changes numbers of the simulated robot, but platform "
            f"{condition.platform!r} of condition {condition.name!r} has none. Choose a condition on platform "
            "'sim'."
        )
    return sim


def changed_condition(condition: Condition, name: str, **changes: object) -> Condition:
    """Return the condition under another name, with other noise, or other settings of its platform."""
    settings = dict(condition.settings())
    if "noise" in changes:
        settings["noise"] = changes.pop("noise")
    if changes:
        settings[condition.platform] = {**settings[condition.platform], **changes}
    made = Condition.model_validate({**settings, "name": name})
    # Both may have the permission to run code. An archive is no setting of a condition with another selection.
    return made.model_copy(update={"task": condition.task, "archive": condition.archive})


def _times(center: float, low: float, high: float) -> Distribution:
    return Distribution(uniform=tuple(sorted((low * center, high * center))))
