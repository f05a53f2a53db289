"""All parameters from poses: rays against `sim`, and robots of `sim` whose numbers are found again."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from realitygap.calibration import fit_from_poses, numbers_of, ranges_of, scribbler_prior, values_of
from realitygap.calibration._shots import shots_of
from realitygap.calibration.infrared._readings import rays_of
from realitygap.platforms import SimEnsemble, SimPlatform, SimTarget
from realitygap.study._calibrate.whole import all_plans
from realitygap.world import Obstacle, RangeSensor, paper_arena

ARENA = paper_arena()
PLATFORM = SimPlatform()


def test_rays_meet_walls_boxes_and_discs() -> None:
    """Ahead a wall 0.2 m away; a box at 45 degrees; a disc, off its middle by 0.6 of its radius."""
    sensor = RangeSensor(x=0.05, y=0.0, reach=0.5)
    faced = np.array([[1.0668 - 0.25, 0.3, 0.0], [1.0668 - 0.25, 0.3, 0.5]])
    distances, cosines = rays_of(sensor, faced, ARENA)
    assert distances[0, 0] == pytest.approx(0.2)
    assert cosines[:, 0] == pytest.approx([1.0, np.cos(0.5)])
    assert distances[1, 0] == pytest.approx((0.25 - 0.05 * np.cos(0.5)) / np.cos(0.5))
    box = Obstacle(0.5, 0.3, np.pi / 4, ((0.05, 0.05), (-0.05, 0.05), (-0.05, -0.05), (0.05, -0.05)))
    disc = Obstacle(0.5, 0.3, radius=0.05)
    pose = np.array([[0.2, 0.31, 0.0]])
    distances, cosines = rays_of(sensor, pose, replace(ARENA, obstacles=(box,)))
    assert distances[0, 0] == pytest.approx(0.5 - 0.05 * np.sqrt(2) + 0.01 - 0.25)
    assert cosines[0, 0] == pytest.approx(np.sqrt(0.5))
    pose[0, 1] = 0.33
    distances, cosines = rays_of(sensor, pose, replace(ARENA, obstacles=(disc,)))
    assert distances[0, 0] == pytest.approx(0.5 - 0.04 - 0.25, abs=5e-4)
    assert cosines[0, 0] == pytest.approx(0.8, abs=0.06)
    assert rays_of(sensor, np.array([[0.3, 0.3, 0.0]]), ARENA)[1][0, 0] == 1.0


def test_a_command_counts_where_the_robot_was_seen_before_and_after_it() -> None:
    with SimTarget(PLATFORM, ARENA, key=1) as target:
        (trial,) = target.carry_out(all_plans(ARENA, PLATFORM.robot, 1, 1), "track")
    poses = trial.poses.copy()
    poses[5] = np.nan
    shots = shots_of([replace(trial, poses=poses)], PLATFORM.robot, ARENA)
    assert np.flatnonzero(~shots.known[0]).tolist() == [4, 5]


@pytest.mark.slow
@pytest.mark.parametrize("seed", [1, 3])
def test_a_robot_of_sim_is_found_again(seed: int) -> None:
    """What poses identify comes within a twentieth of the prior's width, of robots drawn from the prior."""
    prior = scribbler_prior(PLATFORM.robot)
    places = np.clip(np.random.default_rng(seed).normal(size=(1, len(prior))), -2, 2)
    truth = values_of(prior, places)
    numbers = {n: float(v[0]) for n, v in numbers_of(prior, truth, PLATFORM.robot).items()}
    with SimTarget(SimPlatform(set=numbers), ARENA, key=seed) as target:
        trials = list(target.carry_out(all_plans(ARENA, PLATFORM.robot, 10, seed), "track"))
    ensemble = SimEnsemble(PLATFORM, ARENA, ranges=ranges_of(prior, PLATFORM.robot))
    found = fit_from_poses(trials, ensemble, prior, PLATFORM.robot, ARENA, seed=seed)
    assert found.places.shape == (500, len(prior))
    off = {
        p.name: abs(float(p.scale(np.median(found.values[p.name])) - p.scale(truth[p.name][0]))) / p.width
        for p in prior
    }
    sure = ("drive.track", "drive.axle", "body.length", "body.width", "contact.lat", "contact.ang", "range.decay",
            "range.amplitude", "range.incidence")  # fmt: skip
    assert {name: size for name, size in off.items() if name in sure and size > 0.05} == {}
    assert np.median(list(off.values())) < 0.02


@pytest.mark.slow
def test_dead_band_below_a_soft_one_is_even_up_to_it() -> None:
    """A wheel stands still up to the soft dead band, whatever the dead band below it is."""
    numbers = {"drive.dead_band": 0.03, "drive.soft_dead_band": 0.12}
    with SimTarget(SimPlatform(set=numbers), ARENA, key=5) as target:
        trials = list(target.carry_out(all_plans(ARENA, PLATFORM.robot, 6, 5), "track"))
    prior = scribbler_prior(PLATFORM.robot)
    ensemble = SimEnsemble(PLATFORM, ARENA, ranges=ranges_of(prior, PLATFORM.robot))
    posterior = fit_from_poses(trials, ensemble, prior, PLATFORM.robot, ARENA, seed=5)
    low, high = np.quantile(posterior.values["drive.dead_band"], [0.05, 0.95])
    assert low < 0.03
    assert 0.08 < high < 0.14
