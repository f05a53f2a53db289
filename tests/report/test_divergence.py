"""The figure of one network on two platforms says what its trials did."""

import re

import numpy as np
import pytest

from realitygap.playback import measure_divergence, own_divergence
from realitygap.report import compare_trials
from realitygap.report._divergence_figure import draw_divergence
from realitygap.report._tally import read_tally
from realitygap.report._trial_figure import choose_trial
from realitygap.robots.twin import sample_twin
from realitygap.runs import replay


def test_a_network_is_tried_on_both_sides_with_what_each_condition_says(tiny_study):
    own, turned = compare_trials(tiny_study, against="turn", condition="coverage", repeats=4)
    assert (own.name, turned.name) == ("coverage", "turn")
    assert [len(side.trials) for side in (own, turned)] == [4, 4]
    turns = [
        max(np.abs(np.diff(np.unwrap(trial.poses[:, 2]))).max() for trial in side.trials)
        for side in (own, turned)
    ]
    assert turns[0] <= 0.1 + 1e-6
    assert turns[1] > 0.1 + 1e-6
    again = compare_trials(tiny_study, against="turn", condition="coverage", repeats=4)[0]
    for one, other in zip(own.trials, again.trials, strict=True):
        np.testing.assert_array_equal(one.poses, other.poses)


def test_repeats_are_fresh_noise_and_never_the_recorded_trial(tiny_study):
    chosen = choose_trial(read_tally(tiny_study), "novelty")
    recorded = replay(chosen.condition, chosen.row)
    own, same = compare_trials(tiny_study, against="novelty", condition="novelty", repeats=3)
    for one, other in zip(own.trials, same.trials, strict=True):
        np.testing.assert_array_equal(one.poses, other.poses)
        assert (one.rays != recorded.readings).any() or (one.poses != recorded.poses).any()
    assert len({trial.poses.tobytes() for trial in own.trials}) == 3


def test_its_caption_has_the_numbers_of_the_last_step(tiny_study):
    sides = compare_trials(tiny_study, against="turn", condition="coverage", repeats=5)
    drawing = draw_divergence(*sides)
    one, other = (side.trials for side in sides)
    between = measure_divergence(one, [*other[1:], other[0]])
    own = [own_divergence(trials).distance[:, -1].mean() for trials in (one, other)]
    said = re.search(
        r"After 30 steps ([\d.]+) m apart, ([\d.]+) m on coverage alone and ([\d.]+) m on turn",
        drawing.caption,
    )
    assert [float(number) for number in said.groups()] == pytest.approx(
        [between.distance[:, -1].mean(), *own], abs=0.0051
    )
    assert "n = 5" in drawing.caption
    assert "SIM" in drawing.caption
    assert drawing.svg == draw_divergence(*sides).svg


@pytest.mark.slow
def test_a_twin_can_stand_beside_two_simulators(tiny_study, tmp_path):
    file = tmp_path / "same.toml"
    file.write_text(sample_twin("same", 3).to_toml())
    sides = compare_trials(tiny_study, against=f"sim, twin:{file}", condition="coverage", repeats=3)
    assert [side.name for side in sides] == ["jyro", "sim", "twin:same"]
    assert [side.trials[0].label for side in sides] == ["SIM", "SIM", "TWIN"]
    drawing = draw_divergence(*sides)
    one, *others = (side.trials for side in sides)
    assert "SIM and TWIN" in drawing.caption
    for other, name in zip(others, ("sim", "twin"), strict=True):
        apart = measure_divergence(one, [*other[1:], other[0]]).distance[:, -1].mean()
        assert f"{apart:.2f} m apart (jyro and {name}" in drawing.caption
    with pytest.raises(ValueError, match="against names 3, expected one or two"):
        compare_trials(tiny_study, against="sim,turn,novelty", condition="coverage", repeats=3)
    with pytest.raises(ValueError, match="expected twin:FILE"):
        compare_trials(tiny_study, against="twin", condition="coverage", repeats=3)
