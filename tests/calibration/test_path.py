"""The fit to straight paths and turns on the spot."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from realitygap.calibration import end_pose_of, fit_path, moved_in, of_one_length, path_plans, ruled
from realitygap.calibration._path import STRAIGHT, TURNING
from realitygap.platforms import SimPlatform, SimTarget
from realitygap.records import TrialRecord
from realitygap.study._calibrate.kinds import _moved_in_sim
from realitygap.world import INCH, load_robot, paper_arena

pytestmark = pytest.mark.slow

ROBOT = load_robot("scribbler-s2-fluke2")
ARENA = paper_arena()


def fitted(trials, seed: int = 0, robot=ROBOT):
    """The fit, and its parameters by name."""
    fit = fit_path(
        trials, lambda trial: _moved_in_sim(trial, robot, ARENA), robot, np.random.default_rng(seed)
    )
    return fit, {each.name: each for each in fit.fitted}


def recorded(numbers: dict[str, float], key: int, observe="track", n: int = 10) -> list[TrialRecord]:
    """Trials of a simulated robot with these numbers."""
    target = SimTarget(SimPlatform(robot=ROBOT, set=numbers), ARENA, key=key)
    return target.carry_out(path_plans(ARENA, n), observe)


def measured(ahead_in: float, turned_deg: float, command, left_in: float = 0.0) -> TrialRecord:
    """What a person with a ruler has of a trial."""
    trial = TrialRecord(
        start=(0.2, 0.3, 0.0),
        step_s=0.5,
        commands=np.tile(command, (5, 1)),
        readings=np.zeros((5, 3)),
        stalled=np.zeros(5, bool),
        cells=(),
        purpose="path",
    )
    end = end_pose_of(trial, ahead_in * INCH, left_in * INCH, math.radians(turned_deg))
    return replace(trial, end_pose=end)


@pytest.mark.parametrize("seen", ["track", "ruler"])
def test_intervals_cover_gains_and_track_as_often_as_they_say(seen):
    rng = np.random.default_rng(17)
    hits = []
    for key in range(30):
        truth = {
            "drive.gain_left": float(rng.uniform(0.85, 1.1)),
            "drive.gain_right": float(rng.uniform(0.85, 1.1)),
            "drive.track": float(rng.uniform(0.14, 0.17)),
        }
        trials = recorded(truth, key)
        fit, _ = fitted([ruled(trial) for trial in trials] if seen == "ruler" else trials)
        for name, value in truth.items():
            low, high = np.quantile(fit.draws[name], [0.05, 0.95])
            hits.append(low <= value <= high)
    # 90 intervals, those of a robot of the same trials: 0.90 with a standard deviation of 0.05, so that chance alone
    # fails some 1 in 300 keys; these do not
    assert np.mean(hits) >= 0.75


def test_the_papers_own_lengths_make_70_steps_and_not_87():
    trials = [measured(13.75, 0.0, STRAIGHT) for _ in range(5)]
    fit, own = fitted(trials)
    assert own["path.jyro_steps"].estimate == pytest.approx(69.85, abs=0.01)
    assert 69 < own["path.jyro_steps"].low < own["path.jyro_steps"].high < 71
    assert own["path.step_length"].estimate == pytest.approx(2.75 * INCH)
    assert "took 87; its own lengths make it 70" in fit.notes[0]
    assert not own["drive.track"].identified


def test_turns_beyond_half_a_turn_are_counted():
    trials = [measured(13.0, 0.0, STRAIGHT), measured(0, 300.0, TURNING)] * 3
    _, own = fitted(trials)
    assert own["path.step_turn"].estimate == pytest.approx(math.radians(60))
    simulated = next(trial for trial in recorded({}, 0) if trial.commands[0, 1])
    assert moved_in(simulated).turned > math.pi  # 5 steps of 54 degrees


def test_repeats_that_read_the_same_are_as_uncertain_as_the_ruler():
    _, own = fitted([measured(13.75, 0.0, STRAIGHT)] * 3)
    width = own["path.step_length"].high - own["path.step_length"].low
    # t(2) at 5 % is 2.92; an eighth of an inch is even over itself; three repeats, five steps
    assert width == pytest.approx(2 * 2.92 * (INCH / 8) / math.sqrt(12) / math.sqrt(3) / 5, rel=0.25)


def test_one_path_alone_identifies_nothing():
    _, own = fitted([measured(13.75, 0.0, STRAIGHT)])
    assert not own["drive.gain"].identified
    assert "three more times" in own["drive.gain"].advice


def test_one_path_and_one_turn_are_as_uncertain_as_before_whatever_a_camera_reads():
    """They had intervals of a thousandth of a millimeter, from which `--randomize posterior` drew a single robot."""
    fit, own = fitted(recorded({}, 2, n=2))
    assert fit.draws["drive.gain_left"].std() > 0.1
    assert fit.draws["drive.track"].std() > 0.1 * ROBOT.drive.track
    assert not any(own[name].identified for name in ("drive.gain", "drive.asymmetry", "drive.track"))


def test_the_way_in_which_a_robot_comes_to_rest_is_of_the_path():
    """A ruler finds it at rest: the simulated robot was compared at the moment at which it was told to stop."""
    late = {"drive.lag": 0.2, "drive.delay": 0.1, "drive.gain_left": 0.9, "drive.gain_right": 0.9}
    robot = ROBOT.with_numbers({"drive.lag": 0.2, "drive.delay": 0.1})
    trials = recorded(late, 4, n=60)
    fit, _ = fitted(trials, robot=robot)
    assert fit.numbers["drive.gain_left"] == pytest.approx(0.9, rel=0.015)
    # with five full steps, lag and delay hardly matter to where it ends
    assert fitted(trials)[0].numbers["drive.gain_left"] == pytest.approx(0.9, rel=0.015)
    assert not trials[0].commands[-1].any()


def test_asymmetry_is_left_less_right():
    _, own = fitted(recorded({"drive.gain_left": 1.05, "drive.gain_right": 0.95}, 6))
    assert own["drive.asymmetry"].estimate == pytest.approx(0.1, abs=0.03)


def test_draws_of_few_repeats_are_of_robots_that_can_be():
    """Two repeats have a Cauchy distribution: without care some 15 of 500 draws go back where they should go ahead."""
    trials = [measured(13.75, 0.0, STRAIGHT), measured(9.0, 0.0, STRAIGHT)] + [
        measured(0, 300.0, TURNING)
    ] * 2
    fit, own = fitted(trials)
    for name in ("drive.gain_left", "drive.gain_right", "drive.track"):
        assert len(fit.draws[name]) == 500
        assert fit.draws[name].min() > 0
        assert fit.numbers[name] > 0
    assert own["path.step_length"].low > 0


def test_encoders_tell_gains_and_not_the_track():
    trials = recorded({"drive.gain_left": 0.95, "drive.gain_right": 0.95}, 3, observe="encoders")
    fit, own = fitted(trials)
    assert own["drive.gain"].low < 0.95 < own["drive.gain"].high
    assert not own["drive.track"].identified
    assert "drive.track" not in fit.numbers


def test_the_ruler_rounds_and_forgets_what_a_camera_saw():
    trial = recorded({}, 5)[0]
    with_ruler = ruled(trial)
    assert len(with_ruler.poses) == 0
    ahead = (with_ruler.end_pose[0] - trial.start[0]) / INCH
    assert ahead * 8 == pytest.approx(round(ahead * 8), abs=1e-9)
    degrees = math.degrees(with_ruler.end_pose[2])
    assert degrees == pytest.approx(round(degrees), abs=1e-9)
    assert moved_in(with_ruler).way == pytest.approx(moved_in(trial).way, abs=INCH / 16 + 1e-3)


def test_no_straight_path_is_told():
    with pytest.raises(ValueError, match="There is no straight path"):
        fitted([measured(0, 300.0, TURNING)])


def test_a_robot_that_stands_still_or_does_not_turn_is_told():
    with pytest.raises(ValueError, match="stood still on all straight paths"):
        fitted([measured(0.0, 0.0, STRAIGHT), measured(0.0, 0.0, TURNING)])
    with pytest.raises(ValueError, match="did not turn in any trial"):
        fitted([measured(13.75, 0.0, STRAIGHT), measured(0.0, 0.0, TURNING)])


def test_the_most_trials_of_about_one_length_are_kept():
    def lasting(*lengths):
        return [replace(measured(13.0, 0.0, STRAIGHT), step_s=length) for length in lengths]

    trials = lasting(*[0.5] * 5, *[0.53] * 4, 0.56)
    kept, said = of_one_length(trials)
    assert len(kept) == 9
    assert (
        "1 of 10 trials were left out: their commands lasted 0.56 to 0.56 s. Those of the 9 that count lasted 0.5 "
        "to 0.53 s." in said
    )
    assert of_one_length(lasting(0.5, 0.549))[1] == ""
    assert of_one_length([]) == ([], "")
