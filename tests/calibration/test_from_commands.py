"""The fit to whole trials with the same commands, for robots of `sim` whose numbers are known."""

from dataclasses import replace

import numpy as np
import pytest

from realitygap.calibration import (
    Posterior,
    fit_from_commands,
    numbers_of,
    ranges_of,
    scribbler_prior,
    values_of,
)
from realitygap.platforms import SimEnsemble, SimPlatform, SimTarget
from realitygap.study._calibrate.whole import all_plans
from realitygap.world import paper_arena

ARENA = paper_arena()
PLATFORM = SimPlatform(robot="thymio", step_s=0.5)
TRUTH = {
    "drive.gain_left": 0.8, "drive.gain_right": 0.84, "drive.track": 0.104, "drive.lag": 0.12, "drive.delay": 0.2,
    "contact.friction": 0.3, "contact.lat": 0.5, "contact.ang": 150.0,
    "drive.heading_noise_per_m": 0.005, "drive.heading_noise_per_s": 0.001, "drive.travel_noise_per_m": 0.001,
    "drive.delay_jitter": 0.0,
}  # fmt: skip


def fitted(trials, seed=0):
    prior = scribbler_prior(PLATFORM.robot)
    ensemble = SimEnsemble(PLATFORM, ARENA, ranges=ranges_of(prior, PLATFORM.robot))
    places = np.random.default_rng(0).normal(size=(500, len(prior)))
    whole = Posterior(places, values_of(prior, places), np.zeros(len(prior)), 0)
    found = fit_from_commands(
        trials, ensemble, prior, PLATFORM.robot, ARENA, whole, seed=seed, effort="small"
    )
    return numbers_of(prior, found.values, PLATFORM.robot)


def driven(observe, n_steps):
    """Trials of a robot that has the numbers of `TRUTH`, cut to so many steps each."""
    with SimTarget(SimPlatform(robot="thymio", step_s=0.5, set=TRUTH), ARENA, key=3) as target:
        trials = target.carry_out(all_plans(ARENA, PLATFORM.robot, len(n_steps), 1), observe)
    return [
        replace(
            trial,
            commands=trial.commands[:n],
            readings=trial.readings[:n],
            stalled=trial.stalled[:n],
            wheels=trial.wheels[: n + 1],
        )
        for trial, n in zip(trials, n_steps, strict=True)
    ]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("observe", "n_steps"),
    [("cells", 10 * [100]), ("encoders", [100, 30, 100, 100, 60, 100, 100, 100, 5, 100])],
    ids=["cells", "encoders of different lengths"],
)
def test_a_robot_is_found_from_whole_trials_without_poses(observe, n_steps):
    numbers = fitted(driven(observe, n_steps))
    middle = {name: np.median(value) for name, value in numbers.items()}
    for side, gain in (("left", 0.8), ("right", 0.84)):
        moved = numbers[f"drive.gain_{side}"] * (1 - numbers["drive.slip"])
        assert np.median(moved) == pytest.approx(gain, rel=0.02)
    assert middle["drive.track"] == pytest.approx(0.104, rel=0.02)
    assert middle["drive.lag"] + middle["drive.delay"] == pytest.approx(0.32, abs=0.05)
    assert middle["contact.ang"] == pytest.approx(150.0, rel=0.5)
    if observe == "cells":
        check_slip(numbers)


def check_slip(numbers):
    """Slip, which nothing shows, keeps its prior."""
    low, middle, high = np.quantile(numbers["drive.slip"], [0.05, 0.5, 0.95])
    # evenly in 0 to 0.25, less where it would take the gain to an end of its prior
    assert low < 0.05
    assert 0.08 < middle < 0.17
    assert high > 0.2
