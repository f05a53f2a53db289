"""Recorded trials as a target: shown again as they were, and no more of them than there are."""

from dataclasses import replace

import numpy as np
import pytest

from realitygap.errors import RecordError
from realitygap.records import write_observations
from realitygap.study import observations_head, open_target, sample_controllers
from realitygap.trials import TrialPlan
from realitygap.world import paper_arena


@pytest.fixture(scope="module")
def recorded(tmp_path_factory):
    """A file with two trials of one controller, one of another, and one that was cut off; and the first three."""
    path = tmp_path_factory.mktemp("recorded") / "trials.jsonl"
    one, other = (each.genome for each in sample_controllers("random", 2))
    with open_target("sim", paper_arena()) as target:
        plans = [TrialPlan(genome=genome, steps=6, number=k) for k, genome in enumerate((one, other, one))]
        trials = target.carry_out(plans, "track")
        lost = replace(trials[0], number=9, end="lost")
        write_observations(path, observations_head(target, "track"), [*trials, lost])
    return path, trials, (one, other)


def test_each_plan_gets_the_next_trial_of_its_controller(recorded):
    path, trials, (one, other) = recorded
    with open_target(f"recorded:{path}", paper_arena()) as target:
        assert (target.label, target.observes, target.n_sensors, target.steps) == ("SIM", "track", 3, 6)
        assert [n for _, n in target.controllers] == [2, 1]
        plans = [TrialPlan(genome=genome, steps=6, number=k) for k, genome in enumerate((other, one, one))]
        told = []
        found = target.carry_out(plans, "track", lambda k, trial: told.append((k, trial.number)))
    assert told == [(0, 1), (1, 0), (2, 2)]
    assert (found[1].poses == trials[0].poses).all()


def test_no_more_is_seen_than_is_asked_for(recorded):
    path, _, (one, _) = recorded
    with open_target(f"recorded:{path}", paper_arena()) as target:
        (trial,) = target.carry_out([TrialPlan(genome=one, steps=6)], "cells")
    assert (trial.observe, len(trial.poses), len(trial.wheels)) == ("cells", 0, 0)


def test_trials_that_were_not_recorded_are_refused(recorded, tmp_path):
    path, trials, (one, other) = recorded
    with open_target(f"recorded:{path}", paper_arena()) as target:
        with pytest.raises(RecordError, match="has 1 trials of 6 steps of a controller"):
            target.carry_out([TrialPlan(genome=other, steps=6)] * 2, "cells")
        with pytest.raises(RecordError, match="has 0 trials of 50 steps"):
            target.carry_out([TrialPlan(genome=one, steps=50)], "cells")
        with pytest.raises(RecordError, match="has 0 trials"):
            target.carry_out([TrialPlan(commands=np.ones((6, 2)), steps=6)], "cells")
    with open_target("sim", paper_arena()) as target:
        head = observations_head(target, "track")
    write_observations(tmp_path / "none.jsonl", head, [replace(trials[0], end="lost")])
    with pytest.raises(RecordError, match="no whole trial of a controller"):
        open_target(f"recorded:{tmp_path / 'none.jsonl'}", paper_arena())
