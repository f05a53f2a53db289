"""A trial that can be shown says where the robot was at any time, and what it had visited by then."""

import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from realitygap import Condition
from realitygap.platforms import JyroPlatform
from realitygap.playback import RobotShape, first_visits, in_motion
from realitygap.playback._moving import all_trials, nearness, placed, ray_ends
from realitygap.runs import replay, run_replicates
from realitygap.world import paper_arena

from .trials import straight, turning


def test_the_robot_is_between_the_ends_of_steps_and_afterwards_at_the_last():
    trial = straight(10)
    assert trial.duration_s == pytest.approx(1.0)
    half = trial.at(0.25)
    assert half.step == 2
    assert half.pose[0] == pytest.approx(trial.poses[0, 0] + 2.5 * 0.05)
    assert trial.at(99.0).pose == tuple(trial.poses[-1])
    assert trial.at(-1.0).pose == tuple(trial.poses[0])


def test_a_time_that_is_a_whole_number_of_steps_is_at_the_end_of_a_step():
    trial = straight(87)
    assert [trial.at(k * 0.1).step for k in range(88)] == list(range(88))


def test_a_heading_goes_the_short_way_round():
    trial = turning()
    headings = [trial.at(0.5 * k / 4).pose[2] for k in range(4 * 8 + 1)]
    assert np.diff(headings).max() < 0.2 or np.abs(np.remainder(np.diff(headings), math.tau)).max() < 0.2
    assert math.remainder(trial.at(0.75).pose[2] - (math.tau - 0.1), math.tau) == pytest.approx(0.0)


def test_cells_fill_in_as_the_trial_counted_them():
    condition = Condition(name="novelty-50", selection="novelty", noise=0.5)
    for row in run_replicates(condition, 3, 1).iter_rows(named=True):
        trajectory = replay(condition, row)
        trial = in_motion(trajectory, condition.arena.arena(), condition.on)
        assert list(trial.cells) == row["cells"]
        shares = [trial.at(k * trial.step_s).n_cells for k in range(trial.n_steps + 1)]
        assert shares == sorted(shares)
        assert shares[-1] / 72 == trajectory.coverage_line
        _, _, ends = first_visits(trajectory.poses, condition.arena.arena().grid)
        assert len(ends) / 72 == trajectory.coverage_ends


def test_several_rows_a_step_count_as_one_step():
    trial = replace(straight(8), parts=4)
    assert trial.n_steps == 2
    assert trial.duration_s == pytest.approx(0.2)
    assert trial.at(0.1).step == 1
    assert trial.at(0.125).pose[0] == pytest.approx(trial.poses[5, 0])


def test_rays_go_from_their_mounts_as_far_as_they_read():
    trial = straight()
    ends = ray_ends(trial.shape, trial.at(0.0))
    start = paper_arena().start
    assert ends[0].ravel().tolist() == pytest.approx(
        [start.x + 0.09, start.y + 0.05, start.x + 0.29, start.y + 0.05]
    )
    assert np.hypot(*(ends[:, 1] - ends[:, 0]).T).tolist() == pytest.approx([0.2, 0.1, 0.0])
    assert nearness(trial.shape, trial.rays[0]).tolist() == pytest.approx([0.0, 0.5, 1.0])
    assert nearness(trial.shape, np.array([np.nan, 0.4, -0.1])).tolist() == [0.0, 0.0, 1.0]


def test_points_of_the_robot_are_turned_with_it():
    assert placed([(0.1, 0.0), (0.0, 0.2)], (1.0, 2.0, math.pi / 2)).ravel().tolist() == pytest.approx(
        [1.0, 2.1, 0.8, 2.0]
    )


def test_mistakes_are_told():
    trial = straight()
    with pytest.raises(ValueError, match="No trial to show"):
        all_trials([])
    with pytest.raises(TypeError, match="A trial to show is a str, expected a MovingTrial"):
        all_trials(["results/paper"])
    other = replace(trial, arena=replace(trial.arena, walls=trial.arena.walls[:3]), title="b")
    with pytest.raises(
        ValueError, match="b is in the arena 'paper', a in 'paper': trials that are shown together"
    ):
        all_trials([trial, other])
    driven = SimpleNamespace(step_s=0.1, poses=trial.poses, readings=trial.rays[:, :2], stalled=trial.stalled)
    with pytest.raises(ValueError, match=r"readings has shape \(11, 2\), expected \(11, 3\)"):
        in_motion(driven, paper_arena(), JyroPlatform())
    assert RobotShape.of(JyroPlatform()).front == 0.09
