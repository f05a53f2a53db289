"""Plans from a pilot, or from trials that were observed."""

import pytest

from realitygap.errors import StudyError
from realitygap.study import (
    open_target,
    pilot_spreads,
    plan_gap,
    recorded_spreads,
    run_gap,
    sample_controllers,
)
from realitygap.world import paper_arena


def test_a_pilot_tells_how_trials_and_controllers_vary():
    found = pilot_spreads(1)
    assert 0 < found.noise < found.controllers < 0.5
    assert "30 random controllers" in found.origin


def test_observed_trials_tell_the_same(tmp_path):
    path, arena = tmp_path / "trials.jsonl", paper_arena()
    controllers = sample_controllers("random", 30, 1)
    run_gap(
        open_target("sim", arena, key=1),
        open_target("sim", arena, key=2),
        controllers,
        trials=6,
        results=path,
    )
    found, pilot = recorded_spreads(str(path)), pilot_spreads(1)
    assert found.controllers == pytest.approx(pilot.controllers, rel=0.2)
    assert found.noise == pytest.approx(pilot.noise, rel=0.5)


def test_a_larger_effect_takes_fewer_controllers_and_the_best_row_the_fewest_trials():
    spreads = pilot_spreads(1)
    small, large = (plan_gap("effect", each, spreads=spreads) for each in (0.03, 0.1))
    assert small.needed[0].controllers > large.needed[0].controllers
    assert small.best.on_target == min(row.on_target for row in small.needed)


def test_what_cannot_be_planned_is_refused():
    spreads = pilot_spreads(1)
    with pytest.raises(StudyError, match="effect is -1"):
        plan_gap("effect", -1.0, spreads=spreads)
    with pytest.raises(StudyError, match="least"):
        plan_gap("correlation", 0.4, spreads=spreads)
